"""Solves for prismatic joints that move a point by a given vector.

Fixed joints between the prismatic joints may make the directions of the prismatic joints linearly
dependent.
"""

from collections.abc import Sequence
from dataclasses import replace

from ...terms.vectors import ORIGIN, Vector, dot
from ..structure.lines import Axis
from ..subproblems.equations import LineAndPlane
from ..subproblems.found import FoundLength
from ..subproblems.slides import slide_to_plane
from ..subproblems.turns import perpendicular
from .dependent_slides import dependent_lengths, normal_to_both
from .work import Work


def slides(work: Work, axes: Sequence[Axis], displacement: Vector, carried: str) -> None:
    """Solve for one to three prismatic joints that move a point by a vector.

    Args:
        work: Records the steps.
        axes: The prismatic joints, whose directions may depend on fixed joints.
        displacement: The vector by which the joints move the point.
        carried: Description of the point, for the LaTeX article.
    """
    terms = work.terms
    if len(axes) == 2:  # noqa: PLR2004 - two prismatic joints
        two_slides(work, axes[0], axes[1], displacement)
        return
    steps = []
    for k, axis in enumerate(axes):
        alone = len(axes) == 1
        normal = axis.h if alone else normal_to_both(terms, axes[k - 2].h, axes[k - 1].h)
        reason = (
            f"only this joint moves {carried} along its direction"
            if alone
            else f"the other prismatic joints move {carried} in a plane"
        )
        d = dot(terms, normal, displacement)
        steps.append((axis, reason, slide_to_plane(terms, normal, axis.h, ORIGIN, d)))
    _record(work, steps, displacement)


def _record(
    work: Work, steps: Sequence[tuple[Axis, str, FoundLength]], displacement: Vector
) -> None:
    terms, found = work.terms, [found for *_, found in steps]
    rates = [each.equation.rate for each in found if isinstance(each.equation, LineAndPlane)]
    if not all(map(terms.is_constant, rates)):
        # For some values of fixed joints, the directions of the prismatic joints are linearly
        # dependent.
        directions = [axis.h for axis, *_ in steps]
        lengths = dependent_lengths(terms, directions, displacement)
        found = [replace(one, length=two) for one, two in zip(found, lengths, strict=True)]
    for (axis, reason, _), each in zip(steps, found, strict=True):
        work.slide(axis, "line-plane intersection", reason, each)


def two_slides(work: Work, first: Axis, second: Axis, displacement: Vector) -> None:
    """Solve for two prismatic joints that move a point by a vector in the plane of their axes."""
    terms, steps = work.terms, []
    for axis, other in ((first, second), (second, first)):
        n = perpendicular(terms, other.h, axis.h)
        found = slide_to_plane(terms, n, axis.h, ORIGIN, dot(terms, n, displacement))
        reason = f"{other.name} moves the point only along its own direction"
        steps.append((axis, reason, found))
    _record(work, steps, displacement)
