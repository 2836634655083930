"""Conditions for closed loops on the main-chain joints of a chain with redundant joints.

If the closed form does not use all main-chain joints, the remaining loop equations check the values
of the unused joints.
"""

from collections.abc import Iterator, Sequence

import sympy as sp

from ...model.mechanism import Closure, Strut
from ...model.tolerances import LOOPS_AGREE
from ..model.constraints import residuals
from ..model.coupling_equations import chord, residual_of, unit_of
from ..model.planes import Loop, loops
from .solution import Solution, factors_of, reported


def allowed(solutions: Sequence[Solution]) -> sp.Basic:
    """Return the condition that at least one solution closes all loops whose joints are solved.

    Args:
        solutions: The solutions on different branches, computed from the main chain.
    """
    return sp.Or(*map(_closes, solutions))


def _closes(solution: Solution) -> sp.Basic:
    terms, size = solution.reference.terms, solution.reference.size
    left = residuals(solution.mechanism, terms, solution.values, _unread(solution))
    left += _couplings(solution)
    conditions = []
    for unit, most in (("m", LOOPS_AGREE * size), ("1", LOOPS_AGREE)):
        square = terms.let(sum((terms.let(e**2) for e, of in left if of == unit), sp.S.Zero))
        if not terms.is_constant(square):
            conditions.append(sp.Lt(square, sp.Float(most**2)))
    return sp.And(*conditions)


def _couplings(solution: Solution) -> Iterator[tuple[sp.Expr, str]]:
    """Yield (residual, unit) for each coupling that is not used to solve a joint."""
    terms, mechanism = solution.reference.terms, solution.mechanism
    for coupling in mechanism.couplings:
        names = factors_of(coupling)
        if not names.keys() & {*solution.coupled} and names.keys() <= solution.values.keys():
            values = {name: reported(solution, solution.values, name) for name in names}
            residual, unit = residual_of(coupling, values), unit_of(mechanism, coupling)
            yield terms.let(chord(terms, residual) if unit == "1" else residual), unit


def _unread(solution: Solution) -> set[str]:
    closed = {name for step in solution.steps if step.margin is not None for name in step.joints}
    return {
        loop.loop_joint.name
        for loop in loops(solution.mechanism)
        if not (isinstance(loop.loop_joint, Strut) and loop.loop_joint.is_cylinder)
        and not _edges(loop.loop_joint) & closed
        and _members(loop) <= solution.values.keys()
    }


def _edges(loop_joint: Closure | Strut) -> set[str]:
    """Return the names of the joints by which solution steps refer to a closure or strut.

    A solution step that contains one of these joints solves all equations of the closure or strut.
    """
    if isinstance(loop_joint, Strut):
        return {loop_joint.name, loop_joint.swing_name, f"{loop_joint.name}.end"}
    # If a step contains the ball joint of a rod, the step solves only the equation of the rod
    # length.
    return set() if loop_joint.kind == "ball" else {loop_joint.name}


def _members(loop: Loop) -> set[str]:
    """Return the names of the joints in the equations of a loop."""
    names = {joint.name for joint in loop.joints}
    if isinstance(loop.loop_joint, Strut):
        names |= {loop.loop_joint.swing_name} if loop.loop_joint.ends == "pin" else set()
    return names
