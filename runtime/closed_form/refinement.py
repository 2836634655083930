"""Refinement near singularities: poses at which a closed form loses half of its digits.

Where singularities of several steps nearly coincide, each step loses half of its digits, and a pose
within reach may have no slot better than 1e-8. Newton's iteration from there reaches the solution
after a step or two. It runs for such poses only, one in a hundred thousand of poses made to be
singular; all others cost one comparison per slot.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..call._call import Function
from ..contract.facts import FunctionInfo, Manifest
from ..se3 import projected
from ..tolerances import REFINED, SOLVED
from .polish import polish

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Refinement:
    """Newton's iteration for poses that have no valid slot, but one with a small residual.

    Attributes:
        fk_jacobian_mixed: The function ``fk_jacobian_mixed`` of the robot.
        fixed: Indices of the coordinates that are given beside the pose and keep their values.
        unit: The robot's unit of length [m].
    """

    fk_jacobian_mixed: Function[tuple[FloatArray, FloatArray]]
    fixed: tuple[int, ...]
    unit: float = 1.0

    @property
    def near(self) -> float:
        """Largest residual [m] at which a slot is refined."""
        return REFINED * self.unit

    def __call__(
        self,
        inputs: tuple[FloatArray, ...],
        q: FloatArray,
        residual: FloatArray,
        valid: BoolArray,
    ) -> None:
        """Moves slots near a solution onto it, in place.

        A slot that reaches no solution keeps its least-squares answer. A given swivel angle keeps
        its value up to the residual of the closed form.

        Args:
            inputs: The inputs of the inverse: poses (..., 4, 4) first.
            q: (..., k, n) coordinates.
            residual: (..., k).
            valid: (..., k).
        """
        near = residual <= self.near
        missed = np.asarray(~valid.any(-1) & near.any(-1))
        poses = np.broadcast_to(inputs[0], (*missed.shape, 4, 4))
        slots = np.nonzero(near & missed[..., None])
        T = projected("refinement", poses[slots[:-1]])
        found, remaining = refined(self.fk_jacobian_mixed, T, q[slots], self.fixed, self.unit)
        solved = remaining <= SOLVED * self.unit
        slots = tuple(index[solved] for index in slots)
        q[slots], residual[slots], valid[slots] = found[solved], remaining[solved], True


def refined(
    fk_jacobian_mixed: Function[tuple[FloatArray, FloatArray]],
    T: FloatArray,
    q: FloatArray,
    fixed: tuple[int, ...],
    unit: float,
) -> tuple[FloatArray, FloatArray]:
    """Coordinates (..., n) moved until the tool is at poses (..., 4, 4), and their residuals (...).

    The iteration compares a metre with a radian, so it is given lengths in the robot's unit [m].
    """
    target = T if unit == 1 else _divided(T, unit)
    found = polish(_InUnit(fk_jacobian_mixed, unit), target, q, fixed).q
    return found, _residual(fk_jacobian_mixed(found)[0], T, unit)


@dataclass(frozen=True, slots=True)
class _InUnit:
    """The pose and the Jacobian of a robot, with lengths in its unit."""

    function: Function[tuple[FloatArray, FloatArray]]
    unit: float

    @property
    def fk_jacobian_mixed(self) -> Any:
        return self.function if self.unit == 1 else self

    @property
    def inputs(self) -> Any:
        return self.function.inputs

    def __call__(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        T, J = self.function(q)
        J[..., :3, :] /= self.unit
        return _divided(T, self.unit), J


def _divided(T: FloatArray, unit: float) -> FloatArray:
    """Poses with their translations in a unit."""
    poses = np.array(T)
    poses[..., :3, 3] /= unit
    return poses


def refinement_of(
    manifest: Manifest,
    info: FunctionInfo,
    functions: Mapping[str, Function[Any]],
    unit: float = 1.0,
) -> Refinement | None:
    """The refinement of an inverse.

    Args:
        manifest: The robot's manifest.
        info: One of its functions.
        functions: Its other functions.
        unit: Its unit of length [m].

    Returns:
        None unless the function is the inverse of a pose; None for the nominal inverse of a
        calibrated arm, which is iterated on anyway, and without a Jacobian to iterate with.
    """
    jacobian = manifest.with_role("pose and jacobian", "actuators")
    if not (info.is_inverse and info.domain == "pose" and jacobian):
        return None
    if manifest.inverse.tier == "snapped":
        return None
    return Refinement(functions[jacobian.name], info.given, unit)


def _residual(here: FloatArray, there: FloatArray, unit: float) -> FloatArray:
    """The residual between poses (..., 4, 4), defined in the same way as in Solutions."""
    apart = here - there
    distance2 = (apart[..., :3, 3] ** 2).sum(-1)
    turned2 = (apart[..., :3, :3] ** 2).sum((-2, -1))
    return np.asarray(np.sqrt(np.maximum(distance2, turned2 / 2 * unit**2)))
