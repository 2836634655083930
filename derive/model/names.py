"""Checks the names in robot descriptions, and the fields that allow only certain values."""

import re
from collections.abc import Sequence

from .errors import DescriptionError

OWN_PREFIX = "chasles_"
"""Prefix of the C files that all robots share."""


def check_unique(what: str, names: Sequence[str]) -> None:
    """Raise DescriptionError if two names are equal."""
    known: set[str] = set()
    for name in names:
        if name in known:
            raise DescriptionError(f"two {what}s are called {name!r}; names must differ")
        known.add(name)


def check_name(what: str, name: object) -> None:
    """Raise DescriptionError if a name is not an identifier."""
    if not isinstance(name, str) or not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
        raise DescriptionError(f"{what} {name!r}: expected a name of letters, digits and _")


def check_robot_name(name: object) -> None:
    """Raise an error if a name cannot be the prefix of generated names.

    CasADi does not allow two underscores in succession, and an underscore follows the prefix.
    """
    check_name("robot", name)
    if "__" in f"{name}_":
        raise DescriptionError(
            f"robot {name!r}: expected a name without __ and without a trailing _"
        )
    if f"{name}_".lower().startswith(OWN_PREFIX):
        expected = f"a name that does not start with {OWN_PREFIX}, the prefix of chasles' own files"
        raise DescriptionError(f"robot {name!r}: expected {expected}")


def check_choice(what: str, name: str, value: object, choices: Sequence[object]) -> None:
    """Raise DescriptionError if a value is not among the choices."""
    if value not in choices:
        expected = ", ".join(map(str, choices))
        raise DescriptionError(f"{what} {name!r}: expected one of {expected}, got {value!r}")
