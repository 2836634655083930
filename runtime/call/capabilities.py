"""Attributes that some robots lack.

The error message names similar functions and a substitute.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from types import FunctionType
from typing import Any, Protocol, TypeVar

from ..contract import nearest_names
from ..errors import InputTypeError, MissingFunctionError
from .hints import explain, missing_attribute, unknown_keyword

T = TypeVar("T")
Condition = Callable[[Any], bool]


class Capability:
    """A descriptor of an attribute that some robots lack.

    An attribute in the dictionary of the robot instance overrides the descriptor.

    Attributes:
        item: The method or cached property that the descriptor returns. None if the attribute is a
            generated function.
        functions: Names of the generated functions that the attribute needs.
        when: A condition on the robot in addition to ``functions``, or None.
    """

    def __init__(
        self, item: Any, functions: tuple[str, ...] = (), when: Condition | None = None
    ) -> None:
        self.item, self.functions, self.when = item, functions, when

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name
        if self.item is None:
            self.functions, self.__name__ = (name,), name
        elif hasattr(self.item, "__set_name__"):
            self.item.__set_name__(owner, name)

    def is_met(self, robot: Any) -> bool:
        """Test whether the robot has the attribute."""
        has_functions = robot.functions.keys() >= {*self.functions}
        is_met = has_functions and (self.when is None or self.when(robot))
        return bool(is_met or self.name in vars(robot))

    def __get__(self, robot: Any, owner: type) -> Any:
        if robot is None:
            return self.item or self
        if self.is_met(robot):
            return vars(robot).setdefault(self.name, self.item.__get__(robot, owner))
        reason, instead = explain(robot, self.name)
        message = (
            f"robot {robot.name!r} has no {self.name!r}{': ' * bool(reason)}{reason}"
            f"{'; instead: ' * bool(instead)}{instead}; "
            f"nearest functions: {nearest_names(self.name, robot._public)} "
            "(robot.functions lists all)"
        )
        raise MissingFunctionError(message, name=self.name, obj=robot)


class Hint(Capability):
    """An attribute name that no robot has. The error message names the function to use instead."""


class OtherName(Hint):
    """A function name from another library; the error states the chasles function to call."""

    def __get__(self, robot: Any, owner: type) -> Any:
        """Raise an AttributeError."""
        if robot is None:
            return self
        text = missing_attribute(repr(robot.name), self.name, "robot")
        raise MissingFunctionError(text, name=self.name, obj=robot)


class _Mark(Protocol):
    def __call__(self, item: T, /) -> T: ...


def needs(*functions: str, when: Condition | None = None) -> _Mark:
    """Mark a method or cached property that needs generated functions."""

    def mark(item: T, /) -> T:
        checked: Any = _with_hints(item) if isinstance(item, FunctionType) else item
        capability: Any = Capability(checked, functions, when)
        marked: T = capability
        return marked

    return mark


def _with_hints(method: FunctionType) -> Callable[..., Any]:
    code = method.__code__
    known = code.co_varnames[1 : code.co_argcount + code.co_kwonlyargcount]

    @functools.wraps(method)
    def call(robot: Any, *args: Any, **options: Any) -> Any:
        unknown = options.keys() - known if options else ()
        if unknown:
            label = f"{robot.name}.{method.__name__}"
            raise InputTypeError(unknown_keyword(label, min(unknown), known))
        return method(robot, *args, **options)

    return call


def lacks(robot: Any, name: str) -> bool:
    """Test whether a robot lacks an attribute that other robots have."""
    owners = (vars(owner) for owner in type(robot).__mro__)
    item = next((own[name] for own in owners if name in own), None)
    return isinstance(item, Capability) and not item.is_met(robot)
