"""Formats lists of names for sentences."""

from collections.abc import Sequence


def listed(names: Sequence[str]) -> str:
    """Join names for a sentence, for example ``a, b and c``."""
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))
