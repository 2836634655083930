"""The attributes that depend on the robot: its functions, and methods that rest on them.

A robot lacks a method where it lacks the generated functions behind it. Looking up such a method,
or a function that other robots have, raises an AttributeError that lists the robot's functions and
names a substitute where there is one. The errors come from a class of the robot's own, which holds
a descriptor for each missing name and nothing else: all names that work are looked up as on any
other object, which a `__getattr__` would prevent.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NoReturn, Protocol, TypeVar

from ..errors import MissingFunctionError

T = TypeVar("T")
Hint = Callable[[Any], tuple[str, str]]
"""From a robot to the reason why it lacks an attribute, and to a substitute; both may be empty."""


def always(_: Any) -> bool:
    """The condition that every robot meets."""
    return True


def no_hint(_: Any) -> tuple[str, str]:
    """Neither a reason nor a substitute."""
    return "", ""


@dataclass(frozen=True, slots=True)
class Need:
    """The condition on which a robot has an attribute.

    Attributes:
        functions: Names of the generated functions that the attribute needs.
        when: A further condition on the robot.
        hint: The reason and the substitute for the error.
    """

    functions: tuple[str, ...]
    when: Callable[[Any], bool]
    hint: Hint

    def is_met(self, robot: Any) -> bool:
        """Whether the robot has the attribute."""
        return bool(robot.functions.keys() >= {*self.functions} and self.when(robot))


class _Mark(Protocol):
    def __call__(self, item: T, /) -> T: ...


def needs(*functions: str, when: Callable[[Any], bool] = always, hint: Hint = no_hint) -> _Mark:
    """Marks a method, or the function of a cached property, that rests on generated functions.

    Args:
        functions: Names of the generated functions that it needs.
        when: A further condition on the robot.
        hint: The reason and the substitute for the error.
    """

    def mark(item: T, /) -> T:
        item.need = Need(functions, when, hint)  # type: ignore[attr-defined]
        return item

    return mark


def missing_names(
    robot: Any, functions: Iterable[str], hints: Mapping[str, Hint]
) -> dict[str, Hint]:
    """The attributes that robots can have and this one lacks, each with its hint.

    Args:
        robot: The robot, with its functions and facts in place.
        functions: Names of all functions that robots can have.
        hints: Hints for functions, and for methods that have none of their own.
    """
    missing = {name: hints.get(name, no_hint) for name in functions if name not in robot.functions}
    for parent in type(robot).__mro__:
        for name, item in vars(parent).items():
            # A cached property holds the function that was marked.
            need = getattr(getattr(item, "func", item), "need", None)
            if isinstance(need, Need) and not need.is_met(robot):
                missing[name] = hints.get(name, no_hint) if need.hint is no_hint else need.hint
    return {name: hint for name, hint in missing.items() if name not in robot.functions}


class Missing:
    """A descriptor that raises for an attribute which the robot lacks."""

    def __init__(self, name: str, hint: Hint) -> None:
        """Stores the name and its hint."""
        self.name, self.hint = name, hint

    def __get__(self, robot: Any, owner: type) -> NoReturn:
        """Raises an AttributeError that names substitutes and lists the robot's functions."""
        reason, instead = self.hint(robot)
        message = (
            f"robot {robot.name!r} has no {self.name!r}{': ' * bool(reason)}{reason}"
            f"{'; instead: ' * bool(instead)}{instead}; "
            f"its functions are: {', '.join(robot.functions)}"
        )
        raise MissingFunctionError(message, name=self.name, obj=robot)
