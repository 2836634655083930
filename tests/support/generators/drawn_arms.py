"""Random serial arms with two to eight joints, in every convention.

Lengths are multiples of 0.1 m, and angles are multiples of 30 or 45 degrees. Many lengths and
angles are 0, as in real arms. All joints of an arm use the same convention. Some randomly selected
joints are prismatic. Each seed determines one arm.
"""

import random
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from types import SimpleNamespace

import numpy as np
import sympy as sp

from chasles.closed_form.complete_inverse import CompleteInverse
from chasles.closed_form.refinement import Refinement
from chasles.closed_form.solutions import solutions_of
from chasles.closed_form.task_components import Task
from chasles.contract import Coordinate
from chasles.derive import Joint, SerialRobot
from chasles.derive.description.conventions import CONVENTIONS
from chasles.derive.inverse.serial_inverse import Inverses, inverses
from chasles.derive.inverse.structure import rank
from chasles.derive.inverse.structure.lines import Lines, axes_of
from chasles.derive.model.convention import Convention, Field
from chasles.derive.model.kinds import JointKind
from chasles.derive.terms.terms import Terms
from tests.support.generators.poses import Case
from tests.support.generators.synthetic import Found, Function, jacobian
from tests.support.oracles.screws import Screws, screws_of
from tests.support.peers.interface import Answers

Value = sp.Expr | tuple[sp.Expr, ...]
MAX_JOINTS = 8
SETS = 4
"""Number of random sets of fixed joints per arm."""
SLIDES = 0.2
"""Fraction of prismatic joints."""
ZEROS = (0.4, 0.9)
"""Minimum and maximum probability that a length is zero."""
LENGTHS = tuple(sp.Rational(k, 10) for k in (-5, -4, -3, -2, -1, 1, 2, 3, 4, 5))
RIGHT_ANGLES = (0, 0, 90, 90, -90, -90, 180)
ANGLES = (30, 45, 60, 120, 135, 150, -30, -45, -60, -120, -135, -150)
OBLIQUE = 0.1
"""Fraction of angles that are not right angles."""
DIRECTIONS = (
    *((1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0), (0, 0, -1)),
    *((1, 1, 0), (0, 1, -1)),
)


@dataclass(frozen=True)
class Drawn:
    """A random arm in one convention."""

    convention: Convention
    joints: tuple[tuple[JointKind, dict[str, Value]], ...]


def drawn(seed: int, oblique: float = OBLIQUE) -> Drawn:
    draw = random.Random(seed)
    convention = draw.choice(CONVENTIONS)
    zeros = draw.uniform(*ZEROS)
    joints: list[tuple[JointKind, dict[str, Value]]] = []
    for _ in range(draw.randint(2, MAX_JOINTS)):
        kind: JointKind = "prismatic" if draw.random() < SLIDES else "revolute"
        fields = {f.name: _value(draw, f, zeros, oblique) for f in convention.fields}
        joints.append((kind, fields))
    return Drawn(convention, tuple(joints))


def random_arm(seed: int) -> SerialRobot:
    arm = drawn(seed)
    joints = tuple(
        Joint(f"j{k}", kind, *arm.convention(kind, **fields))
        for k, (kind, fields) in enumerate(arm.joints, 1)
    )
    return SerialRobot("arm", joints, title=f"arm {seed}, {arm.convention.name}")


def _value(draw: random.Random, field: Field, zeros: float, oblique: float) -> Value:
    def one(draw: random.Random) -> sp.Expr:
        return _angle(draw, oblique) if "angle" in field.kind else _length(draw, zeros)

    if field.kind == "direction":
        return tuple(sp.Integer(e) for e in draw.choice(DIRECTIONS))
    return tuple(one(draw) for _ in range(3)) if field.is_vector else one(draw)


def _length(draw: random.Random, zeros: float) -> sp.Expr:
    return sp.Integer(0) if draw.random() < zeros else draw.choice(LENGTHS)


def _angle(draw: random.Random, oblique: float) -> sp.Expr:
    degrees = draw.choice(ANGLES if draw.random() < oblique else RIGHT_ANGLES)
    return sp.Rational(degrees, 180) * sp.pi


class PoseAndJacobian:
    """Computes pose and Jacobian in NumPy, with the interface of a robot function."""

    def __init__(self, screws: Screws) -> None:
        self.screws = screws
        self.inputs = (SimpleNamespace(shape=(len(screws.axes),)),)

    def __call__(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return pose (..., 4, 4) and Jacobian (..., 6, n)."""
        return self.screws.fk(q), jacobian(self.screws, q)


@dataclass(frozen=True)
class Derived(Case):
    """A benchmark case of a serial robot and one of its CasADi inverse kinematics functions.

    Attributes:
        described: The robot.
        inverses: Axis structure of the robot and its derived inverse kinematics functions.
    """

    described: SerialRobot | None = None
    inverses: Inverses | None = None

    @cached_property
    def screws(self) -> Screws:
        """Joint screws, computed only from the joint placements of the description."""
        return screws_of(self.described)

    @cached_property
    def robot(self) -> SimpleNamespace:
        """The robot interface that the benchmarks require."""
        unlimited = np.full(len(self.described.coordinates), np.inf)
        others = [function.name for function in self.inverses.others]
        return SimpleNamespace(
            n=len(unlimited),
            loops=(),
            coordinates=self.described.coordinates,
            lower=-unlimited,
            upper=unlimited,
            functions={
                name: Function(self.inverses.functions[name]) for name in (self.function, *others)
            },
            fk=self.screws.fk,
            jacobian_mixed=lambda q: jacobian(self.screws, q),
        )

    def found(self, q: np.ndarray) -> Found:
        """Return all solution slots for the targets computed from the coordinates q (m, n)."""
        return self.robot.functions[self.function](self.targets(q), *self.others(q))

    def answers(self, q: np.ndarray) -> Answers:
        found = self.found(q)
        return Answers(found.q, found.valid)

    def refined(self, q: np.ndarray) -> Answers:
        """Return the inverse kinematics solutions after refinement.

        As in a loaded robot, Newton's method refines inexact closed-form solutions.
        """
        found = self.found(q)
        valid = found.valid
        role = self.inverses.functions[self.function].role
        refine = Refinement(
            PoseAndJacobian(self.screws),
            (*role.fixed, *role.free),
            task=Task(role.components),
            searches=role.searches,
        )
        refine((self.targets(q), *self.others(q)), found.q, found.residual, valid)
        if self.inverses.classification.give:
            kinds = [("revolute", "rad") if turns else ("prismatic", "m") for turns in self.turns]
            of = [Coordinate("", *kind, None, None) for kind in kinds]
            kind = solutions_of(tuple(of), tuple(self.turns.tolist()))
            slots = kind(found.q, found.residual, found.margin, valid)
            inverse = self.robot.functions["ik"]
            fixed = dict(zip(self.given, self.others(q), strict=True))
            complete = CompleteInverse(
                self.given,
                lambda T, fixed: inverse(T, *fixed.values()),
                refine.fk_jacobian_mixed,
                role.fixed,
            )
            slots = complete.complete(slots, self.targets(q), fixed)
            return Answers(slots.q, slots.valid)
        return Answers(found.q, valid)

    @property
    def still(self) -> tuple[int, ...]:
        """Indices of the joints that the inverse kinematics sets to 0."""
        q = self.inverses.functions[self.function].outputs[0]
        return tuple(k for k, value in enumerate(q.entries) if value == 0)


def cases_for_given(robot: SerialRobot, seed: int) -> list[Derived]:
    """Return inverse kinematics cases of a serial robot for random sets of fixed joints.

    In a redundant robot, as many joints are fixed as there are redundant degrees of freedom. In a
    robot without redundancy, one joint is fixed.
    """
    lines = Lines(_terms(robot), axes_of(robot, _terms(robot)))
    count = max(len(lines.axes) - rank.of_chain(lines), 1)
    sets = list(combinations(range(len(lines.axes)), count))
    random.Random(seed).shuffle(sets)
    cases = []
    for give in sets[:SETS]:
        found = inverses(robot, _terms(robot), give=give)
        if "ik" in found.solved and found.polished is None:
            name = f"{robot.title}, {', '.join(robot.moving[k].name for k in give)} given"
            cases.append(Derived(name, "ik", described=robot, inverses=found))
    return cases


def _terms(robot: SerialRobot) -> Terms:
    return Terms({p.symbol: p.value for p in robot.parameters})


def cases_of(robot: SerialRobot, found: Inverses | None = None) -> list[Derived]:
    """Return one benchmark case per closed-form inverse kinematics function of a serial robot.

    Functions with refinement are excluded, because the refinement runs in compiled C.

    Args:
        robot: The robot.
        found: Inverse kinematics functions of the robot, or None to derive these functions.
    """
    found = found or inverses(robot, _terms(robot))
    if found.polished is not None:
        return []
    return [
        Derived(robot.title or robot.name, name, described=robot, inverses=found)
        for name in found.solved
    ]
