"""Fills the placeholders of template files."""

from collections.abc import Mapping
from pathlib import Path


def filled(template: Path, values: Mapping[str, str]) -> str:
    """Return the text of a template with its placeholders replaced.

    A placeholder is a name between two at signs, such as ``@robot@``.
    """
    text = template.read_text(encoding="utf-8")
    for name, value in values.items():
        text = text.replace(f"@{name}@", value)
    return text
