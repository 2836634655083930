"""Texts of robots in the formats of the view; HTML itself is escaped by :func:`html.escape`."""

import json
import string


def markdown(text: str) -> str:
    """Returns Markdown that shows a text as it is.

    The browser reads MDX, which knows tags and braces as code: every punctuation mark becomes a
    character reference.
    """
    return "".join(f"&#{ord(c)};" if c in string.punctuation else c for c in text)


def script_json(data: object) -> str:
    """Returns JSON that a ``<script>`` element can hold, whatever its texts are."""
    text = json.dumps(data, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
