"""Forward kinematics and mixed Jacobian as products of elementary motions.

Sines and cosines of right angles are already replaced by 0, 1 and -1. All symbolic libraries of the
benchmark compile these equations.
"""

from collections.abc import Callable, Sequence
from typing import Any

from ...cases.arms import Arm

Rows = list[list[Any]]


def fk_jacobian(
    arm: Arm, q: Sequence[Any], cos: Callable[[Any], Any], sin: Callable[[Any], Any]
) -> tuple[Rows, Rows]:
    """Return the rows of the pose (4 x 4) and of the mixed Jacobian (6 x n).

    Args:
        arm: The arm.
        q: Joint positions in the number type of the other library.
        cos: Cosine function for this number type.
        sin: Sine function for this number type.
    """
    R: Rows = [[int(i == j) for j in range(3)] for i in range(3)]
    p: list[Any] = [0, 0, 0]
    joints: list[tuple[list[Any], list[Any]]] = []
    for motion in arm.motions:
        column = [row[motion.axis] for row in R]
        if motion.kind == "shift":
            p = [_plus(p[i], _times(motion.value, column[i])) for i in range(3)]
            continue
        if motion.value is None:
            angle = q[len(joints)]
            joints.append((column, p))
            R = _turned(R, motion.axis, cos(angle), sin(angle))
        else:
            R = _turned(R, motion.axis, *motion.cos_sin())
    columns = [_cross(axis, [_minus(p[i], at[i]) for i in range(3)]) + axis for axis, at in joints]
    T = [[*R[i], p[i]] for i in range(3)] + [[0, 0, 0, 1]]
    return T, [[column[i] for column in columns] for i in range(6)]


def _turned(R: Rows, axis: int, c: Any, s: Any) -> Rows:
    j, k = (axis + 1) % 3, (axis + 2) % 3
    turned = [list(row) for row in R]
    for row in turned:
        row[j], row[k] = (
            _plus(_times(c, row[j]), _times(s, row[k])),
            _minus(_times(c, row[k]), _times(s, row[j])),
        )
    return turned


def _cross(a: list[Any], b: list[Any]) -> list[Any]:
    pairs = ((1, 2), (2, 0), (0, 1))
    return [_minus(_times(a[j], b[k]), _times(a[k], b[j])) for j, k in pairs]


def _is(number: Any, value: int) -> bool:
    return isinstance(number, int | float) and number == value


def _times(a: Any, b: Any) -> Any:
    if _is(a, 0) or _is(b, 0):
        return 0
    if _is(a, 1) or _is(a, -1):
        a, b = b, a
    if _is(b, 1):
        return a
    return -a if _is(b, -1) else a * b


def _plus(a: Any, b: Any) -> Any:
    if _is(a, 0):
        return b
    return a if _is(b, 0) else a + b


def _minus(a: Any, b: Any) -> Any:
    return _plus(a, _times(-1, b)) if _is(a, 0) or _is(b, 0) else a - b
