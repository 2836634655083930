"""Computes tool poses with 50 digits, from a robot description or a table of joint parameters."""

import csv
from collections.abc import Mapping, Sequence

import mpmath
import sympy as sp

from chasles.derive import SerialRobot
from chasles.derive.model.robot import Placement, Rotation

DIGITS = 50
Matrix = mpmath.matrix


def tool_pose(robot: SerialRobot, q: Sequence[float]) -> Matrix:
    """Return the pose (4, 4) of the tool at the coordinates q."""
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    with mpmath.workdps(DIGITS):
        theta = iter(robot.joint_values([sp.Rational(x) for x in q]))
        T = _placed(robot.base, values)
        for joint in robot.joints:
            T *= _placed(joint.before, values)
            if joint.kind != "fixed":
                T *= _moved(joint.kind, _mpf(next(theta)), _mpf(joint.pitch.xreplace(values)))
            T *= _placed(joint.after, values)
        return T * _placed(robot.tool, values)


def table_pose(text: str, convention: str, q: Sequence[float]) -> Matrix:
    """Return the tool pose (4, 4) from a CSV table in the convention `dh`, `mdh` or `poe`.

    The link transforms are textbook products for `dh` and `mdh`, and exponentials of screws for
    `poe`.
    """
    with mpmath.workdps(DIGITS):
        base, *rows, tool = csv.DictReader(text.splitlines())
        moving = [row for row in rows if row["type"] != "fixed"]
        joints = {row["name"] for row in moving}
        names = dict.fromkeys(
            name
            for row in moving
            for name in (_leaders(row["coupling"]) if row.get("coupling") else [row["name"]])
            if name not in joints or not row.get("coupling")
        )
        coordinates = dict(zip(names, map(mpmath.mpf, q), strict=True))
        T = _pose_row(base)
        for row in rows:
            theta = _coupled(row.get("coupling") or f"1 * {row['name']}", coordinates)
            theta *= _number(row, "direction", 1)
            T *= _link(row, convention, theta if row["type"] != "fixed" else mpmath.mpf(0))
        return T * _pose_row(tool)


def _coupled(equation: str, coordinates: Mapping[str, mpmath.mpf]) -> mpmath.mpf:
    """Return the value of a joint from its equation, such as `2 * a + 0.1`."""
    total = mpmath.mpf(0)
    for term in equation.split(" + "):
        ratio, _, name = term.partition(" * ")
        total += mpmath.mpf(ratio) * (coordinates.get(name, mpmath.mpf(0)) if name else 1)
    return total


def _leaders(equation: str) -> list[str]:
    return [name for term in equation.split(" + ") if (name := term.partition(" * ")[2])]


def distance(one: Matrix, other: Matrix) -> float:
    """Return the largest difference between the entries of two matrices."""
    with mpmath.workdps(DIGITS):
        return float(max(abs(x) for x in one - other))


def _link(row: dict[str, str], convention: str, theta: mpmath.mpf) -> Matrix:
    pitch = _number(row, "pitch", 0)
    if convention == "poe":
        return _exponential(row, theta, pitch)
    motion = _moved(row["type"], theta, pitch)
    along = _rotation("z", _number(row, "theta")) * _translation(0, 0, _number(row, "d"))
    across = _translation(_number(row, "a"), 0, 0) * _rotation("x", _number(row, "alpha"))
    return along * motion * across if convention == "dh" else across * along * motion


def _exponential(row: dict[str, str], theta: mpmath.mpf, pitch: mpmath.mpf) -> Matrix:
    if row["type"] == "fixed":
        return mpmath.eye(4)
    e = mpmath.matrix([_number(row, f"axis_{x}") for x in "xyz"])
    e /= mpmath.norm(e)
    p = [_number(row, f"point_{x}") for x in "xyz"]
    if row["type"] == "prismatic":
        return _translation(*(e * theta))
    W = mpmath.matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    R = mpmath.eye(4)
    R[:3, :3] = mpmath.eye(3) + mpmath.sin(theta) * W + (1 - mpmath.cos(theta)) * W * W
    return (
        _translation(*(e * (pitch * theta))) * _translation(*p) * R * _translation(*(-x for x in p))
    )


def _moved(kind: str, theta: mpmath.mpf, pitch: mpmath.mpf) -> Matrix:
    if kind == "prismatic":
        return _translation(0, 0, theta)
    return _rotation("z", theta) * _translation(0, 0, pitch * theta)


def _pose_row(row: dict[str, str]) -> Matrix:
    x, y, z = (_number(row, f"xyz_{axis}") for axis in "xyz")
    roll, pitch, yaw = (_number(row, f"rpy_{axis}") for axis in "xyz")
    return (
        _translation(x, y, z) * _rotation("z", yaw) * _rotation("y", pitch) * _rotation("x", roll)
    )


def _number(row: dict[str, str], name: str, default: int = 0) -> mpmath.mpf:
    return mpmath.mpf(row.get(name) or default)


def _placed(placement: Placement, values: dict[sp.Symbol, sp.Expr]) -> Matrix:
    T = mpmath.eye(4)
    for motion in placement:
        if isinstance(motion, Rotation):
            T *= _rotation(motion.axis, _mpf(motion.angle.xreplace(values)))
        else:
            T *= _translation(*(_mpf(x.xreplace(values)) for x in motion.vector))
    return T


def _mpf(value: sp.Expr) -> mpmath.mpf:
    if value.is_Rational:
        return mpmath.mpf(value.p) / value.q
    return mpmath.mpf(sp.Float(value.evalf(DIGITS), DIGITS)._mpf_)


def _rotation(axis: str, angle: mpmath.mpf) -> Matrix:
    j, k = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    T = mpmath.eye(4)
    T[j, j] = T[k, k] = mpmath.cos(angle)
    T[k, j] = mpmath.sin(angle)
    T[j, k] = -T[k, j]
    return T


def _translation(x: mpmath.mpf, y: mpmath.mpf, z: mpmath.mpf) -> Matrix:
    T = mpmath.eye(4)
    T[0, 3], T[1, 3], T[2, 3] = x, y, z
    return T
