"""Robot files of :mod:`tests.support.generators.drawn_arms`, with more oblique angles."""

from tests.support.generators.drawn_arms import Value, drawn

OBLIQUE = 0.5
"""Part of the angles that are no right angles: their constants are the longest."""


def round_arm(seed: int) -> str:
    """The text of a robot file, the same for the same seed."""
    arm = drawn(seed, OBLIQUE)
    lines = [f'name = "arm{seed}"', f'convention = "{arm.convention.name}"']
    for kind, fields in arm.joints:
        lines += ["[[joints]]", f'type = "{kind}"']
        lines += [f"{name} = {_text(value)}" for name, value in fields.items()]
    return "\n".join(lines) + "\n"


def _text(value: Value) -> str:
    return str([str(part) for part in value]) if isinstance(value, tuple) else f'"{value}"'
