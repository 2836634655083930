"""Errors for a single input for which a loop cannot be closed; in a batch, the result is NaN."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import FloatArray
from ..contract import Coordinate
from ..errors import OutOfReachError, SingularityError

if TYPE_CHECKING:
    from ._call import Function


@dataclass(frozen=True, slots=True)
class Guard:
    """Raises an error if an open loop makes a result NaN or infinite.

    Attributes:
        label: Robot and function.
        margin: Function that maps the first input to one margin for each solution step of the
            loops. Each margin is sin^2 of a transmission angle. The margin is positive for a closed
            loop and 0 at a dead point.
        steps: The loop of each solution step.
        coordinates: The coordinates in the first input, with names and units.
        dead_point: Largest margin that counts as a dead point.
        is_followed: Whether the loops are solved by iteration. Loops that are solved by iteration
            have no margin beyond a singularity.
    """

    label: str
    margin: Function[Any]
    steps: tuple[str, ...]
    coordinates: Sequence[Coordinate]
    dead_point: float
    is_followed: bool = False

    def __call__(self, inputs: tuple[FloatArray, ...]) -> None:
        """Raise OutOfReachError for an open loop and SingularityError for a dead point."""
        if not all(np.isfinite(value).all() for value in inputs):
            return
        margin = np.asarray(self.margin(inputs[0]))
        values = zip(self.coordinates, inputs[0], strict=True)
        position = ", ".join(f"{item.name} = {value:.6g} {item.unit}" for item, value in values)
        # If a loop cannot be closed, the margins of later solution steps may be NaN.
        worst = int(np.argmin(np.where(np.isnan(margin), np.inf, margin)))
        loop, value = self.steps[worst], margin[worst]
        if value < 0:
            others = [
                f"; {self.steps[k]} does not close either: margin {margin[k]:.4g}"
                for k in np.flatnonzero(margin < 0)
                if k != worst
            ]
            raise OutOfReachError(
                f"{self.label}: {loop}: the loop does not close at {position}: margin {value:.4g} "
                f"(a dead point has margin 0){''.join(others)}"
            )
        if np.isnan(margin).any():
            loop = self.steps[int(np.argmax(np.isnan(margin)))]
            remark = ", or is not reachable from the reference without a singularity"
            raise OutOfReachError(
                f"{self.label}: {loop}: the loop does not close at {position}"
                f"{remark * self.is_followed}"
            )
        if value <= self.dead_point:
            raise SingularityError(
                f"{self.label}: {loop}: the loop is at a dead point: {position}, "
                f"margin {value:.4g}; rates are not defined"
            )
