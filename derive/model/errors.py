"""The root of the compiler's errors."""


class RobotError(ValueError):
    """A description that is no robot, or one that cannot be compiled; the message says why."""
