"""Checks of arguments."""

import reprlib
from collections.abc import Iterable
from typing import Any

from .errors import InputTypeError


def check_type(name: str, value: Any, *kinds: type) -> None:
    """Raise an error if an argument does not have the expected class.

    Args:
        name: Names of the function and the argument, for the error.
        value: The argument.
        kinds: The expected class, or several classes.

    Raises:
        InputTypeError: The value is not an object of the expected class.
    """
    if not isinstance(value, kinds):
        expected = " or ".join(kind.__name__ for kind in kinds)
        found = " ".join(reprlib.repr(value).split())
        raise InputTypeError(f"{name}: expected a {expected}, got {found}")


def nearest_names(name: str, known: Iterable[str]) -> str:
    """Return the three known names that are most similar to an unknown name."""
    from difflib import get_close_matches  # noqa: PLC0415 - only an error needs difflib

    return ", ".join(get_close_matches(name, [*known], n=3, cutoff=0.0))
