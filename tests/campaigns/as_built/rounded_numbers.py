"""Robots with loops whose dimensions are rounded decimals, half of them on a rotated base.

Each trial rounds the lengths and angles of a shipped robot to 4 to 12 decimal places. The robot
with rounded numbers must have the same closed-form solution steps as the exact robot. The loops of
the rounded robot must close, except for rounding errors.
"""

from dataclasses import dataclass, field

import numpy as np

from chasles.derive import DescriptionError, Mechanism, derive
from chasles.derive.description.cleaned_robot import cleaned
from chasles.derive.terms.casadi_graph import lower
from tests.support.generators.rounded_mechanisms import awkward_turn, rounded
from tests.support.loops.solved import forward, solved
from tests.support.oracles.multi_start import Multistart

from ..bars import barred
from ..campaign import Outcome
from ..loops import with_loops

PLACES = (4, 12)
POSES = 50
AROUND = 0.05
"""Maximum difference of a coordinate from its reference value (radian, or length relative to the
mechanism size)."""
NOISE = 1e-9
"""Closure error caused by rounding and by noise in the numbers of the robot file, relative to the
mechanism size."""
BARS = {"lost": 0, "gap": 10.0}


@dataclass(frozen=True)
class Judged:
    """Error measures of a robot with rounded numbers.

    Attributes:
        lost: 1 if the closed-form solution steps of the exact and the rounded robot differ,
            otherwise 0.
        gap: Largest closure error of the rounded robot, in units of the last decimal place.
        forms: Closed-form solution steps of the robot with exact numbers, and those of the robot
            with rounded numbers.
    """

    lost: int
    gap: float
    forms: tuple[object, object] = field(default=(None, None))


def trial(number: int) -> Outcome:
    rng = np.random.default_rng(number)
    robots = with_loops("**/*.toml")
    design = robots[number // 4 % len(robots)]
    places = int(rng.integers(PLACES[0], PLACES[1] + 1))
    turn = awkward_turn(rng) if rng.random() < 0.5 else ()
    title = f"{design.name}, {places} places{', turned' if turn else ''}"
    try:
        found = judged(design, rounded(design, places, turn), places, rng)
    except DescriptionError as error:
        return Outcome(failures=(f"{title}: {error}",))
    return barred("rounded robots", found, BARS, title)


def judged(design: Mechanism, written: Mechanism, places: int, rng: np.random.Generator) -> Judged:
    """Derive and test a robot with rounded numbers.

    The argument `design` is the mechanism with exact dimensions, and `written` is the mechanism
    with dimensions rounded to `places` decimals.
    """
    robot = cleaned(written)
    forms = _form(design), _form(robot)
    lost = int(forms[0] != forms[1])
    if forward(robot).open:
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
    found = forward(robot)
    steps = tuple(type(step).__name__ for step in found.steps)
    return steps, found.open, () if found.open else solved(robot).backward.open
