"""The role of a function: the facts that the runtime needs besides its shapes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

Aim = Literal["pose", "position", "plane", "direction", "pitch", "heading"]
"""A part of the tool's pose that a task prescribes: its position, the first two coordinates of it,
the direction of its third axis, the elevation of this axis above the base's x-y plane, or the angle
of its first axis in this plane."""
ROLES = (
    *("pose", "link poses", "pose and jacobian", "jacobian", "jacobian rate", "hessian"),
    *("twist", "acceleration"),
    *("inverse", "nominal inverse", "redundancy"),
    *("map", "map derivative", "map rate", "map acceleration", "margin", "branches"),
    *("constraint", "constraint derivative", "constraint rate", "closure", "near"),
    *("lengths", "lengths derivative", "velocity relation"),
    *("assembly polynomial", "assembly pose", "assembly mirror", "rod ends", "modes"),
    *("parametric pose", "parametric jacobian", "identification jacobian"),
    "other",
)
"""Every role that a function can have."""
DOMAINS = ("actuators", "chain", "configuration", "pose", "task", "")
"""Vectors that functions take first or return: actuated coordinates q, joints theta of the main
chain, all variables z of the loops, the pose of the tool, another task of the tool; "" where none
of them is meant."""


@dataclass(frozen=True)
class Role:
    """The role of a function.

    Attributes:
        name: One of :data:`ROLES`.
        domain: The vector that its first input is, one of :data:`DOMAINS`.
        codomain: The vector that a map, its derivatives or its branches lead to, alike; also
            "passive".
        given: The coordinates that the further inputs of an inverse determine, by their indices in
            q: they keep their values where a solution is refined.
        labels: The branch in each slot of an inverse or of branches of loops.
        of_actuators: Name of the function of actuated coordinates that this function of the main
            chain becomes where the runtime solves the loops; empty for all others.
        directions: The components of the twist (v, omega), 0 to 5, in the columns of a velocity
            relation's first matrix.
        aims: The parts of the tool's pose that the first input of an inverse prescribes, in the
            order of its entries; empty where it prescribes the whole pose.
        held: The coordinates that an inverse leaves at 0, by their indices in q.
        searches: Whether the closed form loses poses where joints are at right angles, so that the
            runtime has to search from its least-squares answers.
    """

    name: str = "other"
    domain: str = ""
    codomain: str = ""
    given: tuple[int, ...] = ()
    labels: tuple[str, ...] = ()
    of_actuators: str = ""
    directions: tuple[int, ...] = ()
    aims: tuple[Aim, ...] = ()
    held: tuple[int, ...] = ()
    searches: bool = False

    @property
    def is_inverse(self) -> bool:
        """Whether the function returns solutions in slots, each with residual and margin."""
        return self.name == "inverse"

    @property
    def finds_coordinates(self) -> bool:
        """Whether the function computes coordinates, of this robot or of a nominal one."""
        return self.is_inverse or self.is_start

    @property
    def is_start(self) -> bool:
        """Whether the function is only where another starts, pose by pose."""
        return self.name == "nominal inverse"


OTHER = Role()


def branch_label(choices: Sequence[tuple[str, str]]) -> str:
    """The label of a branch, "coupler_1 left, coupler_2 right".

    Args:
        choices: For each choice between two solutions the parts that it mirrors, and the side.
    """
    return ", ".join(f"{part} {side}" for part, side in choices) or "the only one"


def side_of(sign: int) -> str:
    """The side of a choice that has no better name than its sign."""
    return "+" if sign > 0 else "-"
