"""Classifies the joint axes of a chain by comparing them with each arm family in order."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..model.robot import SerialRobot
from ..model.tolerances import EXACT_STRUCTURE, MEASURED_STRUCTURE, NEARLY_STRUCTURE
from ..terms.terms import Terms
from .families import FAMILIES
from .families.family import Family, Reading
from .given_joints import joint_sets_to_fix
from .structure import rank
from .structure.lines import Lines, axes_of
from .structure.requirement import Requirement

MAX_JOINTS = 6
"""Maximum number of joints of a chain without redundancy."""
MAX_NEAR = 2
"""Maximum number of nominal structures to try if no structure fits exactly."""


@dataclass(frozen=True)
class Attempt:
    """Result of comparing a chain with one family.

    Attributes:
        family: The family.
        reading: The end of the chain at which the numbering of axes starts: base or tool.
        given: Indices of the joints with fixed values.
        requirements: The conditions that the family imposes on the axes of the free joints, and the
            deviation of the axes from each condition.
    """

    family: Family
    reading: Reading
    given: tuple[int, ...]
    requirements: tuple[Requirement, ...]

    @property
    def backwards(self) -> bool:
        """Whether the axes are numbered from the tool to the base."""
        return self.reading == "tool"

    @property
    def is_whole(self) -> bool:
        """Whether the structure contains all joints, in the order from base to tool."""
        return not self.given and not self.backwards

    @property
    def deviation(self) -> float:
        """Largest deviation from a condition, as an angle (radian) or a distance per arm length."""
        return max((requirement.deviation for requirement in self.requirements), default=0.0)

    def on(self, lines: Lines) -> "Attempt":
        """Return the result of comparing the same arm family with another chain.

        The conditions of the arm family are evaluated for the other chain.
        """
        left = lines.at_generic(self.given)
        seen = left.reversed() if self.backwards else left
        return replace(self, requirements=tuple(self.family.requires(seen)))

    @property
    def title(self) -> str:
        """Description of the axis structure."""
        return self.family.title + (", solved from tool to base" if self.backwards else "")


@dataclass(frozen=True)
class Classification:
    """The axis structure of a chain, or the reason why no closed form exists.

    Attributes:
        lines: The axes of the joints in the chain.
        found: The family that fits the chain, or None.
        attempts: The result of each comparison of the chain with an arm family. If an arm family
            fits the chain, the last comparison result belongs to this family.
        missing: The reason why no closed form exists, or "" if a closed form exists.
        near: Axis structures that fit the chain approximately, best first. Each approximate
            structure defines a nominal arm, whose solutions Newton's method refines.
        give: Indices of the joints that the caller fixed, or an empty tuple if the classification
            selects the joints to fix.
    """

    lines: Lines
    found: Attempt | None
    attempts: tuple[Attempt, ...]
    missing: str = ""
    near: tuple[Attempt, ...] = ()
    give: tuple[int, ...] = ()

    @property
    def method(self) -> Literal["exact", "snapped", "none"]:
        """How well the axes fit a structure: exactly, approximately ("snapped") or not at all."""
        if self.found is None:
            return "none"
        return "exact" if self.found.deviation <= EXACT_STRUCTURE else "snapped"


def classify(
    robot: SerialRobot,
    terms: Terms,
    coordinates: int | None = None,
    families: Sequence[Family] = FAMILIES,
    give: tuple[int, ...] = (),
) -> Classification:
    """Classify the axes of a serial robot, or of the main chain of a robot with loops.

    A redundant chain has more coordinates than the tool has degrees of freedom.

    Args:
        robot: The description.
        terms: Table of named terms, which receives the constants of the axes.
        coordinates: Number of coordinates that move the chain if loops couple its joints. None if
            each joint has its own coordinate.
        families: The families of axis structures to try, in order.
        give: Indices of the joints to fix in ascending order, or an empty tuple to fix the first
            suitable set of joints.
    """
    lines = Lines(terms, axes_of(robot, terms))
    reason = unfit(robot)
    if reason:
        return Classification(lines, None, (), reason, give=give)
    return of_lines(lines, coordinates, families, give)


def of_lines(
    lines: Lines,
    coordinates: int | None = None,
    families: Sequence[Family] = FAMILIES,
    give: tuple[int, ...] = (),
) -> Classification:
    """Classify the axis structure of a chain.

    Args:
        lines: The chain.
        coordinates: Number of coordinates that move the chain, or None if this number equals the
            number of joints.
        families: The families of axis structures to try, in order.
        give: Indices of the joints to fix, or an empty tuple to fix the first suitable set of
            joints.
    """
    if give and not _leaves_full_rank(lines, give):
        surplus = len(lines.axes) - rank.of_chain(lines)
        reason = "the other joints could move without moving the tool"
        reason += f"; {surplus} joints must be fixed" if surplus > len(give) else ""
        return Classification(lines, None, (), reason, give=give)
    attempts: list[Attempt] = []
    choices = [give] if give else list(_choices(lines, coordinates or len(lines.axes)))
    for attempt in _attempts(lines, choices, families):
        attempts.append(attempt)
        if attempt.deviation <= EXACT_STRUCTURE:
            return Classification(lines, attempt, tuple(attempts), give=give)
    nearest = min(attempts, key=lambda attempt: attempt.deviation, default=None)
    near = () if _turns_within(lines, give) else tuple(_near(lines, choices, families))
    missing = _nearest_in_words(nearest, lines)
    return Classification(lines, None, tuple(attempts), missing, near, give)


def _turns_within(lines: Lines, given: tuple[int, ...]) -> bool:
    """Whether a fixed revolute joint lies between free joints.

    A chain with a fixed revolute joint between free joints has no nominal arm.
    """
    free = [k for k in range(len(lines.axes)) if k not in given]
    return any(lines.axes[k].turns and free[0] < k < free[-1] for k in given)


def further_families(
    lines: Lines,
    found: Attempt,
    families: Sequence[Family] = FAMILIES,
    give: tuple[int, ...] = (),
) -> Iterator[Attempt]:
    """Yield additional axis structures of the chain, possibly with other fixed joints.

    Args:
        lines: The chain.
        found: The axis structure that is already known to fit the chain exactly and is therefore
            not yielded.
        families: The families of axis structures to try, in order.
        give: Indices of the joints to fix, or an empty tuple to try every possible set of fixed
            joints.
    """
    families = [family for family in families if family.solves_pose and not family.inputs]
    known = found.family, found.reading, found.given
    choices = [give] if give else list(_choices(lines, len(lines.axes)))
    for attempt in _attempts(lines, choices, families):
        other = (attempt.family, attempt.reading, attempt.given) != known
        if other and attempt.deviation <= EXACT_STRUCTURE:
            yield attempt


def _near(
    lines: Lines, choices: Sequence[tuple[int, ...]], families: Sequence[Family]
) -> list[Attempt]:
    """Return the axis structures that fit the chain approximately, best first.

    If an axis structure fits within the tolerance for measurement errors, the function returns only
    this structure. Arm families with a swivel angle are excluded, because these families need exact
    axes.
    """
    families = [family for family in families if not family.inputs]
    measured = _attempts(replace(lines, tolerance=MEASURED_STRUCTURE), choices, families)
    first = next((a for a in measured if a.deviation <= MEASURED_STRUCTURE), None)
    if first is not None:
        return [first]
    nearly = _attempts(replace(lines, tolerance=NEARLY_STRUCTURE), choices, families)
    found = [attempt for attempt in nearly if attempt.deviation <= NEARLY_STRUCTURE]
    return sorted(found, key=lambda attempt: attempt.deviation)[:MAX_NEAR]


def unfit(robot: SerialRobot) -> str:
    """Return the reason why a chain cannot be classified, or "" for a suitable chain."""
    helical = [joint.name for joint in robot.moving if joint.kind == "helical"]
    if robot.couplings:
        return f"{', '.join(rule.joint for rule in robot.couplings)} follows other coordinates"
    if helical:
        return f"{', '.join(helical)} is a screw joint"
    return ""


def _choices(lines: Lines, coordinates: int) -> Iterable[tuple[int, ...]]:
    """Return the sets of joints that can be fixed to remove the redundancy of a chain.

    For a redundant chain, the empty set comes first, then the other sets, starting with joints near
    the tool.
    """
    surplus = coordinates - rank.of_chain(lines)
    if surplus <= 0:
        return [()]
    choices = sorted(joint_sets_to_fix(lines, surplus), key=lambda given: given[::-1], reverse=True)
    return [(), *(given for given in choices if _leaves_full_rank(lines, given))]


def _leaves_full_rank(lines: Lines, given: tuple[int, ...]) -> bool:
    left = lines.at_generic(given)
    return rank.of_chain(left) == len(left.axes)


def _attempts(
    lines: Lines, choices: Iterable[tuple[int, ...]], families: Sequence[Family]
) -> Iterable[Attempt]:
    choices = list(choices)
    late = [family for family in families if family.rather_gives]
    early = [family for family in families if not family.rather_gives]
    for given in choices:
        yield from _of_choice(lines, given, early if given else families)
    for given in filter(None, choices if late else ()):
        yield from _of_choice(lines, given, late)


def _of_choice(
    lines: Lines, given: tuple[int, ...], families: Sequence[Family]
) -> Iterator[Attempt]:
    left = lines.at_generic(given)
    if not given and rank.of_chain(left) < min(len(left.axes), MAX_JOINTS):
        return
    for family in families:
        if len(left.axes) not in family.joints or (given and not family.behind_given):
            continue
        for reading in family.readings:
            seen = left.reversed() if reading == "tool" else left
            yield Attempt(family, reading, given, tuple(family.requires(seen)))


def _nearest_in_words(nearest: Attempt | None, lines: Lines) -> str:
    if nearest is None:
        count = len(lines.axes)
        return f"no structure is known for {count} joints"
    missed = [r for r in nearest.requirements if r.deviation > EXACT_STRUCTURE]
    finite = [r for r in missed if np.isfinite(r.deviation)]
    text = "; ".join(f"{r.text} (off by {r.in_units(lines.length)})" for r in finite)
    never = "; ".join(r.text for r in missed if not np.isfinite(r.deviation))
    parts = [part for part in (text, never) if part]
    return f"the nearest structure is {nearest.title}, which requires that {'; '.join(parts)}"
