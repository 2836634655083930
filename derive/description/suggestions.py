"""Suggests a known word for an unknown word in a description."""

import difflib
import re
from collections.abc import Iterable, Mapping

SAME_MEANING: Mapping[str, tuple[str, ...]] = {
    "type": ("kind",),
    "kind": ("type",),
    "revolute": ("pin",),
    "hinge": ("pin", "revolute"),
    "pin": ("revolute",),
    "prismatic": ("slider",),
    "linear": ("slider", "prismatic"),
    "slider": ("prismatic",),
    "spherical": ("ball",),
    "fixed": ("weld",),
    "weld": ("fixed",),
    "floating": ("free",),
    "rotational": ("revolute",),
    "rotary": ("revolute",),
    "continuous": ("revolute",),
    "translational": ("prismatic",),
    "screw": ("helical",),
    "standard": ("dh",),
    "distal": ("dh",),
    "modified": ("mdh",),
    "proximal": ("mdh",),
    "craig": ("mdh",),
    "screws": ("poe",),
    **dict.fromkeys(("meter", "meters", "metre", "metres"), ("m",)),
    **dict.fromkeys(("centimeters", "centimetres"), ("cm",)),
    **dict.fromkeys(("millimeter", "millimeters", "millimetre", "millimetres"), ("mm",)),
    **dict.fromkeys(("in", "inches"), ("inch",)),
    **dict.fromkeys(("degree", "degrees", "°"), ("deg",)),
    **dict.fromkeys(("radian", "radians"), ("rad",)),
}
"""Words that other programs use, in lower case, each with the equivalent words of robot files."""


def hint(word: str, known: Iterable[str]) -> str:
    """Return a suggestion of a similar known word for the end of an error message, or ""."""
    words, lower = list(known), word.lower()
    close = [other for other in (lower, *SAME_MEANING.get(lower, ())) if other in words]
    close = close or difflib.get_close_matches(word, words, n=1)
    return f" (did you mean {close[0]!r}?)" if close else ""


def suggestion(expected: str) -> str:
    """Return the word that ``hint`` suggested in an error, or ""."""
    found = re.search(r"\(did you mean '(.+)'\?\)$", expected)
    return found.group(1) if found else ""
