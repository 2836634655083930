"""What an identification says of simulated measurements: nothing, a doubt, or an error."""

from dataclasses import dataclass

from chasles.calibration import identify
from chasles.errors import InputValueError

from .generators.simulated_measurements import Simulated

ACCUSING = (
    *("another robot", "contradict", "is its zero another", "may be wrong", "exchanged", "are off"),
    "times the stated noise",
)
"""Words of doubts about the robot or the measurements; other doubts are about their number."""
TOO_FEW = "do not determine"
MOST_NOISE = 3.0
"""Noise of correct measurements, in parts of the stated one: chance exceeds it with a probability
below 1e-6 for two surplus numbers, and one surplus number is not judged."""
LEAST_SURPLUS = 2


@dataclass(frozen=True)
class Verdict:
    """What is said.

    Attributes:
        accusations: The error, or the doubts about the robot or the measurements.
        doubts: All doubts, also that the numbers are few.
        is_too_few: Whether the numbers are fewer than the variables.
        unexplained: What a correct robot would not have: rows left out, or more noise than stated.
    """

    accusations: tuple[str, ...]
    doubts: tuple[str, ...] = ()
    is_too_few: bool = False
    unexplained: tuple[str, ...] = ()

    @property
    def is_clean(self) -> bool:
        """Whether the robot explains the measurements to the noise, without an accusation."""
        return not (self.accusations or self.unexplained)

    @property
    def is_answered(self) -> bool:
        """Whether the measurements are doubted or refused.

        A few numbers of another robot may fit, with zeros degrees away: the doubt is then that they
        are few.
        """
        return bool(self.accusations or self.doubts)

    @property
    def text(self) -> str:
        """All in a line."""
        return "; ".join((*self.accusations, *self.unexplained))


def verdict(robot, draw: Simulated) -> Verdict:
    """What an identification says of a draw."""
    try:
        found = identify(
            robot, draw.q, draw.observation, vary=draw.vary, tolerances=draw.tolerances
        )
    except InputValueError as error:
        return Verdict((str(error),), is_too_few=TOO_FEW in str(error))
    said = [doubt for doubt in found.doubts if any(word in doubt for word in ACCUSING)]
    unexplained = [f"left out: {label}" for label in found.outliers]
    if found.freedoms > LEAST_SURPLUS and found.noise > MOST_NOISE:
        unexplained.append(f"noise {found.noise:.3g} times the stated one")
    return Verdict(tuple(said), found.doubts, unexplained=tuple(unexplained))
