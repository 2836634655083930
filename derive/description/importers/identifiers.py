"""Names of links, joints and robots of other programs as names that C and Python allow."""

import keyword
import re

LONGEST_NAME = 60


def identifier(name: str) -> str:
    """A name that C and Python allow, short enough for the name of a file.

    Characters that such names cannot hold become _; a name that begins with a digit gets an x.
    """
    allowed = re.sub(r"[^A-Za-z0-9_]", "_", name)[:LONGEST_NAME]
    if keyword.iskeyword(allowed):
        return f"{allowed}_"
    return allowed if allowed[:1].isalpha() else f"x{allowed}"


def prefix(name: str) -> str:
    """An identifier with single underscores between its parts: the name of a robot."""
    found = re.sub("__+", "_", identifier(name)).rstrip("_")
    return f"x{found}" if keyword.iskeyword(found) else found
