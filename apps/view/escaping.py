"""Escape texts from robot files for Markdown, and for JSON in HTML."""

import json
import string


def markdown(text: str) -> str:
    """Return Markdown that displays a text literally.

    The browser interprets tags and braces as MDX code. Each punctuation mark therefore becomes a
    character reference.
    """
    return "".join(f"&#{ord(c)};" if c in string.punctuation else c for c in text)


def script_json(data: object) -> str:
    """Return JSON that is safe inside a ``<script>`` element."""
    text = json.dumps(data, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
