"""Linear equations between named joints, solved by Gauss-Jordan elimination."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from .tolerances import SAME_EQUATION


@dataclass(frozen=True)
class LinearEquation:
    """The equation: sum of factor * joint = value.

    Attributes:
        factors: The nonzero factor of each joint, keyed by joint name.
        value: The right side of the equation (radian or meter).
    """

    factors: Mapping[str, sp.Expr]
    value: sp.Expr

    @property
    def is_contradiction(self) -> bool:
        """Whether the equation has the form 0 = value with a nonzero value."""
        return not self.factors and abs(float(self.value)) > SAME_EQUATION

    def without(self, name: str, other: "LinearEquation") -> "LinearEquation":
        """Eliminate a joint from this equation by subtracting a multiple of another equation."""
        if name not in self.factors:
            return self
        part = self.factors[name] / other.factors[name]
        names = dict.fromkeys((*self.factors, *other.factors))
        found = {
            n: _difference(self.factors.get(n, sp.S.Zero), part * other.factors.get(n, sp.S.Zero))
            for n in names
            if n != name
        }
        kept = {n: factor for n, factor in found.items() if factor != 0}
        return LinearEquation(kept, self.value - part * other.value)


def eliminated(
    equations: Iterable[LinearEquation], names: Iterable[str]
) -> tuple[Mapping[str, LinearEquation], Sequence[LinearEquation]]:
    """Solve linear equations for as many of the named unknowns as possible.

    Unknowns are eliminated in the order of the names.

    Returns:
        The solved equations, keyed by the solved joint, and the remaining equations. The solved
        equation of a joint contains no other solved joint.
    """
    rows = list(equations)
    solved: dict[str, LinearEquation] = {}
    for name in names:
        pivot = next((row for row in rows if name in row.factors), None)
        if pivot is not None:
            rows = [row.without(name, pivot) for row in rows if row is not pivot]
            solved = {n: row.without(name, pivot) for n, row in solved.items()} | {name: pivot}
    return solved, rows


def conflict(equations: Sequence[LinearEquation]) -> tuple[int, ...]:
    """Return indices of equations without a common solution, or none if a solution exists.

    The returned set is minimal: if any one equation is removed, the others have a common solution.
    """
    kept = [*range(len(equations))]
    if not _is_contradictory(equations):
        return ()
    for k in range(len(equations)):
        others = [j for j in kept if j != k]
        if _is_contradictory([equations[j] for j in others]):
            kept = others
    return tuple(kept)


def _is_contradictory(equations: Sequence[LinearEquation]) -> bool:
    names = dict.fromkeys(name for equation in equations for name in equation.factors)
    return any(row.is_contradiction for row in eliminated(equations, names)[1])


def _difference(a: sp.Expr, b: sp.Expr) -> sp.Expr:
    """Return a - b, or zero if the numbers are equal except for rounding errors."""
    size = max(abs(float(a)), abs(float(b)))
    return sp.S.Zero if abs(float(a - b)) <= SAME_EQUATION * size else a - b
