"""Special characters in the texts of a robot are escaped in Markdown and in scripts."""

import html
import json
import re

from chasles.view.escaping import markdown, script_json

HOSTILE = "</script><!--<script> <iframe srcdoc='x'> {1 + 1} [a](javascript:b) `c` **d** & \\ é"


def test_markdown_shows_hostile_text_as_it_is():
    escaped = markdown(HOSTILE)
    assert re.sub(r"&#\d+;", "", escaped).replace(" ", "").isalnum()
    assert html.unescape(escaped) == HOSTILE


def test_script_holds_hostile_text():
    escaped = script_json({"name": HOSTILE})
    assert not set("<>&") & set(escaped)
    assert json.loads(escaped) == {"name": HOSTILE}
