"""Joint equalities of a MuJoCo model as equations between joints, in a form without redundancy.

An equality states y - y0 = a0 + a1 (x - x0). Gauss-Jordan elimination converts the equalities to
one equation for each dependent joint. The result does not depend on the order of the equalities.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from ....model.errors import DescriptionError
from ....model.robot import Coupling
from ....model.tolerances import SAME_EQUATION
from ..identifiers import identifier


@dataclass(frozen=True)
class Law:
    """A linear joint equality: follower = multiplier * leader + offset.

    Attributes:
        follower: Name of the coupled joint.
        leader: Name of the leader, or "" if the joint is constant.
        multiplier: Motion of the follower per unit of the leader.
        offset: Value of the follower if the leader is 0 (radian or meter).
    """

    follower: str
    leader: str
    multiplier: sp.Expr
    offset: sp.Expr


@dataclass(frozen=True)
class Equation:
    """The value of a dependent joint: the sum of ratio * joint, plus the offset.

    Attributes:
        joint: Name of the dependent joint.
        ratios: Ratios of the independent joints by name.
        offset: Value of the joint if all independent joints are 0 (radian or meter).
    """

    joint: str
    ratios: Mapping[str, sp.Expr]
    offset: sp.Expr

    @property
    def coupling(self) -> Coupling:
        """The equation as a coupling between joints of a robot."""
        ratios = tuple((identifier(name), ratio) for name, ratio in self.ratios.items())
        return Coupling(identifier(self.joint), ratios, self.offset)


@dataclass(frozen=True)
class _Row:
    """A linear equation: the sum of factor * joint is equal to ``value``.

    Attributes:
        factors: The nonzero factors by joint name.
        value: The right side (radian or meter).
        joints: Names of the joints in the equalities from which the equation follows.
    """

    factors: Mapping[str, sp.Expr]
    value: sp.Expr
    joints: frozenset[str]

    def without(self, name: str, other: "_Row") -> "_Row":
        """Eliminates a joint by means of another equation."""
        if name not in self.factors:
            return self
        part = self.factors[name] / other.factors[name]
        names = dict.fromkeys((*self.factors, *other.factors))
        found = {
            n: _difference(self.factors.get(n, sp.S.Zero), part * other.factors.get(n, sp.S.Zero))
            for n in names
        }
        kept = {n: factor for n, factor in found.items() if factor != 0}
        return _Row(kept, self.value - part * other.value, self.joints | other.joints)


def joint_equations(laws: Iterable[Law], names: Sequence[str]) -> tuple[Equation, ...]:
    """Returns one equation for each dependent joint, in the order of the names.

    Joints without a place in ``names`` depend on the named joints if possible. Of the named joints,
    followers depend on other joints, and later joints depend on earlier joints.

    Args:
        laws: The equalities in any order.
        names: Names of joints, from the base.
    """
    solved, _ = _reduced(laws, names)
    order = [*names, *(name for name in solved if name not in names)]
    return tuple(_equation(name, solved[name]) for name in order if name in solved)


def check_agreement(laws: Iterable[Law], names: Sequence[str]) -> None:
    """Raises an error if no positions of the named joints satisfy all equalities.

    Raises:
        DescriptionError: The equalities do not have a common solution.
    """
    _, left = _reduced(laws, names)
    for row in left:
        if row.joints & {*names}:
            raise DescriptionError(
                f"no joint positions satisfy all equalities of {', '.join(sorted(row.joints))}; "
                "correct or delete one of these equalities"
            )


def _reduced(
    laws: Iterable[Law], names: Sequence[str]
) -> tuple[Mapping[str, _Row], Sequence[_Row]]:
    """Returns the equation of each dependent joint, and the equations without a solution."""
    # The sorted equalities give the same digits in each order, even if some of them differ by
    # rounding errors only.
    ordered = sorted(laws, key=str)
    rows, followers = [_row(law) for law in ordered], {law.follower for law in ordered}
    columns = [*sorted({name for row in rows for name in row.factors} - {*names})]
    columns += [name for name in reversed(names) if name in followers]
    columns += [name for name in reversed(names) if name not in followers]
    solved: dict[str, _Row] = {}
    for name in columns:
        pivot = next((row for row in rows if name in row.factors), None)
        if pivot is not None:
            rows = [row.without(name, pivot) for row in rows if row is not pivot]
            solved = {n: row.without(name, pivot) for n, row in solved.items()} | {name: pivot}
    return solved, [row for row in rows if abs(row.value) > SAME_EQUATION]


def coupled_groups(laws: Iterable[Law]) -> list[set[str]]:
    """Returns the names of joints that equalities connect, directly or through other joints."""
    groups: list[set[str]] = []
    for law in laws:
        joined = [group for group in groups if group & {law.follower, law.leader}]
        merged = {law.follower, law.leader}.union(*joined) - {""}
        groups = [group for group in groups if group not in joined] + [merged]
    return groups


def _row(law: Law) -> _Row:
    factors = {law.follower: sp.S.One} | ({law.leader: -law.multiplier} if law.leader else {})
    kept = {name: factor for name, factor in factors.items() if factor != 0}
    return _Row(kept, law.offset, frozenset(factors))


def _difference(a: sp.Expr, b: sp.Expr) -> sp.Expr:
    """Returns a - b, or zero if the numbers are equal except for rounding errors."""
    return sp.S.Zero if abs(a - b) <= SAME_EQUATION * max(abs(a), abs(b)) else a - b


def _equation(name: str, row: _Row) -> Equation:
    own = row.factors[name]
    ratios = {other: -factor / own for other, factor in row.factors.items() if other != name}
    return Equation(name, ratios, row.value / own)
