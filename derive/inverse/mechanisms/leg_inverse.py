"""Inverse kinematics of a platform on six cylinders."""

import sympy as sp

from ...loops.functions.maps import Maker
from ...loops.modes.platforms import is_platform
from ...loops.modes.rods import pins_in_tool, rods_of
from ...loops.solve.solved_loops import SolvedLoops
from ...terms.role import Role
from ...terms.symbolic_function import Result, SymbolicFunction
from ...terms.vectors import dot
from ..tasks.slots import POSE_SYMBOLS, pose_argument, squares

FREEDOMS = 6


def makers(h: SolvedLoops) -> dict[str, Maker]:
    """Return the function ``ik`` of a platform on six cylinders.

    The returned dictionary is empty for robots other than platforms on six cylinders.
    """
    mechanism = h.mechanism
    moved = {coordinate.moves for coordinate in mechanism.coordinates}
    on_cylinders = {strut.name for strut in mechanism.struts if strut.is_cylinder} == moved
    if h.forward.open and on_cylinders and len(moved) == FREEDOMS and is_platform(mechanism):
        return {"ik": leg_lengths}
    return {}


def leg_lengths(h: SolvedLoops) -> SymbolicFunction:
    """Return the function ``ik``, which computes the leg lengths at a pose.

    A leg length is the distance between the end points of the leg. The residual of ``ik`` is the
    deviation of the target matrix T from a rigid pose. Every pose determines the leg lengths, but
    forward kinematics with these leg lengths may return the pose of another assembly mode.
    """
    terms, names = h.terms, [strut.name for strut in h.mechanism.struts]
    rows = [POSE_SYMBOLS[4 * i : 4 * i + 4] for i in range(3)]
    lengths = {}
    for name, pin, rod in zip(names, pins_in_tool(h), rods_of(h), strict=True):
        d = [
            terms.let(sum((r * b for r, b in zip(row[:3], pin, strict=True)), row[3]) - a)
            for row, a in zip(rows, rod.a, strict=True)
        ]
        square = sum((component**2 for component in d), sp.Integer(0))
        lengths[name] = terms.let(sp.sqrt(terms.let(square)))
    own = {strut.name: strut.length for strut in h.mechanism.struts}
    q = tuple(
        terms.let((lengths[c.moves] - own[c.moves]) / c.ratio) for c in h.mechanism.coordinates
    )
    axes = [(rows[0][k], rows[1][k], rows[2][k]) for k in range(3)]
    products = [
        dot(terms, axes[i], axes[k]) - (1 if i == k else 0) for i in range(3) for k in range(i, 3)
    ]
    residual = terms.let(sp.sqrt(squares(terms, products)))
    # The margin is the shortest leg length, because a leg of length zero has no direction.
    margin = lengths[names[0]]
    for name in names[1:]:
        margin = terms.let(sp.Min(margin, lengths[name], evaluate=False))
    outputs = (
        Result("q", q, (1, len(q)), "m", "coordinates of the legs"),
        Result("residual", (residual,), (1,), "1", "deviation of T from a rigid pose"),
        Result("margin", (margin,), (1,), "m", "length of the shortest leg"),
    )
    return SymbolicFunction(
        "ik",
        "The leg lengths at a pose of the tool.",
        "q[0]_i = |p + R b_i - a_i| - l_i, and T is one of the poses of modes(q[0])",
        (pose_argument(h.robot),),
        outputs,
        terms,
        role=Role("inverse", "pose", labels=("the only one",)),
    )
