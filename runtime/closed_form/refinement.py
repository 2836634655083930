"""The last resort of an inverse: poses that its closed form only comes near to.

Where singularities of several steps nearly coincide, each step loses half of its digits, and a pose
within reach may be left with no slot better than 1e-8. Newton's iteration, begun there, is at the
solution after a step or two. It is asked for such poses only, which are one in a hundred thousand
of those made to be singular; all others cost one comparison a slot.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..call._call import Function
from ..contract.facts import FunctionInfo, Manifest
from ..screws import off_rotation
from ..tolerances import REFINED, SOLVED
from .polish import polish

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Refinement:
    """Newton's iteration for poses that have no valid slot, but one with a small residual.

    Attributes:
        fk_jacobian_mixed: Of the robot.
        fixed: Which coordinates are given beside the pose, and keep their values.
        near: The largest such residual.
    """

    fk_jacobian_mixed: Function[tuple[FloatArray, FloatArray]]
    fixed: tuple[int, ...]
    near: float = REFINED

    def __call__(
        self,
        inputs: tuple[FloatArray, ...],
        q: FloatArray,
        residual: FloatArray,
        valid: BoolArray,
    ) -> None:
        """Moves the slots that are near onto solutions, in place, where there are any.

        A slot that does not come to one keeps its least-squares answer. A swivel angle that was
        given is kept as nearly as the closed form had the pose.

        Args:
            inputs: What the inverse was called with: poses (..., 4, 4) first.
            q: (..., k, n) coordinates.
            residual: (..., k).
            valid: (..., k).
        """
        near = residual <= self.near
        missed = np.asarray(~valid.any(-1) & near.any(-1))
        poses = np.broadcast_to(inputs[0], (*missed.shape, 4, 4))
        # The tool comes no nearer to what is no pose, such as one in single precision, than it is.
        rigid = np.zeros_like(missed)
        rigid[missed] = off_rotation(poses[missed][:, :3, :3]) <= SOLVED
        slots = np.nonzero(near & rigid[..., None])
        if not len(slots[-1]):
            return
        T = poses[slots[:-1]]
        found = polish(self, T, q[slots], self.fixed).q
        remaining = _residual(self.fk_jacobian_mixed(found)[0], T)
        solved = remaining <= SOLVED
        slots = tuple(index[solved] for index in slots)
        q[slots], residual[slots], valid[slots] = found[solved], remaining[solved], True


def refinement_of(
    manifest: Manifest, info: FunctionInfo, functions: Mapping[str, Function[Any]]
) -> Refinement | None:
    """The refinement of an inverse.

    Args:
        manifest: The robot's manifest.
        info: One of its functions.
        functions: Its other functions.

    Returns:
        None unless the function is the inverse of a pose; None for the nominal inverse of a
        calibrated arm, which is iterated on anyway, and without a Jacobian to iterate with.
    """
    jacobian = manifest.with_role("pose and jacobian", "actuators")
    if not (info.is_inverse and info.domain == "pose" and jacobian):
        return None
    if manifest.inverse.tier == "snapped":
        return None
    return Refinement(functions[jacobian.name], info.given)


def _residual(here: FloatArray, there: FloatArray) -> FloatArray:
    """How far poses (N, 4, 4) are apart as the generated code has it."""
    apart = here - there
    distance2 = np.einsum("Ni,Ni->N", apart[:, :3, 3], apart[:, :3, 3])
    turned2 = np.einsum("Nij,Nij->N", apart[:, :3, :3], apart[:, :3, :3])
    return np.asarray(np.sqrt(np.maximum(distance2, turned2 / 2)))
