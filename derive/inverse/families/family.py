"""A family of chains with a closed-form inverse, and all that the compiler knows of it.

A family is one object in one file, listed in the package's ``__init__``. Classification,
derivation, explanation and article read the fields of this object and do not know it by name.
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
"""The end of the chain from which its axes are numbered."""


def _no_functions(_robot: SerialRobot, _lines: Lines) -> tuple[SymbolicFunction, ...]:
    return ()


@dataclass(frozen=True)
class Family:
    """A structure of axes and the inverse that follows from it.

    Attributes:
        title: The structure in words, for ``--explain`` and the article.
        joints: The numbers of joints that such a chain can have.
        requires: The conditions on the axes, each with its deviation.
        solve: Finds all joints for a displacement of the tool, step by step. A step carries its
            reason, its degenerate case and its equation, which are its words in ``--explain`` and
            in the article.
        readings: The ends from which the axes may be read to have the structure.
        behind_given: Whether a longer chain may have the structure without its given joints.
        rather_gives: Whether that is tried after all other families: its slide is rather given.
        solves_pose: Whether ``ik`` of a serial robot asks for the tool's pose. A family that meets
            the position alone offers its tasks instead.
        inputs: The inputs of ``solve`` beside the displacement, a swivel angle for example.
        tasks: Tasks beside the pose, for a chain that is read from the base with no joint given.
        functions: Functions that belong to the inverse of such a chain, for example the value of an
            input in a configuration.
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
