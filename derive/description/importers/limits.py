"""Lists the joints of a file that have no limits."""

from collections.abc import Sequence

from ..toml_file import listed


def without_limits(joints: Sequence[str]) -> tuple[str, ...]:
    """Return a note on joints without limits, or () if all joints have limits.

    Args:
        joints: Names of the joints that have no limits.
    """
    if not joints:
        return ()
    if len(joints) == 1:
        return (f"the file states no limits for joint {joints[0]}, which is unlimited",)
    return (f"the file states no limits for joints {listed(joints)}, which are unlimited",)
