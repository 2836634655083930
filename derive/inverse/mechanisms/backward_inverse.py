"""Inverse kinematics of robots whose forward kinematics solves the loops by iteration.

A tool pose determines the joints of the main chain, and these joints determine the actuators in
closed form. Each loop has two branches, because the links of the loop can fold in two ways. If the
loops reduce the degrees of freedom of the main chain, the loop equations decide whether a pose is
reachable. An example of such a robot is a delta robot with a rotated platform.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np
import sympy as sp

from ...chain.kinematics import common_unit
from ...loops.functions.constraint_functions import equations
from ...loops.functions.maps import Maker
from ...loops.model.constraints import ClosureEquations
from ...loops.model.coupling_equations import CouplingEquation, chord
from ...loops.modes.platforms import is_platform, of_open_chain, triad_of
from ...loops.solve.solution import near_reference
from ...loops.solve.solved_loops import SolvedLoops, named
from ...model.mechanism import Mechanism
from ...model.tolerances import SAMPLED_RANGE
from ...terms.casadi_graph import lower
from ...terms.symbolic_function import SymbolicFunction
from ..classify import classify
from ..families import FAMILIES
from ..serial_inverse import Inverses
from ..steps.work import Work
from ..structure.words import listed
from ..tasks.slots import (
    POSE_SYMBOLS,
    branches,
    function_of,
    larger,
    pose_argument,
    pose_errors,
    pose_residual,
    squares,
    tool_of,
)
from ..tool_axis import with_still_axis
from .carried_arm import CarriedArm, carried_arm
from .carried_arm import missing as missing_arm
from .carried_platform import keeps_planes
from .carried_wrist import CarriedWrist, carried_wrist
from .leg_chains import LegChain, leg_chains
from .loop_sides import (
    MAX_CHOICES,
    SAMPLES,
    FloatArray,
    idle_choices,
    idle_signs,
    solved_on_sides,
)
from .moving_chain import MovingChain, moving_chain
from .substitution import substituted

Chain = MovingChain | CarriedWrist | CarriedArm
WHOLE = 6
"""Degrees of freedom of a platform that only its legs constrain."""
SIGNS_AT_A_POSE = 16
"""Number of random combinations of branch signs to try at each closed configuration."""
IDENTITY = "T is a pose at which the loops close with q[k] if residual[k] is a rounding error"


def makers(h: SolvedLoops) -> dict[str, Maker]:
    """Return the function ``ik`` if the main chain determines all joints in closed form.

    If the main chain does not determine all joints in closed form, the returned dictionary is
    empty. The dictionary is also empty for planar platforms with three legs, which have their own
    inverse kinematics function.
    """
    fits = h.forward.open and triad_of(h) is None
    if not fits or (h.may_have_inverse and not is_platform(h.mechanism)):
        return {}
    legs = leg_chains(h)
    chain = None if legs is None else _chain(h)
    if legs is None or chain is None:
        return {}
    return {"ik": partial(_inverse, chain=chain, legs=legs)}


def is_carried(h: SolvedLoops) -> bool:
    """Whether the inverse kinematics finds the rotations of a platform that carries a wrist."""
    return isinstance(_chain(h), CarriedWrist)


def is_carried_arm(h: SolvedLoops) -> bool:
    """Whether the legs keep ball joints in planes, and joints are before or on the platform."""
    return isinstance(_chain(h), CarriedArm)


def missing(h: SolvedLoops) -> str:
    """Return the reason why a robot whose loops are solved by iteration has no function ``ik``.

    The returned text is empty if the reason is unknown. The argument must be a robot without a
    function ``ik``.
    """
    if not h.forward.open or h.may_have_inverse or triad_of(h) is not None:
        return ""
    if leg_chains(h) is None:
        return f"the main chain does not determine {listed(h.backward.open)} in closed form"
    if _chain(h):
        return ""
    reason = "" if keeps_planes(h) else classify(h.robot, h.terms).missing
    return f"for the main chain, {reason}" if reason else missing_arm(h)


def _chain(h: SolvedLoops) -> Chain | None:
    """Return the main chain with its IK function, or None if no known structure fits the chain."""
    whole = _whole_chain(h)
    moving = moving_chain(h, FAMILIES) if whole is None else None
    return (whole if moving is None else moving[0]) or carried_wrist(h) or carried_arm(h)


def _whole_chain(h: SolvedLoops) -> MovingChain | None:
    classification = classify(h.robot, h.terms)
    found = classification.found
    if found is None:
        longer = with_still_axis(h.robot, classification, FAMILIES)
        return None if longer is None else MovingChain.of(h.robot, *longer)
    if classification.method != "exact" or found.given or found.family.inputs:
        return None
    return MovingChain.of(h.robot, classification.lines, found)


def moving_inverses(h: SolvedLoops) -> Inverses | None:
    """Return the inverse kinematics of the moving main-chain joints, or None if all joints move."""
    if leg_chains(h) is None or _whole_chain(h) is not None:
        return None
    moving = moving_chain(h, FAMILIES)
    if moving is None:
        return None
    (chain, classification), work = moving, Work(h.terms)
    arguments, joints = chain.coordinates(work)
    values = [joint.direction * x for joint, x in zip(h.robot.moving, joints, strict=True)]
    residual = pose_residual(h.terms, tool_of(h.terms, h.robot, values), POSE_SYMBOLS)
    inputs_of_task = (pose_argument(h.robot), *arguments)
    solved = branches("ik", h.robot, work, inputs_of_task, values, residual, IDENTITY, chain.given)
    return Inverses(classification, {"ik": solved})


def _inverse(h: SolvedLoops, chain: Chain, legs: Sequence[LegChain]) -> SymbolicFunction:
    """Return the function ``ik``, which has one solution slot per combination of branch signs."""
    function, work = _solved(h, frozenset(), chain, legs)
    settled = _settled(h, function, work, chain, has_legs=bool(legs))
    return _solved(h, settled, chain, legs)[0] if settled else function


def _settled(
    h: SolvedLoops,
    function: SymbolicFunction,
    work: Work,
    chain: Chain,
    *,
    has_legs: bool,
) -> frozenset[int]:
    """Return the indices of branch signs that do not affect the result of ``ik``."""
    unused = _unused(h, function, work)
    if h.mechanism.couplings:
        # A branch sign that changes no coordinate may still decide whether a joint coupling holds.
        return unused
    if len(h.theta) == WHOLE and _has_loops_at_its_ends(h.mechanism):
        # Several joint vectors of the main chain lead to the same platform pose and the same leg
        # coordinates.
        unused |= frozenset(range(len(work.signs) - len(work.sides)))
        return unused | _idle_in_legs(h, function, chain) if has_legs else unused
    if has_legs and work.signs:
        return unused | _idle_in_legs(h, function, chain)
    if not 0 < len(work.signs) <= MAX_CHOICES:
        return unused
    if len(h.theta) > len(h.q):
        # Loops can rarely be closed at random poses, but branch signs change the coordinates even
        # if the loops are open.
        return unused | idle_choices(h, function, *_poses(h, chain), within=np.inf)[0]
    same, without = idle_choices(h, function, *_poses(h, chain))
    return unused | same | {k for k in without if work.signs[k] in work.sides}


def _idle_in_legs(h: SolvedLoops, function: SymbolicFunction, chain: Chain) -> frozenset[int]:
    """Return the indices of branch signs that belong to legs and do not affect the coordinates.

    The loops of a platform with all degrees of freedom can be closed at every pose.
    """
    if len(h.theta) <= len(h.q):
        return idle_signs(h, function, *_poses(h, chain))
    (fk,) = lower([of_open_chain("fk", h)], "chain")
    places = [h.numbers.names.index(joint.name) for joint in h.robot.moving]
    theta = np.repeat([w[places] for w in h.numbers.generic], SIGNS_AT_A_POSE, axis=0)
    T = np.array(fk(theta.T)).reshape(16, -1)
    return idle_signs(h, function, T, *_inputs(h, chain, theta))


def _unused(h: SolvedLoops, function: SymbolicFunction, work: Work) -> frozenset[int]:
    q = function.outputs[0].entries
    if h.mechanism.couplings:
        q = (*q, *function.outputs[1].entries)
    behind = [*q, *(h.terms.definitions[symbol] for symbol in h.terms.needed(q))]
    used = {symbol for entry in behind for symbol in entry.free_symbols}
    return frozenset(
        k for k, sign in enumerate(work.signs) if sign in work.sides and sign not in used
    )


def _has_loops_at_its_ends(mechanism: Mechanism) -> bool:
    chain = {joint.name for joint in mechanism.main_chain.moving}
    ends = [frame for loop_joint in mechanism.loop_joints for frame in (loop_joint.a, loop_joint.b)]
    paths = [chain & {joint.name for joint in mechanism.path_to(frame.body)} for frame in ends]
    actuated = {coordinate.moves for coordinate in mechanism.coordinates}
    return not chain & actuated and all(path in (set(), chain) for path in paths)


def _inputs(h: SolvedLoops, chain: Chain, theta: FloatArray) -> list[FloatArray]:
    """Return the samples of all inputs of ``ik`` except the tool pose.

    The array theta (N, n) contains the main-chain joint values.
    """
    if isinstance(chain, CarriedArm):
        return [theta.T[chain.places]]
    if not isinstance(chain, CarriedWrist):
        return [theta.T[[k]] for k in chain.given]
    (fk,) = lower([chain.platform_pose(h)], "platform")
    return [np.array(fk(theta.T)).reshape(16, -1)]


def _poses(h: SolvedLoops, chain: Chain) -> list[FloatArray]:
    """Return random tool poses (16, N) near the reference, and samples of other ``ik`` inputs."""
    (fk,) = lower([of_open_chain("fk", h)], "chain")
    size = h.backward.reference.size
    middle = np.array([h.at_reference[joint.name] for joint in h.robot.moving])
    lengths = np.array([joint.kind == "prismatic" for joint in h.robot.moving])
    reach = SAMPLED_RANGE * np.where(lengths, size, 1.0)
    theta = middle + np.random.default_rng(0).uniform(-reach, reach, (SAMPLES, len(middle)))
    return [np.array(fk(theta.T)).reshape(16, -1), *_inputs(h, chain, theta)]


def _solved(
    h: SolvedLoops,
    settled: frozenset[int],
    chain: Chain,
    legs: Sequence[LegChain],
) -> tuple[SymbolicFunction, Work]:
    """Return the function ``ik`` without the branch signs ``settled``, and its solution steps."""
    terms, work = h.terms, Work(h.terms, settled=settled)
    arguments, joints = chain.coordinates(work)
    joints = near_reference(h.mechanism, terms, h.robot.moving, joints)
    theta = dict(zip(h.theta, joints, strict=True))
    values = [joint.direction * x for joint, x in zip(h.robot.moving, joints, strict=True)]
    loops = solved_on_sides(h, work)
    margins = [margin for _, margin in loops.margins]
    variables = [v.name for v in h.variables]
    symbols = dict(zip(variables, h.arguments["z"].symbols, strict=True))
    known = [name for name in variables if name not in h.backward.open]
    z = substituted(terms, named(h, loops, known), theta)
    at_theta = {symbols[name]: value for name, value in zip(known, z, strict=True)}
    moves = [c for c in h.mechanism.coordinates if c.moves not in h.backward.open]
    driven = substituted(terms, h.driven(named(h, loops, [c.moves for c in moves]), moves), theta)
    q = dict(zip([c.name for c in moves], driven, strict=True))
    residuals = []
    for leg in legs:
        found, residual = leg.solved(h, work, dict(zip(known, z, strict=True)))
        q |= found
        residuals.append(residual)
    of_legs = {leg.closure for leg in legs}
    open_ = [e for loop in equations(h) if loop.name not in of_legs for e in _errors(h, loop)]
    closing = substituted(terms, open_, at_theta)
    moved, turned = pose_errors(tool_of(terms, h.robot, values), POSE_SYMBOLS)
    distance2 = squares(terms, [*moved, *closing])
    for residual in residuals:
        distance2 = terms.let(distance2 + residual)
    residual = larger(terms, distance2, terms.let(squares(terms, turned) / 2))
    unit = common_unit([c.unit for c in h.mechanism.coordinates])
    function = function_of(
        *("ik", work, (pose_argument(h.robot), *arguments)),
        tuple(q[c.name] for c in h.mechanism.coordinates),
        *(unit, residual, IDENTITY),
        () if isinstance(chain, CarriedArm) else _coordinates(h, chain.given),
        substituted(terms, margins, theta),
    )
    return function, work


def _errors(h: SolvedLoops, loop: ClosureEquations) -> Sequence[sp.Expr]:
    """Return the residuals of a loop or of a joint coupling.

    If the residual of a joint coupling is an angle, the returned residual is zero at every full
    turn.
    """
    if isinstance(loop, CouplingEquation) and loop.units == ("1",):
        return [chord(h.terms, loop.residual[0])]
    return loop.residual


def _coordinates(h: SolvedLoops, joints: Sequence[int]) -> list[int]:
    moves = [c.moves for c in h.mechanism.coordinates]
    return [moves.index(h.robot.moving[k].name) for k in joints]
