"""The check reports all errors of a robot file.

The check does not report errors that are only consequences of other errors.
"""

import json
import re

import pytest

from chasles.derive import DescriptionError, check, read
from tests.support.command_line import run

SERIAL = """\
name = "bad_arm"
convention = "DH"
units = { length = "meters", angle = "degrees" }
colour = "red"

[parameters]
a2 = "x+1"
2d = 0.5

[[joints]]
name = "one"
alfa = 90
d = "2d"
type = "rotational"

[[joints]]
name = "one"
a = "a2"
limits = [3]

[[joints]]
name = "three"
d = true
mimic = { joint = "nobody" }

[[joints]]
type = "hellical"
a = "unknown1 + 2"
"""
SERIAL_ERRORS = {
    2: ["convention"],
    3: ["units.angle", "units.length"],
    4: ["colour"],
    7: ["parameters.a2"],
    8: ["parameters.2d"],
    12: ["joints[1].alfa"],
    14: ["joints[1].type"],
    17: ["joints[2].name"],
    19: ["joints[2].limits"],
    23: ["joints[3].d"],
    24: ["joints[3].mimic.joint"],
    26: ["joints[4].pitch"],
    27: ["joints[4].type"],
    28: ["joints[4].a"],
}
LOOPS = """\
name = "rods"
convention = "dh"
actuated = ["crank"]

[[joints]]
name = "crank"
parent = "0"
a = 1

[[joints]]
name = "rocker"
parrent = "0"
a = "1 m"

[[rods]]
name = "coupler"
length = -1
a = { body = "link1" }
b = { body = "link3" }

[reference]
crnk = 1
"""
LOOP_ERRORS = {
    12: ["joints[2].parrent"],
    13: ["joints[2].a"],
    17: ["rods[1].length"],
    19: ["rods[1].b.body"],
    22: ["reference.crnk"],
}


def found(path) -> dict[int, list[str]]:
    fields: dict[int, list[str]] = {}
    for finding in check(path):
        assert finding.severity == "error", finding
        line, field = finding.where.removeprefix(f"{path}:").split(": ")
        fields.setdefault(int(line), []).append(field)
    return {line: sorted(names) for line, names in fields.items()}


@pytest.mark.parametrize(
    ("text", "errors"), [(SERIAL, SERIAL_ERRORS), (LOOPS, LOOP_ERRORS)], ids=["serial", "loops"]
)
def test_all_errors_are_reported_with_their_lines(tmp_path, text, errors):
    path = tmp_path / "arm.toml"
    path.write_text(text)
    assert found(path) == errors


def test_words_of_other_programs_are_suggested(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(SERIAL)
    text = "\n".join(map(str, check(path)))
    for word in ("dh", "m", "deg", "revolute", "alpha", "helical"):
        assert f"did you mean '{word}'?" in text


def test_suggested_word_that_the_table_has_is_no_second_error(tmp_path):
    path = tmp_path / "arm.toml"
    joint = '[[joints]]\nname = "one"\na = 1\n'
    path.write_text(f'name = "arm"\nconvention = "dh"\ntitel = "an arm"\ntitle = "Arm"\n{joint}')
    (finding,) = check(path)
    assert "did you mean 'title'?" in finding.message
    path.write_text(path.read_text() + "alfa = 1\nalpha = 1\nd = true\n")
    assert found(path) == {3: ["titel"], 8: ["joints[1].alfa"], 10: ["joints[1].d"]}


def test_first_error_is_the_error_of_the_reader(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(SERIAL)
    with pytest.raises(DescriptionError) as error:
        read(path)
    assert str(error.value) in map(str, check(path))


def test_check_states_that_it_ended_early(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text('name = "arm"\nconvention = "own"\n[[joints]]\nb = 1\n')
    error, note = check(path)
    assert error.where == f"{path}:2: convention"
    assert note.severity == "note"
    assert "ended early" in note.message


@pytest.mark.parametrize("name", ["panda", "four_bar"])
def test_valid_robots_have_no_errors(name):
    assert all(finding.severity != "error" for finding in check(name))


def test_rounded_numbers_are_notes(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text('name = "arm"\nconvention = "dh"\n[[joints]]\na = 0.3\nalpha = 1.5708\n')
    findings = check(path)
    assert {finding.severity for finding in findings} == {"note"}
    assert any("1.5708" in finding.message for finding in findings)


def test_urdf_error_is_reported(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text('<robot name="arm"><link name="a"/><joint name="j" type="revolut"/></robot>')
    (finding,) = check(path)
    assert finding.severity == "error"
    assert finding.where.startswith(str(path))


def test_command_prints_findings_and_fails(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(SERIAL)
    done = run("check", path, "panda")
    assert done.exit_code == 1
    assert done.stderr.count(str(path)) == sum(map(len, SERIAL_ERRORS.values()))
    assert "no errors" in done.output
    done = run("check", path, "--json")
    assert done.exit_code == 1
    assert {row["severity"] for row in json.loads(done.stdout)} == {"error"}
    assert run("check", "ur5e").exit_code == 0


BOOM = """\
name = "boom"
convention = "urdf"
actuated = ["jack"]
units = { length = "mm", angle = "deg" }

[[joints]]
name = "boom"
axis = [0, 0, 1]

[[cylinders]]
name = "jack"
limits = [800, LONGEST]
a = { body = "0", xyz = [0, -600, 0] }
b = { body = "link1", xyz = [500, 0, 0] }

[reference]
boom = 45
jack = JACK
"""


@pytest.mark.parametrize(
    ("jack", "limits", "severity", "message"),
    [
        ("jack = 1500", "[800, 1000]", "error", "does not close at the reference"),
        ("jack = 900", "[800, 1400]", "note", "limits of jack, .* close from 800 to 1100 mm"),
        ("", "[]", "error", r"does not close at the reference \(jack = 0 mm\)"),
    ],
)
def test_loops_are_checked_at_reference(tmp_path, jack, limits, severity, message):
    path = tmp_path / "boom.toml"
    text = BOOM.replace("jack = JACK", jack).replace("[800, LONGEST]", limits)
    path.write_text(text.replace("limits = []\n", ""))
    (found,) = (finding for finding in check(path) if re.search(message, finding.message))
    assert (found.severity, found.where) == (severity, str(path))
