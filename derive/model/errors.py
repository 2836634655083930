"""The root of the compiler's errors."""


class RobotError(ValueError):
    """A description that is no robot, or that cannot be compiled; the message gives the reason."""
