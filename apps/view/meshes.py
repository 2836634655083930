"""URDF meshes for the bodies of a robot's skeleton."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
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
from chasles.contract.isolation import IsolatedWorkError, Limits, isolated

from ..drawing import Skeleton

FloatArray = NDArray[np.float64]
READING = Limits()
"""Limits of the process that reads meshes. A small archive may expand to terabytes."""


@dataclass(frozen=True, eq=False)
class BodyMesh:
    """The mesh of a body.

    Attributes:
        body: Index of the body in the skeleton.
        surface: The `trimesh.Trimesh` in the body's frame [m].
    """

    body: int
    surface: Any


@dataclass(frozen=True, eq=False)
class Drawing:
    """The surfaces of a URDF file as plain data.

    Attributes:
        surfaces: The link, the pose (4, 4) and the `trimesh.Trimesh` of each surface.
        parents: The parent of each link.
        poses: The pose of each link at zero joint positions (4, 4).
        base: The base link.
        meshes: Number of mesh files.
        missing: Number of mesh files that were not found.
    """

    surfaces: tuple[tuple[str, FloatArray, Any], ...]
    parents: dict[str, str]
    poses: dict[str, FloatArray]
    base: str
    meshes: int
    missing: int


def body_meshes(file: Path, skeleton: Skeleton) -> tuple[BodyMesh, ...]:
    """Return the visual meshes and primitive shapes of a URDF file.

    Each link belongs to the body with the same name. A link without such a body, for example a
    gripper link, moves with its nearest ancestor link that has a body. The joints between link and
    ancestor are at zero.

    Args:
        file: The URDF file. Mesh files are searched relative to this file and in its ROS package.
        skeleton: The skeleton of the robot. The robot was derived from this URDF file.

    Returns:
        A mesh for each link with an available shape, or () if the file is not a .urdf file.

    Warns:
        UserWarning: Mesh files were not found.

    Raises:
        NotInstalledError: yourdfpy is not installed.
        InputValueError: yourdfpy cannot read the file, or a mesh is outside the ROS package of the
            file. If the URDF file is not in a ROS package, meshes must be in the folder of the URDF
            file.
    """
    if file.suffix != ".urdf":
        return ()
    drawn = _read(file)
    q = np.zeros(len(skeleton.robot.configuration_variables) or skeleton.robot.n)
    poses = skeleton.poses_from_configuration(q)
    index = {body.name: k for k, body in enumerate(skeleton.bodies)}
    name = skeleton.bodies[0].name
    base = drawn.poses[name if name in drawn.poses else drawn.base]
    found = []
    for node_link, T, surface in drawn.surfaces:
        link: str | None = node_link
        while link is not None and link not in index:
            link = drawn.parents.get(link)
        k = index[link] if link is not None else 0
        surface.apply_transform(np.linalg.solve(poses[k], np.linalg.solve(base, T)))
        found.append(BodyMesh(k, surface))
    return tuple(found)


def count_meshes(file: Path) -> int:
    """Return the number of visual mesh files of a URDF file, or 0 for any other file."""
    if file.suffix != ".urdf":
        return 0
    with requires("chasles[view]"):
        root = _root(file)
    return len({mesh.get("filename") for mesh in root.iterfind(".//visual//mesh")})


def _root(file: Path) -> Any:
    """Return the root of a URDF file.

    Raise an error if the file declares a document type.
    """
    from lxml import etree  # noqa: PLC0415

    # An XML entity could read another file.
    parser = etree.XMLParser(resolve_entities=False, no_network=True)
    root = etree.fromstring(read_input(file, MAX_DESCRIPTION), parser)
    if root.getroottree().docinfo.doctype:
        raise InputValueError(f"{file}: expected no document type declaration")
    return root


def _read(file: Path) -> Drawing:
    """Return the drawing of a URDF file, read in a separate process."""
    with requires("chasles[view]"):
        import lxml  # noqa: F401, PLC0415
        import yourdfpy  # noqa: F401, PLC0415
    try:
        drawn = isolated(partial(drawing, file), READING)
    except IsolatedWorkError as error:
        raise InputValueError(f"{file}: cannot read the meshes ({error})") from None
    if drawn.missing:
        warnings.warn(
            f"{file}: {drawn.missing} of {drawn.meshes} meshes were not found; their links are "
            "drawn as rods",
            stacklevel=3,
        )
    return drawn


def drawing(file: Path) -> Drawing:
    """Return the drawing of a URDF file.

    Raises:
        InputValueError: A file cannot be read, or a mesh is outside the ROS package of the file.
    """
    import yourdfpy  # noqa: PLC0415
    from yourdfpy.urdf import filename_handler_magic  # noqa: PLC0415

    folder = input_folder(file)
    is_file: dict[str, bool] = {}

    def found(fname: str) -> str:
        path = Path(filename_handler_magic(fname, str(file.parent)))
        is_file[fname] = path.is_file()
        if is_file[fname] and not is_inside(path, folder):
            raise InputValueError(
                f"{file}: expected meshes inside {folder}, got {fname!r}; copy the mesh into this "
                f"folder, or mark a common parent folder with {PACKAGE_FILE}"
            )
        return str(path)

    try:
        _root(file)
        with _missing_files_unlogged():
            urdf = yourdfpy.URDF.load(str(file), filename_handler=found)
    except (InputValueError, MemoryError):
        raise
    except Exception as error:
        # The readers of the mesh formats raise errors of many types.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputValueError(f"{file}: cannot read the meshes ({reason})") from error
    graph = urdf.scene.graph
    surfaces = []
    for node in graph.nodes_geometry:
        T, geometry = graph.get(node)
        surface = urdf.scene.geometry[geometry]
        # A transform of a trimesh primitive does not change its vertices. The primitive is
        # therefore converted to a mesh.
        own = surface.to_mesh() if hasattr(surface, "to_mesh") else surface.copy()
        surfaces.append((str(graph.transforms.parents[node]), T, own))
    return Drawing(
        tuple(surfaces),
        {joint.child: joint.parent for joint in urdf.robot.joints},
        {link: graph.get(link)[0] for link in urdf.link_map},
        str(urdf.base_link),
        len(is_file),
        len(is_file) - sum(is_file.values()),
    )


@contextmanager
def _missing_files_unlogged() -> Iterator[None]:
    """Context in which yourdfpy does not log missing mesh files."""
    logger = logging.getLogger("yourdfpy.urdf")

    def is_other(record: logging.LogRecord) -> bool:
        return not record.getMessage().startswith(("Unable to resolve filename", "Can't find"))

    logger.addFilter(is_other)
    try:
        yield
    finally:
        logger.removeFilter(is_other)
