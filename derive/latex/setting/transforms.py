"""Prints link transforms as elementary motions and as matrices."""

from collections.abc import Sequence

import sympy as sp

from ...model.placements import Placement, Rotation, Translation, symbols_of
from ...model.robot import Joint, SerialRobot
from . import names
from .notation import Notation
from .printer import Printer

PLANES = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}


def labels(robot: SerialRobot) -> list[str]:
    """Return the labels of the frames from the base to the tool.

    Frame 0 is the first frame of the chain. Without a base placement, frame 0 is the base frame.
    Without a tool placement, the last link frame is the tool frame.
    """
    base, tool = names.frame(robot.base_frame), names.frame(robot.tool_frame)
    first = first_number(robot)
    links = [str(k) for k in range(first - 1, len(robot.joints) + first)]
    if not robot.base:
        links[0] = base
    elif base == "0":
        links[0] = "0'"
    before = [base] if robot.base else []
    return [*before, *links, *([tool] if robot.tool else [])]


def first_number(robot: SerialRobot) -> int:
    """Return the index of the first transform that the LaTeX article prints.

    The index is 0 if only the first joint is fixed, and the robot has neither a base transform nor
    a base frame named 0. For all other robots, the index of the first transform is 1.
    """
    first, *others = robot.joints
    is_mount = first.kind == "fixed" and all(joint.kind != "fixed" for joint in others)
    return 0 if is_mount and not robot.base and robot.base_frame != "0" else 1


def transform(start: str, end: str) -> str:
    """Return the symbol of a frame's pose in another frame."""
    return f"{{}}^{{{start}}}T_{{{end}}}"


def motions(joint: Joint, value: sp.Expr) -> Placement:
    """Return the pose of a link relative to its parent link."""
    motion: Placement = ()
    if joint.kind in ("revolute", "helical"):
        motion += (Rotation("z", value),)
    if joint.kind in ("prismatic", "helical"):
        slide = value if joint.kind == "prismatic" else joint.pitch * value
        motion += (Translation((sp.Integer(0), sp.Integer(0), slide)),)
    return (*joint.before, *motion, *joint.after)


def placements(robot: SerialRobot, q: Sequence[sp.Expr]) -> list[Placement]:
    """Return the poses between adjacent frames at coordinates q."""
    found = [robot.base] if robot.base else []
    values = iter(robot.joint_values(q))
    for joint in robot.joints:
        value = sp.Integer(0) if joint.kind == "fixed" else next(values)
        found.append(motions(joint, value))
    found += [robot.tool] if robot.tool else []
    return [_merged(placement) for placement in found]


def matrix(placement: Placement, notation: Notation) -> sp.ImmutableMatrix:
    """Return a placement as a matrix (4, 4) of expressions in short symbols."""
    T = sp.eye(4)
    for motion in placement:
        T = T * (_turn(motion, notation) if isinstance(motion, Rotation) else _shift(motion))
    return sp.ImmutableMatrix(T)


def factors(placement: Placement, printer: Printer) -> list[str]:
    """Return the elementary rotations and translations of a placement in LaTeX."""
    return [_factor(motion, printer) for motion in placement]


def symbolic_factors(transform: Placement) -> list[str]:
    """Format the link transform of a convention as elementary motions."""
    used = symbols_of(transform)
    return factors(transform, Printer({s: names.parameter(s.name) for s in used}, {}))


def _factor(motion: Rotation | Translation, printer: Printer) -> str:
    if isinstance(motion, Rotation):
        return f"R_{motion.axis}({printer.tex(motion.angle)})"
    along = [axis for axis, x in zip("xyz", motion.vector, strict=True) if x != 0]
    if len(along) == 1:
        return f"T_{along[0]}({printer.tex(sum(motion.vector))})"
    return f"T({', '.join(printer.tex(x) for x in motion.vector)})"


def _merged(placement: Placement) -> Placement:
    merged: list[Rotation | Translation] = []
    for motion in placement:
        if isinstance(motion, Rotation):
            index = len(merged)
            while index and _commutes(merged[index - 1], motion):
                index -= 1
            before = merged[index - 1] if index else None
            if isinstance(before, Rotation) and before.axis == motion.axis:
                merged[index - 1] = Rotation(motion.axis, before.angle + motion.angle)
                continue
        merged.append(motion)
    return tuple(merged)


def turned_back(placement: Placement) -> Placement:
    """Combine two rotations about one axis if a translation is between them."""
    motions = list(placement)
    k = 0
    while k + 2 < len(motions):
        match motions[k : k + 3]:
            case [Rotation() as first, Translation() as shift, Rotation() as last] if (
                first.axis == last.axis and (2 * last.angle / sp.pi).is_Integer
            ):
                angle = first.angle + last.angle
                turn = [Rotation(first.axis, angle)] if angle != 0 else []
                motions[k : k + 3] = [*turn, _shift_seen_from(last, shift)]
                k = max(k - 2, 0)
            case _:
                k += 1
    return tuple(motions)


def _shift_seen_from(turn: Rotation, shift: Translation) -> Translation:
    j, k = PLANES[turn.axis]
    c, s = sp.cos(turn.angle), sp.sin(turn.angle)
    vector = list(shift.vector)
    y, z = vector[j], vector[k]
    vector[j], vector[k] = c * y + s * z, c * z - s * y
    return Translation((vector[0], vector[1], vector[2]))


def _commutes(shift: Rotation | Translation, turn: Rotation) -> bool:
    if isinstance(shift, Rotation):
        return False
    across = PLANES[turn.axis]
    return all(shift.vector[k] == 0 for k in across)


def _turn(rotation: Rotation, notation: Notation) -> sp.Matrix:
    c, s = (_short(function(rotation.angle), notation) for function in (sp.cos, sp.sin))
    j, k = PLANES[rotation.axis]
    T = sp.eye(4)
    T[j, j], T[j, k], T[k, j], T[k, k] = c, -s, s, c
    return T


def _short(value: sp.Expr, notation: Notation) -> sp.Expr:
    sign, function = value.as_coeff_Mul()
    if function.func in (sp.cos, sp.sin):
        return sign * notation.trigonometric(function)
    return notation.constant(value)


def _shift(translation: Translation) -> sp.Matrix:
    T = sp.eye(4)
    T[:3, 3] = sp.Matrix(translation.vector)
    return T
