"""Robot files as in ``tests.support.generators.drawn_arms``, with more oblique angles."""

from tests.support.generators.drawn_arms import Value, drawn

OBLIQUE = 0.5
"""Fraction of angles that are not right angles."""


def round_arm(seed: int) -> str:
    """Return the robot file for a seed."""
    arm = drawn(seed, OBLIQUE)
    lines = [f'name = "arm{seed}"', f'convention = "{arm.convention.name}"']
    for kind, fields in arm.joints:
        lines += ["[[joints]]", f'type = "{kind}"']
        lines += [f"{name} = {_text(value)}" for name, value in fields.items()]
    return "\n".join(lines) + "\n"


def _text(value: Value) -> str:
    return str([str(part) for part in value]) if isinstance(value, tuple) else f'"{value}"'
