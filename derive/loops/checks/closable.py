"""Checks whether the loops close within the actuator limits, and which limits are unreachable.

If the loops close at less than half of random actuator values within the limits, a remark states
this. For each actuator with unreachable limits, another remark states the interval that is
reachable if all other actuators stay at their reference values. A further remark names the joint
whose reference value differs most from its value at the closed configuration.
"""

import math
from collections.abc import Callable, Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from ...model.mechanism import Coordinate, Mechanism
from ...model.tolerances import MOVED_REFERENCE
from ...terms.casadi_graph import lower
from ..closing.shown_values import interval, shown
from ..closing.swapped_ends import doubtful_ends
from ..functions.maps import margin
from ..model.numeric_mechanism import NumericMechanism
from ..solve.solved_loops import SolvedLoops
from .nearly_met import nearly_met

Floats = NDArray[np.float64]
IsClosed = Callable[[Floats], bool]
"""Returns whether the loops close at actuated coordinates."""
MANY, MANY_STEPS = 500, 64
"""Numbers of random configurations and of grid values at which loops with a closed form are tested.
"""
FEW, FEW_STEPS = 60, 17
"""Numbers of random configurations and of grid values at which loops without a closed form are
tested."""
HALVINGS = 20
OMITTED = 0.01
"""Largest accepted difference between the assumed value of an omitted actuator and the value that
closes the loops (radian, or relative to the size). If the difference is larger, the check prints
the assumed actuator value and the actuator value that closes the loops."""
LITTLE = 0.5
"""The check prints a remark if the loops close at a smaller fraction of the random configurations
than this value."""


def limits_of(h: SolvedLoops) -> tuple[str, ...]:
    """Return remarks on actuator limits at which the loops do not close."""
    mechanism = h.mechanism
    if h.forward.open:
        search = BySearch(NumericMechanism(mechanism), h.at_reference)
        return tuple(limits_in_words(mechanism, h.q_at_reference, search.is_closed, FEW, FEW_STEPS))
    if not h.forward.margins:
        return ()
    kernel = lower([margin(h)], mechanism.name)[0]

    def is_closed(q: Floats) -> bool:
        return bool(np.all(np.asarray(kernel(q)).ravel() >= 0))

    return tuple(limits_in_words(mechanism, h.q_at_reference, is_closed, MANY, MANY_STEPS))


def doubts_of(h: SolvedLoops) -> tuple[str, ...]:
    """Return warnings about a robot with closed loops, usually an empty tuple.

    The warnings concern rods with swapped ends, reference values that are omitted or far from a
    closed configuration, and geometry that narrowly misses the conditions of a closed-form
    solution.
    """
    swapped = doubtful_ends(h.mechanism, h.at_reference)
    doubts = (swapped, omitted_actuators(h), moved_reference(h), *nearly_met(h))
    return tuple(filter(None, doubts))


class BySearch:
    """Tests whether the loops close, with a numerical search that starts at the reference."""

    def __init__(self, bodies: NumericMechanism, configuration: Mapping[str, float]) -> None:
        """Store a closed configuration, at which the numerical search starts."""
        self.bodies = bodies
        self.configuration = {name: configuration[name] for name in bodies.values}
        self.names = [loop_joint.name for loop_joint in bodies.mechanism.loop_joints]

    def is_closed(self, q: Floats) -> bool:
        """Whether the loops close at the given actuated coordinates."""
        coordinates = self.bodies.mechanism.coordinates
        actuated = {
            c.moves: float(value) * self.bodies.number(c.ratio)
            for c, value in zip(coordinates, q, strict=True)
        }
        at = self.bodies.nearest(
            {**self.configuration, **actuated}, self.bodies.unknown, self.names
        )
        return self.bodies.all_closed(at, self.names)


def limits_in_words(
    mechanism: Mechanism, reference: Floats, is_closed: IsClosed, samples: int, steps: int
) -> Iterator[str]:
    """Yield messages about actuator limits at which the loops do not close.

    Args:
        mechanism: The description.
        reference: Actuated coordinates at the reference configuration. If a coordinate lacks a
            limit, its reference value replaces both limits.
        is_closed: Function that returns whether the loops close at the given actuated coordinates.
        samples: Number of random configurations within the coordinate limits.
        steps: Number of grid values between the limits of each coordinate.
    """
    coordinates = mechanism.coordinates
    low, high = _bounds(coordinates, reference)
    limited = [k for k in range(len(coordinates)) if low[k] < high[k]]
    if not limited:
        return
    box = np.random.default_rng(0).uniform(low, high, (samples, len(low)))
    part = float(np.mean([is_closed(q) for q in box]))
    if part < LITTLE:
        where = "in no" if part == 0 else f"in {100 * part:.0f} % of"
        yield f"limits: the loops close {where} {samples} random configurations within them"
    for k in limited:
        c = coordinates[k]
        closed = _closing(k, np.linspace(low[k], high[k], steps), reference, is_closed)
        is_length = c.unit == "m"
        within = interval(float(low[k]), float(high[k]), is_length)
        if closed is None:
            yield f"limits of {c.name}, {within}: with the others at the reference no loop closes"
        elif closed[0] > low[k] or closed[1] < high[k]:
            yield (
                f"limits of {c.name}, {within}: with the others at the reference the loops close "
                f"from {interval(*closed, is_length)}"
            )


def _bounds(coordinates: tuple[Coordinate, ...], reference: Floats) -> tuple[Floats, Floats]:
    """Return the lower and upper limits of all actuated coordinates.

    If a coordinate lacks a limit, its reference value replaces both limits.
    """
    low, high = reference.copy(), reference.copy()
    for k, c in enumerate(coordinates):
        lowest, highest = c.limits
        if lowest is not None and highest is not None:
            low[k], high[k] = float(lowest), float(highest)
    return low, high


def _closing(
    k: int, values: Floats, reference: Floats, is_closed: IsClosed
) -> tuple[float, float] | None:
    """Return the interval around the reference value of coordinate k in which the loops close."""

    def closes(value: float) -> bool:
        q = reference.copy()
        q[k] = value
        return is_closed(q)

    # A grid can miss a narrow interval in which the loops close, so the search starts at the
    # reference.
    start = float(np.clip(reference[k], values[0], values[-1]))
    if not closes(start):
        return None
    ends = []
    for steps in (values[values < start][::-1], values[values > start]):
        inside = start
        for value in map(float, steps):
            if not closes(value):
                inside = _edge_between(inside, value, closes)
                break
            inside = value
        ends.append(inside)
    return ends[0], ends[1]


def _edge_between(inside: float, outside: float, closes: Callable[[float], bool]) -> float:
    for _ in range(HALVINGS):
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if closes(middle) else (inside, middle)
    return inside


def omitted_actuators(h: SolvedLoops) -> str:
    """List the actuators without a reference value, with their assumed values.

    If an assumed actuator value contradicts the joint values in the description, the text also
    states the actuator value that closes the loops.

    The text is empty if the reference contains all actuator values, or no values at all.
    """
    mechanism, bodies = h.mechanism, NumericMechanism(h.mechanism)
    omitted = [c.moves for c in mechanism.coordinates if c.moves in mechanism.omitted]
    if not omitted or {name for name, _ in mechanism.reference} <= {*mechanism.omitted}:
        return ""
    names = [loop_joint.name for loop_joint in mechanism.loop_joints]
    near = bodies.nearest(bodies.values, omitted, names)
    near = bodies.nearest(near, [*bodies.unknown, *omitted], names)
    words = []
    for name in omitted:
        is_length = bodies.is_length(name)
        text = f"{name} = {shown(bodies.values[name], is_length)}"
        off = abs(near[name] - bodies.values[name]) / (bodies.size if is_length else 1.0)
        if off > OMITTED and bodies.all_closed(near, names):
            text += f" ({shown(near[name], is_length)} at the stated joints)"
        words.append(text)
    text = (
        "reference: the file omits actuated coordinates, which start in the middle of their limits"
    )
    return f"{text}: {', '.join(words)}"


def moved_reference(h: SolvedLoops) -> str:
    """State which joint value differs most between the reference and the closed configuration.

    The reference values of dependent joints only select the branch. A large difference between
    reference and closed configuration usually means that the actuated coordinates are wrong. The
    text is empty if all reference values agree closely with the closed configuration, up to full
    turns.
    """
    at, size = h.at_reference, h.numbers.size
    described = {name: float(h.terms.value(x)) for name, x in h.mechanism.reference}
    lengths = {v.name for v in h.variables if v.unit == "m"}
    off = {
        name: abs(value - at[name]) / size
        if name in lengths
        else abs(math.remainder(value - at[name], math.tau))
        for name, value in described.items()
        if name in at
    }
    farthest = max(off, key=lambda name: off[name], default=None)
    if farthest is None or off[farthest] <= MOVED_REFERENCE:
        return ""
    is_length = farthest in lengths
    moved = [c.moves for c in h.mechanism.coordinates]
    actuated = ", ".join(f"{name} = {shown(at[name], name in lengths)}" for name in moved)
    return (
        f"reference: {farthest} is {shown(described[farthest], is_length)} in the file, and "
        f"{shown(at[farthest], is_length)} where the loops close at {actuated}"
    )
