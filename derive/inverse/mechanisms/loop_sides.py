"""The choices of an inverse of a robot with loops: the sides of its loops, and idle choices.

Joints of the main chain are held by several vectors of actuated coordinates where a leg or a
four-bar can fold to either side. The inverse offers the side as one more choice. Choices that make
no difference are settled when the inverse is derived: a platform that does not turn has the same
legs for both ways to write its orientation, and a side on which forward kinematics never is gives
no solution.
"""

from collections.abc import Sequence

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ...loops.hybrid import Hybrid
from ...loops.maps import chain, from_actuators
from ...loops.planar.loop_step import LoopStep
from ...loops.solution import Solution, with_free_sides
from ...model.tolerances import LED_BACK, LED_STEP
from ...terms.branches import patterns
from ...terms.casadi_graph import lower
from ...terms.symbolic_function import SymbolicFunction
from ..steps.work import Work
from ..tasks.task import Solved

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
SAMPLES, MOST_DRAWN = 200, 4000
"""Configurations that an inverse is asked for, and those drawn to find them: loops of cranks and
rods close at one in twenty."""
PARTS, FEW = (1.0, 0.1, 0.01, 0.001), 20
"""Parts of the mechanism's size over which lengths without limits are drawn, in turn until a few
configurations close: three booms far from the base close within a small part of it."""
MOST_CHOICES = 9
"""Choices that are tried together, in 512 slots; with more, loops stay on the reference's side."""


def solved_on_sides(hybrid: Hybrid, work: Work) -> Solution:
    """All joints from the main chain, with a sign for the side of each loop.

    Args:
        hybrid: The robot.
        work: Receives the signs and the names of the sides; a sign of 1 is the reference's side.
    """
    given = [joint.name for joint in hybrid.robot.moving]
    solution = with_free_sides(hybrid.loops, hybrid.backward, given, work.sign)
    chosen = [step for step in solution.steps if _is_free(step)]
    names = [step.name(hybrid.mechanism) for step in chosen]
    for step, name in zip(chosen, names, strict=True):
        # A loop that two steps close in turn is not enough of a name.
        told = f"{name} at {step.joints[1].split('.')[0]}" if names.count(name) > 1 else name
        (symbol,) = sp.Add(step.sign).free_symbols
        work.sides[symbol] = told, _sides(step, symbol)
    return solution


def _is_free(step: LoopStep) -> bool:
    """Whether the side of a step is a symbol, not a number."""
    return bool(sp.Add(step.sign).free_symbols)


def _sides(step: LoopStep, symbol: sp.Symbol) -> dict[int, str]:
    """The names of both sides of a step, by the value of its sign's symbol."""
    sign = sp.Add(step.sign)
    return {value: step.branches[int(sign.subs(symbol, value))] for value in (1, -1)}


def settled_choices(hybrid: Hybrid, solved: Solved, given: Sequence[int] = ()) -> frozenset[int]:
    """The choices of an inverse that make no difference, by their number.

    The inverse is asked for the poses of random configurations. A choice is idle where both its
    sides have the same coordinates, and the side of a loop where the other one gives no solution.

    Args:
        hybrid: The robot.
        solved: Its inverse with all choices.
        given: Indices of the main chain's joints that the inverse takes besides a pose.
    """
    function, work = solved.function, solved.work
    of_loops = choices_of_loops(work)
    if not function.signs:
        return frozenset()
    if len(function.inputs) != 1 + len(given) or len(function.signs) > MOST_CHOICES:
        return of_loops
    _, *inputs = _poses(hybrid, given)
    same, without = idle_choices(hybrid, function, *inputs)
    return same | (without & of_loops)


def choices_of_loops(work: Work) -> frozenset[int]:
    """The choices that are sides of loops, by their number."""
    return frozenset(k for k, symbol in enumerate(work.signs) if symbol in work.sides)


def unused_sides(built: Hybrid, start: Solved, given: Sequence[int] = ()) -> frozenset[int]:
    """The sides of loops on which a robot as built never is, by the number of their choice.

    At the poses of random configurations, the reference's side of such a loop gives starts that are
    as near to the coordinates.

    Args:
        built: The robot as built.
        start: The starts of its inverse, with all sides of its loops.
        given: Indices of the main chain's joints that the inverse takes besides a pose.
    """
    function, of_loops = start.function, choices_of_loops(start.work)
    if not of_loops:
        return frozenset()
    if len(function.inputs) != 1 + len(given) or len(function.signs) > MOST_CHOICES:
        return of_loops
    known, *inputs = _poses(built, given)
    q, _ = _asked(function, inputs)
    far = np.nan_to_num(_moved(built, q - known).max(-1), nan=np.inf)
    unused = set()
    for k in sorted(of_loops):
        own, other = (_least(np.take(far, [side], axis=k)) for side in (0, 1))
        if not ((other < own) & (other < LED_STEP)).any():
            unused.add(k)
            far = np.take(far, [0], axis=k)
    return frozenset(unused)


def _least(far: FloatArray) -> FloatArray:
    """The least distance (N,) of all slots (..., N)."""
    return np.asarray(far.reshape(-1, far.shape[-1]).min(0))


def idle_choices(
    hybrid: Hybrid, function: SymbolicFunction, *inputs: FloatArray, within: float | None = None
) -> tuple[frozenset[int], frozenset[int]]:
    """The choices of an inverse that make no difference at some poses, by their number.

    Args:
        hybrid: The robot.
        function: Its inverse with all choices.
        inputs: What the inverse takes: poses (16, N) first.
        within: The residual below which coordinates solve a pose; rounding by default.

    Returns:
        The choices both of whose sides have the same coordinates; and those whose other side has
        no solution.
    """
    if within is None:
        within = LED_BACK * min(hybrid.backward.reference.size, 1.0)
    q, residual = _asked(function, inputs)
    solves = np.asarray(residual < within)
    choices = range(len(function.signs))
    same = frozenset(k for k in choices if _is_idle(hybrid, q, solves, k))
    return same, frozenset(k for k in choices if not np.take(solves, 1, axis=k).any())


def _poses(hybrid: Hybrid, given: Sequence[int]) -> list[FloatArray]:
    """Random coordinates (N, n), their poses (16, N), and given joints (1, N) there."""
    fk, theta = lower([hybrid.tool_functions(["fk"])["fk"], chain(from_actuators(hybrid))], "true")
    for part in PARTS:
        known = _configurations(hybrid, part)
        T = np.array(fk(known.T)).reshape(16, -1)
        closed = np.flatnonzero(np.isfinite(T).all(0))[:SAMPLES]
        if len(closed) >= FEW:
            break
    known, T = known[closed], T[:, closed]
    return [known, T, *(np.array(theta(known.T))[k][None] for k in given)]


def _asked(
    function: SymbolicFunction, inputs: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Coordinates (2, ..., 2, N, n) of every slot at poses, and residuals (2, ..., 2, N)."""
    (ik,) = lower([function], "inverse")
    count = inputs[0].shape[1]
    slots = [
        ik(*inputs, np.repeat(np.array(signs, dtype=float)[:, None], count, 1))
        for signs in patterns(function)
    ]
    sides = (2,) * len(function.signs)
    q = np.stack([np.array(slot[0]).T for slot in slots]).reshape(*sides, count, -1)
    return q, np.stack([np.array(slot[1])[0] for slot in slots]).reshape(*sides, count)


def _is_idle(hybrid: Hybrid, q: FloatArray, solves: BoolArray, choice: int) -> bool:
    """Whether both sides of a choice have the same solutions."""
    one, other = (np.take(solves, side, axis=choice) for side in (0, 1))
    if not one.any() or (one != other).any():
        return False
    moved = _moved(hybrid, (np.take(q, 0, axis=choice) - np.take(q, 1, axis=choice))[one])
    turns = [c.kind == "revolute" for c in hybrid.mechanism.coordinates]
    sizes = np.where(turns, 1.0, hybrid.backward.reference.size)
    return not bool((moved > LED_BACK * sizes).any())


def _moved(hybrid: Hybrid, apart: FloatArray) -> FloatArray:
    """How far differences (..., n) of coordinates move their joints, the shorter way round."""
    moved = apart * [float(hybrid.terms.value(c.ratio)) for c in hybrid.mechanism.coordinates]
    turns = [c.kind == "revolute" for c in hybrid.mechanism.coordinates]
    wrapped = np.remainder(moved + np.pi, 2 * np.pi) - np.pi
    return np.asarray(np.abs(np.where(turns, wrapped, moved)))


def _configurations(hybrid: Hybrid, part: float) -> FloatArray:
    """The reference's coordinates and random ones (N, n).

    They are within the limits, all round, or within a part of the mechanism's size.
    From closer to the reference than its whole size, a rocker may not have passed its dead points.
    """
    low, high = [], []
    for c in hybrid.mechanism.coordinates:
        ratio = float(hybrid.terms.value(c.ratio))
        middle = hybrid.at_reference[c.moves] / ratio
        size = hybrid.backward.reference.size
        reach = np.pi if c.kind == "revolute" else part * size
        ends = zip(c.limits, (-reach / abs(ratio), reach / abs(ratio)), strict=True)
        a, b = (middle + off if v is None else float(v) for v, off in ends)
        low.append(a)
        high.append(b)
    drawn = np.random.default_rng(0).uniform(low, high, (MOST_DRAWN, len(low)))
    return np.vstack([hybrid.q_at_reference, drawn])
