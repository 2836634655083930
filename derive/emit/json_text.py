"""Readable JSON: a value that fits into one line is not broken."""

import json
from typing import Any

LINE = 100
"""Characters."""


def json_text(value: Any, depth: int = 0) -> str:
    """Formats plain data as JSON; only values longer than a line are broken.

    Args:
        value: Dictionaries, lists, texts, numbers, booleans and None.
        depth: Indentation in spaces.
    """
    line = json.dumps(value, ensure_ascii=False)
    if len(line) + depth <= LINE or not isinstance(value, dict | list):
        return line
    if isinstance(value, dict):
        parts = [f"{json.dumps(key)}: {json_text(part, depth + 1)}" for key, part in value.items()]
    else:
        parts = [json_text(part, depth + 1) for part in value]
    begin, end = "{}" if isinstance(value, dict) else "[]"
    within = ",\n".join(" " * (depth + 1) + part for part in parts)
    return f"{begin}\n{within}\n{' ' * depth}{end}"
