"""Inverse kinematics of robots whose forward kinematics solves the loops by iteration.

A tool pose determines the joints of the main chain, and these joints determine the actuators in
closed form, loop by loop. Each loop has two branches, one for each of the two folded positions of
its links. If the loops reduce the degrees of freedom of the main chain, as in a delta robot with a
rotated platform, the loop equations decide whether the pose is reachable.
"""

from functools import partial

import numpy as np

from ...chain.kinematics import common_unit
from ...loops.functions.constraint_functions import equations
from ...loops.functions.maps import Maker
from ...loops.modes.platforms import is_platform, of_open_chain, triad_of
from ...loops.solve.solved_loops import SolvedLoops, named
from ...model.mechanism import Mechanism
from ...model.tolerances import SAMPLED_RANGE
from ...terms.casadi_graph import lower
from ...terms.symbolic_function import SymbolicFunction
from ..chain_solution import solve_chain
from ..classify import Attempt, classify
from ..families import FAMILIES
from ..steps.target import of_pose
from ..steps.work import Work
from ..structure.lines import Lines, home_of
from ..tasks.slots import (
    POSE_SYMBOLS,
    function_of,
    larger,
    pose_argument,
    pose_errors,
    squares,
    tool_of,
    values_of,
)
from ..tool_axis import with_still_axis
from .loop_sides import MAX_CHOICES, SAMPLES, FloatArray, idle_choices, solved_on_sides
from .substitution import substituted

Structure = tuple[Lines, Attempt]
WHOLE = 6
"""Degrees of freedom of a platform constrained only by its legs."""
IDENTITY = "T is a pose at which the loops close with q[k] wherever residual[k] is rounding"


def makers(h: SolvedLoops) -> dict[str, Maker]:
    """Returns the function ``ik`` if all joints are closed-form functions of the main-chain joints.

    Returns no function otherwise; planar platforms with three legs have a separate inverse.
    """
    fits = h.forward.open and triad_of(h) is None
    if not fits or h.backward.open or (h.may_have_inverse and not is_platform(h.mechanism)):
        return {}
    structure = _structure(h)
    return {} if structure is None else {"ik": partial(_inverse, structure=structure)}


def _structure(h: SolvedLoops) -> Structure | None:
    """Returns the main-chain axes and a structure that solves the pose, or None."""
    classification = classify(h.robot, h.terms)
    found = classification.found
    if found is None:
        return with_still_axis(h.robot, classification, FAMILIES)
    fits = classification.tier == "exact" and not found.given and not found.family.inputs
    return (classification.lines, found) if fits else None


def _inverse(h: SolvedLoops, structure: Structure) -> SymbolicFunction:
    """Returns the function ``ik``, with one slot per distinct combination of branch signs."""
    function, work = _solved(h, frozenset(), structure)
    settled = _settled(h, function, work)
    return _solved(h, settled, structure)[0] if settled else function


def _settled(h: SolvedLoops, function: SymbolicFunction, work: Work) -> frozenset[int]:
    """Returns the indices of the branch signs that do not affect the result."""
    unused = _unused(h, function, work)
    if len(h.theta) == WHOLE and _is_held_at_its_end(h.mechanism):
        # Several joint vectors of the platform chain describe the same pose and the same legs.
        return unused | frozenset(range(len(work.signs) - len(work.sides)))
    if not 0 < len(work.signs) <= MAX_CHOICES:
        return unused
    if len(h.theta) > len(h.q):
        # For random poses of the chain, the loops can rarely be closed, but the branch signs still
        # change the computed coordinates.
        return unused | idle_choices(h, function, _poses(h), within=np.inf)[0]
    same, without = idle_choices(h, function, _poses(h))
    return unused | same | {k for k in without if work.signs[k] in work.sides}


def _unused(h: SolvedLoops, function: SymbolicFunction, work: Work) -> frozenset[int]:
    """Returns the loop branches that do not affect the actuated coordinates."""
    q = function.outputs[0].entries
    behind = [*q, *(h.terms.definitions[symbol] for symbol in h.terms.needed(q))]
    used = {symbol for entry in behind for symbol in entry.free_symbols}
    return frozenset(
        k for k, sign in enumerate(work.signs) if sign in work.sides and sign not in used
    )


def _is_held_at_its_end(mechanism: Mechanism) -> bool:
    """Whether the loops constrain only the last body of an unactuated main chain."""
    chain = {joint.name for joint in mechanism.main_chain.moving}
    ends = [frame for closer in mechanism.closers for frame in (closer.a, closer.b)]
    ways = [chain & {joint.name for joint in mechanism.way(frame.body)} for frame in ends]
    actuated = {coordinate.moves for coordinate in mechanism.coordinates}
    return not chain & actuated and all(way in (set(), chain) for way in ways)


def _poses(h: SolvedLoops) -> FloatArray:
    """Returns random poses (16, N) of the main chain around the reference."""
    (fk,) = lower([of_open_chain("fk", h)], "chain")
    size = h.backward.reference.size
    middle = np.array([h.at_reference[joint.name] for joint in h.robot.moving])
    lengths = np.array([joint.kind == "prismatic" for joint in h.robot.moving])
    reach = SAMPLED_RANGE * np.where(lengths, size, 1.0)
    theta = middle + np.random.default_rng(0).uniform(-reach, reach, (SAMPLES, len(middle)))
    return np.array(fk(theta.T)).reshape(16, -1)


def _solved(
    h: SolvedLoops, settled: frozenset[int], structure: Structure
) -> tuple[SymbolicFunction, Work]:
    """Returns the function without redundant branch signs, and its solution steps."""
    lines, found = structure
    terms, work = h.terms, Work(h.terms, settled=settled)
    target = of_pose(terms, POSE_SYMBOLS, home_of(h.robot, terms))
    solve_chain(work, lines, found, target, {})
    values = values_of(work, h.robot, {})
    moving = zip(h.theta, h.robot.moving, values, strict=True)
    theta = {symbol: joint.direction * value for symbol, joint, value in moving}
    loops = solved_on_sides(h, work)
    margins = [margin for _, margin in loops.margins]
    z = named(h, loops, [variable.name for variable in h.variables])
    actuators = h.actuators_in(loops)
    q = substituted(terms, actuators, theta)
    at_theta = dict(zip(h.arguments["z"].symbols, substituted(terms, z, theta), strict=True))
    open_ = [entry for loop in equations(h) for entry in loop.residual]
    closing = substituted(terms, open_, at_theta)
    moved, turned = pose_errors(tool_of(terms, h.robot, values), POSE_SYMBOLS)
    residual = larger(
        terms, squares(terms, [*moved, *closing]), terms.let(squares(terms, turned) / 2)
    )
    unit = common_unit([c.unit for c in h.mechanism.coordinates])
    function = function_of(
        *("ik", work, (pose_argument(h.robot),), q, unit, residual, IDENTITY, ()),
        substituted(terms, margins, theta),
    )
    return function, work
