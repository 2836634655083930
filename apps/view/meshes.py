"""URDF meshes for the bodies of a robot's skeleton."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError
from chasles.contract import (
    MAX_DESCRIPTION,
    PACKAGE_FILE,
    input_folder,
    is_inside,
    read_input,
    requires,
)

from ..drawing import Skeleton

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BodyMesh:
    """The mesh of a body.

    Attributes:
        body: Index of the body in the skeleton.
        surface: The `trimesh.Trimesh` in the body's frame [m].
    """

    body: int
    surface: Any


def body_meshes(file: Path, skeleton: Skeleton) -> tuple[BodyMesh, ...]:
    """Return the visual meshes and primitive shapes of a URDF file.

    A link belongs to the body with its name. A link without a body of its name, such as a gripper
    link, is attached to its nearest ancestor with a body, at zero joint positions.

    Args:
        file: The URDF file. Mesh files are searched relative to this file and in its ROS package.
        skeleton: The skeleton of the robot derived from this file.

    Returns:
        A mesh for each link with an available shape; () if the file is not a .urdf file.

    Warns:
        UserWarning: Mesh files were not found.

    Raises:
        NotInstalledError: yourdfpy is not installed.
        InputValueError: yourdfpy cannot read the file, or a mesh is outside the ROS package of the
            file; without a package, outside the folder of the file.
    """
    if file.suffix != ".urdf":
        return ()
    urdf = _read(file)
    q = np.zeros(len(skeleton.robot.configuration_variables) or skeleton.robot.n)
    poses = skeleton.poses_from_configuration(q)
    index = {body.name: k for k, body in enumerate(skeleton.bodies)}
    parents = {joint.child: joint.parent for joint in urdf.robot.joints}
    found = []
    base, _ = urdf.scene.graph.get(_base(skeleton, urdf))
    for node in urdf.scene.graph.nodes_geometry:
        T, geometry = urdf.scene.graph.get(node)
        link: str | None = urdf.scene.graph.transforms.parents[node]
        while link is not None and link not in index:
            link = parents.get(link)
        k = index[link] if link is not None else 0
        T_0_mesh = np.linalg.solve(base, T)
        surface = urdf.scene.geometry[geometry]
        # A transform of a trimesh primitive does not change its vertices, so the primitive is
        # converted first.
        own = surface.to_mesh() if hasattr(surface, "to_mesh") else surface.copy()
        own.apply_transform(np.linalg.solve(poses[k], T_0_mesh))
        found.append(BodyMesh(k, own))
    return tuple(found)


def _base(skeleton: Skeleton, urdf: Any) -> str:
    """Return the name of the link that is the base of the robot."""
    name = skeleton.bodies[0].name
    return name if name in urdf.link_map else str(urdf.base_link)


def count_meshes(file: Path) -> int:
    """Return the number of visual mesh files of a URDF file; 0 if the file is not a .urdf file."""
    if file.suffix != ".urdf":
        return 0
    with requires("chasles[view]"):
        root = _root(file)
    return len({mesh.get("filename") for mesh in root.iterfind(".//visual//mesh")})


def _root(file: Path) -> Any:
    """Return the root of a URDF file without a document type; another may raise a SyntaxError."""
    from lxml import etree  # noqa: PLC0415

    # An XML entity could read another file.
    parser = etree.XMLParser(resolve_entities=False, no_network=True)
    root = etree.fromstring(read_input(file, MAX_DESCRIPTION), parser)
    if root.getroottree().docinfo.doctype:
        raise InputValueError(f"{file}: expected no document type declaration")
    return root


def _read(file: Path) -> Any:
    with requires("chasles[view]"):
        import lxml  # noqa: F401, PLC0415
        import yourdfpy  # noqa: PLC0415
        from yourdfpy.urdf import filename_handler_magic  # noqa: PLC0415
    folder = input_folder(file)
    is_file: dict[str, bool] = {}

    def found(fname: str) -> str:
        path = Path(filename_handler_magic(fname, str(file.parent)))
        is_file[fname] = path.is_file()
        if is_file[fname] and not is_inside(path, folder):
            raise InputValueError(
                f"{file}: expected meshes inside {folder}, got {fname!r}; copy the mesh there, or "
                f"put a {PACKAGE_FILE} into a folder that contains both"
            )
        return str(path)

    try:
        _root(file)
        with _missing_files_unlogged():
            urdf = yourdfpy.URDF.load(str(file), filename_handler=found)
    except InputValueError:
        raise
    except (OSError, SyntaxError, ValueError, KeyError) as error:
        raise InputValueError(f"{file}: cannot read the meshes ({error})") from error
    if missing := len(is_file) - sum(is_file.values()):
        warnings.warn(
            f"{file}: {missing} of {len(is_file)} meshes were not found; their links are drawn as "
            "rods",
            stacklevel=3,
        )
    return urdf


@contextmanager
def _missing_files_unlogged() -> Iterator[None]:
    """Context in which yourdfpy does not log two lines for each missing mesh file."""
    logger = logging.getLogger("yourdfpy.urdf")

    def is_other(record: logging.LogRecord) -> bool:
        return not record.getMessage().startswith(("Unable to resolve filename", "Can't find"))

    logger.addFilter(is_other)
    try:
        yield
    finally:
        logger.removeFilter(is_other)
