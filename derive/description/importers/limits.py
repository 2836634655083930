"""Lists the joints of a file that have no limits."""

from collections.abc import Sequence

from ..toml_file import listed


def without_limits(joints: Sequence[str]) -> tuple[str, ...]:
    """Returns a note on joints without limits, or () if all joints have limits.

    Args:
        joints: Names of the joints that have no limits.
    """
    if not joints:
        return ()
    state = f"joint {joints[0]} states" if len(joints) == 1 else f"joints {listed(joints)} state"
    return (f"{state} no range of limits: taken as unlimited",)
