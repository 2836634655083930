"""Random serial arms in round numbers, whose axes meet and are parallel by chance."""

import random

from chasles.derive.description.conventions import CONVENTIONS
from chasles.derive.model.convention import Convention, Field

LENGTHS = (*("0",) * 3, *(f"{sign}0.{k}" for sign in ("", "-") for k in range(1, 6)))
ANGLES = (
    *("0", "0", "pi/2", "-pi/2", "pi"),
    *("pi/4", "-pi/4", "3*pi/4", "pi/6", "-pi/6", "pi/3", "-pi/3", "2*pi/3"),
)
AXES = ("[0, 0, 1]", "[0, 1, 0]", "[1, 0, 0]", "[0, 0, -1]", "[0, -1, 0]", "[1, 1, 0]", "[0, 1, 1]")
JOINTS = (2, 8)
SLIDES = 0.2
"""Share of prismatic joints."""


def round_arm(seed: int) -> str:
    """The text of a robot file, the same for the same seed."""
    dice = random.Random(seed)
    convention = dice.choice(CONVENTIONS)
    lines = [f'name = "arm{seed}"', f'convention = "{convention.name}"']
    for _ in range(dice.randint(*JOINTS)):
        lines += ["[[joints]]", *_joint(convention, dice)]
    return "\n".join(lines) + "\n"


def _joint(convention: Convention, dice: random.Random) -> list[str]:
    kind = "prismatic" if dice.random() < SLIDES else "revolute"
    fields = [f"{field.name} = {_value(field, dice)}" for field in convention.fields]
    return [f'type = "{kind}"', *fields]


def _value(field: Field, dice: random.Random) -> str:
    if field.kind == "direction":
        return dice.choice(AXES)
    choices = LENGTHS if field.kind in ("length", "lengths") else ANGLES
    if field.kind in ("length", "angle"):
        return f'"{dice.choice(choices)}"'
    return str([dice.choice(choices) for _ in range(3)])
