"""Arms that are singular in every configuration."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...model.tolerances import JACOBIAN_RANK
from . import rank
from .lines import Lines
from .words import listed

PAIR = 2


def self_motion(lines: Lines, given: Sequence[int] = ()) -> str:
    """Describe the joints that can always move without moving the tool.

    Args:
        lines: The axes of all joints.
        given: Indices of the fixed joints.

    Returns:
        A clause that describes a self-motion, such as "the tool depends on joint5 + joint6 alone".
        The clause is empty if every joint motion moves the tool.
    """
    left = lines.at_generic(given)
    motions = [_null_space(J) for J in rank.jacobians(left)]
    joints = _moving(motions)
    if not len(joints):
        return ""
    names = [left.axes[k].name for k in joints]
    sign = _constant_sign(motions, joints)
    if sign:
        return f"the tool depends on {names[0]} {'+' if sign < 0 else '-'} {names[1]} alone"
    return f"{listed(names)} can move without moving the tool"


def joints_of_self_motion(lines: Lines) -> tuple[int, ...]:
    """Return the joints that can always move without moving the tool."""
    return tuple(_moving([_null_space(J) for J in rank.jacobians(lines)]).tolist())


def _moving(motions: Sequence[NDArray[np.float64]]) -> NDArray[np.intp]:
    if min(map(len, motions)) == 0:
        return np.array([], dtype=np.intp)
    return np.flatnonzero(np.max([np.abs(m).max(0) for m in motions], axis=0) > JACOBIAN_RANK)


def _null_space(J: NDArray[np.float64]) -> NDArray[np.float64]:
    _, sizes, V = np.linalg.svd(J)
    return V[int((sizes > JACOBIAN_RANK).sum()) :]


def _constant_sign(motions: Sequence[NDArray[np.float64]], joints: NDArray[np.intp]) -> float:
    """Return the ratio of two joint velocities if it is always 1 or always -1, otherwise 0."""
    if len(joints) != PAIR or any(len(motion) > 1 for motion in motions):
        return 0.0
    ratios = np.array([motion[0, joints[1]] / motion[0, joints[0]] for motion in motions])
    sign = float(np.sign(ratios[0]))
    return sign if np.abs(ratios - sign).max() < JACOBIAN_RANK else 0.0
