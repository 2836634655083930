"""Short texts for `repr` of a result: facts in words, arrays by their shape."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

_FEW = 8
"""Numbers of an array up to which they are written out."""
_LONG = 200
"""Characters of a field up to which it is written out."""
_AXES = "xyz"


def short_repr(result: Any) -> str:
    """A dataclass by its fields: arrays of more than a few numbers by their shape.

    A class takes it as its own: ``__repr__ = short_repr``.
    """
    values = ((item.name, getattr(result, item.name)) for item in fields(result) if item.repr)
    inside = ", ".join(f"{name}={_short(value)}" for name, value in values)
    return f"{type(result).__name__}({inside})"


def summary_repr(result: Any, of: str, *facts: str, methods: str = "") -> str:
    """The `repr` of a result: its class, the robot that it belongs to, facts and methods.

    Args:
        result: The result.
        of: What it belongs to, a robot's name as a rule; "" for nothing.
        facts: Facts in words; empty ones are left out.
        methods: Attributes and methods that lead on.
    """
    parts = [fact for fact in (*facts, methods) if fact]
    name = type(result).__name__ + (f" of {of}" if of else "")
    return f"<{name}: {'; '.join(parts)}>"


def ranges(extents: Any) -> str:
    """Extents (2, k) in words: x from a to b, y from c to d."""
    spans = zip(_AXES, np.asarray(extents).T, strict=False)
    return ", ".join(f"{axis} {low:.4g} to {high:.4g}" for axis, (low, high) in spans) + " m"


def _short(value: Any) -> str:
    if isinstance(value, np.ndarray):
        if value.size > _FEW or value.ndim > 1:
            return f"{value.dtype} {value.shape}"
        return np.array2string(value, precision=6, separator=", ")
    if hasattr(value, "coordinates") and hasattr(value, "digest"):
        return str(value.name)
    if isinstance(value, tuple | list | dict | str):
        text = repr(value) if isinstance(value, str) else _short_items(value)
        return text if len(text) <= _LONG else f"{len(value)} of {type(value).__name__}"
    return repr(value)


def _short_items(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key!r}: {_short(item)}" for key, item in value.items()) + "}"
    inside = ", ".join(_short(item) for item in value)
    if hasattr(value, "_fields"):
        pairs = zip(value._fields, value, strict=True)
        return f"{type(value).__name__}({', '.join(f'{k}={_short(v)}' for k, v in pairs)})"
    return f"[{inside}]" if isinstance(value, list) else f"({inside})"
