"""Methods that a robot has only where it has the generated functions that they rest on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, TypeVar, cast

Method = TypeVar("Method", bound=Callable[..., Any])


class _Mark(Protocol):
    def __call__(self, method: Method, /) -> Method: ...


def needs(*functions: str, when: Callable[[Any], bool] = lambda _: True) -> _Mark:
    """Marks a method: without those functions, the robot says that it has no such attribute.

    Args:
        functions: Names of generated functions, all of which it takes.
        when: What else must hold of the robot.
    """

    def mark(method: Method, /) -> Method:
        return cast(Method, _Offered(method, functions, when))

    return mark


class _Offered:
    def __init__(
        self, method: Callable[..., Any], functions: tuple[str, ...], when: Callable[[Any], bool]
    ) -> None:
        self.method, self.functions, self.when = method, functions, when
        self.__doc__ = method.__doc__

    def __get__(self, robot: Any, owner: type) -> Callable[..., Any]:
        if robot is None:
            return self.method
        if robot.functions.keys() >= {*self.functions} and self.when(robot):
            bound: Callable[..., Any] = self.method.__get__(robot, owner)
            return bound
        # The robot's __getattr__ then says what there is.
        raise AttributeError(self.method.__name__)
