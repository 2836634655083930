"""Shortens a chain with coupled joints until every remaining joint moves independently.

A coupled joint does not move independently. Three identities between rigid motions remove coupled
joints. In these identities, M and M' are constant placements between consecutive joints.

The identity ``Rz(a) M Rz(b) = Rz(a + s b) M`` with s = 1 or -1 merges two coaxial revolute joints
with angles a and b.

The identity ``Tz(a) M Tz(b) = Tz(a + s b) M`` with s = 1 or -1 merges two parallel prismatic joints
with displacements a and b.

The identity ``Rz(a) M Rz(-s a) M' Rz(b) = T(t') Rz(a) T(t) R' Rz(b - s' a)`` removes the second of
three parallel revolute joints.

In the identity for three parallel joints, the rotations by a and -s a cancel, so the body after the
second joint only translates. In the identity for three parallel joints, R and t are the rotation
and translation of M, and R' and t' are the rotation and translation of R M'.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import sympy as sp

from ..chain.poe import placement_matrix
from ..model.coupling import Limits
from ..model.placements import Placement, Rotation, rotation, translation
from ..model.robot import Joint, SerialRobot
from ..model.tolerances import EVALUATION_DIGITS

_ZERO = sp.Float(10) ** -(EVALUATION_DIGITS // 2)


@dataclass(frozen=True)
class CoupledChain:
    """A chain, and the linear map from the robot's coordinates to the chain's joint values.

    Attributes:
        robot: The chain without couplings, in which every joint has the direction 1 (positive).
        C: Matrix (joints, coordinates) with the motion of each joint per unit of each coordinate.
        c: Joint values (joints, 1) if all coordinates are 0.
        members: For each joint of the chain, the names of the robot joints that were merged into
            this joint.
    """

    robot: SerialRobot
    C: sp.ImmutableMatrix
    c: sp.ImmutableMatrix
    members: tuple[tuple[str, ...], ...]

    @property
    def surplus(self) -> int:
        """Number of joints minus number of coordinates."""
        return int(self.C.rows - self.C.cols)

    def inverse(self) -> tuple[sp.ImmutableMatrix, tuple[int, ...]]:
        """Return the matrix L of q = L (theta - c), which maps joint values to coordinates.

        The second result contains the indices of the joints whose values form the vector theta.
        """
        _, pivots = self.C.T.rref()
        rows = self.C.extract(list(pivots), list(range(self.C.cols)))
        return sp.ImmutableMatrix(rows.inv()), tuple(pivots)

    @property
    def keeps_turns(self) -> bool:
        """Whether full turns of the independent joints leave the pose unchanged.

        The pose is unchanged if full turns of the independent joints rotate every revolute joint by
        full turns and move no prismatic joint.
        """
        L, joints = self.inverse()
        D = self.C * L
        moving = self.robot.moving
        return all(
            D[i, k].is_Integer and (moving[i].kind == "revolute" or D[i, k] == 0)
            for k, j in enumerate(joints)
            for i in range(D.rows)
            if moving[j].kind == "revolute" and i != j
        )

    def index(self, name: str) -> int:
        """Return the index of the merged joint that contains the joint `name`."""
        return next(k for k, names in enumerate(self.members) if name in names)

    def joints_at(self, q: Sequence[sp.Expr]) -> list[sp.Expr]:
        """Return the joint values of the chain at the robot coordinates q."""
        return [
            sp.Add(*(r * s for r, s in zip(self.C.row(j), q, strict=True) if r != 0), self.c[j])
            for j in range(self.C.rows)
        ]


@dataclass(frozen=True)
class _Link:
    """A moving joint, its placement, and the linear equation for its value."""

    joint: Joint
    before: Placement
    row: sp.Matrix
    offset: sp.Expr
    members: tuple[str, ...]


@dataclass(frozen=True)
class _State:
    """The moving joints of a chain, and the placement after the last joint."""

    links: tuple[_Link, ...]
    after: Placement
    values: Mapping[sp.Symbol, sp.Expr]

    def shorter(self) -> "_State | None":
        """Return the chain without one of its joints, or None if all joints are needed."""
        for k in range(len(self.links) - 1):
            found = self._merged(k)
            if found is not None and found.rank == self.rank:
                return found
        translating = (self._translating(k) for k in range(len(self.links) - 2))
        return next((found for found in translating if found is not None), None)

    @property
    def rank(self) -> int:
        return int(sp.Matrix.vstack(*(link.row for link in self.links)).rank())

    def _merged(self, k: int) -> "_State | None":
        one, other = self.links[k : k + 2]
        sense = self._sense(one.joint.kind, other)
        if sense == 0 or (other.joint.kind == "revolute" and not self._is_coaxial(other)):
            return None
        # If exactly one of the two joints depends on a single coordinate, the merged joint has the
        # name of this joint. If both joints or neither joint depend on a single coordinate, the
        # merged joint has the name of the second joint.
        is_free = [sum(entry != 0 for entry in link.row) == 1 for link in (one, other)]
        named = one if is_free == [True, False] else other
        merged = replace(
            one,
            joint=replace(one.joint, name=named.joint.name, limits=(None, None)),
            row=one.row + sense * other.row,
            offset=one.offset + sense * other.offset,
            members=one.members + other.members,
        )
        return self._with(k, (merged,), other.before, 2)

    def _translating(self, k: int) -> "_State | None":
        one, other, last = self.links[k : k + 3]
        sense, sense_of_last = self._sense("revolute", other), self._sense("revolute", last)
        if one.joint.kind != "revolute" or sense * sense_of_last == 0:
            return None
        if any(one.row + sense * other.row):
            return None
        constant = rotation("z", one.offset + sense * other.offset)
        turned = constant + _rotations(other.before)
        shift, shift_before = (
            translation(*placement_matrix(placement)[:3, 3])
            for placement in (other.before, turned + last.before)
        )
        sign = sense * sense_of_last
        first = replace(one, before=one.before + shift_before)
        second = replace(
            last,
            before=shift + turned + _rotations(last.before),
            row=last.row - sign * one.row,
            offset=last.offset - sign * one.offset,
            members=last.members + other.members,
        )
        return self._with(k, (first, second), (), 3)

    def _with(self, k: int, links: tuple[_Link, ...], behind: Placement, count: int) -> "_State":
        rest = self.links[k + count :]
        if not rest:
            return replace(self, links=self.links[:k] + links, after=behind + self.after)
        rest = (replace(rest[0], before=behind + rest[0].before), *rest[1:])
        return replace(self, links=self.links[:k] + links + rest)

    def _sense(self, kind: str, other: _Link) -> int:
        if kind != other.joint.kind or kind not in ("revolute", "prismatic"):
            return 0
        T = self._matrix(other)
        if not self._is_zero(T[0, 2]) or not self._is_zero(T[1, 2]):
            return 0
        return 1 if sp.N(T[2, 2]) > 0 else -1

    def _is_coaxial(self, other: _Link) -> bool:
        T = self._matrix(other)
        return self._is_zero(T[0, 3]) and self._is_zero(T[1, 3])

    def _matrix(self, link: _Link) -> sp.Matrix:
        return placement_matrix(link.before).xreplace(self.values)

    @staticmethod
    def _is_zero(entry: sp.Expr) -> bool:
        return bool(abs(sp.N(entry, EVALUATION_DIGITS)) < _ZERO)


def coupled_chain(robot: SerialRobot) -> CoupledChain:
    """Shorten the chain of a coupled robot so that its joints move independently, if possible.

    The shortened chain has the same tool pose and the same coordinates as the robot. A joint is
    removed only while the chain has more joints than coordinates.
    """
    state: _State | None = _described(robot)
    found = state
    while state is not None and len(state.links) > state.links[0].row.cols:
        found, state = state, state.shorter()
    if state is not None:
        found = state
    assert found is not None
    plain = [
        replace(
            link.joint,
            before=link.before,
            after=(),
            link="",
            direction=1,
            convention=None,
            given=(),
        )
        for link in found.links
    ]
    plain[-1] = replace(plain[-1], after=found.after)
    bare = replace(robot.uncoupled, joints=tuple(plain), base=(), load=None)
    C = sp.ImmutableMatrix(sp.Matrix.vstack(*(link.row for link in found.links)))
    c = sp.ImmutableMatrix([link.offset for link in found.links])
    return CoupledChain(bare, C, c, tuple(link.members for link in found.links))


def _described(robot: SerialRobot) -> _State:
    links: list[_Link] = []
    before, own = robot.base, robot.linear_map
    for joint in robot.joints:
        before += joint.before
        if joint.kind != "fixed":
            k = len(links)
            row, offset = joint.direction * own.C.row(k), joint.direction * own.c[k]
            mirrored = (
                joint if joint.direction == 1 else replace(joint, limits=_negated(joint.limits))
            )
            links.append(_Link(mirrored, before, sp.Matrix(row), offset, (joint.name,)))
            before = ()
        before += joint.after
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    return _State(tuple(links), before, values)


def _negated(limits: Limits) -> Limits:
    lower, upper = (None if limit is None else -limit for limit in limits)
    return upper, lower


def _rotations(placement: Placement) -> Placement:
    return tuple(part for part in placement if isinstance(part, Rotation))
