"""Defines the robot kinds, function roles, vectors and task components.

A role states what a function computes. The compiler and the runtime do not derive the role of a
function from its name.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from .records import Check, one_of

KINDS = {
    "serial": "The joints are the actuated coordinates.",
    "hybrid": "The loops are solved in closed form.",
    "platform": "The loops are solved by iteration; the actuated coordinates follow from the main "
    "chain in closed form.",
    "iterated": "The loops are solved by iteration in both directions.",
}
"""Robot kinds, which differ in how the coordinates determine the tool pose."""

SOLUTIONS = {
    "serial": "",
    "hybrid": "closed form",
    "platform": "newton",
    "iterated": "newton",
}
"""Method that solves the kinematic loops, keyed by the kind of robot."""

VECTORS = {
    "actuators": "actuated coordinates q",
    "chain": "joints theta of the main chain",
    "passive": "joints that are neither actuated nor in the main chain",
    "configuration": "all variables z of the loops",
    "pose": "the pose T of the tool",
    "task": "a part of the tool's pose",
    "": "none of these",
}
"""Names and meanings of the coordinate vectors in the inputs and outputs of functions."""

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
    "chain pose": "pose and Jacobian of the tool for the joints of the main chain",
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
"""What a function returns, keyed by the role of the function."""

INTERMEDIATE = {
    *("branches", "chain pose", "closure", "lengths", "lengths derivative", "modes"),
    "nominal inverse",
    *("assembly polynomial", "assembly pose", "assembly mirror", "rod ends", "velocity relation"),
}
"""Roles of generated functions that are not part of a robot's interface.

Methods of the robot call these functions.
"""

TASK_COMPONENTS = {
    "position": 3,
    "plane": 2,
    "orientation": 9,
    "direction": 3,
    "pitch": 1,
    "heading": 1,
}
"""The components of a task, and the number of entries in each component. The component "position"
contains the coordinates x, y and z of the tool. The component "plane" contains only x and y. The
component "orientation" is the rotation matrix of the tool. The component "direction" is the third
axis of the tool. The component "pitch" is the elevation of the third axis above the x-y plane of
the base. The component "heading" is the angle of the first axis in the x-y plane."""


TaskName = Literal[
    "pose", "position", "position_pitch", "position_direction", "orientation", "planar"
]
TASKS: Mapping[TaskName, tuple[str, ...]] = {
    "pose": (),
    "position": ("position",),
    "position_pitch": ("position", "pitch"),
    "position_direction": ("position", "direction"),
    "orientation": ("orientation",),
    "planar": ("plane", "heading"),
}
"""The components of each task of `ik_path` and `ik_nearest`. The value () stands for a complete
pose."""


Kind = Annotated[str, one_of(KINDS)]
RoleName = Annotated[str, one_of(ROLES)]
VectorName = Annotated[str, one_of(VECTORS)]
TaskComponent = Annotated[str, one_of(TASK_COMPONENTS)]
Direction = Annotated[int, Check("components of a twist, 0 to 5", lambda index: index <= 5)]  # noqa: PLR2004


@dataclass(frozen=True)
class Role:
    """What a function computes, with its input and output vectors.

    Attributes:
        name: One of ``ROLES``.
        domain: The vector of the first input, one of ``VECTORS``.
        codomain: For a map between coordinate vectors, the output vector, one of ``VECTORS``. A
            derivative of a map has the codomain of the map.
        fixed: Indices in q of the coordinates that an inverse kinematics function takes as inputs
            after the pose. A fixed coordinate is constant during the refinement.
        labels: Branch labels, one for each row of the output. Only inverse kinematics functions,
            and functions that return all loop branches, have branch labels.
        directions: Indices (0 to 5) of twist components (v, omega), one per column of the first
            matrix in a velocity relation.
        components: The task components in the first input of an inverse kinematics function, in
            order. Each component is one of ``TASK_COMPONENTS``. The tuple is empty if the task is a
            complete pose.
        free: Indices in q of the coordinates that the task leaves free. The inverse kinematics
            function sets these coordinates to 0.
        searches: Whether the closed form can miss configurations with joint angles at multiples of
            90 degrees. If `searches` is true and no slot is valid, Newton's method starts from the
            least-squares solutions.
    """

    name: RoleName = field(metadata={"key": "role"})
    domain: VectorName = ""
    codomain: VectorName = ""
    fixed: tuple[int, ...] = ()
    labels: tuple[str, ...] = ()
    directions: tuple[Direction, ...] = ()
    components: tuple[TaskComponent, ...] = ()
    free: tuple[int, ...] = ()
    searches: bool = False

    @property
    def key(self) -> tuple[str, str, str]:
        """The key by which the runtime finds a function: name, domain and codomain."""
        return self.name, self.domain, self.codomain

    @property
    def is_intermediate(self) -> bool:
        """Whether the function is internal."""
        return self.name in INTERMEDIATE

    @property
    def is_inverse(self) -> bool:
        """Whether the function returns an array of solutions with their residuals and margins."""
        return self.name == "inverse"

    @property
    def has_slots(self) -> bool:
        """Whether the first dimension of each result is the number of branches."""
        return self.name in ("inverse", "branches")
