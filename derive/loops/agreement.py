"""Whether the loops allow joints of the main chain together, where it has more than freedoms.

A solution from such joints reads no more of them than it needs. What it does not read is judged by
the equations of the loops that no step has made to close.
"""

from collections.abc import Sequence

import sympy as sp

from ..model.mechanism import Closure, Strut
from ..model.tolerances import LOOPS_AGREE
from .constraints import residuals
from .planar.planes import Loop, loops
from .solution import Solution


def allowed(solutions: Sequence[Solution]) -> sp.Basic:
    """The condition that the loops close on one of several solutions, as far as they are known.

    Args:
        solutions: Solutions from the main chain, on different branches.
    """
    return sp.Or(*map(_closes, solutions))


def _closes(solution: Solution) -> sp.Basic:
    terms, size = solution.reference.terms, solution.reference.size
    left = residuals(solution.mechanism, terms, solution.values, _unread(solution))
    conditions = []
    for unit, most in (("m", LOOPS_AGREE * size), ("1", LOOPS_AGREE)):
        square = terms.let(sum((terms.let(e**2) for e, of in left if of == unit), sp.S.Zero))
        if not terms.is_constant(square):
            conditions.append(sp.Lt(square, sp.Float(most**2)))
    return sp.And(*conditions)


def _unread(solution: Solution) -> set[str]:
    """Names of the closers that no step with a margin has closed, as far as all is known there.

    A cylinder is as long as it has to be.
    """
    closed = {name for step in solution.steps if step.margin is not None for name in step.joints}
    return {
        loop.closer.name
        for loop in loops(solution.mechanism)
        if not (isinstance(loop.closer, Strut) and loop.closer.is_cylinder)
        and not _edges(loop.closer) & closed
        and _members(loop) <= solution.values.keys()
    }


def _edges(closer: Closure | Strut) -> set[str]:
    """Names by which steps that hold all equations of a closer know it."""
    if isinstance(closer, Strut):
        return {closer.name, closer.swing_name, f"{closer.name}.end"}
    # A step closes the ball of a rod by its length alone.
    return set() if closer.kind == "ball" else {closer.name}


def _members(loop: Loop) -> set[str]:
    """Names of the joints, and of the swing, that a loop's equations hold."""
    names = {joint.name for joint in loop.joints}
    if isinstance(loop.closer, Strut):
        names |= {loop.closer.swing_name} if loop.closer.ends == "pin" else set()
    return names
