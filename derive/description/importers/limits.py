"""A note on joints whose limits a file does not state."""

from collections.abc import Sequence

from ..toml_file import listed


def without_limits(joints: Sequence[str]) -> tuple[str, ...]:
    """Return a note on joints that state no limits, or 0 and 0; none without such joints.

    Args:
        joints: Their names.
    """
    if not joints:
        return ()
    state = f"joint {joints[0]} states" if len(joints) == 1 else f"joints {listed(joints)} state"
    return (f"{state} no range of limits: taken as unlimited",)
