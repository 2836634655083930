"""The error of a single pose at which a loop does not close.

A loop that does not close gives NaN. A batch returns the NaN; a call with one pose raises an error
that names the loop and the coordinates.
"""

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
    """Raises for a pose at which a loop makes a function's result not finite.

    Attributes:
        label: Robot and function.
        margin: From the function's first input to sin^2 of the transmission angle of each step of
            the loops' solution: positive where the loop closes, 0 at a dead point.
        steps: The loop of each step.
        coordinates: The elements of the function's first input.
        dead_point: Margin up to which a loop counts as at its dead point.
        is_followed: Whether the loops are followed from the reference configuration, and may have
            no margin because a singularity is on the way.
    """

    label: str
    margin: Function[Any]
    steps: tuple[str, ...]
    coordinates: Sequence[Coordinate]
    dead_point: float
    is_followed: bool = False

    def __call__(self, inputs: tuple[FloatArray, ...]) -> None:
        """Finds the loop that makes the result not finite.

        Raises:
            OutOfReachError: If a loop does not close there.
            SingularityError: If a loop is at a dead point.
        """
        if not all(np.isfinite(value).all() for value in inputs):
            return
        margin = np.asarray(self.margin(inputs[0]))
        values = zip(self.coordinates, inputs[0], strict=True)
        position = ", ".join(f"{item.name} = {value:.6g} {item.unit}" for item, value in values)
        # Steps after one that does not close may have no margin.
        worst = int(np.argmin(np.where(np.isnan(margin), np.inf, margin)))
        loop, value = self.steps[worst], margin[worst]
        if value < 0:
            others = [
                f"; {self.steps[k]} does not close either: margin {margin[k]:.4g}"
                for k in np.flatnonzero(margin < 0)
                if k != worst
            ]
            raise OutOfReachError(
                f"{self.label}: {loop} does not close at {position}: margin {value:.4g} "
                f"(0 is a dead point){''.join(others)}"
            )
        if np.isnan(margin).any():
            loop = self.steps[int(np.argmax(np.isnan(margin)))]
            way = ", or not on a way without singularities from the reference configuration"
            raise OutOfReachError(
                f"{self.label}: {loop} does not close at {position}{way * self.is_followed}"
            )
        if value <= self.dead_point:
            raise SingularityError(
                f"{self.label}: at a dead point of {loop}, at {position}: margin {value:.4g}; "
                "rates are not defined"
            )
