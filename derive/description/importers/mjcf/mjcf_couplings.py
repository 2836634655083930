"""Converts the joint equalities of a MuJoCo model to independent equations between joints.

An equality states y - y0 = a0 + a1 (x - x0). Gauss-Jordan elimination converts the equalities to
one equation for each dependent joint. The result does not depend on the order of the equalities.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from ....model.errors import DescriptionError
from ....model.linear_equations import LinearEquation, conflict, eliminated
from ....model.robot import Coupling
from ..identifiers import identifier


@dataclass(frozen=True)
class Law:
    """A linear joint equality: follower = multiplier * leader + offset.

    Attributes:
        follower: Name of the coupled joint.
        leader: Name of the leader, or "" if the joint is constant.
        multiplier: Change of the follower's value per unit change of the leader's value.
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
        ratios: Factors of the independent joints in the equation, keyed by joint name.
        offset: Value of the joint if all independent joints are 0 (radian or meter).
    """

    joint: str
    ratios: Mapping[str, sp.Expr]
    offset: sp.Expr

    @property
    def coupling(self) -> Coupling:
        """The equation as a coupling."""
        ratios = tuple((identifier(name), ratio) for name, ratio in self.ratios.items())
        return Coupling(identifier(self.joint), ratios, self.offset)


def joint_equations(laws: Iterable[Law], names: Sequence[str]) -> tuple[Equation, ...]:
    """Return one equation for each dependent joint, in the order of the names.

    A joint outside ``names`` depends on joints in ``names`` if possible. A follower in ``names``
    depends on joints that follow no other joint, if possible. Otherwise, a joint depends on joints
    before it in ``names``.

    The dependent joints are, in this order of preference: joints that are not in ``names``,
    followers of equalities, and the last joints of ``names``.

    Args:
        laws: The equalities between joints. Their order does not change the result.
        names: Names of joints, from the base.
    """
    # The equalities are sorted. Therefore, no digit of the result depends on the order of the
    # equalities, even if equalities differ only by rounding errors.
    ordered = sorted(laws, key=str)
    rows, followers = [_row(law) for law in ordered], {law.follower for law in ordered}
    columns = sorted({name for row in rows for name in row.factors} - {*names})
    columns += [name for name in reversed(names) if name in followers]
    columns += [name for name in reversed(names) if name not in followers]
    solved, _ = eliminated(rows, columns)
    order = [*names, *(name for name in solved if name not in names)]
    return tuple(_equation(name, solved[name]) for name in order if name in solved)


def check_agreement(laws: Iterable[Law], names: Collection[str]) -> None:
    """Raise an error if no positions of the named joints satisfy all equalities.

    Raises:
        DescriptionError: The equalities do not have a common solution.
    """
    ordered = list(laws)
    near = {*names}.union(*(group for group in coupled_groups(ordered) if group & {*names}))
    meant = [law for law in ordered if law.follower in near]
    if wrong := conflict([_row(law) for law in meant]):
        joints = sorted({name for k in wrong for name in (meant[k].follower, meant[k].leader)})
        raise DescriptionError(
            f"no joint positions satisfy all equalities of {', '.join(filter(None, joints))}; "
            "correct or delete one of these equalities"
        )


def coupled_groups(laws: Iterable[Law]) -> list[set[str]]:
    """Return the sets of joints that equalities connect, directly or through other joints."""
    groups: list[set[str]] = []
    for law in laws:
        joined = [group for group in groups if group & {law.follower, law.leader}]
        merged = {law.follower, law.leader}.union(*joined) - {""}
        groups = [group for group in groups if group not in joined] + [merged]
    return groups


def _row(law: Law) -> LinearEquation:
    factors = {law.follower: sp.S.One} | ({law.leader: -law.multiplier} if law.leader else {})
    kept = {name: factor for name, factor in factors.items() if factor != 0}
    return LinearEquation(kept, law.offset)


def _equation(name: str, row: LinearEquation) -> Equation:
    own = row.factors[name]
    ratios = {other: -factor / own for other, factor in row.factors.items() if other != name}
    return Equation(name, ratios, row.value / own)
