"""Measures how much the tool moves if the values written in a file are replaced by exact values.

No bound of the tool motion holds for all configurations, because near a dead point, a small change
of a length moves the tool far. At random configurations, the module closes the loops with the
written values and with the exact values. The module reports the largest difference between the two
tool poses.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...model.mechanism import Coordinate, Mechanism
from ...model.tolerances import SAMPLED_RANGE
from ..model.numeric_mechanism import NumericMechanism
from ..model.numeric_rows import NumericRows

Floats = NDArray[np.float64]
SAMPLES = 20
"""Number of configurations at which pose changes are computed, including the reference."""


def with_pose_change(mechanism: Mechanism) -> Mechanism:
    """Record the largest change in tool pose caused by removing noise from the robot file.

    The pose changes are computed at the reference and at random configurations.

    Args:
        mechanism: A robot whose values are exact and whose loops close at the reference.
    """
    if mechanism.as_written is None:
        return mechanism
    changes = [*_changes(mechanism, mechanism.as_written)]
    position, orientation = (max(of) for of in zip(*changes, strict=True))
    cleaning = replace(
        mechanism.cleaning, position=position, orientation=orientation, samples=len(changes)
    )
    notes = (*mechanism.notes, cleaning.line, *cleaning.sentences)
    return replace(mechanism, cleaning=cleaning, notes=notes, as_written=None)


def _changes(mechanism: Mechanism, written: Mechanism) -> Iterator[tuple[float, float]]:
    """Yield tool displacement (meter) and rotation (radian) due to removed noise, per sample."""
    exact = NumericMechanism(mechanism)
    own = NumericMechanism(written, _planes(exact, written))
    rows, own_rows = NumericRows(exact), NumericRows(own)
    names = [loop_joint.name for loop_joint in mechanism.loop_joints]
    moved, random = mechanism.coordinates, np.random.default_rng(0)
    reach = 0.0
    for _ in range(SAMPLES):
        q = {c.moves: _drawn(exact, c, reach * random.uniform(-1, 1)) for c in moved}
        at = exact.nearest(exact.values | q, exact.unknown, names)
        reach = 1.0
        if exact.all_closed(at, names):
            at = rows.polished(at)
            yield _apart(_tool(exact, at), _tool(own, own_rows.polished(at)))


def _planes(exact: NumericMechanism, written: Mechanism) -> dict[str, Floats]:
    """Return the plane of each planar loop, keyed by the name of its closure or strut.

    Loop planes that are fixed to the base are expressed in the base frame of ``written``, the robot
    with the printed numbers.
    """
    m = exact.mechanism
    turned = np.linalg.inv(exact.matrix(written.base)) @ exact.matrix(m.base)
    base = {c.name for c in m.loop_joints if c.a.body == m.base_frame}
    return {
        name: turned[:3, :3] @ plane if name in base else plane
        for name, plane in exact.planes.items()
    }


def _drawn(bodies: NumericMechanism, c: Coordinate, part: float) -> float:
    """Return a value of a coordinate within its limits.

    A coordinate without limits gets a value near its reference value. If ``part`` is 0, the
    coordinate gets its reference value, with or without limits.

    Args:
        bodies: The robot.
        c: The coordinate.
        part: Position of the coordinate value between the lower limit (-1) and the upper limit (1).
    """
    at = bodies.values[c.moves]
    if part == 0:
        return at
    low, high = bodies.mechanism.members[c.moves].limits
    if low is None or high is None:
        return at + part * SAMPLED_RANGE * (bodies.size if c.unit == "m" else 1.0)
    lower, upper = bodies.number(low), bodies.number(high)
    return lower + (1 + part) / 2 * (upper - lower)


def _tool(bodies: NumericMechanism, at: dict[str, float]) -> Floats:
    m = bodies.mechanism
    pose: Floats = bodies.matrix(m.base) @ bodies.poses(at)[m.tool_body] @ bodies.matrix(m.tool)
    return pose


def _apart(one: Floats, other: Floats) -> tuple[float, float]:
    """Return the distance (meter) and the angle (radian) between two poses."""
    half_chord = float(np.linalg.norm(one[:3, :3] - other[:3, :3])) / np.sqrt(8)
    angle = 2 * float(np.arcsin(min(1.0, half_chord)))
    return float(np.linalg.norm(one[:3, 3] - other[:3, 3])), angle
