"""A report on the quality of a robot's model: the findings, and their text."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from ..model.kinds import JointKind
from ..model.tolerances import CONTINUOUS_MODEL, ZERO_SINGULAR_VALUE

_GAP = 2
"""Blanks between the columns of a table."""


@dataclass(frozen=True)
class ConventionQuality:
    """A convention between two axes.

    Attributes:
        convention: Its name.
        numbers: Names of its numbers.
        needed: How many an axis of the joint's kind needs: 4 a line, 2 a direction.
        determinant: det(D^T D) by its own numbers.
        completed: det(D^T D) by the numbers of a whole pose, with turns about and shifts along the
            neighboring axes; it vanishes where the model jumps.
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

    @property
    def verdict(self) -> str:
        """Its qualities, or the displacements that it misses, in words."""
        if self.value is None:
            return "has no numbers for this axis"
        if not self.is_complete:
            return f"misses {'; '.join(self.misses)}"
        qualities = {"continuous": self.is_continuous, "minimal": self.is_minimal}
        return ", ".join(["complete", *(word for word, holds in qualities.items() if holds)])


@dataclass(frozen=True)
class JointQuality:
    """The conventions between the axis of a joint and the axis before.

    Attributes:
        joint: Name of the joint.
        kind: Its kind.
        before: Name of the joint before.
        angle: Angle between both axes (radian).
        distance: Their distance (metre); 0 where one is a direction alone.
        own: Names of the conventions in which the robot describes the link between both.
        misses: The displacements of the axis that the robot's own numbers cannot give.
        conventions: Every convention.
        suitable: The convention that suits the joint.
    """

    joint: str
    kind: JointKind
    before: str
    angle: float
    distance: float
    own: tuple[str, ...]
    misses: tuple[str, ...]
    conventions: tuple[ConventionQuality, ...]
    suitable: str


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
        suitable_numbers: How many numbers there are in the conventions that suit the joints.
        suitable_rank: Rank of the tool's poses by those.
    """

    robot: str
    joints: tuple[JointQuality, ...]
    revolute: int
    prismatic: int
    helical: int
    numbers: int
    rank: int
    suitable_numbers: int
    suitable_rank: int

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

    def conventions_of(self, *, slides: bool) -> tuple[ConventionQuality, ...]:
        """The conventions at turning or sliding joints; () where the robot has none of them."""
        found = (joint for joint in self.joints if (joint.kind == "prismatic") == slides)
        return next((joint.conventions for joint in found), ())


def plain(expression: sp.Expr) -> str:
    """An expression as people write it."""
    return str(expression).replace("**", "^").replace("*", " ")


def ranked(model: str, numbers: int, rank: int, identifiable: int) -> str:
    """A sentence on the numbers of a model and their rank."""
    found = "complete"
    if rank < identifiable:
        found = f"misses {identifiable - rank} of {identifiable} displacements"
    repeating = f"{numbers - rank} repeat others" if numbers > rank else "minimal"
    return f"{model}: {numbers} numbers with base and tool, rank {rank}: {found}, {repeating}"


def _lines(report: ModelReport) -> Iterator[str]:
    r, t = report.revolute, report.prismatic
    pitches = f" + {report.helical} pitches" if report.helical else ""
    yield f"Model of the {report.robot}"
    yield f"identifiable: 4 r + 2 t + 6{pitches} = {report.identifiable} with r = {r}, t = {t};"
    yield "  4 numbers place the line of a turning joint, 2 the direction of a sliding one, and 6"
    yield "  the tool. 5 r + 2 t + 6 counts also the place of each frame along its turning axis,"
    yield "  which no pose of the tool shows."
    yield ranked("as described", report.numbers, report.rank, report.identifiable)
    yield ranked("as suited", report.suitable_numbers, report.suitable_rank, report.identifiable)
    for slides, words in ((False, "turning"), (True, "sliding")):
        if found := report.conventions_of(slides=slides):
            yield f"\ndet(D^T D) of the link to a {words} joint"
            head = ("convention", "numbers", "by its own numbers", "by those of a whole pose")
            yield from _table(
                head,
                [
                    (c.convention, ", ".join(c.numbers), plain(c.determinant), plain(c.completed))
                    for c in found
                ],
            )
    for joint in report.joints:
        yield from _of_joint(joint)


def _of_joint(joint: JointQuality) -> Iterator[str]:
    angle = f"angle {np.degrees(joint.angle):.6g} deg"
    yield f"\n{joint.joint} behind {joint.before}: {angle}, distance {joint.distance:.6g} m"
    missing = "; ".join(joint.misses)
    described = f"as described ({' and '.join(joint.own) or 'placements'})"
    yield f"{described}: {f'misses {missing}' if missing else 'complete'}"
    rows = [
        (
            "suits" if item.convention == joint.suitable else "",
            item.convention,
            "" if item.value is None else f"{item.value:.3g}",
            item.verdict,
        )
        for item in joint.conventions
    ]
    yield from _table(("", "convention", "det", ""), rows)


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    widths = [max(map(len, cells)) + _GAP for cells in zip(head, *rows, strict=True)]
    for row in (head, *rows):
        padded = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        yield f"  {''.join(padded)}".rstrip()
