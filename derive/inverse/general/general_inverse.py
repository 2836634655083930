"""The inverse of six revolute joints without a structure, and its words for ``--explain``."""

from dataclasses import dataclass

from ...model.robot import Robot
from ...terms.symbolic_function import SymbolicFunction, WrittenFunction
from ...terms.terms import Terms
from . import raghavan_roth, written_inverse


@dataclass(frozen=True)
class GeneralInverse:
    """The inverse of a general arm.

    Attributes:
        title: The kind of arm and the source of the method, in words.
        method: The method in words.
        split: The order of the joints in the equations.
        equations: The side of the equations that depends on the pose.
        function: The function ``ik``, which takes the eigenvalues of a matrix.
        steps: The numbered steps in words.
    """

    title: str
    method: str
    split: raghavan_roth.Split
    equations: SymbolicFunction
    function: WrittenFunction
    steps: tuple[str, ...]


def general_inverse(robot: Robot, terms: Terms) -> GeneralInverse | None:
    """The inverse of an arm by its eigenvalues, or None where its equations do not allow it.

    Args:
        robot: The description.
        terms: Receives the terms of the equations.
    """
    split = raghavan_roth.split_of(robot)
    if split is None:
        return None
    return GeneralInverse(
        "an arm of six revolute joints without a structure (Raghavan and Roth)",
        "by the eigenvalues of a matrix",
        split,
        raghavan_roth.matrices(robot, split, terms),
        written_inverse.inverse(robot, split),
        _steps(robot, split),
    )


def _steps(robot: Robot, split: raghavan_roth.Split) -> tuple[str, ...]:
    one, two, suppressed, v, w, last = (robot.moving[k].name for k in split.joints)
    return (
        f"{last} does not move its own axis: fourteen quantities of this axis are linear in the "
        f"products of cosines and sines of {one} and {two}, and in those of {v} and {w}. Six "
        f"combinations of the equations do not contain {one} and {two}.",
        f"{suppressed}: with the half angle of {v} these are twelve equations, singular at sixteen "
        "complex angles, the eigenvalues of a matrix. The real angles among them are solutions.",
        f"{v}, {w}: from the eigenvector. {one}, {two}: from the equations that were combined.",
        f"{last}: from the orientation that the other joints leave. Newton steps on the pose "
        "refine the result.",
    )
