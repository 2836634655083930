"""Robot files: what they may say, and what is said of those that are wrong."""

import pytest
import sympy as sp

from chasles.derive import DescriptionError, load, loads

ARM = """\
name = "arm"
title = "An arm"
convention = "dh"
units = { length = "mm", angle = "deg" }

[base]
name = "w"
rpy = [0, 0, 90]

[parameters]
a1 = 300
d2 = { value = "8.05", unit = "cm", meaning = "offset" }
tilt = { value = "pi/6", unit = "rad" }
k = { value = "3/2", unit = "1" }

[[joints]]
name = "first"
a = "a1"
limits = [-90, "180/2"]

[[joints]]
name = "second"
type = "prismatic"
d = "k*d2 + 5"
alpha = "tilt + 90"
limits = [0, 120]
link = "carriage"

[[joints]]
name = "third"
type = "helical"
pitch = "a1/100"
direction = -1
mimic = { joint = "first", multiplier = "-1/2", offset = 45 }
"""


def test_a_whole_file():
    robot = loads(ARM)
    first, second, third = robot.joints
    a1, d2, tilt, k = (parameter.symbol for parameter in robot.parameters)
    values = [parameter.value for parameter in robot.parameters]
    assert values == [sp.Rational(3, 10), sp.Rational(805, 10000), sp.pi / 6, sp.Rational(3, 2)]
    assert [p.kind for p in robot.parameters] == ["length", "length", "angle", "ratio"]
    assert first.limits == (-sp.pi / 2, sp.pi / 2)
    assert first.after[0].vector == (a1, 0, 0)
    assert second.limits == (0, sp.Rational(12, 100))
    assert sp.expand(second.before[0].vector[2] - (k * d2 + sp.Rational(5, 1000))) == 0
    assert sp.expand(second.after[0].angle - tilt - sp.pi / 2) == 0
    assert third.pitch == a1 / 100
    assert (third.direction, third.mimic.multiplier) == (-1, sp.Rational(-1, 2))
    assert third.mimic.offset == sp.pi / 4
    assert robot.link_names == ("link1", "carriage", "link3")
    assert (robot.base_frame, robot.tool_frame) == ("w", "ee")
    assert [joint.name for joint in robot.coordinates] == ["first", "second"]


def test_units_change_the_numbers_and_not_the_robot():
    metric = """\
name = "r"
convention = "mdh"
[[joints]]
a = "0.3"
alpha = "pi/2"
limits = ["-pi", "pi"]
"""
    same = """\
name = "r"
convention = "mdh"
units = { length = "mm", angle = "deg" }
[[joints]]
a = 300
alpha = 90
limits = [-180, 180]
"""
    inches = same.replace('"mm"', '"inch"').replace("300", '"300/25.4"')
    assert loads(metric) == loads(same) == loads(inches)


def test_joints_on_one_line_each_and_windows_line_ends(tmp_path):
    text = 'name = "r"\nconvention = "dh"\njoints = [\n  { a = 1 },\n  { d = 2 },\n]\n'
    path = tmp_path / "r.toml"
    path.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    assert load(path) == loads(text)


# The line of the file to be replaced, what stands there instead, the field that is complained of,
# and words of the complaint.
WRONG = [
    (1, 'name = "2nd"', "name", "a letter"),
    (1, "name = 5", "name", "found 5"),
    (1, 'name = "class"', "name", "no Python keyword"),
    (1, "", "name", "a letter"),
    (2, "title = 5", "title", "one line of text"),
    (2, 'titel = "An arm"', "titel", "did you mean 'title'?"),
    (3, 'convention = "DH"', "convention", "one of dh, mdh"),
    (3, 'convention = "mdh6"', "convention", "did you mean 'mdh'?"),
    (4, 'units = { length = "ft" }', "units.length", "one of m, cm, mm, inch"),
    (4, 'units = { angle = "degree" }', "units.angle", "did you mean 'deg'?"),
    (4, 'units = { mass = "kg" }', "units.mass", "one of the fields length, angle"),
    (4, "units = 5", "units", "a table"),
    (7, 'name = "w o"', "base.name", "letters, digits and _"),
    (8, "rpy = [0, 0]", "base.rpy", "a list of three numbers"),
    (8, 'rpy = [0, 0, "ninety"]', "base.rpy[3]", "unknown parameter 'ninety'"),
    (8, "xzy = [0, 0, 1]", "base.xzy", "did you mean 'xyz'?"),
    (11, 'a1 = "d2"', "parameters.a1", "a number"),
    (11, "a1 = true", "parameters.a1", "a number"),
    (11, "a1 = nan", "parameters.a1", "not a finite number"),
    (11, "a1 = 1e400", "parameters.a1", "larger than 1e30"),
    (11, "q1 = 300", "parameters.q1", "no coordinate such as q1"),
    (11, "pi = 3", "parameters.pi", "none of"),
    (12, 'd2 = { value = 8, unit = "kg" }', "parameters.d2.unit", "one of m, cm, mm, inch"),
    (12, "d2 = { vale = 8 }", "parameters.d2.vale", "did you mean 'value'?"),
    (12, 'd2 = { unit = "cm" }', "parameters.d2.value", "a number"),
    (17, "name = 5", "joints[1].name", "a letter"),
    (18, 'a = "b1"', "joints[1].a", "unknown parameter 'b1'"),
    (18, 'a = "a1 +"', "joints[1].a", "not a number or an expression"),
    (18, 'a = "1/0"', "joints[1].a", "division by zero"),
    (18, 'a = "sqrt(-1)"', "joints[1].a", "not a real number"),
    (18, 'a = "9**9**9"', "joints[1].a", "exponent"),
    (18, 'a = "a1*d2"', "joints[1].a", "a length"),
    (18, 'a = "tilt"', "joints[1].a", "tilt is an angle"),
    (18, "a = []", "joints[1].a", "a list is no exact number"),
    (18, "a = \"__import__('os')\"", "joints[1].a", "not understood"),
    (18, 'aa = "a1"', "joints[1].aa", "did you mean 'a'?"),
    (19, "limits = [90, -90]", "joints[1].limits", "a lowest below the highest"),
    (19, "limits = [1, 2, 3]", "joints[1].limits", "two numbers"),
    (19, 'limits = ["a1", 5]', "joints[1].limits[1]", "a number"),
    (19, "limits = 90", "joints[1].limits", "two numbers"),
    (22, 'name = "first"', "joints[2].name", "another name than joints[1] has"),
    (23, 'type = "sliding"', "joints[2].type", "one of revolute, prismatic"),
    (23, 'type = "helical"', "joints[2]", "advance per radian"),
    (25, 'alpha = "a1"', "joints[2].alpha", "a1 is a length"),
    (25, "axis = [0, 0, 1]", "joints[2].axis", "one of the fields"),
    (27, 'link = "link1"', "joints[2].link", "another link than joints[1] has"),
    (32, "pitch = 0.5.1", "", "valid TOML"),
    (33, "direction = 2", "joints[3].direction", "one of 1, -1"),
    (34, 'mimic = { joint = "nobody" }', "joints[3].mimic.joint", "first"),
    (34, 'mimic = { joint = "third" }', "joints[3].mimic.joint", "first"),
    (34, 'mimic = "first"', "joints[3].mimic", "a table"),
    (34, 'mimic = { leader = "first" }', "joints[3].mimic.leader", "one of the fields joint"),
]


@pytest.mark.parametrize(("line", "text", "field", "words"), WRONG)
def test_a_wrong_line(line, text, field, words):
    lines = ARM.splitlines()
    lines[line - 1] = text
    with pytest.raises(DescriptionError) as caught:
        loads("\n".join(lines), "arm.toml")
    error = caught.value
    assert error.field.startswith(field)
    assert words in str(error)
    assert str(error).startswith("arm.toml:") or error.line is None
    if text and error.line is not None:
        # A field that is missing is looked for in its table, which begins before the line.
        assert error.line == line or line in (12, 23)


def test_enough_wrong_lines():
    assert len(WRONG) >= 40


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "says nothing"),
        ('name = "r"\nconvention = "dh"\n', "joints"),
        ('name = "r"\nconvention = "dh"\njoints = []\n', "a list of 1 to 256 joints"),
        ('name = "r"\nconvention = "dh"\njoints = [1]\n', "a table"),
        ('name = "r"\nconvention = "dh"\n[[joints]]\ntype = "fixed"\n', "moves by itself"),
        ('name = "r"\n[[joints]]\n', "convention"),
        ("x = " + "[" * 3000, "brackets"),
        ("x = " + "9" * 5000, "digits"),
        ('name = "r"\nname = "r"\n', "valid TOML"),
        ("\x00", "valid TOML"),
    ],
)
def test_a_wrong_whole(text, words):
    with pytest.raises(DescriptionError, match=words):
        loads(text)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(DescriptionError, match="a readable file"):
        load(tmp_path / "none.toml")
    with pytest.raises(DescriptionError, match="a readable file"):
        load(tmp_path)
    latin = tmp_path / "latin.toml"
    latin.write_bytes('name = "r"\ntitle = "Gelenkarm für'.encode("latin-1"))
    with pytest.raises(DescriptionError, match=r"latin.toml:2: expected UTF-8 text"):
        load(latin)
    large = tmp_path / "large.toml"
    large.write_bytes(b"#" * 1_000_001)
    with pytest.raises(DescriptionError, match="at most 1000000 bytes"):
        load(large)


def test_the_line_inside_a_list_of_lists():
    text = (
        'name = "r"\nconvention = "dh"\njoints = [\n  { a = 1 },\n  { a = "x" },\n  { d = 1 },\n]\n'
    )
    with pytest.raises(DescriptionError) as caught:
        loads(text)
    assert (caught.value.line, caught.value.field) == (5, "joints[2].a")
