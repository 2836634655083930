"""Describes a family of chains with a closed-form inverse.

A family is one object in one file, listed in the package's ``__init__``. Classification,
derivation, explanation and article read only the fields of this object, never its name.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from ...model.robot import SerialRobot
from ...terms.symbolic_function import SymbolicFunction
from ..steps.target import Target
from ..steps.work import Work
from ..structure.lines import Lines
from ..structure.requirement import Requirement
from ..tasks.task import Task, TaskInput

Reading = Literal["base", "tool"]
"""The end of the chain from which the axes are numbered."""


def _no_functions(_robot: SerialRobot, _lines: Lines) -> tuple[SymbolicFunction, ...]:
    return ()


@dataclass(frozen=True)
class Family:
    """A structure of axes and its closed-form inverse.

    Attributes:
        title: Description of the structure, for ``chasles explain`` and the article.
        joints: Possible joint counts of a chain in this family.
        requires: Returns the conditions on the axes, with their deviations.
        solve: Solves for all joints for a displacement of the tool, step by step. Each solution
            step has a reason, a degenerate case and an equation, printed by ``chasles explain`` and
            in the article.
        readings: The ends from which the axes may be numbered.
        behind_given: Whether the family is also tested on the free joints of a longer chain whose
            other joints are fixed.
        rather_gives: Whether this family is tested last on a chain with fixed joints, because
            fixing its prismatic joint is preferable.
        solves_pose: Whether the family solves the full tool pose (task ``ik``). Other families of
            axis structures solve only specific tasks, such as the position.
        inputs: Inputs of ``solve`` in addition to the displacement, for example a swivel angle.
        tasks: Tasks in addition to the pose; they require a chain without fixed joints, numbered
            from the base.
        functions: Returns further functions of a chain without fixed joints, for example its swivel
            angle.
        has_couplings: Whether the steps include the couplings of the joints.
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
