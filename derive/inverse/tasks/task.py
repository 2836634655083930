"""Tasks of an inverse: functions, inputs, and the form in which the article prints inputs."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import sympy as sp

from ...model.robot import SerialRobot
from ...terms.symbolic_function import Argument, SymbolicFunction
from ..steps.work import Work
from ..structure.lines import Lines


@dataclass(frozen=True)
class InputLetter:
    """Printed form of an input symbol in the article.

    Attributes:
        letters: LaTeX letters in order of preference; letters that denote robot parameters are
            avoided.
        component: Component index (0 to 2) of a vector input, or None for a scalar.
    """

    letters: tuple[str, ...]
    component: int | None = None


@dataclass(frozen=True)
class TaskInput:
    """An input of a task.

    Attributes:
        argument: Symbols, shape, unit and meaning of the input.
        printed: The printed form of each input symbol: a letter, or the tool-pose entry that equals
            the symbol.
    """

    argument: Argument
    printed: tuple[InputLetter | sp.Symbol, ...]


@dataclass(frozen=True)
class Solved:
    """A solved task.

    Attributes:
        function: The generated function.
        work: The solved joints and their solution steps.
        given: Names of the fixed joints.
        inputs: Inputs other than the pose and the fixed joints, with the letters that the article
            prints.
    """

    function: SymbolicFunction
    work: Work
    given: tuple[str, ...] = ()
    inputs: tuple[TaskInput, ...] = ()

    @property
    def is_known(self) -> bool:
        """Whether the prescribed pose components are known."""
        return self.function.role.domain == "pose" or bool(self.function.role.components)

    def with_search(self) -> "Solved":
        """Returns the task with a flag that makes the runtime search for missed solutions."""
        role = replace(self.function.role, searches=True)
        return replace(self, function=replace(self.function, role=role))


def _always(_robot: SerialRobot, _lines: Lines) -> bool:
    return True


@dataclass(frozen=True)
class Task:
    """A task, other than the tool pose, that a family solves for an unmodified chain.

    Attributes:
        name: The name of the generated function, for example ``ik_position``.
        solved: A function that solves the task for a robot and its axes.
        applies: A function that returns whether the task applies to a robot of the family.
        reads_base: Whether the task numbers the chain from the base even if the family numbers it
            from the tool.
    """

    name: str
    solved: Callable[[SerialRobot, Lines], Solved]
    applies: Callable[[SerialRobot, Lines], bool] = _always
    reads_base: bool = False
