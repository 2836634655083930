"""Test error messages about a loop that cannot close because of another loop."""

import re
from dataclasses import replace

import numpy as np
import pytest

from chasles.derive import LoopError, derive, read, read_text
from chasles.derive.loops.checks.closable import doubts_of, omitted_actuators
from tests.support.derivations import ROBOTS
from tests.support.loops.loader_arm import LOADER
from tests.support.loops.solved import solved

FRONT = (
    '  { name = "front", parent = "0", link = "front", xyz = [855, 0, 660], axis = [0, -1, 0] },\n'
)
OMITTED = LOADER.replace(", lift = 765", "")
ROD = """
[[rods]]
name = "front"
a = { body = "0", xyz = [855, 0, 660] }
b = { body = "arm", xyz = [402, 0, 0] }
length = 997
"""


def with_rod(length):
    """Return the robot file of a loader arm with a rod as its front link."""
    closure, cylinder = LOADER.index("[[closures]]"), LOADER.index("[[cylinders]]")
    text = LOADER[:closure].replace(FRONT, "").replace("front = 142, ", "") + LOADER[cylinder:]
    return text + ROD.replace("997", length)


def message(text):
    with pytest.raises(LoopError) as raised:
        derive(read_text(text), functions=["chain"])
    return str(raised.value)


def test_pin_across_its_loop_is_named_although_another_loop_is_open():
    """The loop of the pin closes at the reference, but the pin locks the joints of the cylinder."""
    text = message(LOADER.replace(", rpy = [90, 0, 0]", ""))
    assert "the loop of 'lift' does not close" in text
    assert "'pin' immobilizes the joints of its loop: a pin rotates about the z axis" in text
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


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ("[30, 150]", "at the reference (lift = 90 mm, the middle of its limits): its ends"),
        ("[300, 500]", "in [reference]; lift started in the middle of the limits"),
    ],
)
def test_error_states_that_an_omitted_cylinder_starts_in_the_middle(limits, words):
    text = OMITTED.replace("[640, 1180]", limits)
    assert words in message(text)


def test_note_compares_an_omitted_cylinder_with_the_stated_joints():
    (note,) = doubts_of(solved(read_text(OMITTED)))
    assert note.startswith("reference: the file omits actuated coordinates, which start in the")
    found = re.search(r"lift = 910 mm \((\S+) mm at the stated joints\)", note).group(1)
    rear, arm = np.radians([135, -142])
    ends = [115 + 890j, 430 + 330j]
    far = ends[0] + np.exp(1j * rear) * (623 + np.exp(1j * arm) * (900 - 130j)) - ends[1]
    assert float(found) == pytest.approx(abs(far), abs=10)


def test_no_note_on_a_complete_or_missing_reference():
    assert omitted_actuators(solved(read_text(LOADER))) == ""
    bare = replace(read(ROBOTS / "five_bar.toml"), reference=())
    assert {c.moves for c in bare.coordinates} <= {*bare.omitted}
    assert omitted_actuators(solved(bare)) == ""
