"""The meaning of robots, functions, vectors and tasks, stated once.

A role says what a function computes. Neither the compiler nor the runtime infers a meaning from the
name of a function.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from .records import Check, one_of

KINDS = {
    "serial": "The joints are the actuated coordinates.",
    "hybrid": "The loops are solved in closed form.",
    "platform": "The loops are solved by iteration; the actuated coordinates follow from the main "
    "chain in closed form.",
    "iterated": "The loops are solved by iteration in both directions.",
}
"""The kinds of robots: how the tool's pose follows from the actuated coordinates."""

SOLUTIONS = {
    "serial": "",
    "hybrid": "closed form",
    "platform": "newton",
    "iterated": "newton",
}
"""The method that solves the loops, by the kind of the robot."""

VECTORS = {
    "actuators": "actuated coordinates q",
    "chain": "joints theta of the main chain",
    "passive": "joints that are neither actuated nor in the main chain",
    "configuration": "all variables z of the loops",
    "pose": "the pose T of the tool",
    "task": "a part of the tool's pose",
    "": "none of these",
}
"""The vectors that functions take first or return: domain and codomain of a role."""

ROLES = {
    "pose": "pose of the tool",
    "link poses": "poses of all links",
    "pose and jacobian": "pose and Jacobian of the tool",
    "jacobian": "Jacobian of the tool",
    "jacobian rate": "time derivative of the Jacobian",
    "hessian": "derivative of the Jacobian with respect to the coordinates",
    "twist": "twist of the tool",
    "acceleration": "derivative of the twist",
    "inverse": "all solutions for a pose or a task, in slots with residual and margin",
    "nominal inverse": "start configurations of an inverse that is refined",
    "redundancy": "value of a redundancy parameter, such as the swivel angle",
    "map": "one vector from another through the loops",
    "map derivative": "derivative of a map",
    "map rate": "rate of a map",
    "map acceleration": "second time derivative of a map",
    "margin": "distance of each loop from not closing",
    "branches": "a map on all branches, in slots",
    "constraint": "residuals of the closure equations",
    "constraint derivative": "derivative of the residuals",
    "constraint rate": "time derivative of that derivative",
    "closure": "the loops, closed by iteration from the reference configuration",
    "near": "a function on the branch of a configuration nearby",
    "lengths": "lengths of rods",
    "lengths derivative": "derivative of these lengths",
    "velocity relation": "matrices A, B with A twist = B qd",
    "assembly polynomial": "polynomial whose roots are the assembly modes",
    "assembly pose": "pose of an assembly mode from a root",
    "assembly mirror": "assembly mode that mirrors another",
    "rod ends": "end points of the rods of a platform",
    "modes": "all assembly modes, found by iteration",
    "parametric pose": "pose of the tool for the geometry p",
    "parametric jacobian": "Jacobian of the tool for the geometry p",
    "identification jacobian": "derivative of the pose with respect to the geometry p",
    "other": "no meaning beyond its summary",
}
"""The roles of functions, and what each computes."""

AIMS = {"position": 3, "plane": 2, "direction": 3, "pitch": 1, "heading": 1}
"""The components of a task and the number of entries of each: the tool's position, its first two
coordinates, the direction of the tool's third axis, the elevation of this axis above the base's
x-y plane, and the angle of the tool's first axis in this plane."""


Kind = Annotated[str, one_of(KINDS)]
RoleName = Annotated[str, one_of(ROLES)]
VectorName = Annotated[str, one_of(VECTORS)]
Aim = Annotated[str, one_of(AIMS)]
Direction = Annotated[int, Check("components of a twist, 0 to 5", lambda index: index <= 5)]  # noqa: PLR2004


@dataclass(frozen=True)
class Role:
    """The role of a function.

    Attributes:
        name: One of :data:`ROLES`.
        domain: The vector that its first input is, one of :data:`VECTORS`.
        codomain: The vector that a map, its derivatives or its branches return.
        given: The coordinates that the further inputs of an inverse determine, by index in q: they
            keep their values when a solution is refined.
        labels: The branch in each slot of an inverse or of branches of loops.
        directions: The components of the twist (v, omega), 0 to 5, in the columns of a velocity
            relation's first matrix.
        aims: The components of the task that the first input of an inverse prescribes, in the order
            of its entries, each one of :data:`AIMS`; () for a whole pose.
        held: The coordinates that an inverse leaves at 0, by index in q.
        searches: Whether the closed form loses poses where joints are at right angles, so that the
            runtime searches from its least-squares answers.
    """

    name: RoleName = field(metadata={"key": "role"})
    domain: VectorName = ""
    codomain: VectorName = ""
    given: tuple[int, ...] = ()
    labels: tuple[str, ...] = ()
    directions: tuple[Direction, ...] = ()
    aims: tuple[Aim, ...] = ()
    held: tuple[int, ...] = ()
    searches: bool = False

    @property
    def key(self) -> tuple[str, str, str]:
        """Name, domain and codomain, by which the runtime finds a function."""
        return self.name, self.domain, self.codomain

    @property
    def is_inverse(self) -> bool:
        """Whether the function returns solutions in slots, each with residual and margin."""
        return self.name == "inverse"

    @property
    def has_slots(self) -> bool:
        """Whether the first dimension of each result counts branches."""
        return self.name in ("inverse", "branches")
