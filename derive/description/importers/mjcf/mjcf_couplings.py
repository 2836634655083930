"""Joint equalities of a MuJoCo model as couplings between the joints of a robot with loops.

An equality states y - y0 = a0 + a1 (x - x0). Joints outside the robot are eliminated from the
equations, because they carry no part of the robot. For example, the joint of a motor may be outside
the robot.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from ....model.errors import DescriptionError
from ....model.robot import Coupling
from ..identifiers import identifier
from .mjcf_bodies import BodyJoint, Law


@dataclass(frozen=True)
class _Row:
    """A linear equation: the sum of factor * joint is equal to ``value``."""

    factors: Mapping[str, sp.Expr]
    value: sp.Expr
    follower: str

    def without(self, name: str, other: "_Row") -> "_Row":
        """Eliminates a joint by means of another equation."""
        if name not in self.factors:
            return self
        part = self.factors[name] / other.factors[name]
        names = dict.fromkeys((*self.factors, *other.factors))
        found = {n: self.factors.get(n, 0) - part * other.factors.get(n, 0) for n in names}
        kept = {n: factor for n, factor in found.items() if factor != 0}
        return _Row(kept, self.value - part * other.value, self.follower)


def joint_couplings(
    laws: Iterable[tuple[str, Law, str]], tree: Sequence[BodyJoint]
) -> tuple[Coupling, ...]:
    """Returns the couplings between the joints of a robot.

    Args:
        laws: The follower, the equation and the leader ("" without a leader) of each equality.
        tree: The joints of the robot.

    Raises:
        DescriptionError: Equalities contradict each other, or two equalities can only be solved for
            one joint.
    """
    inside = {joint.name for joint in tree}
    rows = [_row(*law) for law in laws]
    for name in dict.fromkeys(name for row in rows for name in row.factors):
        if name not in inside:
            solved = next(row for row in rows if name in row.factors)
            rows = [row.without(name, solved) for row in rows if row is not solved]
    return tuple(_couplings([row for row in rows if row.factors or row.value != 0]))


def coupled_groups(laws: Iterable[tuple[str, Law, str]]) -> list[set[str]]:
    """Returns the names of joints that equalities connect, directly or through other joints."""
    groups: list[set[str]] = []
    for follower, _, leader in laws:
        joined = [group for group in groups if group & {follower, leader}]
        merged = {follower, leader}.union(*joined) - {""}
        groups = [group for group in groups if group not in joined] + [merged]
    return groups


def _row(follower: str, law: Law, leader: str) -> _Row:
    factors = {follower: sp.S.One} | ({leader: -law.multiplier} if leader else {})
    kept = {name: factor for name, factor in factors.items() if factor != 0}
    return _Row(kept, law.offset, follower)


def _couplings(rows: Iterable[_Row]) -> Iterator[Coupling]:
    """Yields one coupling per equation. Each joint is the left side of at most one coupling."""
    taken: set[str] = set()
    for row in rows:
        names = sorted(row.factors, key=lambda name: name != row.follower)
        own = next((name for name in names if name not in taken), None)
        if own is None:
            raise DescriptionError(
                f"joint {row.follower!r} is in several equalities that contradict or repeat each "
                "other; delete one of them"
            )
        taken.add(own)
        factor = row.factors[own]
        ratios = [(identifier(n), -f / factor) for n, f in row.factors.items() if n != own]
        yield Coupling(identifier(own), tuple(ratios), row.value / factor)
