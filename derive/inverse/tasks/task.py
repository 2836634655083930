"""Tasks of an inverse: the function, its inputs, and how the article prints them."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import sympy as sp

from ...model.robot import SerialRobot
from ...terms.symbolic_function import Argument, SymbolicFunction
from ..steps.work import Work
from ..structure.lines import Lines


@dataclass(frozen=True)
class InputLetter:
    """The form in which the article prints an input's symbol.

    Attributes:
        letters: LaTeX letters in order of preference; a letter that a parameter has is avoided.
        component: The component, 0 to 2, of an input that is a vector.
    """

    letters: tuple[str, ...]
    component: int | None = None


@dataclass(frozen=True)
class TaskInput:
    """An input of a task.

    Attributes:
        argument: Its symbols, shape, unit and meaning.
        printed: The printed form of each symbol: a letter, or the entry of the tool's pose
            that it equals.
    """

    argument: Argument
    printed: tuple[InputLetter | sp.Symbol, ...]


@dataclass(frozen=True)
class Solved:
    """A solved task.

    Attributes:
        function: The function that is generated.
        work: The joints and the steps that found them.
        given: Names of the joints whose values are given.
        inputs: The inputs beside a pose and given joints, with the letters of the article.
    """

    function: SymbolicFunction
    work: Work
    given: tuple[str, ...] = ()
    inputs: tuple[TaskInput, ...] = ()

    @property
    def is_known(self) -> bool:
        """Whether the function's role says what the task asks of the tool's pose."""
        return self.function.role.domain == "pose" or bool(self.function.role.aims)

    def searching(self) -> "Solved":
        """The same task, whose function says that the runtime has to search for lost poses."""
        role = replace(self.function.role, searches=True)
        return replace(self, function=replace(self.function, role=role))


def _always(_robot: SerialRobot, _lines: Lines) -> bool:
    return True


@dataclass(frozen=True)
class Task:
    """A task beside the tool's pose that a family solves for a chain as the file describes it.

    Attributes:
        name: The name of the generated function, ``ik_position``.
        solved: Solves it for a robot and its axes.
        applies: Whether a robot with the family's structure has the task.
    """

    name: str
    solved: Callable[[SerialRobot, Lines], Solved]
    applies: Callable[[SerialRobot, Lines], bool] = _always
