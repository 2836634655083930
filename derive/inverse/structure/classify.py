"""Which closed-form inverse a chain has: structures are tried in order, and say what they miss."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from types import ModuleType

import numpy as np

from ...model.robot import Robot
from ...terms.terms import Terms
from ..families import (
    column,
    inner_centre,
    parallel_forearm,
    planar,
    position,
    spherical_wrist,
    swivel,
    three_parallel,
    turntable,
)
from . import rank
from .lines import EXACT, SNAPPED, Lines, axes_of
from .locks import ways_to_give
from .requirement import Requirement

FAMILIES: dict[int, tuple[ModuleType, ...]] = {
    2: (planar,),
    3: (planar, position),
    4: (planar, turntable),
    5: (turntable,),
    6: (three_parallel, spherical_wrist, column, parallel_forearm, inner_centre),
    7: (swivel,),
}
"""The structures of chains by the number of their joints, in the order in which they are tried."""
MOST_JOINTS = 6
"""A longer chain is redundant, and its families say how that is settled."""


@dataclass(frozen=True)
class Attempt:
    """One structure tried on a chain.

    Attributes:
        family: The structure's module.
        backwards: Whether the chain was read from the tool.
        given: Places of the joints whose values are given.
        requirements: Its conditions, with how far the axes are from them.
    """

    family: ModuleType
    backwards: bool
    given: tuple[int, ...]
    requirements: tuple[Requirement, ...]

    @property
    def apart(self) -> float:
        """How far the axes are from the structure: radian, or parts of the arm's length."""
        return max((requirement.apart for requirement in self.requirements), default=0.0)

    @property
    def title(self) -> str:
        """The structure in words."""
        return str(self.family.TITLE) + (", read from the tool" if self.backwards else "")


@dataclass(frozen=True)
class Classification:
    """What was found out about the inverse of a chain.

    Attributes:
        lines: Its axes.
        found: The structure that holds, if one does.
        attempts: All that were tried, up to the one that holds.
        missing: Why there is no closed form, in words; empty where there is one.
    """

    lines: Lines
    found: Attempt | None
    attempts: tuple[Attempt, ...]
    missing: str = ""

    @property
    def tier(self) -> str:
        """How well the structure holds: "exact", "snapped" or "none"."""
        if self.found is None:
            return "none"
        return "exact" if self.found.apart <= EXACT else "snapped"


def classify(robot: Robot, terms: Terms, coordinates: int | None = None) -> Classification:
    """The structure of a serial robot, or of the main chain of one with loops.

    Where there are more coordinates than the tool has freedoms, so many joints must be given: the
    first choice that leaves a solvable chain.

    Args:
        robot: The description.
        terms: Receives the constants of the axes.
        coordinates: How many coordinates move the chain, where loops hold some of its joints.
    """
    lines = Lines(terms, axes_of(robot, terms))
    reason = _unfit(robot)
    if reason:
        return Classification(lines, None, (), reason)
    return of_lines(lines, coordinates)


def of_lines(lines: Lines, coordinates: int | None = None) -> Classification:
    """The structure of a chain of axes, moved by so many coordinates, all its joints by default."""
    attempts: list[Attempt] = []
    choices = list(_choices(lines, coordinates or len(lines.axes)))
    for attempt in _attempts(lines, choices):
        attempts.append(attempt)
        if attempt.apart <= EXACT:
            return Classification(lines, attempt, tuple(attempts))
    # Of an arm that was built to a structure and measured, the first that is nearly there.
    for attempt in _attempts(replace(lines, tolerance=SNAPPED), choices):
        if attempt.apart <= SNAPPED:
            return Classification(lines, attempt, tuple(attempts))
    nearest = min(attempts, key=lambda attempt: attempt.apart, default=None)
    return Classification(lines, None, tuple(attempts), _nearest_in_words(nearest))


def _unfit(robot: Robot) -> str:
    """Why a chain is not to be classified at all."""
    followers = [joint.name for joint in robot.moving if joint.mimic]
    helical = [joint.name for joint in robot.moving if joint.kind == "helical"]
    if followers:
        return f"{', '.join(followers)} follows another joint"
    if helical:
        return f"{', '.join(helical)} is a screw joint"
    return ""


def _choices(lines: Lines, coordinates: int) -> Iterable[tuple[int, ...]]:
    """Which joints may be given: as many as there are coordinates too many."""
    too_many = coordinates - rank.of_chain(lines)
    if too_many <= 0:
        return [()]
    # From the tool: what is nearest to the hand is what an operator sets first.
    choices = sorted(ways_to_give(lines, too_many), key=lambda given: given[::-1], reverse=True)
    return [(), *(given for given in choices if _leaves_full_rank(lines, given))]


def _leaves_full_rank(lines: Lines, given: tuple[int, ...]) -> bool:
    left = lines.at_generic(given)
    return rank.of_chain(left) == len(left.axes)


def _attempts(lines: Lines, choices: Iterable[tuple[int, ...]]) -> Iterable[Attempt]:
    for given in choices:
        left = lines.at_generic(given)
        if not given and rank.of_chain(left) < len(left.axes) and len(left.axes) <= MOST_JOINTS:
            continue
        for family in FAMILIES.get(len(left.axes), ()):
            for backwards in _readings(family, given):
                seen = left.reversed() if backwards else left
                yield Attempt(family, backwards, given, tuple(family.requires(seen)))


def _readings(family: ModuleType, given: tuple[int, ...]) -> tuple[bool, ...]:
    """Whether a structure is looked for from the base, from the tool, or not at all.

    A place alone is no displacement that could be undone, and a swivel angle is told by the base.
    """
    if family is position:
        return () if given else (False,)
    return (False,) if family is swivel else (False, True)


def _nearest_in_words(nearest: Attempt | None) -> str:
    if nearest is None:
        return "no structure of so many joints is known"
    missed = [r for r in nearest.requirements if r.apart > EXACT]
    text = "; ".join(f"{r.text} (off by {r.apart:.3g})" for r in missed if np.isfinite(r.apart))
    never = "; ".join(r.text for r in missed if not np.isfinite(r.apart))
    parts = [part for part in (text, never) if part]
    return f"nearest is {nearest.title}, which asks that {'; '.join(parts)}"
