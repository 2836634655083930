"""Inverse-kinematics tasks, with their functions and inputs."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import sympy as sp

from ...model.robot import SerialRobot
from ...terms.symbolic_function import Argument, SymbolicFunction
from ..steps.work import Work
from ..structure.lines import Lines


@dataclass(frozen=True)
class InputLetter:
    """The symbol of a task input in the LaTeX article.

    Attributes:
        letters: LaTeX letters in order of preference. A letter that denotes a robot parameter is
            skipped.
        component: Index (0 to 2) of the component of a vector input, or None for a scalar input.
    """

    letters: tuple[str, ...]
    component: int | None = None


@dataclass(frozen=True)
class TaskInput:
    """An input of a task.

    Attributes:
        argument: Symbols, shape, unit and meaning of the input.
        printed: The form of each input symbol in the LaTeX article: a letter, or the entry of the
            tool pose that equals the symbol.
    """

    argument: Argument
    printed: tuple[InputLetter | sp.Symbol, ...]


@dataclass(frozen=True)
class Solved:
    """A solved task.

    Attributes:
        function: The generated function.
        work: The values of the solved joints, and the solution steps.
        given: Names of the fixed joints.
        inputs: Inputs of the task except the pose and the fixed joints, with their letters in the
            LaTeX article.
    """

    function: SymbolicFunction
    work: Work
    given: tuple[str, ...] = ()
    inputs: tuple[TaskInput, ...] = ()

    @property
    def is_known(self) -> bool:
        """Whether the task states which parts of the pose it prescribes."""
        return self.function.role.domain == "pose" or bool(self.function.role.components)

    def with_search(self) -> "Solved":
        """Return a copy of the task that makes the runtime search for missed solutions."""
        role = replace(self.function.role, searches=True)
        return replace(self, function=replace(self.function, role=role))


def _always(_robot: SerialRobot, _lines: Lines) -> bool:
    return True


@dataclass(frozen=True)
class Task:
    """An additional task that a family solves, such as a position instead of a full pose.

    An additional task applies only to a chain without fixed or added joints.

    Attributes:
        name: The name of the generated function, for example ``ik_position``.
        solved: A function that solves the task for a robot.
        applies: A function that returns whether the task applies to a robot.
        reads_base: Whether this task always numbers the axes from the base, although the function
            ``ik`` may number the axes from the tool.
    """

    name: str
    solved: Callable[[SerialRobot, Lines], Solved]
    applies: Callable[[SerialRobot, Lines], bool] = _always
    reads_base: bool = False
