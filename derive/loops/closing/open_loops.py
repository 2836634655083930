"""Diagnoses the first loop of a mechanism that does not close.

The report states the closure error of the open loop, and lengths that would close this loop.

The module adds the loops one by one. After each addition, the module tries to close all loops added
so far, with start values at the reference and at random configurations. The report describes the
first loop that does not close together with the earlier loops.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...model.errors import DescriptionError, LoopError
from ...model.mechanism import Closure, Mechanism, Strut
from ...model.placements import Placement, symbols_of
from ...model.tolerances import NUMERICALLY_CLOSED, REPEATED_EQUATION
from ..model.numeric_mechanism import NumericMechanism, length_of, offset_of
from ..model.numeric_rows import NumericRows
from .actuation import across, check_actuation
from .closed_loops import ClosedLoops
from .shown_values import interval, shown
from .suspect_rods import suspect_rod
from .swapped_ends import swapped_ends
from .tilted_pins import explain_open_loop

STARTS = 8
"""Number of random start configurations that are tried before a loop counts as open."""
MAX_REFINED = 3
"""Number of configurations that a further search refines, namely those with the smallest closure
errors."""
MAX_REMEDIES = 5
"""Maximum number of lengths and angles that a message suggests to change, with the smallest change
first. Changes of actuated coordinates are listed even beyond this maximum."""
DOUBLINGS, HALVINGS = 12, 16
FARTHEST = 8.0
"""Upper bound for lengths that are tested as remedies, relative to the size of the mechanism."""
FIRST_STEP = 0.05
"""First step (radian, or relative to the robot size) in the search for an end of the interval in
which the loops close."""
ASIDE = 0.2
"""Shift (radian, or relative to the robot size) of each unknown variable from a possible dead point
to a start configuration."""


@dataclass(frozen=True)
class Remedy:
    """A length or angle that can close a loop, with the interval of values that close the loop.

    Attributes:
        name: Description of the length or angle in words.
        now: Present length or angle in the robot description (meter or radian).
        low: The lowest value that closes the loop, or None if no lowest value was found.
        high: The highest value that closes the loop, or None if no highest value was found.
        is_length: True if the remedy changes a length, False if it changes an angle.
    """

    name: str
    now: float
    low: float | None
    high: float | None
    is_length: bool

    def __str__(self) -> str:
        now = shown(self.now, self.is_length)
        return f"{self.name}, now {now}: {interval(self.low, self.high, self.is_length)}"


def open_loop(mechanism: Mechanism) -> LoopError | None:
    """Describe the first open loop at the reference, its closure error, and possible remedies.

    Args:
        mechanism: The description.

    Returns:
        Error that describes the first open loop, or None if all loops close.
    """
    bodies = NumericMechanism(mechanism)
    values, tried = bodies.values, []
    for loop_joint in mechanism.loop_joints:
        tried.append(loop_joint.name)
        values = _closed(bodies, values, tried)
        closure_error = bodies.closure_errors(values)[loop_joint.name]
        if not bodies.is_closed(closure_error) or not bodies.all_closed(values, tried):
            return _loop_error(bodies, loop_joint, values, tried)
    return None


def diagnose_open_loop(mechanism: Mechanism, error: DescriptionError) -> DescriptionError:
    """Add advice to the error of a solver that could not close the loops at the reference.

    Args:
        mechanism: The description.
        error: Error of the solver. If Newton's method can close the loops, the returned error is
            usually the solver's error with an appended suggestion.
    """
    found = open_loop(mechanism)
    swapped = swapped_ends(mechanism)
    if found is not None:
        more = f"\n    Or {swapped}" if swapped else ""
        cause = explain_open_loop(mechanism)
        text = f"robot {mechanism.name!r}: {found}{cause}{more}"
        return LoopError(text, closure_error=found.closure_error, remedies=found.remedies)
    if swapped:
        return type(error)(f"{error}\n    Perhaps {swapped}")
    bodies = NumericMechanism(mechanism)
    for loop_joint in mechanism.loop_joints:
        words = across(bodies, loop_joint)
        if words:
            return type(error)(f"{error} ({loop_joint.name}: {words})")
    names = [loop_joint.name for loop_joint in mechanism.loop_joints]
    at = _closed(bodies, bodies.values, names)
    actuation = _wrong_actuation(mechanism, at)
    if actuation is not None:
        return actuation
    moving = {c.moves for c in mechanism.coordinates}
    cylinders = [strut.name for strut in mechanism.struts if strut.name in moving]
    free = [*bodies.unknown, *cylinders]
    # The default stroke of a cylinder, the middle of its limits, may contradict the stated joint
    # values.
    nearest = bodies.nearest(bodies.values, free, names)
    if cylinders and bodies.all_closed(nearest, names):
        at = nearest
    near = ", ".join(
        f"{name} = {shown(_wrapped(at[name], is_length), is_length)}"
        for name, is_length in ((name, bodies.is_length(name)) for name in free)
    )
    rows = NumericRows(bodies)
    J = rows.relative(at)[:, [name in bodies.unknown for name in rows.names]]
    if np.linalg.matrix_rank(J, tol=REPEATED_EQUATION) < J.shape[1]:
        actuated = ", ".join(mechanism.actuated)
        advice = f"set other values of {actuated} in [reference] at which the loops can move"
        return type(error)(f"{error}\n    The loops are at a dead point at {near}: {advice}")
    omitted = [name for name in mechanism.omitted if name in moving]
    default = f"; {', '.join(omitted)} started in the middle of the limits" if omitted else ""
    advice = f"write values close to these in [reference]{default}"
    return type(error)(f"{error}\n    The loops close at {near}: {advice}")


def _wrong_actuation(mechanism: Mechanism, at: Mapping[str, float]) -> DescriptionError | None:
    """Return the error for actuators that do not determine the motion, or None.

    The numerical test of the actuators also fails at a dead point, even if the actuators are
    correct.

    Args:
        mechanism: The description.
        at: Coordinate values near a closed configuration.
    """
    loops = ClosedLoops(mechanism, at)
    try:
        loops.closed(loops.reference, np.ones(len(loops.names), dtype=bool))
    except DescriptionError:
        return None
    try:
        check_actuation(loops)
    except DescriptionError as error:
        return error
    return None


def _wrapped(value: float, is_length: bool) -> float:
    """Return an angle reduced to [-pi, pi], or a length without change."""
    return value if is_length else math.remainder(value, 2 * math.pi)


def _closed(
    bodies: NumericMechanism, values: Mapping[str, float], loops: Sequence[str]
) -> dict[str, float]:
    """Search for a closed configuration from several start values, and return the best found."""
    random = np.random.default_rng(0)
    last = loops[-1]
    best = bodies.nearest(values, bodies.unknown, loops)
    if bodies.all_closed(best, loops):
        return best
    found = [best]
    for _ in range(STARTS):
        trial = dict(values)
        for name in bodies.unknown:
            reach = bodies.size if bodies.is_length(name) else math.pi
            trial[name] += random.uniform(-reach, reach)
        trial = bodies.nearest(trial, bodies.unknown, loops)
        if bodies.all_closed(trial, loops):
            return trial
        found.append(trial)
    found.sort(key=lambda at: _misfit(bodies, at, loops))
    least = [bodies.nearest(at, bodies.unknown, loops, last) for at in (best, *found[:MAX_REFINED])]
    return min(least, key=lambda at: _misfit(bodies, at, loops))


def _misfit(bodies: NumericMechanism, values: Mapping[str, float], loops: Sequence[str]) -> float:
    closure_errors = bodies.closure_errors(values)
    return max(
        closure_errors[name].distance / bodies.size + closure_errors[name].turn for name in loops
    )


# --- remedies ---


def _loop_error(
    bodies: NumericMechanism,
    loop_joint: Closure | Strut,
    values: Mapping[str, float],
    loops: Sequence[str],
) -> LoopError:
    closure_error, words = _error_in_words(bodies, loop_joint, values)
    head = f"the loop of {loop_joint.name!r} does not close{_where(bodies, loop_joint)}: {words}"
    words = _across_at(bodies, loop_joint, loops)
    if words:
        return LoopError(f"{head}; {words}", closure_error=closure_error)
    remedies = sorted(
        _remedies(bodies, loop_joint, values, loops), key=lambda r: _change(bodies, r)
    )
    suspect = suspect_rod(bodies, loops)
    head = f"{head}. {suspect}" if suspect else head
    if not remedies:
        text = f"{head}; no single length, angle or coordinate of it closes the loop"
        return LoopError(text, closure_error=closure_error)
    coordinates = {c.name for c in bodies.mechanism.coordinates}
    lines = [
        f"    {remedy}"
        for k, remedy in enumerate(remedies)
        if k < MAX_REMEDIES or remedy.name in coordinates
    ]
    text = "\n".join([f"{head}. Any one of these closes it:", *lines])
    return LoopError(text, closure_error=closure_error, remedies=tuple(remedies))


def _across_at(bodies: NumericMechanism, open_: Closure | Strut, loops: Sequence[str]) -> str:
    """List pin axes that are not normal to the plane of their loop."""
    if words := across(bodies, open_):
        return words
    for loop_joint in bodies.mechanism.loop_joints:
        if loop_joint.name in loops and (words := across(bodies, loop_joint)):
            return f"{loop_joint.name!r} immobilizes the joints of its loop: {words}"
    return ""


def _where(bodies: NumericMechanism, loop_joint: Closure | Strut) -> str:
    """List the reference values of the actuated coordinates of a loop."""
    names = {name for name, _, _ in _candidates(bodies, loop_joint)}
    omitted = bodies.mechanism.omitted
    stated = [
        f"{c.name} = {shown(bodies.values[c.moves] / bodies.number(c.ratio), c.unit == 'm')}"
        f"{', the middle of its limits' if c.moves in omitted else ''}"
        for c in bodies.mechanism.coordinates
        if c.moves in names
    ]
    return f" at the reference ({', '.join(stated)})" if stated else " at the reference"


def _error_in_words(
    bodies: NumericMechanism, loop_joint: Closure | Strut, values: Mapping[str, float]
) -> tuple[float, str]:
    """Return the closure error (meter) of a loop, and a text that describes this error."""
    _, _, d = bodies.ends(loop_joint, values)
    distance = float(np.linalg.norm(d))
    if isinstance(loop_joint, Strut):
        length = bodies.length(loop_joint, values)
        word = "too short" if distance > length else "too long"
        words = (
            f"its ends on {loop_joint.a.body} and {loop_joint.b.body} are at best"
            f" {shown(distance, True)} apart, but it is {shown(length, True)} long,"
            f" {shown(abs(distance - length), True)} {word}"
        )
        return abs(distance - length), words
    error = bodies.closure_errors(values)[loop_joint.name]
    parts = (
        [shown(error.distance, True)] if error.distance > NUMERICALLY_CLOSED * bodies.size else []
    )
    parts += [shown(error.turn, False)] if error.turn > NUMERICALLY_CLOSED else []
    apart = f"are at best {' and '.join(parts)} apart"
    words = f"its frames on {loop_joint.a.body} and {loop_joint.b.body} {apart}"
    return float(error.distance), words


def _remedies(
    bodies: NumericMechanism,
    loop_joint: Closure | Strut,
    values: Mapping[str, float],
    loops: Sequence[str],
) -> Iterator[Remedy]:
    for name, words, factor in _candidates(bodies, loop_joint):
        found = _range(bodies, name, values, loops)
        if found is not None:
            now = values.get(name, bodies.constants.get(name, 0.0))
            low, high = (None if v is None else v / factor for v in found)
            if factor < 0:
                low, high = high, low
            is_length = bodies.is_length(name) and factor == 1
            yield Remedy(words, now / factor, low, high, is_length)


def _candidates(
    bodies: NumericMechanism, loop_joint: Closure | Strut
) -> Iterator[tuple[str, str, float]]:
    """Yield a tuple (name, description, factor) for each constant and each actuator of a loop."""
    mechanism = bodies.mechanism
    paths = [mechanism.path_to(frame.body) for frame in (loop_joint.a, loop_joint.b)]
    joints = [joint for path in paths for joint in path if not all(joint in w for w in paths)]
    yield from _constants(bodies, loop_joint, [joint.before for joint in joints])
    for joint in joints:
        if offset_of(joint) in bodies.constants:
            yield (
                offset_of(joint),
                f"distance of joint {joint.name} from the origin of {joint.parent}",
                1.0,
            )
    moved = {joint.name for joint in joints} | {loop_joint.name}
    for c in mechanism.coordinates:
        if c.moves in moved or _spans_moving(mechanism, c.moves, moved):
            yield c.moves, c.name, bodies.number(c.ratio)


def _constants(
    bodies: NumericMechanism, loop_joint: Closure | Strut, placements: Sequence[Placement]
) -> Iterator[tuple[str, str, float]]:
    if (
        isinstance(loop_joint, Strut)
        and length_of(loop_joint) in bodies.constants
        and not loop_joint.is_cylinder
    ):
        yield length_of(loop_joint), f"length of {loop_joint.name}", 1.0
    used = set().union(
        *map(symbols_of, (*placements, loop_joint.a.placement, loop_joint.b.placement))
    )
    if isinstance(loop_joint, Strut):
        used |= loop_joint.length.free_symbols
    for parameter in bodies.mechanism.parameters:
        if parameter.symbol in used and parameter.kind != "ratio":
            meaning = f" ({parameter.meaning})" if parameter.meaning else ""
            yield parameter.name, f"{parameter.name}{meaning}", 1.0
    for side, frame in (("a", loop_joint.a), ("b", loop_joint.b)):
        if offset_of(loop_joint, side) in bodies.constants:
            words = f"distance of {loop_joint.name}'s end {side} from the origin of {frame.body}"
            yield offset_of(loop_joint, side), words, 1.0


def _spans_moving(mechanism: Mechanism, name: str, moved: set[str]) -> bool:
    """Whether a joint in ``moved`` lies between the base and one end of the strut ``name``."""
    for strut in mechanism.struts:
        if strut.name == name:
            paths = {j.name for f in (strut.a, strut.b) for j in mechanism.path_to(f.body)}
            return bool(paths & moved)
    return False


# --- ranges ---


def _range(
    bodies: NumericMechanism, name: str, values: Mapping[str, float], loops: Sequence[str]
) -> tuple[float | None, float | None] | None:
    """Return the interval of lengths or angles that close the loops, or None if none is found."""
    now = values.get(name, bodies.constants.get(name, 0.0))
    inside = _inside(bodies, name, now, values, loops)
    if inside is None:
        return None
    at, configuration = inside
    near = _edge(bodies, name, at, now, configuration, loops)
    sense = 1.0 if at > now else -1.0
    far = at
    step = FIRST_STEP * (bodies.size if bodies.is_length(name) else 1.0)
    for _ in range(DOUBLINGS):
        beyond = far + sense * step
        if not _is_sensible(bodies, name, now, beyond):
            is_short = name in bodies.constants and bodies.is_length(name) and beyond <= 0
            return _ordered(near, 0.0 if is_short else None, sense)
        closed = _at(bodies, name, beyond, configuration, loops) or _at(
            bodies, name, beyond, _off_dead_point(bodies, configuration), loops
        )
        if closed is None:
            return _ordered(near, _edge(bodies, name, far, beyond, configuration, loops), sense)
        far, configuration, step = beyond, closed, 2 * step
    return _ordered(near, None, sense)


def _ordered(near: float, far: float | None, sense: float) -> tuple[float | None, float | None]:
    return (near, far) if sense > 0 else (far, near)


def _off_dead_point(
    bodies: NumericMechanism, configuration: Mapping[str, float]
) -> dict[str, float]:
    """Return a configuration that is shifted slightly away from a possible dead point.

    At the shifted configuration, unlike at a dead point, the joint directions are defined.
    """
    moved = dict(configuration)
    for k, name in enumerate(bodies.unknown):
        moved[name] += ASIDE * (-1) ** k * (bodies.size if bodies.is_length(name) else 1.0)
    return moved


def _is_sensible(bodies: NumericMechanism, name: str, now: float, value: float) -> bool:
    if bodies.is_length(name):
        positive = name not in bodies.constants or value > 0
        return positive and abs(value) < FARTHEST * bodies.size
    return abs(value - now) < 2 * math.pi


def _inside(
    bodies: NumericMechanism,
    name: str,
    now: float,
    values: Mapping[str, float],
    loops: Sequence[str],
) -> tuple[float, dict[str, float]] | None:
    """Return a length or angle that closes the loop, with the closed configuration.

    None is returned if no plausible length or angle closes the loop.
    """
    reach = bodies.size if bodies.is_length(name) else math.pi
    for start in (0.0, 0.1, -0.1, 0.5, -0.5, 1.0, -1.0):
        trial = {**values, name: now + start * reach}
        found = _nearest_with(bodies, name, trial, loops)
        value = found.pop(name) if name in bodies.constants else found[name]
        if _is_sensible(bodies, name, now, value):
            closed = _at(bodies, name, value, found, loops)
            if closed is not None:
                return value, closed
    return None


def _nearest_with(
    bodies: NumericMechanism, name: str, values: Mapping[str, float], loops: Sequence[str]
) -> dict[str, float]:
    before = bodies.constants
    if name in bodies.constants:
        bodies.constants = {**before, name: values[name]}
    found = bodies.nearest(values, [*bodies.unknown, name], loops)
    bodies.constants = before
    return found


def _at(
    bodies: NumericMechanism,
    name: str,
    value: float,
    values: Mapping[str, float],
    loops: Sequence[str],
) -> dict[str, float] | None:
    """Return the closed configuration for a length or angle, or None if the loops stay open."""
    before = bodies.constants
    if name in bodies.constants:
        bodies.constants = {**before, name: value}
        found = bodies.nearest(values, bodies.unknown, loops)
    else:
        found = bodies.nearest({**values, name: value}, bodies.unknown, loops)
    closed = bodies.all_closed(found, loops)
    bodies.constants = before
    return found if closed else None


def _edge(
    bodies: NumericMechanism,
    name: str,
    inside: float,
    outside: float,
    configuration: Mapping[str, float],
    loops: Sequence[str],
) -> float:
    """Return the length or angle, nearest to ``outside``, at which the loops still close."""
    for _ in range(HALVINGS):
        middle = (inside + outside) / 2
        closed = _at(bodies, name, middle, configuration, loops)
        if closed is None:
            outside = middle
        else:
            inside, configuration = middle, closed
    return inside


def _change(bodies: NumericMechanism, remedy: Remedy) -> float:
    """Return the smallest change of the remedy's length or angle that closes the loop.

    The change of an angle is in radian, and the change of a length is relative to the robot size.
    """
    ends = [abs(end - remedy.now) for end in (remedy.low, remedy.high) if end is not None]
    return min(ends, default=math.inf) / (bodies.size if remedy.is_length else 1.0)
