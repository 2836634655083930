"""Compiles the kinematics of an MJCF model with MuJoCo.

Shapes, materials, sensors and cameras are removed before the compilation, so meshes may be missing.
MuJoCo resolves defaults, includes, frames, angle units and orientations. Positions and quaternions
have double precision.
"""

import re
import warnings
from pathlib import Path
from typing import Any, NamedTuple

import mpmath as mp
import numpy as np
import sympy as sp
from lxml import etree

from chasles.contract.errors import DescriptionError, NotInstalledError
from chasles.contract.input_files import input_folder

from ....model.exact import read, snap_angle
from ....model.placements import Vector
from ....model.tolerances import COMPILED_ANGLE, COMPILED_DECIMALS, EVALUATION_DIGITS, UNIT_VECTOR
from ...file_text import included_bytes, text_of
from ...toml_file import file_error
from ..robot_xml import local_name, parsed
from ..roll_pitch_yaw import of_quaternion
from .mjcf_drives import Drives, drives_of

NEEDED = "the package mujoco, to read MJCF (pip install 'chasles[files]')"
NAMES = ("name", "class", "childclass", "model", "joint", "body", "site", "file")
"""Attributes whose values are not numbers."""
UNNAMED = "MuJoCo Model"
"""Model name that MuJoCo uses by default."""
REMOVED = (
    "keys",
    "sensors",
    "actuators",
    "pairs",
    "excludes",
    "tendons",
    "skins",
    "flexes",
    "geoms",
    "meshes",
    "hfields",
    "materials",
    "textures",
    "cameras",
    "lights",
    "tuples",
    "numerics",
    "texts",
    "plugins",
)
"""Elements of a model that do not affect poses. Each element type is listed before the element
types to which it can refer."""
OPENED = ("include", "model", "flexcomp")
"""XML elements whose ``file`` attribute names a file that MuJoCo opens."""
MEANT_EQUALITIES = ("mjEQ_CONNECT", "mjEQ_WELD", "mjEQ_JOINT")


class CompiledModel(NamedTuple):
    """A compiled model with its drives, and with the joint axes as written in the file."""

    name: str
    arrays: Any
    mujoco: Any
    axes: dict[int, tuple[float, ...]]
    drives: Drives

    def named(self, kind: str, index: int) -> str:
        """Return the name of a body, joint, site or equality.

        Unnamed objects have an empty name.
        """
        found = self.mujoco.mj_id2name(self.arrays, getattr(self.mujoco.mjtObj, kind), index)
        return str(found or "")


def compiled(file: Path) -> CompiledModel:
    """Compile an MJCF file with MuJoCo.

    Raises:
        NotInstalledError: The Python package mujoco is not installed.
        DescriptionError: mujoco cannot read the file.
    """
    try:
        import mujoco  # noqa: PLC0415
    except ModuleNotFoundError as error:
        raise NotInstalledError(f"{file}: expected {NEEDED}") from error
    _check_text(file, file, [])
    try:
        spec = mujoco.MjSpec.from_file(str(file))
        drives = drives_of(spec, mujoco)
        _remove_shapes(spec, mujoco)
        with warnings.catch_warnings():
            # Warnings about masses and other properties without effect on poses.
            warnings.simplefilter("ignore")
            arrays = spec.compile()
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        raise _refused(file, str(error)) from error
    _check_model(file, arrays, mujoco)
    axes = {joint.id: tuple(float(value) for value in joint.axis) for joint in spec.joints}
    name = str(spec.modelname)
    name = file.stem if name == UNNAMED else name
    return CompiledModel(name, arrays, mujoco, axes, drives)


def _remove_shapes(spec: Any, mujoco: Any) -> None:
    for kind in REMOVED:
        for element in list(getattr(spec, kind)):
            spec.delete(element)
    meant = [getattr(mujoco.mjtEq, name) for name in MEANT_EQUALITIES]
    for equality in list(spec.equalities):
        if equality.type not in meant:
            spec.delete(equality)
    # MuJoCo requires a mass for moving bodies. The deleted shapes defined this mass. These settings
    # provide a substitute for the mass.
    spec.compiler.boundmass = spec.compiler.boundinertia = 1
    spec.compiler.balanceinertia = 1
    for joint in spec.joints:
        joint.armature = 1
    for site in spec.sites:
        site.material = ""
    spec.compiler.fusestatic = 0


def _check_text(file: Path, by: Path, seen: list[Path]) -> None:
    """Check a file and its included files before MuJoCo opens them.

    All numbers must be finite. MuJoCo itself does not reject infinite numbers, but writes a log
    file. Included files must be in the folder of the model. MuJoCo opens no other files, because
    shapes are removed.

    Args:
        file: The model file or an included file.
        by: The model.
        seen: The files that were already checked. The function appends ``file`` to this list.
    """
    seen.append(file)
    # MuJoCo reads every file as UTF-8 and ignores the declared encoding.
    root = parsed(str(file), text_of(file), "mujoco" if file == by else None)
    for element in root.iter(tag=etree.Element):
        for name in sorted({*map(str, element.keys())}.difference(NAMES)):
            value = str(element.get(name))
            if {"nan", "inf", "-inf"} & {*value.lower().split()}:
                field = f"<{element.tag!s}> {name}"
                line = element.sourceline
                raise file_error(str(file), line, field, value, "finite numbers")
        # MuJoCo ignores namespaces.
        if local_name(element) in OPENED and element.get("file") is not None:
            included = _included(element, file, by)
            if included not in seen:
                _check_text(included, by, seen)


def _included(element: etree._Element, file: Path, by: Path) -> Path:
    """Return an included file.

    The folder of the model is searched before the folder of the including file.
    """
    name = str(element.get("file"))
    for folder in (by.parent, file.parent):
        try:
            included_bytes(folder / name, [input_folder(by)], by)
        except FileNotFoundError:
            continue
        return folder / name
    expected = "the name of an existing file"
    raise file_error(str(file), element.sourceline, f"<{element.tag!s}> file", name, expected)


def _check_model(file: Path, arrays: Any, mujoco: Any) -> None:
    """Raise an error if a position or orientation of the compiled model is not finite."""
    kinds = {
        "body": ("mjOBJ_BODY", ("body_pos", "body_quat")),
        "joint": ("mjOBJ_JOINT", ("jnt_pos", "jnt_axis", "jnt_range")),
        "site": ("mjOBJ_SITE", ("site_pos", "site_quat")),
    }
    for kind, (code, names) in kinds.items():
        for name in names:
            values = getattr(arrays, name)
            bad = np.flatnonzero(~np.isfinite(values).all(-1))
            if len(bad):
                owner = mujoco.mj_id2name(arrays, getattr(mujoco.mjtObj, code), int(bad[0]))
                field = f"{kind} {owner or bad[0]}, {name.partition('_')[2]}"
                value = " ".join(f"{x:g}" for x in values[bad[0]])
                raise file_error(str(file), None, field, value, "finite numbers")


def _refused(file: Path, reason: str) -> DescriptionError:
    lines = [line.strip() for line in reason.strip().splitlines() if line.strip()]
    found = re.search(r"(?:line |Line number=)(\d+)", reason)
    expected = f"MJCF that MuJoCo reads ({'; '.join(lines)})"
    return file_error(str(file), int(found[1]) if found else None, "", None, expected)


# --- floating-point numbers as exact numbers ---


def length(value: float) -> sp.Expr:
    """Convert a length (meter) of the compiled model to an exact number without rounding noise."""
    return read(repr(round(float(value), COMPILED_DECIMALS)))


def lengths(values: Any) -> Vector:
    """Convert a vector (meter) of the compiled model to exact numbers without rounding noise."""
    x, y, z = (length(value) for value in values)
    return x, y, z


def angle(value: float) -> sp.Expr:
    """Return an angle (radian) of the compiled model.

    An angle close to a multiple of pi/12 is rounded to this multiple.
    """
    exact = length(value)
    multiple = snap_angle(exact)
    return multiple if abs(float(multiple) - float(value)) < COMPILED_ANGLE else exact


def roll_pitch_yaw(quaternion: Any) -> Vector:
    """Return roll, pitch and yaw (radian) of a quaternion (w, x, y, z)."""
    with mp.workdps(EVALUATION_DIGITS):
        roll, pitch, yaw = of_quaternion(*map(mp.mpf, quaternion))
    return angle(roll), angle(pitch), angle(yaw)


def snapped(angles: Vector) -> tuple[Vector, list[str]]:
    """Round angles to near multiples of pi/12, and return a note for each changed angle."""
    exact = [snap_angle(value) for value in angles]
    notes = [
        f"{which} = {float(value)!r} interpreted as {taken}"
        for which, value, taken in zip("rpy", angles, exact, strict=True)
        if taken != value
    ]
    roll, pitch, yaw = exact
    return (roll, pitch, yaw), notes


def direction(model: CompiledModel, joint: int) -> Vector:
    """Return a joint axis.

    MuJoCo normalizes the axis. If the axis in the file has the same direction as the normalized
    axis, the function returns the numbers in the file.
    """
    unit = [float(value) for value in model.arrays.jnt_axis[joint]]
    written = model.axes[joint]
    size = sum(value**2 for value in written) ** 0.5
    if all(abs(w - size * u) < UNIT_VECTOR * size for w, u in zip(written, unit, strict=True)):
        unit = [*written]
    return lengths(unit)
