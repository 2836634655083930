"""The base class of the compiler's errors."""

from chasles.contract import ChaslesError


class RobotError(ChaslesError, ValueError):
    """An invalid description, or one that cannot be compiled; the message gives the reason."""
