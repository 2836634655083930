"""Counts right-angle configurations whose poses an inverse kinematics function misses.

At some poses, the angle of one joint is arbitrary, and the closed form selects one value of this
angle. If the other joints can reach the pose only with a different value of the arbitrary angle,
the closed form misses the solution. If dimensions of the arm are equal, an inverse kinematics
function is likely to miss poses of right-angle configurations. An inverse kinematics function is
also likely to miss poses if two axes intersect at the fixed value of a prismatic joint.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from chasles.contract import TaskComponent

from ..model.tolerances import LOST
from ..terms.branches import patterns
from ..terms.casadi_graph import lower
from ..terms.symbolic_function import SymbolicFunction
from .structure.lines import SOME_SLIDE
from .structure.numeric_arm import NumericArm

FloatArray = NDArray[np.float64]
SAMPLES = 4000
"""Number of sampled configurations. If an inverse kinematics function misses one pose in 1,200, the
sample contains a missed pose with a probability of 96 %."""
QUARTERS = np.arange(-1, 3) * (np.pi / 2)
WHOLE: tuple[TaskComponent, ...] = ("pose",)

TARGETS: Mapping[TaskComponent, Callable[[FloatArray], FloatArray]] = {
    "pose": lambda T: T.reshape(len(T), 16),
    "position": lambda T: T[:, :3, 3],
    "plane": lambda T: T[:, :2, 3],
    "direction": lambda T: T[:, :3, 2],
    "orientation": lambda T: T[:, :3, :3].reshape(len(T), 9),
    "pitch": lambda T: np.arctan2(T[:, 2:3, 2], np.hypot(T[:, 0:1, 2], T[:, 1:2, 2])),
    "heading": lambda T: np.arctan2(T[:, 1:2, 0], T[:, 0:1, 0]),
}
"""Functions, keyed by task component, that return the target entries (N, size) for poses (N, 4, 4).
"""


def lost_poses(arm: NumericArm, inverse: SymbolicFunction) -> int:
    """Count the sampled configurations whose pose an inverse kinematics function misses.

    Args:
        arm: The arm.
        inverse: Inverse kinematics function of one task. Its inputs are the task target and the
            values of the fixed joints.

    Returns:
        Number of sampled configurations whose pose the inverse kinematics function misses, from 0
        to ``SAMPLES``.
    """
    role = inverse.role
    q = configurations(arm, role.free)
    T, _ = arm.pose_jacobian(q)
    inputs = [
        np.concatenate([TARGETS[component](T) for component in role.components or WHOLE], axis=1).T
    ]
    inputs += [q[:, k][None] for k in role.fixed]
    return _unsolved(inverse, inputs, LOST * min(arm.length, 1.0))


def _unsolved(inverse: SymbolicFunction, inputs: Sequence[FloatArray], tolerance: float) -> int:
    """Count the input samples (size, N) for which no branch of an IK function gives a solution.

    Each solution branch is evaluated only at samples that no earlier branch solves.
    """
    (kernel,) = lower([inverse], "inverse")
    for signs in patterns(inverse):
        count = inputs[0].shape[1]
        choice = [np.repeat(np.array(signs)[:, None], count, 1)] if signs else []
        residuals = np.array(kernel(*inputs, *choice)[1])[0]
        unsolved = ~(residuals <= tolerance)
        inputs = [values[:, unsolved] for values in inputs]
        if not unsolved.any():
            break
    return int(inputs[0].shape[1])


def configurations(arm: NumericArm, fixed: Sequence[int]) -> FloatArray:
    """Return at most ``SAMPLES`` configurations (N, n) whose revolute joints are at right angles.

    The position of a prismatic joint is 0, a generic value, or a sum of one or two link offsets. A
    prismatic joint at a sum of link offsets may cancel an offset and make axes intersect.
    """
    rng = np.random.default_rng(0)
    offsets = np.unique([0.0, SOME_SLIDE * arm.length, *arm.offsets, *-arm.offsets])
    slides = np.add.outer(offsets, offsets).reshape(-1)
    q = np.stack([rng.choice(QUARTERS if turns else slides, SAMPLES) for turns in arm.turns], 1)
    q[:, list(fixed)] = 0.0
    return np.unique(q, axis=0)
