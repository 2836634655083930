"""The errors of the compiler."""

from chasles.contract.errors import ChaslesError, NotInstalledError

__all__ = ["ChaslesError", "NotInstalledError", "RobotError"]


class RobotError(ChaslesError, ValueError):
    """An invalid description, or one that cannot be compiled; the message gives the reason."""
