"""Variables of the configuration of a robot with loops."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Variable:
    """A passive joint or a variable of the loop configuration z, with its unit."""

    name: str
    unit: str


@dataclass(frozen=True, slots=True)
class LimitedVariable:
    """A passive joint or cylinder that has limits.

    Attributes:
        index: Index of the joint or cylinder in the configuration vector `z`.
        lower: Lower limit [rad or m], or None.
        upper: Upper limit [rad or m], or None.
        turns: Whether a full turn of the joint leaves the configuration unchanged.
    """

    index: int
    lower: float | None
    upper: float | None
    turns: bool


@dataclass(frozen=True, slots=True)
class ActuatedVariable:
    """The variable z[index] that an actuated coordinate moves: q = z[index] / ratio."""

    index: int
    ratio: float
