"""Converts names from other programs to valid C and Python names."""

import keyword
import re

LONGEST_NAME = 60


def identifier(name: str) -> str:
    """Return a valid name for C and Python. The name is short enough for a file name.

    Invalid characters become "_". A name that starts with a digit gets the prefix "x".
    """
    allowed = re.sub(r"[^A-Za-z0-9_]", "_", name)[:LONGEST_NAME]
    if keyword.iskeyword(allowed):
        return f"{allowed}_"
    return allowed if allowed[:1].isalpha() else f"x{allowed}"


def prefix(name: str) -> str:
    """Return a robot name: an identifier without double or trailing underscores."""
    found = re.sub("__+", "_", identifier(name)).rstrip("_")
    return f"x{found}" if keyword.iskeyword(found) else found
