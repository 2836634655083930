"""The JSON text of manifests has readable lines and preserves the data."""

import json

from hypothesis import given, settings
from hypothesis import strategies as st

from chasles.derive.emit.manifest import LINE, json_text

TEXT = st.text(st.sampled_from('aZ0 "\\/{}[],:\n\t\x00\x7fé\u2028中\U0001f916'), max_size=6)
"""Texts with quotes, brackets, control characters and characters of one to four bytes."""
LEAVES = st.none() | st.booleans() | st.floats(allow_nan=False) | TEXT | st.integers()
DATA = st.recursive(
    LEAVES, lambda part: st.lists(part) | st.dictionaries(TEXT, part), max_leaves=20
)


@settings(max_examples=40)
@given(DATA)
def test_json_text_round_trips_data(value):
    assert json.loads(json_text(value)) == value


def test_short_values_are_written_on_a_single_line():
    short, long = {"name": "q", "shape": [6]}, [["x" * 40] * 2] * 3
    assert json_text(short) == '{"name": "q", "shape": [6]}'
    lines = json_text({"short": short, "long": long}).split("\n")
    assert lines[1] == ' "short": {"name": "q", "shape": [6]},'
    assert lines[2] == ' "long": ['
    assert all(len(line) <= LINE + 1 for line in lines)
    assert len(lines) == 8
