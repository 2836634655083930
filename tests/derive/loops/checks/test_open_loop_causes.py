"""Error messages for an open loop whose cause lies in another loop."""

import re

import pytest

from chasles.derive import LoopError, derive, read_text
from tests.support.loops.loader_arm import LOADER

FRONT = (
    '  { name = "front", parent = "0", link = "front", xyz = [855, 0, 660], axis = [0, -1, 0] },\n'
)
ROD = """
[[rods]]
name = "front"
a = { body = "0", xyz = [855, 0, 660] }
b = { body = "arm", xyz = [402, 0, 0] }
length = 997
"""


def with_rod(length):
    """Returns the loader arm whose front link is a rod."""
    closure, cylinder = LOADER.index("[[closures]]"), LOADER.index("[[cylinders]]")
    text = LOADER[:closure].replace(FRONT, "").replace("front = 142, ", "") + LOADER[cylinder:]
    return text + ROD.replace("997", length)


def message(text):
    """Returns the text of the error for an open loop."""
    with pytest.raises(LoopError) as raised:
        derive(read_text(text), functions=["chain"])
    return str(raised.value)


def test_pin_across_its_loop_is_named_although_another_loop_is_open():
    """The pin closes at the reference, but locks the joints that the cylinder moves."""
    text = message(LOADER.replace(", rpy = [90, 0, 0]", ""))
    assert "the loop of 'lift' does not close" in text
    assert "'pin' locks the joints of its loop: a pin rotates about the z axis" in text
    assert "rotate frame a by rpy = [90, 0, 0] deg and frame b by rpy = [90, 0, 0] deg" in text
    assert "Any one of these" not in text


def test_rod_length_in_wrong_unit_is_named_although_a_cylinder_loop_is_open():
    derive(read_text(with_rod("997")), functions=["chain"])
    text = message(with_rod("0.997"))
    assert "the loop of 'lift' does not close" in text
    assert "length of 'front', 0.997 mm, is suspect: all other lengths are between 402 mm" in text
    assert "and the loops close with 997 mm; check its unit" in text


def test_rod_length_that_no_unit_explains_is_suspect():
    text = message(with_rod("0.35"))
    assert "length of 'front', 0.35 mm, is suspect" in text
    assert "check its unit" not in text


def test_rod_of_usual_length_is_not_suspect():
    assert "suspect" not in message(with_rod("5000"))


def test_error_states_reachable_stroke_after_five_smaller_changes(monkeypatch):
    monkeypatch.setattr("chasles.derive.loops.closing.open_loops.MAX_REMEDIES", 0)
    text = message(LOADER.replace("lift = 765", "lift = 30"))
    (stroke,) = re.findall(r"^    lift, now 30 mm: (\S+) to (\S+) mm$", text, re.M)
    assert [float(end) for end in stroke] == pytest.approx([176.0, 1004.0], abs=1)
    assert text.count("\n") == 1
