r"""The worked example of a robot with loops: a posture near its reference, forward and back."""

import math

import numpy as np

from ...model.mechanism import Coordinate
from ..chain.example_fragment import bounds, example, rounded, value_at
from .loop_page import LoopPage

NEAR = 0.1
"""Part of the range by which the coordinates are off the reference, where the loops close."""
SOME = {"rad": math.radians(100), "m": 1.0}
"""Range that stands for the limits of a coordinate without limits."""


def worked_example_of_loops(page: LoopPage) -> str:
    """A posture, the pose of its tool, and all postures with this pose.

    The fragment is empty where the tool's pose is no formula of the actuated coordinates.
    """
    named = {function.name: function for function in page.functions}
    if "fk" not in named:
        return ""
    coordinates, hybrid = page.mechanism.coordinates, page.hybrid
    at, value = hybrid.at_reference, hybrid.terms.value
    q = np.array([_near(c, at[c.moves] / float(value(c.ratio))) for c in coordinates])
    known = {}
    if "chain" in named:
        joints = [joint.name for joint in page.chain.robot.coordinates]
        known = dict(zip(joints, value_at(named["chain"], q), strict=True))
    return example(
        named["fk"], page.functions, coordinates, page.members.q, q, known, page.chain.pose
    )


def _near(coordinate: Coordinate, reference: float) -> float:
    lower, upper = bounds(coordinate)
    span = upper - lower if math.isfinite(upper - lower) else SOME[coordinate.unit]
    sign = 1 if reference + NEAR * span <= upper else -1
    return rounded(reference + sign * NEAR * span, coordinate.unit)
