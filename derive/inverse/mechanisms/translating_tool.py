"""The inverse of a robot as built whose design keeps the tool from turning, such as a delta's.

As built its platform turns a little, by rods of a pair that are not quite parallel. Three
coordinates hold it in a pose or a position alike: the nominal robot is solved for the position, the
turn of a pose plays no part, and the iteration then reaches the pose, or the position alone.
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
    """The axes of a tool that no coordinate turns; None where one does."""
    axes, _ = design.kinematics.forward.tool_pose()
    is_still = all(design.terms.is_constant(entry) for axis in axes for entry in axis)
    return axes if is_still else None


def of_position_alone(function: SymbolicFunction, axes: Basis) -> SymbolicFunction:
    """The task ``ik`` of a design, of which the turn of the pose plays no part.

    Args:
        function: The task.
        axes: The axes of the tool.
    """
    still = {POSE_SYMBOLS[4 * i + j]: axes[j][i] for i in range(3) for j in range(3)}
    outputs = tuple(
        replace(result, entries=substituted(function.terms, result.entries, still))
        for result in function.outputs
    )
    return replace(function, outputs=outputs)


def position_task(polished: WrittenFunction) -> WrittenFunction:
    """The function ``ik_position``, from the function ``ik`` that is led to positions.

    Its C starts from the same nominal inverse.
    """
    argument = Argument("p", POSITION, (3,), "m", "position of the tool in the base frame")
    role = replace(polished.role, domain="task", aims=("position",))
    return replace(
        polished,
        name=NAME,
        identity="fk(q[k]) has its origin in p wherever residual[k] is rounding",
        inputs=(argument,),
        role=role,
    )
