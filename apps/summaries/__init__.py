"""Functions that return short `repr` texts for result objects."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

_FEW = 8
"""Largest array size that is printed in full."""
_LONG = 200
"""Largest field length, in characters, that is printed in full."""


def short_repr(result: Any) -> str:
    """Return the class and fields of a result, without the contents of large arrays."""
    values = ((item.name, getattr(result, item.name)) for item in fields(result) if item.repr)
    inside = ", ".join(f"{name}={_short(value)}" for name, value in values)
    return f"{type(result).__name__}({inside})"


def summary_repr(result: Any, of: str, *facts: str, methods: str = "") -> str:
    """Return the `repr` of a result with its class, robot, key figures and methods."""
    parts = [fact for fact in (*facts, methods) if fact]
    name = type(result).__name__ + (f" of {of}" if of else "")
    return f"<{name}: {'; '.join(parts)}>"


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
