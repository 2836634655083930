"""The root of the compiler's errors."""

from chasles.contract import ChaslesError


class RobotError(ChaslesError, ValueError):
    """A description that is no robot, or that cannot be compiled; the message gives the reason."""
