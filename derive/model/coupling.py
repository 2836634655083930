"""Couplings, which map motor coordinates to joint coordinates: theta = C q + c."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import sympy as sp

from .errors import DescriptionError
from .exact import exact
from .linear_equations import LinearEquation, conflict
from .names import check_choice, check_name, check_unique

Limits = tuple[sp.Expr | None, sp.Expr | None]
MotorKind = Literal["revolute", "prismatic"]


@dataclass(frozen=True)
class Motor:
    """An actuated coordinate that is not a joint and moves joints through couplings.

    Attributes:
        name: Unique name among joints and motors.
        kind: ``revolute`` or ``prismatic``.
        limits: Lowest and highest value (radian or meter). None means no limit.
        assumed: Names of the fields whose values the data source of the robot does not state.
    """

    name: str
    kind: MotorKind = "revolute"
    limits: Limits = (None, None)
    assumed: tuple[str, ...] = ()

    direction = 1
    """A motor always moves in the direction of its coordinate."""

    def __post_init__(self) -> None:
        check_name("motor", self.name)
        check_choice("motor", self.name, self.kind, get_args(MotorKind))
        lower, upper = (None if limit is None else exact(limit) for limit in self.limits)
        object.__setattr__(self, "limits", (lower, upper))

    @property
    def unit(self) -> str:
        """Unit of the motor coordinate: m for a prismatic motor, otherwise rad."""
        return "m" if self.kind == "prismatic" else "rad"


@dataclass(frozen=True)
class Coupling:
    """The equation of a coupled joint: joint value = sum(ratio * coordinate) + offset.

    A coordinate is a motor or a joint. If the ratios contain the name of the coupled joint itself,
    this joint also has its own coordinate. If the ratios contain the name of another coupled joint,
    the equation of that joint is substituted.

    Attributes:
        joint: Name of the coupled joint.
        ratios: Pairs (coordinate name, ratio). The ratio is the joint displacement per unit of the
            coordinate. A joint whose ratios are all zero is constant.
        offset: Joint value if all coordinates are 0 (radian or meter).
    """

    joint: str
    ratios: tuple[tuple[str, sp.Expr], ...]
    offset: sp.Expr = sp.S.Zero

    def __post_init__(self) -> None:
        rows = [(name, exact(ratio)) for name, ratio in self.ratios]
        check_unique(f"leader of joint {self.joint!r}", [name for name, _ in rows])
        object.__setattr__(self, "ratios", tuple(row for row in rows if row[1] != 0))
        object.__setattr__(self, "offset", exact(self.offset))

    @property
    def has_own(self) -> bool:
        """Whether the joint has its own coordinate."""
        return self.joint in dict(self.ratios)


def check_joint_couplings(
    robot: str, couplings: Sequence[Coupling], members: Collection[str]
) -> None:
    """Check that each coupling of a robot with loops is an equation between joints of this robot.

    Args:
        robot: Name of the robot.
        couplings: The equations.
        members: Names of the moving joints and cylinders.

    Raises:
        DescriptionError: A name in a coupling is neither a moving joint nor a cylinder, or the
            ratios of a coupling contain the name of its own joint.
    """
    check_unique("coupling of joint", [coupling.joint for coupling in couplings])
    for coupling in couplings:
        begin = f"robot {robot!r}: the coupling of {coupling.joint!r}"
        for name in (coupling.joint, *(name for name, _ in coupling.ratios)):
            if name not in members:
                known = ", ".join(members)
                raise DescriptionError(
                    f"{begin}: expected moving joints or cylinders, {known}, got {name!r}; a gear "
                    "or shaft with its own angle is a revolute joint with a link"
                )
        if coupling.has_own:
            raise DescriptionError(
                f"{begin}: a joint must not be coupled to itself; in a robot with loops, a joint "
                "has no coordinate of its own: add a revolute joint for the motor, and name it "
                "instead"
            )
    if wrong := contradictory(couplings):
        raise DescriptionError(f"robot {robot!r}: {no_solution(wrong)}")


def contradictory(couplings: Sequence[Coupling]) -> tuple[str, ...]:
    """Return the joints of contradictory couplings, or an empty tuple if there are none."""
    return tuple(couplings[k].joint for k in conflict([*map(equation_of, couplings)]))


def equation_of(coupling: Coupling) -> LinearEquation:
    """Return the equation: joint - sum of ratio * coordinate = offset."""
    factors = {coupling.joint: sp.S.One} | {name: -ratio for name, ratio in coupling.ratios}
    return LinearEquation(factors, coupling.offset)


def solved_for(joint: str, equation: LinearEquation) -> Coupling:
    """Solve a linear equation of several joint values for one of these values."""
    own = equation.factors[joint]
    others = [(name, -factor / own) for name, factor in equation.factors.items() if name != joint]
    return Coupling(joint, tuple(others), equation.value / own)


def no_solution(joints: Sequence[str]) -> str:
    """Return the message for joints whose couplings have no common solution."""
    return (
        f"no joint values fulfill the couplings of {', '.join(joints)} at the same time; correct "
        "or delete one of these couplings"
    )


Row = tuple[Mapping[str, sp.Expr], sp.Expr]
"""The coupling ratios of a joint, keyed by coordinate, and the offset of the joint."""


@dataclass(frozen=True)
class LinearMap:
    """The map theta = C q + c from the coordinates to the joints.

    Attributes:
        coordinates: Names of the coordinates in the order of q.
        C: The ratios, shape (joints, coordinates).
        c: The offsets, shape (joints, 1).
    """

    coordinates: tuple[str, ...]
    C: sp.ImmutableMatrix
    c: sp.ImmutableMatrix

    def at(self, q: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
        """Return theta = C q + c."""
        # A sum over all columns would give long expressions, which SymPy simplifies slowly.
        return tuple(
            sp.Add(*(r * s for r, s in zip(self.C.row(j), q, strict=True) if r != 0), self.c[j])
            for j in range(self.C.rows)
        )

    def inverse(self) -> tuple[sp.ImmutableMatrix, tuple[int, ...]]:
        """Return the matrix L with q = L (theta - c), and the indices of the independent joints.

        L has one column for each independent joint.
        """
        _, pivots = self.C.T.rref()
        return self.C.extract(list(pivots), list(range(self.C.cols))).inv(), tuple(pivots)


def linear_map(joints: Sequence[str], couplings: Sequence[Coupling]) -> LinearMap:
    """Return the map from the coordinates to the moving joints.

    The coordinates have the order of the joints.

    Args:
        joints: Names of the moving joints, in order from the base.
        couplings: The equations of the coupled joints.

    Raises:
        DescriptionError: A coupled joint is not a moving joint, couplings form a cycle, or the
            joints do not determine the coordinates.
    """
    rules = {rule.joint: rule for rule in couplings}
    check_unique("coupling of joint", [rule.joint for rule in couplings])
    for rule in couplings:
        if rule.joint not in joints:
            expected = ", ".join(joints)
            raise DescriptionError(
                f"coupling of {rule.joint!r}: expected a moving joint ({expected})"
            )
    rows = [_row(name, rules, ()) for name in joints]
    placed = [
        name
        for joint, (ratios, _) in zip(joints, rows, strict=True)
        for name in ratios
        if name == joint or name not in joints
    ]
    names = tuple(dict.fromkeys((*placed, *(name for ratios, _ in rows for name in ratios))))
    C = sp.ImmutableMatrix([[ratios.get(name, 0) for name in names] for ratios, _ in rows])
    c = sp.ImmutableMatrix([offset for _, offset in rows])
    if len(names) > len(joints) or (rules and C.rank() < len(names)):
        raise DescriptionError(
            f"several motors move the same joints; {len(joints)} joints cannot determine "
            f"{len(names)} coordinates: {', '.join(names)}"
        )
    return LinearMap(names, C, c)


def _row(name: str, rules: Mapping[str, Coupling], path: tuple[str, ...]) -> Row:
    """Return the ratios and the offset of a joint value as a function of the coordinates.

    ``path`` lists dependent joints.
    """
    if name in path:
        circle = " follows ".join((*path[path.index(name) :], name))
        raise DescriptionError(f"couplings form a cycle: {circle}")
    rule = rules.get(name)
    if rule is None:
        return {name: sp.S.One}, sp.S.Zero
    found: dict[str, sp.Expr] = {}
    offset = rule.offset
    for leader, ratio in rule.ratios:
        is_coordinate = leader not in rules or rules[leader].has_own
        ratios, shift = (
            ({leader: sp.S.One}, sp.S.Zero) if is_coordinate else _row(leader, rules, (*path, name))
        )
        offset += ratio * shift
        for other, own in ratios.items():
            found[other] = found.get(other, sp.S.Zero) + ratio * own
    return {other: own for other, own in found.items() if own != 0}, offset
