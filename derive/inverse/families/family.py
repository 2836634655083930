"""Description of a family of chains with a closed-form inverse kinematics function.

Each arm family is one object in its own file. The package's ``__init__`` lists all families. Other
modules use only the fields of the family object, and never test for a particular family.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from ...model.robot import SerialRobot
from ...terms.symbolic_function import SymbolicFunction
from ..coupled_chain import CoupledChain
from ..steps.target import Target
from ..steps.work import Work
from ..structure.lines import Lines
from ..structure.requirement import Requirement
from ..tasks.task import Solved, Task, TaskInput

Reading = Literal["base", "tool"]
"""The end of the chain at which the numbering of axes starts."""


def _no_functions(_robot: SerialRobot, _lines: Lines) -> tuple[SymbolicFunction, ...]:
    return ()


@dataclass(frozen=True, repr=False)
class Family:
    """A structure of axes and its closed-form inverse kinematics function.

    Attributes:
        title: Description of the axis structure, for ``chasles explain`` and the LaTeX article.
        joints: Possible numbers of joints.
        requires: Function that returns the conditions on the axes, and how far the axes deviate
            from each condition.
        solve: Function that solves for all joints step by step, given the displacement of the tool.
            Each solution step has a reason, a degenerate case and an equation for the explanation
            and the LaTeX article.
        readings: The ends of the chain from which the axes may be numbered.
        behind_given: Whether the family may solve the free joints of a longer chain whose other
            joints are fixed.
        rather_gives: Whether a chain with fixed joints is compared with this family only after all
            other families.
        solves_pose: Whether the family solves for the full tool pose (task ``ik``). A family with
            ``solves_pose = False`` solves only parts of the pose, such as the position.
        inputs: Inputs of ``solve`` other than the displacement of the tool, for example a swivel
            angle.
        tasks: Inverse tasks other than ``solve``, available only if no joint is fixed and the axes
            are numbered from the base.
        functions: Function that returns further functions of a chain without fixed joints, such as
            its swivel angle.
        has_couplings: Whether the solution steps already include the couplings between joints.
        coupled_position: Function that returns the inverse task of the hand position, or None if
            couplings do not fix the hand orientation. If a family has no such task,
            ``coupled_position`` itself is None.
    """

    title: str
    joints: tuple[int, ...]
    requires: Callable[[Lines], list[Requirement]]
    solve: Callable[[Work, Lines, Target], None]
    readings: tuple[Reading, ...] = ("base", "tool")
    behind_given: bool = True
    rather_gives: bool = False
    solves_pose: bool = True
    inputs: tuple[TaskInput, ...] = ()
    tasks: tuple[Task, ...] = ()
    functions: Callable[[SerialRobot, Lines], tuple[SymbolicFunction, ...]] = _no_functions
    has_couplings: bool = False
    coupled_position: Callable[[CoupledChain, Lines], Solved | None] | None = None

    def __repr__(self) -> str:
        return f"Family({self.title!r})"
