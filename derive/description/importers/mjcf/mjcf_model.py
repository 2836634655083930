"""MJCF compiled by MuJoCo, without the parts that kinematics does not need.

Meshes may be missing: shapes, materials, sensors, cameras and all that refers to them is removed
before MuJoCo compiles the model. Defaults, includes, frames, angle units and orientations of every
form are resolved by MuJoCo, and positions and quaternions are its doubles.
"""

import re
import warnings
from pathlib import Path
from typing import Any, NamedTuple

import mpmath as mp
import numpy as np
import sympy as sp
from lxml import etree

from ....model.exact import read, snap_angle
from ....model.placements import Vector
from ....model.tolerances import COMPILED_ANGLE, COMPILED_DECIMALS, EVALUATION_DIGITS, UNIT_VECTOR
from ...toml_file import DescriptionError
from ..robot_xml import parsed, read_xml
from ..roll_pitch_yaw import of_quaternion
from .mjcf_drives import Drives, drives_of

NEEDED = "the package mujoco, to read MJCF (pip install 'chasles[files]')"
NAMES = ("name", "class", "childclass", "model", "joint", "body", "site", "file")
"""Attributes that hold words, not numbers."""
UNNAMED = "MuJoCo Model"
"""The name that MuJoCo gives a model without one."""
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
"""Lists of a model's elements that no pose depends on; those that refer to others come first."""
MEANT_EQUALITIES = ("mjEQ_CONNECT", "mjEQ_WELD", "mjEQ_JOINT")


class CompiledModel(NamedTuple):
    """A model: MuJoCo's arrays, axes as written, and what moves its joints."""

    name: str
    arrays: Any
    mujoco: Any
    axes: dict[int, tuple[float, ...]]
    drives: Drives

    def named(self, kind: str, index: int) -> str:
        """The name of a body, joint, site or equality; empty where the file gives none."""
        found = self.mujoco.mj_id2name(self.arrays, getattr(self.mujoco.mjtObj, kind), index)
        return str(found or "")


def compiled(file: Path) -> CompiledModel:
    """The model of an MJCF file.

    Raises:
        DescriptionError: The package mujoco is not installed, or cannot read the file.
    """
    try:
        import mujoco  # noqa: PLC0415
    except ModuleNotFoundError as error:
        raise DescriptionError(str(file), None, "", None, NEEDED) from error
    _check_text(file, read_xml(file))
    try:
        spec = mujoco.MjSpec.from_file(str(file))
        drives = drives_of(spec, mujoco)
        _remove_shapes(spec, mujoco)
        with warnings.catch_warnings():
            # Of masses and the like, on which no pose depends.
            warnings.simplefilter("ignore")
            arrays = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
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
    # Bodies whose mass came from their shapes have none now, and MuJoCo asks for some.
    spec.compiler.boundmass = spec.compiler.boundinertia = 1
    spec.compiler.balanceinertia = 1
    for joint in spec.joints:
        joint.armature = 1
    for site in spec.sites:
        site.material = ""
    spec.compiler.fusestatic = 0


def _check_text(file: Path, text: str) -> None:
    """Refuses numbers in the file that are not finite; MuJoCo would warn in a file of logs."""
    try:
        root = parsed(str(file), text, "mujoco")
    except DescriptionError:
        return
    for element in root.iter(tag=etree.Element):
        for name in sorted({*map(str, element.keys())}.difference(NAMES)):
            value = str(element.get(name))
            if {"nan", "inf", "-inf"} & {*value.lower().split()}:
                field = f"<{element.tag!s}> {name}"
                line = element.sourceline
                raise DescriptionError(str(file), line, field, value, "finite numbers")


def _check_model(file: Path, arrays: Any, mujoco: Any) -> None:
    """Refuses numbers of included files that are not finite, and on which a pose depends."""
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
                raise DescriptionError(str(file), None, field, value, "finite numbers")


def _refused(file: Path, reason: str) -> DescriptionError:
    lines = [line.strip() for line in reason.strip().splitlines() if line.strip()]
    found = re.search(r"(?:line |Line number=)(\d+)", reason)
    expected = f"MJCF that MuJoCo reads ({'; '.join(lines)})"
    return DescriptionError(str(file), int(found[1]) if found else None, "", None, expected)


# --- doubles as exact numbers ---


def length(value: float) -> sp.Expr:
    """A compiled length (metre) without the rounding that compiling leaves."""
    return read(repr(round(float(value), COMPILED_DECIMALS)))


def lengths(values: Any) -> Vector:
    """A compiled vector (metre), component by component as :func:`length`."""
    x, y, z = (length(value) for value in values)
    return x, y, z


def angle(value: float) -> sp.Expr:
    """A compiled angle (radian): a multiple of pi/12 where only compiling's rounding is between."""
    exact = length(value)
    multiple = snap_angle(exact)
    return multiple if abs(float(multiple) - float(value)) < COMPILED_ANGLE else exact


def roll_pitch_yaw(quaternion: Any) -> Vector:
    """The angles (radian) of a compiled quaternion, scalar first."""
    with mp.workdps(EVALUATION_DIGITS):
        roll, pitch, yaw = of_quaternion(*map(mp.mpf, quaternion))
    return angle(roll), angle(pitch), angle(yaw)


def snapped(angles: Vector) -> tuple[Vector, list[str]]:
    """Angles that a file rounds, as multiples of pi/12, and a note of each that changes."""
    exact = [snap_angle(value) for value in angles]
    notes = [
        f"{which} = {float(value)!r} taken as {taken}"
        for which, value, taken in zip("rpy", angles, exact, strict=True)
        if taken != value
    ]
    roll, pitch, yaw = exact
    return (roll, pitch, yaw), notes


def direction(model: CompiledModel, joint: int) -> Vector:
    """A joint's axis as the file writes it, where MuJoCo only made its length 1."""
    unit = [float(value) for value in model.arrays.jnt_axis[joint]]
    written = model.axes[joint]
    size = sum(value**2 for value in written) ** 0.5
    if all(abs(w - size * u) < UNIT_VECTOR * size for w, u in zip(written, unit, strict=True)):
        unit = [*written]
    return lengths(unit)
