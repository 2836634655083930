"""The poses that an inverse loses where joints are at right angles, counted on a sample.

Where a joint carries what comes behind it along its own axis, its angle is arbitrary, and a step
takes one. If other joints reach the pose for some angles alone, the closed form may lose it. That
happens at right angles, in arms of round numbers, and with a given slide that makes axes meet which
otherwise do not; so such configurations are tried.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from chasles.contract import Aim

from ..model.tolerances import LOST
from ..terms.branches import patterns
from ..terms.casadi_graph import lower
from ..terms.symbolic_function import SymbolicFunction
from .structure.lines import SOME_SLIDE
from .structure.numeric_arm import NumericArm

FloatArray = NDArray[np.float64]
SAMPLES = 4000
"""An arm that loses one pose in 1,200 is found out with a probability of 96 %."""
QUARTERS = np.arange(-1, 3) * (np.pi / 2)
WHOLE: tuple[Aim, ...] = ("pose",)

TARGETS: Mapping[Aim, Callable[[FloatArray], FloatArray]] = {
    "pose": lambda T: T.reshape(len(T), 16),
    "position": lambda T: T[:, :3, 3],
    "plane": lambda T: T[:, :2, 3],
    "direction": lambda T: T[:, :3, 2],
    "pitch": lambda T: np.arctan2(T[:, 2:3, 2], np.hypot(T[:, 0:1, 2], T[:, 1:2, 2])),
    "heading": lambda T: np.arctan2(T[:, 1:2, 0], T[:, 0:1, 0]),
}
"""The entries (N, size) of an aim, from poses (N, 4, 4)."""


def lost_poses(arm: NumericArm, inverse: SymbolicFunction) -> int:
    """The number of sampled configurations whose pose no branch reaches, not even nearly.

    Args:
        arm: The arm.
        inverse: The inverse of one of its tasks, whose further inputs are given joints.

    Returns:
        From 0 to ``SAMPLES``.
    """
    role = inverse.role
    q = configurations(arm, role.held)
    T, _ = arm.pose_jacobian(q)
    inputs = [np.concatenate([TARGETS[aim](T) for aim in role.aims or WHOLE], axis=1).T]
    inputs += [q[:, k][None] for k in role.given]
    least = _least_residuals(inverse, inputs)
    return int((~(least <= LOST * min(arm.length, 1.0))).sum())


def _least_residuals(inverse: SymbolicFunction, inputs: Sequence[FloatArray]) -> FloatArray:
    """The least residual (N,) of all branches."""
    (kernel,) = lower([inverse], "inverse")
    count = inputs[0].shape[1]
    residuals = []
    for signs in patterns(inverse):
        choice = [np.repeat(np.array(signs)[:, None], count, 1)] if signs else []
        residuals.append(np.array(kernel(*inputs, *choice)[1])[0])
    return np.asarray(np.fmin.reduce(residuals))


def configurations(arm: NumericArm, held: Sequence[int]) -> FloatArray:
    """Different configurations (N, n) at right angles, ``SAMPLES`` at most.

    A slide is 0, or as long as two of the arm's offsets at most, which it may cancel so that axes
    meet, or in general position.
    """
    rng = np.random.default_rng(0)
    offsets = np.unique([0.0, SOME_SLIDE * arm.length, *arm.offsets, *-arm.offsets])
    slides = np.add.outer(offsets, offsets).reshape(-1)
    q = np.stack([rng.choice(QUARTERS if turns else slides, SAMPLES) for turns in arm.turns], 1)
    q[:, list(held)] = 0.0
    return np.unique(q, axis=0)
