"""Classifies the warnings and errors of a parameter identification."""

from dataclasses import dataclass

from chasles.calibration import identify
from chasles.errors import InputValueError

from .generators.simulated_measurements import Simulated

ACCUSING = (
    *("another robot", "contradict", "check its zero", "may be wrong", "swapped", "are off"),
    "times the stated noise",
)
"""Phrases in warnings that concern the robot or the measurements."""
TOO_FEW = "measure more configurations"
MAX_NOISE = 3.0
"""Maximum noise of correct measurements, relative to the stated noise."""
MIN_SURPLUS = 2


@dataclass(frozen=True)
class Verdict:
    accusations: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    is_too_few: bool = False
    unexplained: tuple[str, ...] = ()

    @property
    def is_clean(self) -> bool:
        """Test whether the robot model fits the measurements without a warning."""
        return not (self.accusations or self.unexplained)

    @property
    def is_answered(self) -> bool:
        """Test whether the measurements cause a warning or an error.

        If there are only a few measurements, a warning about their small number is sufficient.
        """
        return bool(self.accusations or self.warnings)

    @property
    def text(self) -> str:
        return "; ".join((*self.accusations, *self.unexplained))


def verdict(robot, draw: Simulated) -> Verdict:
    try:
        found = identify(
            robot, draw.q, draw.measurements, vary=draw.vary, parameter_std=draw.parameter_std
        )
    except InputValueError as error:
        return Verdict((str(error),), is_too_few=TOO_FEW in str(error))
    said = [text for text in found.warnings if any(word in text for word in ACCUSING)]
    unexplained = [f"left out: {label}" for label in found.outliers]
    if found.residual_dof > MIN_SURPLUS and found.noise > MAX_NOISE:
        unexplained.append(f"noise {found.noise:.3g} times the stated noise")
    return Verdict(tuple(said), found.warnings, unexplained=tuple(unexplained))
