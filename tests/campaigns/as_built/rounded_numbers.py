"""Robots with loops in rounded decimals, half of them on a base at an awkward angle.

A shipped robot is written to 4 to 12 places. Without its exact numbers it must have the same steps
of a closed form, and its closed configurations must close the loops that the decimals describe, up
to the rounding of these decimals.
"""

from dataclasses import dataclass, field

import numpy as np

from chasles.derive import Mechanism, RobotError, derive
from chasles.derive.description.cleaned_robot import cleaned
from chasles.derive.loops.hybrid import Hybrid
from chasles.derive.terms.casadi_graph import lower
from tests.support.generators.rounded_mechanisms import awkward_turn, rounded
from tests.support.oracles.multi_start import Multistart

from ..bars import barred
from ..campaign import Outcome
from ..loops import with_loops

PLACES = (4, 12)
POSES = 50
AROUND = 0.05
"""Distance from the reference: radian, or relative to the size."""
NOISE = 1e-9
"""Gap that rounding of doubles and noise of files leave, relative to the size."""
BARS = {"lost": 0, "gap": 10.0}


@dataclass(frozen=True)
class Judged:
    """The figures of a robot in rounded numbers.

    Attributes:
        lost: 1 if its closed form is not that of the exact numbers.
        gap: Largest gap of its closed configurations in the decimals, in their last places.
        forms: The steps with the exact numbers and with the decimals.
    """

    lost: int
    gap: float
    forms: tuple[object, object] = field(default=(None, None))


def trial(number: int) -> Outcome:
    """Rounds one robot; consecutive trials of this kind take robots in turn."""
    rng = np.random.default_rng(number)
    robots = with_loops("**/*.toml")
    design = robots[number // 4 % len(robots)]
    places = int(rng.integers(PLACES[0], PLACES[1] + 1))
    turn = awkward_turn(rng) if rng.random() < 0.5 else ()
    title = f"{design.name}, {places} places{', turned' if turn else ''}"
    try:
        found = judged(design, rounded(design, places, turn), places, rng)
    except RobotError as error:
        return Outcome(failures=(f"{title}: {error}",))
    return barred("rounded robots", found, BARS, title)


def judged(design: Mechanism, written: Mechanism, places: int, rng: np.random.Generator) -> Judged:
    """Derive and judge a robot in rounded numbers.

    Args:
        design: The robot in exact numbers.
        written: The same robot in decimals.
        places: Places of the decimals.
        rng: Draws the configurations.
    """
    robot = cleaned(written)
    forms = _form(design), _form(robot)
    lost = int(forms[0] != forms[1])
    if Hybrid(robot).forward.open:
        return Judged(lost, 0.0, forms)
    derivation = derive(robot, functions=["configuration"])
    (kernel,) = lower([derivation.function("configuration")], robot.name)
    numbers = Multistart(written)
    scales = np.array([numbers.size if c.unit == "m" else 1.0 for c in robot.coordinates])
    q = derivation.hybrid.q_at_reference + AROUND * scales * rng.uniform(
        -1, 1, (POSES, len(scales))
    )
    z = np.array([np.asarray(kernel(row)).ravel() for row in q])
    z = z[np.isfinite(z).all(1)]
    names = [variable.name for variable in derivation.hybrid.variables]
    gap = numbers.gaps(dict(zip(names, z.T, strict=True))).max()
    rounding = 10.0**-places * max(1.0, 1 / numbers.size)
    return Judged(lost, float(gap / max(rounding, NOISE)), forms)


def _form(robot: Mechanism) -> tuple[object, ...]:
    """The steps from the actuators, and the joints that stay open from either side."""
    hybrid = Hybrid(robot)
    steps = tuple(type(step).__name__ for step in hybrid.forward.steps)
    return steps, hybrid.forward.open, hybrid.backward.open
