"""The inverse kinematics of a platform on rods that arms move, where the way forward is iterated.

A rod from an arm to the platform gives the arm's angle from the pose, leg by leg, and an arm can
fold to either side. Where several rods hang on an arm, as in a delta whose platform is turned, the
platform has fewer freedoms than a pose, and the others tell whether it reaches the pose.
"""

from functools import partial

import sympy as sp

from ...chain.kinematics import common_unit
from ...loops.hybrid import Hybrid
from ...loops.maps import Maker
from ...loops.platforms import is_platform
from ...loops.rods import joint_values, rods_of
from ...loops.spatial.body_frames import pose_of
from ...terms.symbolic_function import SymbolicFunction
from ..chain_solution import solve_chain
from ..classify import Attempt, Classification, classify
from ..steps.target import of_pose
from ..steps.work import Work
from ..structure.lines import home_of
from ..tasks.slots import (
    POSE_SYMBOLS,
    function_of,
    larger,
    pose_argument,
    pose_errors,
    squares,
    values_of,
)
from .loop_sides import actuators_on_sides
from .substitution import substituted

FREEDOMS = 6
IDENTITY = "T is one of the poses of modes(q[k]) wherever residual[k] is rounding"


def makers(h: Hybrid) -> dict[str, Maker]:
    """The function ``ik`` of a platform on rods and arms, none for other robots.

    The platform is carried by six joints, so that its pose determines them; each arm has a closed
    form from them.
    """
    mechanism = h.mechanism
    moved = {coordinate.moves for coordinate in mechanism.coordinates}
    fits = h.forward.open and is_platform(mechanism) and len(h.robot.moving) == FREEDOMS
    if not fits or not moved.isdisjoint(h.backward.open):
        return {}
    classification = classify(h.robot, h.terms)
    found = classification.found
    if found is None or classification.tier != "exact" or found.given or found.family.inputs:
        return {}
    return {"ik": partial(_arms, classification=classification, found=found)}


def _arms(h: Hybrid, classification: Classification, found: Attempt) -> SymbolicFunction:
    """The function ``ik``: a slot for each choice of sides."""
    free = Work(h.terms)
    _solve(h, free, classification, found)
    # The joints that carry the platform write one pose in several ways: the arms are the same.
    work = Work(h.terms, settled=frozenset(range(free.choices)))
    return _function(h, work, _solve(h, work, classification, found))


def _solve(
    h: Hybrid, work: Work, classification: Classification, found: Attempt
) -> dict[sp.Symbol, sp.Expr]:
    """The joints that carry the platform, from the pose."""
    target = of_pose(h.terms, POSE_SYMBOLS, home_of(h.robot, h.terms))
    solve_chain(work, classification.lines, found, target, {})
    values = values_of(work, h.robot, {})
    moving = zip(h.theta, h.robot.moving, values, strict=True)
    return {symbol: joint.direction * value for symbol, joint, value in moving}


def _function(h: Hybrid, work: Work, theta: dict[sp.Symbol, sp.Expr]) -> SymbolicFunction:
    terms, count = h.terms, len(h.q)
    actuators, margins = actuators_on_sides(h, work)
    found = substituted(terms, [*actuators, *margins], theta)
    q, closing = found[:count], found[count:]
    axes, origin = pose_of(h.mechanism, terms, h.mechanism.tool_mounting, joint_values(h))
    lengths = [terms.let(rod.distance - rod.length) for rod in rods_of(h)]
    entries = [e for vector in (*axes, origin) for e in vector]
    at = theta | dict(zip(h.q, q, strict=True))
    met = substituted(terms, [*entries, *lengths], at)
    x, y, z, position = (met[k : k + 3] for k in range(0, 12, 3))
    moved, turned = pose_errors(((x, y, z), position), POSE_SYMBOLS)
    residual = larger(
        terms, squares(terms, [*moved, *met[12:]]), terms.let(squares(terms, turned) / 2)
    )
    unit = common_unit([c.unit for c in h.mechanism.coordinates])
    return function_of(
        "ik", work, (pose_argument(h.robot),), q, unit, residual, IDENTITY, (), closing
    )
