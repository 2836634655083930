"""What an identification says of simulated measurements: nothing, a warning, or an error."""

from dataclasses import dataclass

from chasles.calibration import identify
from chasles.errors import InputValueError

from .generators.simulated_measurements import Simulated

ACCUSING = (
    *("another robot", "contradict", "is its zero another", "may be wrong", "exchanged", "are off"),
    "times the stated noise",
)
"""Words of warnings about the robot or the measurements; other warnings are about their number."""
TOO_FEW = "do not determine"
MOST_NOISE = 3.0
"""Noise of correct measurements, in parts of the stated one: chance exceeds it with a probability
below 1e-6 for two surplus numbers, and one surplus number is not judged."""
LEAST_SURPLUS = 2


@dataclass(frozen=True)
class Verdict:
    """What is said.

    Attributes:
        accusations: The error, or the warnings about the robot or the measurements.
        warnings: All warnings, also that the numbers are few.
        is_too_few: Whether the numbers are fewer than the variables.
        unexplained: What a correct robot would not have: rows left out, or more noise than stated.
    """

    accusations: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    is_too_few: bool = False
    unexplained: tuple[str, ...] = ()

    @property
    def is_clean(self) -> bool:
        """Whether the robot explains the measurements to the noise, without an accusation."""
        return not (self.accusations or self.unexplained)

    @property
    def is_answered(self) -> bool:
        """Whether the measurements get a warning or an error.

        A few numbers of another robot may fit, with zeros degrees away; the warning then is about
        their number.
        """
        return bool(self.accusations or self.warnings)

    @property
    def text(self) -> str:
        """All in a line."""
        return "; ".join((*self.accusations, *self.unexplained))


def verdict(robot, draw: Simulated) -> Verdict:
    """What an identification says of a draw."""
    try:
        found = identify(
            robot, draw.q, draw.measurements, vary=draw.vary, parameter_std=draw.parameter_std
        )
    except InputValueError as error:
        return Verdict((str(error),), is_too_few=TOO_FEW in str(error))
    said = [text for text in found.warnings if any(word in text for word in ACCUSING)]
    unexplained = [f"left out: {label}" for label in found.outliers]
    if found.residual_dof > LEAST_SURPLUS and found.noise > MOST_NOISE:
        unexplained.append(f"noise {found.noise:.3g} times the stated one")
    return Verdict(tuple(said), found.warnings, unexplained=tuple(unexplained))
