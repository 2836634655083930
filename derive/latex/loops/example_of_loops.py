r"""Prints an example of forward and inverse kinematics for a robot with loops."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ...model.errors import LoopError
from ...model.mechanism import Coordinate
from ...model.robot import Joint
from ...terms.casadi_graph import lower
from ...terms.symbolic_function import SymbolicFunction
from ..chain.example_fragment import bounds, example, rounded, solutions_of_pose, value_at
from .loop_page import LoopPage

FloatArray = NDArray[np.float64]

PARTS = (0.1, -0.1, 0.03, -0.03)
"""Offsets from the reference configuration, as fractions of each coordinate range. The printed
example uses the first offset at which the robot's loops close. The example does not use the
reference configuration itself, because round coordinate values may hide a sign error."""
SOME = {"rad": math.radians(100), "m": 1.0}
"""Assumed width of the range of a coordinate without limits, keyed by the coordinate's unit."""


def worked_example_of_loops(page: LoopPage) -> str:
    """Print an example configuration, its tool pose and all configurations with this pose.

    If an iteration solves the loops, the example lists all vectors of actuator coordinates for one
    tool pose.
    """
    named = {function.name: function for function in page.functions}
    if "fk" not in named:
        return _example_of_actuators(page, named)
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


def _example_of_actuators(page: LoopPage, named: Mapping[str, SymbolicFunction]) -> str:
    if not {"chain_fk", "actuators_all"} <= named.keys():
        return ""
    joints = page.chain.robot.moving
    (kernel,) = lower([named["actuators_all"]], "example")
    chosen: tuple[FloatArray, dict[int, FloatArray]] | None = None
    for part in (*PARTS, 0.0):
        theta = _main_chain(page, part)
        if theta is None:
            continue
        shaped = zip(kernel(theta), named["actuators_all"].outputs, strict=True)
        q, margins = (np.array(found).reshape(output.shape) for found, output in shaped)
        closed = np.isfinite(q).all(-1) & (margins >= 0).reshape(len(q), -1).all(-1)
        slots = {int(k): q[k] for k in np.flatnonzero(closed)}
        is_inside = any(_is_within(page, values) for values in slots.values())
        if slots and (chosen is None or is_inside):
            chosen = theta, slots
        if is_inside:
            break
    if chosen is None:
        return ""
    theta, slots = chosen
    symbols = page.members.theta
    return solutions_of_pose(
        *(named["chain_fk"], "actuators_all", joints, symbols, theta, page.chain.pose),
        *(page.mechanism.coordinates, page.members.q, slots),
    )


def _main_chain(page: LoopPage, part: float) -> FloatArray | None:
    hybrid, joints = page.hybrid, page.chain.robot.moving
    reference = [hybrid.at_reference[joint.name] for joint in joints]
    pairs = zip(joints, reference, strict=True)
    theta = np.array([_near(joint, value, part, page.skeleton.size) for joint, value in pairs])
    if len(theta) == hybrid.freedoms:
        return theta
    # For most values of the main-chain joints, the loops do not close, so an iteration corrects
    # these values.
    numbers = hybrid.numbers
    w = np.array([hybrid.at_reference[name] for name in numbers.names])
    places = [numbers.names.index(joint.name) for joint in joints]
    w[places] = theta
    try:
        found: FloatArray = numbers.closed(w, np.ones(len(w), dtype=bool))[places]
    except LoopError:
        return None
    return found


def _is_within(page: LoopPage, q: FloatArray) -> bool:
    limits = map(bounds, page.mechanism.coordinates)
    return all(low <= value <= high for value, (low, high) in zip(q, limits, strict=True))


def _closing(page: LoopPage, fk: SymbolicFunction) -> FloatArray:
    coordinates, reference = page.mechanism.coordinates, page.hybrid.q_at_reference
    for part in PARTS:
        q = np.array([_near(c, r, part) for c, r in zip(coordinates, reference, strict=True)])
        if np.isfinite(value_at(fk, q)).all():
            return q
    return reference


def _near(
    coordinate: Coordinate | Joint, reference: float, part: float, length: float = 1.0
) -> float:
    low, high = bounds(coordinate)
    free = SOME[coordinate.unit] * (length if coordinate.unit == "m" else 1.0)
    span = high - low if math.isfinite(high - low) else free
    sign = 1 if low <= reference + part * span <= high else -1
    return rounded(reference + sign * part * span, coordinate.unit)
