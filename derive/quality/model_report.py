"""The quality of a robot's model for calibration: complete, continuous, minimal.

A model is complete where its numbers displace every axis in every direction, continuous where small
displacements take small changes of the numbers, and minimal where no number repeats others.

Source:
    K. Schroeer, S. Albright, M. Grethlein, Complete, minimal and model-continuous kinematic models
    for robot calibration, Robotics and Computer-Integrated Manufacturing 13 (1997); Closed chain
    cascade manipulator with an improved kinematic model, Mathematical Problems in Engineering, 3.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ..description.conventions import CONVENTIONS
from ..description.conventions.axis_maps import Motions, axis_map, field_values, free_of
from ..description.conventions.neighbours import Neighbours, least_singular_value, neighbours
from ..description.conventions.suited import suited, suited_conventions
from ..model.convention import Convention
from ..model.geometry import geometry
from ..model.mechanism import Described, Mechanism
from ..model.robot import Robot
from ..model.tolerances import CONTINUOUS_MODEL, ZERO_SINGULAR_VALUE
from .determinants import completed_determinant, determinant
from .missed import missed
from .own_numbers import own_displacements

POSES = 60
"""Random poses over which the rank is taken."""


@dataclass(frozen=True)
class ConventionQuality:
    """A convention between two axes.

    Attributes:
        convention: Its name.
        numbers: Names of its numbers.
        needed: How many an axis of the joint's kind needs: 4 a line, 2 a direction.
        determinant: det(D^T D) by its own numbers.
        completed: det(D^T D) by the numbers of a whole pose, with turns about and shifts along the
            neighbouring axes; it vanishes where the model jumps.
        value: Value of ``completed`` at the robot (lengths in metres); None where the convention
            has no numbers for the axis.
        least: The least displacement of the axis by numbers of norm 1, lengths in parts of the
            arm's.
        misses: The displacements of the axis that its numbers cannot give.
    """

    convention: str
    numbers: tuple[str, ...]
    needed: int
    determinant: sp.Expr
    completed: sp.Expr
    value: float | None
    least: float
    misses: tuple[str, ...]

    @property
    def is_complete(self) -> bool:
        """Whether its numbers displace the axis in every direction."""
        return self.value is not None and not self.misses

    @property
    def is_continuous(self) -> bool:
        """Whether no number moves much farther than the axis, and the determinant is not 0."""
        if not self.is_complete or self.value is None:
            return False
        return self.least > CONTINUOUS_MODEL and self.value > ZERO_SINGULAR_VALUE

    @property
    def is_minimal(self) -> bool:
        """Whether it is complete with as many numbers as the axis needs."""
        return self.is_complete and len(self.numbers) == self.needed


@dataclass(frozen=True)
class JointQuality:
    """The conventions between the axis of a joint and the axis before.

    Attributes:
        joint: Name of the joint.
        before: Name of the joint before.
        angle: Angle between both axes (radian).
        distance: Their distance (metre); 0 where one is a direction alone.
        own: Names of the conventions in which the robot describes the link between both.
        misses: The displacements of the axis that the robot's own numbers cannot give.
        conventions: Every convention.
        suited: The convention that suits the joint.
    """

    joint: str
    before: str
    angle: float
    distance: float
    own: tuple[str, ...]
    misses: tuple[str, ...]
    conventions: tuple[ConventionQuality, ...]
    suited: str


@dataclass(frozen=True)
class ModelReport:
    """The quality of a robot's model: ``print(model_report(robot))``.

    Attributes:
        robot: The robot's title.
        joints: Every joint behind the first, whose axis the six numbers of the base frame place.
        revolute: r, turning joints, helical ones included.
        prismatic: t, sliding joints.
        helical: Helical joints, each of which has a pitch.
        numbers: How many numbers the robot's own conventions, the base and the tool have.
        rank: Rank of the tool's poses by these numbers, over random postures.
        suited_numbers: How many numbers there are in the conventions that suit the joints.
        suited_rank: Rank of the tool's poses by those.
    """

    robot: str
    joints: tuple[JointQuality, ...]
    revolute: int
    prismatic: int
    helical: int
    numbers: int
    rank: int
    suited_numbers: int
    suited_rank: int

    @property
    def identifiable(self) -> int:
        """4 r + 2 t + 6, and the pitches of helical joints: all that poses of the tool can tell."""
        return 4 * self.revolute + 2 * self.prismatic + 6 + self.helical

    @property
    def is_complete(self) -> bool:
        """Whether the robot's own numbers explain every error of assembly."""
        return self.rank == self.identifiable

    @property
    def is_minimal(self) -> bool:
        """Whether no number of the robot's own model repeats others."""
        return self.numbers == self.rank

    def __str__(self) -> str:
        """The report to read."""
        return "\n".join(_lines(self))


def _lines(report: ModelReport) -> Iterator[str]:
    yield f"Model of {report.robot}"
    yield from _counts(report)
    for joint in report.joints:
        yield ""
        yield (
            f"{joint.joint} behind {joint.before}: angle {np.degrees(joint.angle):.6g} deg, "
            f"distance {joint.distance:.6g} m; {joint.suited} suits it"
        )
        own = " and ".join(joint.own) or "placements"
        if joint.misses:
            yield f"  as described ({own}): misses {'; '.join(joint.misses)}"
        else:
            yield f"  as described ({own}): complete"
        yield from _table(joint)


def _counts(report: ModelReport) -> Iterator[str]:
    r, t = report.revolute, report.prismatic
    pitches = f" + {report.helical} (pitches)" if report.helical else ""
    yield f"identifiable: 4 r + 2 t + 6{pitches} = {report.identifiable}, r = {r}, t = {t}"
    yield "  4 numbers place the line of a turning joint, 2 the direction of a sliding one, and 6"
    yield "  the tool. 5 r + 2 t + 6 counts also the place of each frame along its turning axis,"
    yield "  which no pose of the tool shows."
    missing = report.identifiable - report.rank
    found = "complete" if report.is_complete else f"misses {missing} displacements of axes"
    yield _ranked("as described", report.numbers, report.rank, found)
    found = "complete" if report.suited_rank == report.identifiable else "not complete"
    yield _ranked("as suited", report.suited_numbers, report.suited_rank, found)


def _ranked(model: str, numbers: int, rank: int, found: str) -> str:
    repeating = f", {numbers - rank} repeat others" if numbers > rank else ", minimal"
    return f"{model}: {numbers} numbers with base and tool, rank {rank}: {found}{repeating}"


def _table(joint: JointQuality) -> Iterator[str]:
    for item in joint.conventions:
        marks = ", ".join(
            word
            for word, holds in (
                ("complete", item.is_complete),
                ("continuous", item.is_continuous),
                ("minimal", item.is_minimal),
            )
            if holds
        )
        value = "no numbers" if item.value is None else f"{item.value:.3g}"
        yield (
            f"  {item.convention:<8} {len(item.numbers)} of {item.needed}  "
            f"det {plain(item.determinant)}; completed {plain(item.completed)} = {value}"
            f"  {marks or 'incomplete'}"
        )
        for misses in item.misses:
            yield f"           misses {misses}"


def plain(expression: sp.Expr) -> str:
    """An expression as people write it."""
    return str(expression).replace("**", "^").replace("*", " ")


def model_report(
    robot: Described, conventions: Sequence[Convention] = CONVENTIONS, seed: int = 0
) -> ModelReport:
    """Which conventions describe each joint of a robot completely, continuously and minimally.

    Args:
        robot: A serial robot; of a robot with loops, the main chain is judged.
        conventions: The conventions to compare; those that cannot place an axis are left out.
        seed: Of the random postures of the rank.
    """
    chain = robot.main_chain if isinstance(robot, Mechanism) else robot
    fitting = [convention for convention in conventions if convention.fit]
    kinds = [joint.kind for joint in chain.moving]
    suits = suited_conventions(chain)
    return ModelReport(
        robot.title or robot.name,
        tuple(
            _joint(pair, own_displacements(chain, pair), placed, suit.name, fitting)
            for pair, (placed, suit) in zip(neighbours(chain)[1:], suits[1:], strict=True)
        ),
        sum(kind != "prismatic" for kind in kinds),
        kinds.count("prismatic"),
        kinds.count("helical"),
        *_rank(chain, seed),
        *_rank(suited(chain), seed),
    )


def _joint(
    pair: Neighbours,
    own: NDArray[np.float64],
    placed: Neighbours,
    suits: str,
    conventions: Sequence[Convention],
) -> JointQuality:
    return JointQuality(
        pair.joint.name,
        pair.before.name if pair.before else "",
        pair.angle,
        pair.distance if pair.is_of_lines else 0.0,
        tuple(
            dict.fromkeys(
                joint.convention.name
                for joint in (pair.before, pair.joint)
                if joint and joint.convention
            )
        ),
        missed(own, pair.words),
        tuple(_quality(placed, convention) for convention in conventions),
        suits,
    )


def _quality(pair: Neighbours, convention: Convention) -> ConventionQuality:
    kind = pair.joint.kind
    link = axis_map(convention, kind)
    fit, rows = pair.fit(convention), pair.displacements(convention)
    completed = completed_determinant(convention, kind)
    value = None
    if fit is not None:
        known = field_values(fit)
        value = float(completed.subs({s: known.get(s.name, 0.0) for s in link.symbols}))
    return ConventionQuality(
        convention.name,
        tuple(symbol.name for symbol in link.own),
        len(free_of(kind)),
        determinant(convention, kind),
        completed,
        value,
        least_singular_value(rows),
        () if rows is None else missed(rows, pair.words),
    )


def _rank(robot: Robot, seed: int) -> tuple[int, int]:
    """How many numbers the robot's own model has, and its rank over random postures."""
    q = sp.symbols(f"q1:{len(robot.coordinates) + 1}", real=True)
    found = geometry(robot, q)
    own = [
        k for k, item in enumerate(found.parameters) if item.part not in ("axis", "transmission")
    ]
    symbols = [item.symbol for item in found.parameters]
    nominal = [float(item.value) for item in found.parameters]
    motions = Motions(found.motions, [*q, *symbols])
    random = np.random.default_rng(seed)
    J = np.concatenate(
        [motions([*at, *nominal])[0][:, len(q) :] for at in random.uniform(-2, 2, (POSES, len(q)))]
    )[:, own]
    return len(own), _rank_of(J)


def _rank_of(J: NDArray[np.float64]) -> int:
    size = np.linalg.norm(J, axis=0)
    values = np.linalg.svd(J[:, size > 0] / size[size > 0], compute_uv=False)
    return int(np.sum(values > ZERO_SINGULAR_VALUE * values[0]))
