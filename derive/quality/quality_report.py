"""Quality report of a kinematic model."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from ..model.kinds import JointKind
from ..model.tolerances import CONTINUOUS_MODEL, ZERO_SINGULAR_VALUE

_GAP = 2
"""Number of spaces between table columns."""


@dataclass(frozen=True)
class ConventionQuality:
    """How well a convention describes small errors of one axis relative to another axis.

    Attributes:
        convention: The convention's name.
        numbers: Names of the convention's parameters.
        needed: Number of parameters for the axis: 4 for a line, 2 for a direction.
        determinant: det(D^T D) for the convention's parameters. D is the derivative of the link
            matrix with respect to the parameters.
        completed: det(D^T D) for a link model that has all parameters of a pose. The determinant is
            zero at discontinuities of the model.
        value: The determinant ``completed``, evaluated at the robot's dimensions (meter). None if
            the convention cannot represent the axis.
        least: The smallest axis displacement for parameters of norm 1. Lengths are relative to the
            arm's size.
        misses: The axis displacements that the convention cannot represent.
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
        """Whether the parameters can displace the axis in every direction."""
        return self.value is not None and not self.misses

    @property
    def is_continuous(self) -> bool:
        """Whether small changes of the axis require only small changes of the parameters."""
        if not self.is_complete or self.value is None:
            return False
        return self.least > CONTINUOUS_MODEL and self.value > ZERO_SINGULAR_VALUE

    @property
    def is_minimal(self) -> bool:
        """Whether the model is complete with the minimum number of parameters."""
        return self.is_complete and len(self.numbers) == self.needed

    @property
    def verdict(self) -> str:
        """Return the properties of the convention as text."""
        if self.value is None:
            return "cannot represent this axis"
        if not self.is_complete:
            return f"misses {'; '.join(self.misses)}"
        qualities = {"continuous": self.is_continuous, "minimal": self.is_minimal}
        return ", ".join(["complete", *(word for word, holds in qualities.items() if holds)])


@dataclass(frozen=True)
class JointQuality:
    """How well each convention describes a joint axis relative to the previous joint axis.

    Attributes:
        joint: Name of the joint.
        kind: Kind of the joint.
        before: Name of the previous joint.
        angle: Angle between the joint axis and the previous joint axis (radian).
        distance: Distance between the joint axis and the previous joint axis (meter).
        own: Names of the conventions with which the robot file describes the joint axis relative to
            the previous axis.
        misses: The axis displacements that the robot's parameters cannot represent.
        conventions: The quality of every tested convention.
        suitable: The suitable convention.
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
    """Quality of a robot's kinematic model, printed by ``print(model_report(robot))``.

    Attributes:
        robot: The robot's title.
        joints: The quality of each joint except the first, whose axis follows from the base pose.
        revolute: Number r of revolute and helical joints.
        prismatic: Number t of prismatic joints.
        helical: Number of helical joints.
        numbers: Number of kinematic parameters in the robot description, including base and tool.
        rank: Number of independent parameters in the robot description: the rank of the tool pose
            Jacobian with respect to the parameters, at random configurations.
        suitable_numbers: Number of parameters if each joint is described by the convention that
            suits it.
        suitable_rank: Number of independent parameters if each joint is described by the convention
            that suits it.
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
        """The number of identifiable parameters: 4 r + 2 t + 6, plus 1 per helical joint."""
        return 4 * self.revolute + 2 * self.prismatic + 6 + self.helical

    @property
    def is_complete(self) -> bool:
        """Whether the parameters of the robot description can represent every assembly error."""
        return self.rank == self.identifiable

    @property
    def is_minimal(self) -> bool:
        """Whether no parameter of the robot description is redundant."""
        return self.numbers == self.rank

    def __str__(self) -> str:
        return "\n".join(_lines(self))

    def conventions_of(self, *, slides: bool) -> tuple[ConventionQuality, ...]:
        """Return how well each convention describes the first joint of a type after joint 1.

        Args:
            slides: True for the first prismatic joint, False for the first joint of another type.

        Returns:
            The quality of each compared convention for this joint, or () if the robot has no joint
            of this type after joint 1.
        """
        found = (joint for joint in self.joints if (joint.kind == "prismatic") == slides)
        return next((joint.conventions for joint in found), ())


def plain(expression: sp.Expr) -> str:
    """Format an expression in ordinary notation."""
    return str(expression).replace("**", "^").replace("*", " ")


def ranked(model: str, numbers: int, rank: int, identifiable: int) -> str:
    """Return a sentence about the number of parameters and the rank."""
    found = "complete"
    if rank < identifiable:
        found = f"misses {identifiable - rank} of {identifiable} displacements"
    repeating = f"{numbers - rank} redundant" if numbers > rank else "minimal"
    return f"{model}: {numbers} parameters with base and tool, rank {rank}: {found}, {repeating}"


def _lines(report: ModelReport) -> Iterator[str]:
    r, t = report.revolute, report.prismatic
    pitches = f" + {report.helical} pitches" if report.helical else ""
    yield f"Model of the {report.robot}"
    yield f"identifiable: 4 r + 2 t + 6{pitches} = {report.identifiable} with r = {r}, t = {t};"
    yield "  The line of a revolute joint has 4 parameters, the direction of a prismatic joint 2,"
    yield "  the tool 6. 5 r + 2 t + 6 also counts the position of each frame along its revolute"
    yield "  axis, which tool poses do not determine."
    yield ranked("as described", report.numbers, report.rank, report.identifiable)
    yield ranked("as suited", report.suitable_numbers, report.suitable_rank, report.identifiable)
    for slides, words in ((False, "revolute"), (True, "prismatic")):
        if found := report.conventions_of(slides=slides):
            yield f"\ndet(D^T D) of the link to a {words} joint"
            head = ("convention", "parameters", "own parameters", "full-pose parameters")
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
    yield f"\n{joint.joint} after {joint.before}: {angle}, distance {joint.distance:.6g} m"
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
