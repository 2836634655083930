"""Checks that an argument is an object of the expected class, such as a robot."""

import reprlib
from typing import Any

from .errors import InputTypeError


def check_type(name: str, value: Any, *kinds: type) -> None:
    """Raise an error that names the argument if its value is not an object of the expected class.

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
