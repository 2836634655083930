"""Loop branches in the inverse kinematics of a robot with loops.

If a leg or a four-bar linkage has two branches, two actuator vectors lead to the same main-chain
joints. Each loop with two branches adds a branch sign to the inverse kinematics. A branch sign that
does not change the actuated coordinates is removed during the derivation. For example, the branch
sign for the orientation of a translating platform is removed, because both orientations lead to
equal joint values of the legs. A loop branch that forward kinematics never reaches gives no inverse
kinematics solutions.
"""

from collections.abc import Sequence

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ...loops.functions.maps import CHAIN, from_actuators
from ...loops.functions.tool import tool_functions
from ...loops.planar.loop_step import LoopStep
from ...loops.solve.solution import Solution, with_free_sides
from ...loops.solve.solved_loops import SolvedLoops
from ...model.tolerances import MAX_REFINING_STEP, RECOVERED
from ...terms.branches import patterns
from ...terms.casadi_graph import lower
from ...terms.symbolic_function import SymbolicFunction
from ..steps.work import Work
from ..tasks.task import Solved

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
SAMPLES, MAX_DRAWN = 200, 4000
"""Number of test configurations, and maximum number of random trials.

In mechanisms with cranks and rods, the loops may close in as few as one of twenty random trials.
"""
PARTS, FEW = (1.0, 0.1, 0.01, 0.001), 20
"""Sampling ranges for lengths without limits, as fractions of the mechanism size.

The sampling ranges are tried in the listed order, up to the first range in which the loops close
for at least ``FEW`` samples. For example, a loop of three long booms closes only within a small
range.
"""
MAX_CHOICES = 9
"""Maximum number of branch signs of an inverse kinematics function. Nine branch signs distinguish
2^9 = 512 solutions.

If a function would need more branch signs, its loops have none and stay on the reference branch.
"""


def solved_on_sides(hybrid: SolvedLoops, work: Work) -> Solution:
    """Compute all joints from the joints of the main chain, with a branch sign for each loop.

    Args:
        hybrid: The robot.
        work: Record of the solution, to which the function adds the branch signs and their names.
    """
    given = [joint.name for joint in hybrid.robot.moving]
    solution = with_free_sides(hybrid.loops, hybrid.backward, given, work.sign)
    chosen = [step for step in solution.steps if _is_free(step)]
    names = [step.name(hybrid.mechanism) for step in chosen]
    for step, name in zip(chosen, names, strict=True):
        # If two solution steps close the same loop, the name of the branch sign also contains the
        # joint name.
        message = f"{name} at {step.joints[1].split('.')[0]}" if names.count(name) > 1 else name
        (symbol,) = sp.Add(step.sign).free_symbols
        work.sides[symbol] = message, _sides(step, symbol)
    return solution


def _is_free(step: LoopStep) -> bool:
    return bool(sp.Add(step.sign).free_symbols)


def _sides(step: LoopStep, symbol: sp.Symbol) -> dict[int, str]:
    sign = sp.Add(step.sign)
    return {value: step.branches[int(sign.subs(symbol, value))] for value in (1, -1)}


def settled_choices(
    hybrid: SolvedLoops, solved: Solved, given: Sequence[int] = ()
) -> frozenset[int]:
    """Return the indices of branch signs that an inverse kinematics function does not need.

    The inverse kinematics function is evaluated at the poses of random configurations. A branch
    sign is not needed if both of its values lead to the same coordinates. The branch sign of a loop
    is not needed if only the value 1 gives solutions.

    Args:
        hybrid: The robot.
        solved: Inverse kinematics with all branch signs.
        given: Indices of the main-chain joints that are inputs of the inverse kinematics function.
    """
    function, work = solved.function, solved.work
    of_loops = choices_of_loops(work)
    if not function.signs:
        return frozenset()
    if len(function.inputs) != 1 + len(given) or len(function.signs) > MAX_CHOICES:
        return of_loops
    _, *inputs = _poses(hybrid, given)
    same, without = idle_choices(hybrid, function, *inputs)
    return same | (without & of_loops)


def choices_of_loops(work: Work) -> frozenset[int]:
    """Return the indices of the branch signs that select branches of loops."""
    return frozenset(k for k, symbol in enumerate(work.signs) if symbol in work.sides)


def unused_sides(built: SolvedLoops, start: Solved, given: Sequence[int] = ()) -> frozenset[int]:
    """Return the indices of branch signs whose second branch a built robot never reaches.

    Args:
        built: The robot as built.
        start: Inverse kinematics that gives start values for Newton's method on all loop branches.
        given: Indices of the main-chain joints that are inputs of the inverse kinematics function.
    """
    function, of_loops = start.function, choices_of_loops(start.work)
    if not of_loops:
        return frozenset()
    if len(function.inputs) != 1 + len(given) or len(function.signs) > MAX_CHOICES:
        return of_loops
    known, *inputs = _poses(built, given)
    q, _ = _evaluated(function, inputs)
    far = np.nan_to_num(_moved(built, q - known).max(-1), nan=np.inf)
    unused = set()
    for k in sorted(of_loops):
        own, other = (_least(np.take(far, [side], axis=k)) for side in (0, 1))
        if not ((other < own) & (other < MAX_REFINING_STEP)).any():
            unused.add(k)
            far = np.take(far, [0], axis=k)
    return frozenset(unused)


def _least(far: FloatArray) -> FloatArray:
    return np.asarray(far.reshape(-1, far.shape[-1]).min(0))


def idle_choices(
    hybrid: SolvedLoops,
    function: SymbolicFunction,
    *inputs: FloatArray,
    within: float | None = None,
) -> tuple[frozenset[int], frozenset[int]]:
    """Find branch signs that give no additional inverse kinematics solutions at sample poses.

    Args:
        hybrid: The robot.
        function: Inverse kinematics function with all branch signs.
        inputs: Inputs of the inverse kinematics function, of which the first is an array (16, N) of
            sample poses.
        within: Maximum residual of a solution. The default maximum residual accepts only rounding
            errors.

    Returns:
        Two sets of branch sign indices. Branch signs of the first set do not change the actuated
        coordinates. A branch sign of the second set gives no solution if its value is -1.
    """
    if within is None:
        within = RECOVERED * min(hybrid.backward.reference.size, 1.0)
    q, residual = _evaluated(function, inputs)
    solves = np.asarray(residual < within)
    choices = range(len(function.signs))
    same = frozenset(k for k in choices if _is_idle(hybrid, q, solves, k))
    return same, frozenset(k for k in choices if not np.take(solves, 1, axis=k).any())


def idle_signs(
    hybrid: SolvedLoops, function: SymbolicFunction, *inputs: FloatArray
) -> frozenset[int]:
    """Find branch signs that change no actuated coordinate at sample poses.

    Each branch sign is tested while all other branch signs have random values.
    """
    (ik,) = lower([function], "inverse")
    shape = len(function.signs), inputs[0].shape[1]
    signs = np.random.default_rng(0).choice([-1.0, 1.0], shape)
    sizes = _tolerances(hybrid)
    q = np.array(ik(*inputs, signs)[0]).T
    found = set()
    for k in range(len(signs)):
        other = signs.copy()
        other[k] *= -1
        moved = _moved(hybrid, q - np.array(ik(*inputs, other)[0]).T)
        if not (moved > sizes).any() and np.isfinite(moved).any():
            found.add(k)
    return frozenset(found)


def _poses(hybrid: SolvedLoops, given: Sequence[int]) -> list[FloatArray]:
    fk, theta = lower(
        [tool_functions(hybrid, ["fk"])["fk"], CHAIN.function(from_actuators(hybrid))], "true"
    )
    for part in PARTS:
        known = _configurations(hybrid, part)
        T = np.array(fk(known.T)).reshape(16, -1)
        closed = np.flatnonzero(np.isfinite(T).all(0))[:SAMPLES]
        if len(closed) >= FEW:
            break
    known, T = known[closed], T[:, closed]
    return [known, T, *(np.array(theta(known.T))[k][None] for k in given)]


def _evaluated(
    function: SymbolicFunction, inputs: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray]:
    (ik,) = lower([function], "inverse")
    count = inputs[0].shape[1]
    slots = [
        ik(*inputs, np.repeat(np.array(signs, dtype=float)[:, None], count, 1))
        for signs in patterns(function)
    ]
    sides = (2,) * len(function.signs)
    q = np.stack([np.array(slot[0]).T for slot in slots]).reshape(*sides, count, -1)
    return q, np.stack([np.array(slot[1])[0] for slot in slots]).reshape(*sides, count)


def _is_idle(hybrid: SolvedLoops, q: FloatArray, solves: BoolArray, choice: int) -> bool:
    one, other = (np.take(solves, side, axis=choice) for side in (0, 1))
    if not one.any() or (one != other).any():
        return False
    moved = _moved(hybrid, (np.take(q, 0, axis=choice) - np.take(q, 1, axis=choice))[one])
    return not bool((moved > _tolerances(hybrid)).any())


def _tolerances(hybrid: SolvedLoops) -> FloatArray:
    turns = [c.kind == "revolute" for c in hybrid.mechanism.coordinates]
    return RECOVERED * np.where(turns, 1.0, hybrid.backward.reference.size)


def _moved(hybrid: SolvedLoops, apart: FloatArray) -> FloatArray:
    """Convert differences of actuated coordinates (..., n) to absolute joint differences."""
    moved = apart * [float(hybrid.terms.value(c.ratio)) for c in hybrid.mechanism.coordinates]
    turns = [c.kind == "revolute" for c in hybrid.mechanism.coordinates]
    wrapped = np.remainder(moved + np.pi, 2 * np.pi) - np.pi
    return np.asarray(np.abs(np.where(turns, wrapped, moved)))


def _configurations(hybrid: SolvedLoops, part: float) -> FloatArray:
    """Return the reference and random configurations as actuated coordinates (N, n).

    Random actuated coordinates lie within the coordinate limits. Angles without limits differ from
    the reference by at most half a turn. Length coordinates without limits differ from the
    reference by at most ``part`` times the mechanism size. If ``part`` is small, the random
    configurations stay on one side of the dead points of the loops.
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
    sampled = np.random.default_rng(0).uniform(low, high, (MAX_DRAWN, len(low)))
    return np.vstack([hybrid.q_at_reference, sampled])
