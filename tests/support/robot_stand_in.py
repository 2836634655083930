"""An object that functions accept in place of a compiled robot."""

from types import SimpleNamespace
from typing import Any

from chasles import Robot


class RobotStandIn(SimpleNamespace):
    """A robot object with attributes, but without compiled functions.

    The function `isinstance` recognizes this object as a `Robot`.
    """

    @property
    def __class__(self) -> Any:
        return Robot
