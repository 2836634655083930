r"""The worked example of a robot with loops: a posture near its reference, forward and back."""

import math

import numpy as np
from numpy.typing import NDArray

from ...model.mechanism import Coordinate
from ...terms.symbolic_function import SymbolicFunction
from ..chain.example_fragment import bounds, example, rounded, value_at
from .loop_page import LoopPage

PARTS = (0.1, -0.1, 0.03, -0.03)
"""Parts of the range by which the coordinates are off the reference; the first that closes counts.
The reference itself is a posture of round numbers, at which a wrong sign may not show."""
SOME = {"rad": math.radians(100), "m": 1.0}
"""Range that stands for the limits of a coordinate without limits."""


def worked_example_of_loops(page: LoopPage) -> str:
    """A posture, the pose of its tool, and all postures with this pose.

    The fragment is empty where the tool's pose is no formula of the actuated coordinates.
    """
    named = {function.name: function for function in page.functions}
    if "fk" not in named:
        return ""
    coordinates = page.mechanism.coordinates
    q = _closing(page, named["fk"])
    known = {}
    if "chain" in named:
        joints = [joint.name for joint in page.chain.robot.coordinates]
        known = dict(zip(joints, value_at(named["chain"], q), strict=True))
    return example(
        *(named["fk"], page.functions, coordinates, page.members.q, q, known, page.members.of),
        page.chain.pose,
    )


def _closing(page: LoopPage, fk: SymbolicFunction) -> NDArray[np.float64]:
    """Coordinates near the reference at which the loops close; else the reference's own."""
    coordinates, reference = page.mechanism.coordinates, page.hybrid.q_at_reference
    for part in PARTS:
        q = np.array([_near(c, r, part) for c, r in zip(coordinates, reference, strict=True)])
        if np.isfinite(value_at(fk, q)).all():
            return q
    return reference


def _near(coordinate: Coordinate, reference: float, part: float) -> float:
    lower, upper = bounds(coordinate)
    span = upper - lower if math.isfinite(upper - lower) else SOME[coordinate.unit]
    sign = 1 if lower <= reference + part * span <= upper else -1
    return rounded(reference + sign * part * span, coordinate.unit)
