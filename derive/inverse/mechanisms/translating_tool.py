"""Inverse of a robot as built whose design has a purely translating tool, such as a delta.

The rods of a built delta are not quite parallel, so its platform rotates slightly. Three
coordinates determine the pose as well as the position. The nominal robot is solved for the position
and ignores the orientation; Newton's method then reaches the pose, or only the position.
"""

from dataclasses import replace

from ...loops.hybrid import Hybrid
from ...terms.symbolic_function import Argument, SymbolicFunction, WrittenFunction
from ...terms.vectors import Basis
from ..tasks.partial_poses import POSITION
from ..tasks.slots import POSE_SYMBOLS
from .substitution import substituted

NAME = "ik_position"


def still_axes(design: Hybrid) -> Basis | None:
    """Returns the tool axes if no coordinate rotates the tool, else None."""
    axes, _ = design.kinematics.forward.tool_pose()
    is_still = all(design.terms.is_constant(entry) for axis in axes for entry in axis)
    return axes if is_still else None


def of_position_alone(function: SymbolicFunction, axes: Basis) -> SymbolicFunction:
    """Returns the task ``ik`` of a design without the orientation error in its residual.

    Args:
        function: The task.
        axes: The axes of the tool frame.
    """
    still = {POSE_SYMBOLS[4 * i + j]: axes[j][i] for i in range(3) for j in range(3)}
    outputs = tuple(
        replace(result, entries=substituted(function.terms, result.entries, still))
        for result in function.outputs
    )
    return replace(function, outputs=outputs)


def position_task(polished: WrittenFunction) -> WrittenFunction:
    """Derives the function ``ik_position`` from a refined ``ik`` with position targets.

    Both functions start from the same nominal inverse.
    """
    argument = Argument("p", POSITION, (3,), "m", "position of the tool in the base frame")
    role = replace(polished.role, domain="task", components=("position",))
    return replace(
        polished,
        name=NAME,
        identity="fk(q[k]) has its origin in p wherever residual[k] is rounding",
        inputs=(argument,),
        role=role,
    )
