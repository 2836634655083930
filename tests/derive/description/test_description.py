"""Robot files: valid content, and errors for invalid content."""

import pytest
import sympy as sp

from chasles import UnknownRobotError
from chasles.derive import Coupling, DescriptionError, read, read_text
from tests.support.counting import calls_of

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


def test_robot_file_fields_are_read_with_units():
    robot = read_text(ARM)
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
    assert third.direction == -1
    assert robot.couplings == (Coupling("third", (("first", "-1/2"),), sp.pi / 4),)
    assert robot.link_names == ("link1", "carriage", "link3")
    assert (robot.base_frame, robot.tool_frame) == ("w", "ee")
    assert [joint.name for joint in robot.coordinates] == ["first", "second"]


def test_robot_is_independent_of_file_units():
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
    assert read_text(metric) == read_text(same) == read_text(inches)


def test_byte_order_mark_and_windows_line_endings_are_accepted(tmp_path):
    text = 'name = "r"\nconvention = "dh"\njoints = [\n  { a = 1 },\n  { d = 2 },\n]\n'
    path = tmp_path / "r.toml"
    path.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    assert read(path) == read_text(text)


# Each invalid edit of a robot file is a tuple: line number, new line, and field name and text of
# the expected error.
WRONG = [
    (1, 'name = "2nd"', "name", "a letter"),
    (1, "name = 5", "name", "found 5"),
    (1, 'name = "class"', "name", "not a Python keyword"),
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
    (11, "q1 = 300", "parameters.q1", "not a coordinate such as q1"),
    (11, "pi = 3", "parameters.pi", "not one of"),
    (12, 'd2 = { value = 8, unit = "lb" }', "parameters.d2.unit", "one of m, cm, mm, inch"),
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
    (18, "a = []", "joints[1].a", "expected an exact number, got a list"),
    (18, "a = \"__import__('os')\"", "joints[1].a", "expected numbers, pi"),
    (18, 'aa = "a1"', "joints[1].aa", "did you mean 'a'?"),
    (19, "limits = [90, -90]", "joints[1].limits", "a minimum below the maximum"),
    (19, "limits = [1, 2, 3]", "joints[1].limits", "two numbers"),
    (19, 'limits = ["a1", 5]', "joints[1].limits[1]", "a number"),
    (19, "limits = 90", "joints[1].limits", "two numbers"),
    (22, 'name = "first"', "joints[2].name", "a name other than the name of joints[1]"),
    (23, 'type = "sliding"', "joints[2].type", "one of revolute, prismatic"),
    (23, 'type = "helical"', "joints[2]", "advance per radian"),
    (25, 'alpha = "a1"', "joints[2].alpha", "a1 is a length"),
    (25, "alpha = 0.1" + "0" * 70 + "1", "joints[2].alpha", "more than 60 digits"),
    (25, "axis = [0, 0, 1]", "joints[2].axis", "one of the fields"),
    (27, 'link = "link1"', "joints[2].link", "a link other than the link of joints[1]"),
    (32, "pitch = 0.5.1", "", "valid TOML"),
    (33, "direction = 2", "joints[3].direction", "one of 1, -1"),
    (34, 'mimic = { joint = "nobody" }', "joints[3].mimic.joint", "first"),
    (34, 'mimic = { joint = "third" }', "joints[3].mimic.joint", "first"),
    (34, 'mimic = "first"', "joints[3].mimic", "a table"),
    (34, 'mimic = { leader = "first" }', "joints[3].mimic.leader", "one of the fields joint"),
]


@pytest.mark.parametrize(
    ("line", "text", "field", "words"),
    WRONG,
    ids=[f"{field}-{words}" for _, _, field, words in WRONG],
)
def test_invalid_field_error_names_line_and_field(line, text, field, words):
    lines = ARM.splitlines()
    lines[line - 1] = text
    with pytest.raises(DescriptionError) as caught:
        read_text("\n".join(lines), file="arm.toml")
    error = caught.value
    assert error.field.startswith(field)
    assert words in str(error)
    if not text:
        assert (error.line, str(error)[:15]) == (None, "arm.toml: name:")
        return
    # The error about a missing field reports the line of the table that should contain the field.
    expected = 21 if "advance per radian" in words else line
    assert error.line == expected
    assert str(error).startswith(f"arm.toml:{expected}: {field}")


def test_invalid_field_cases_number_at_least_forty():
    assert len(WRONG) >= 40


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "a robot in the file, which is empty"),
        ('name = "r"\nconvention = "dh"\n', "joints"),
        ('name = "r"\nconvention = "dh"\njoints = []\n', "a list of 1 to 256 joints"),
        ('name = "r"\nconvention = "dh"\njoints = [1]\n', "a table"),
        ('name = "r"\nconvention = "dh"\n[[joints]]\ntype = "fixed"\n', "its own coordinate"),
        ('name = "r"\n[[joints]]\n', "convention"),
        ("x = " + "[" * 3000, "brackets"),
        ("x = " + "9" * 5000, "digits"),
        ('name = "r"\nname = "r"\n', "valid TOML"),
        ("\x00", "valid TOML"),
    ],
    ids=[
        "empty",
        "no joints",
        "empty joints",
        "joint not a table",
        "only fixed",
        "no convention",
        "brackets",
        "digits",
        "repeated key",
        "nul",
    ],
)
def test_structurally_invalid_files_are_rejected(text, words):
    with pytest.raises(DescriptionError, match=words):
        read_text(text)


def test_unreadable_files_are_rejected(tmp_path):
    with pytest.raises(DescriptionError, match="a readable file"):
        read(tmp_path / "none.toml")
    with pytest.raises(DescriptionError, match="a readable file"):
        read(tmp_path)
    latin = tmp_path / "latin.toml"
    latin.write_bytes('name = "r"\ntitle = "Gelenkarm für'.encode("latin-1"))
    with pytest.raises(DescriptionError, match=r"latin.toml:2: expected UTF-8 text"):
        read(latin)
    large = tmp_path / "large.toml"
    large.write_bytes(b"#" * 1_000_001)
    with pytest.raises(DescriptionError, match="at most 1000000 bytes"):
        read(large)


HEAD = 'name = "r"\nconvention = "dh"\n'
NESTED = [
    ('[[joints]]\nlimits = [\n  1, # lowest [\n  "x", # highest\n]\n', 6, "joints[1].limits[2]"),
    ("[[joints]]\nlimits = [\n  3,\n  2,\n]\n", 4, "joints[1].limits"),
    ('[[joints]]\n\n[[joints]]\n\n[[joints]]\na = "x"\n', 8, "joints[3].a"),
    ("[[joints]]\nd.a = 1\n", 4, "joints[1].d"),
    ('[[joints]]\n[joints.mimic]\njoint = "j"\nofset = 1\n', 6, "joints[1].mimic.ofset"),
    ("[[joints]]\n[joints.mimic]\noffset = 1\n", 4, "joints[1].mimic.joint"),
    ('[[joints]]\ntype = "helical"\n\n# end\n', 3, "joints[1].pitch"),
    ("joints = [\n  {}, {},\n  3,\n]\n", 5, "joints[3]"),
    ('joints = [{ limits = [\n  1,\n  "x",\n] }]\n', 5, "joints[1].limits[2]"),
    ("joints = [{}, { limits = [1,\n2,\n3] }]\n", 3, "joints[2].limits"),
    ("base = { xyz = [\n0,\n0,\ntrue,\n] }\n", 6, "base.xyz[3]"),
    ('base.rpy = [0,\n"x", 0]\n', 4, "base.rpy[2]"),
    ('base.nmae = "w"\n', 3, "base.nmae"),
    ("[tool]\nxyz = [0, 0, 1]\nrpy = [\n1,\n{}\n,0]\n", 7, "tool.rpy[2]"),
    ("tool = 5\n", 3, "tool"),
    ('[units]\nlength = "m"\nangle = "grad"\n', 5, "units.angle"),
    ('units.length = "mn"\n', 3, "units.length"),
    ('parameters.a1 = "b"\n', 3, "parameters.a1"),
    ('parameters.a1.value = 1\nparameters.a1.unit = "x"\n', 4, "parameters.a1.unit"),
    ('[parameters]\na1 = { value = 1, meaning = "a]" }\na2 = []\n', 5, "parameters.a2"),
    ("[parameters]\na = 1\n[parameters.a2]\n\nvalue = [\n1]\n", 7, "parameters.a2.value"),
    ("[parameters]\na1 = 1\nA1 = 2\nlambda = 3\n", 6, "parameters.lambda"),
    ('title = """\none\ntwo"""\n', 3, "title"),
    ("title = \"\"\"[\"\"\"\nsource = '''{\n[[x]]\n'''\n", 4, "source"),
    ('title = "\u2028 \\" [ { # "\n', 3, "title"),
    ("title = 0x" + "f" * 9000 + "\n", 3, "title"),
    ('title = "a"\r\nsource = 5\r\n', 4, "source"),
    ('\n# name\n\nname2 = "x"\n', 6, "name2"),
    ('"conventions" = "x"\n', 3, "conventions"),
    ('[[joints]]\nname = "j"\n[[joints]]\nlink = "l"\nname = "j"\n', 7, "joints[2].name"),
    ('[[joints]]\nlink = "link2"\n[[joints]]\na = 1\n', 5, "joints[2].link"),
    ('[[joints]]\ntype = "fixed"\n\nlimits = [0, 1]\n', 6, "joints[1].limits"),
    ('[[joints]]\ntype = "prismatic"\npitch = 1\n', 5, "joints[1].pitch"),
    ('[[joints]]\nconvention = "poe"\naxis = [0, 0,\n0]\n', 5, "joints[1].axis"),
    ('[[joints]]\nconvention = "poe"\npoint = [0, 0,\n"x"]\n', 6, "joints[1].point[3]"),
    ('[[joints]]\nconvention = "urdf"\n\nd = 1\n', 6, "joints[1].d"),
]


@pytest.mark.parametrize(("text", "line", "field"), NESTED, ids=[field for _, _, field in NESTED])
def test_error_in_nested_value_names_its_line(text, line, field):
    with pytest.raises(DescriptionError) as caught:
        read_text(HEAD + text + ("" if "joints" in text else "[[joints]]\n"), file="r.toml")
    assert (caught.value.line, caught.value.field) == (line, field)
    assert str(caught.value).startswith(f"r.toml:{line}: {field}: expected ")


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("a = 1\na = 2\n", 4),
        ("[a]\n[b]\n[a]\n", 5),
        ("a = \n", 3),
        ("x = [1,\n2\n", 4),
        ('x = """a\nb', 4),
        ("ok = 1\nx = " + "[" * 3000 + "]" * 3000 + "\n", 4),
        ("ok = 1\nx = " + "9" * 5000 + "\n", 4),
        ("ok = 1\nx = 1e" + "9" * 30 + "\ny = 2", 4),
        ("x = '\x07'\n", 3),
    ],
    ids=[
        "repeated key",
        "repeated table",
        "no value",
        "open list",
        "open text",
        "brackets",
        "digits",
        "exponent",
        "control character",
    ],
)
def test_toml_syntax_error_names_its_line(text, line):
    with pytest.raises(DescriptionError) as caught:
        read_text(HEAD + text)
    assert caught.value.line == line


@pytest.mark.parametrize(
    ("parameters", "value", "words"),
    [
        ("l = 1\nm = 1", "l**2/(l - m)", "division by zero at the parameters' values"),
        ("l = -1\nm = 1", "m*sqrt(l/m)", "not a real number at the parameters' values"),
        ("l = 1\nm = 1e-30", "l*l/m*l/m", "larger than 1e30 at the parameters' values"),
    ],
    ids=["division by zero", "not real", "too large"],
)
def test_expressions_undefined_at_parameter_values_are_rejected(parameters, value, words):
    with pytest.raises(DescriptionError) as caught:
        read_text(f'{HEAD}[parameters]\n{parameters}\n[[joints]]\na = "{value}"\n')
    assert words in str(caught.value)
    assert (caught.value.line, caught.value.field) == (7, "joints[1].a")


def test_unit_check_rarely_divides_by_zero():
    text = (
        f'{HEAD}[parameters]\nl = 1\nr = {{ value = 2, unit = "1" }}\n'
        '[[joints]]\na = "l/(r - %s)"\n'
    )
    count = 0
    for tenths in (*range(20), *range(21, 41)):
        assert read_text(text % f"{tenths / 10}").joints[0].after
        count += 1
    assert count == 40
    with pytest.raises(DescriptionError):
        read_text(text % "8928/10007")


MAX_CALLS_A_CHARACTER = 80
"""Maximum number of function calls of the file reader per character of a file."""


def test_long_files_are_refused_in_linear_time():
    comments = "# a name of joints\n" * 1_000
    parameters = "".join(f"p{k} = {k}\n" for k in range(1_000))
    joints = '[[joints]]\na = "p1"\n' * 255 + '[[joints]]\na = "pp"\n'
    for text, line in (
        (f'{HEAD}{comments}[[joints]]\na = "x"\n', 1_004),
        (f"{HEAD}[parameters]\n{parameters}{joints}", 3 + 1_000 + 512),
        (f"{HEAD}joints = [\n{'{},' * 256}\n3 ]\n", 3),
        (f"{HEAD}[[joints]]\nlimits = [{'1,' * 5_000}]", 4),
    ):
        errors = []

        def attempt(text=text, errors=errors):
            with pytest.raises(DescriptionError) as caught:
                read_text(text)
            errors.append(caught.value)

        assert calls_of(attempt) < MAX_CALLS_A_CHARACTER * len(text)
        assert errors[0].line == line
        assert len(str(errors[0])) < 1000


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('alpha = "tilt + 90"', 'alpha = "pi/2"'),
        ('limits = [-90, "180/2"]', 'limits = ["-pi", "pi"]'),
        ("rpy = [0, 0, 90]", 'rpy = [0, 0, "pi/2"]'),
    ],
    ids=["alpha", "limits", "rpy"],
)
def test_pi_in_degree_fields_is_rejected(old, new):
    with pytest.raises(DescriptionError, match='pi requires the unit "rad"'):
        read_text(ARM.replace(old, new))


@pytest.mark.parametrize("name", ["UR5e", "ur5-e", "ur_5e"])
def test_other_spelling_of_a_robot_name_is_suggested(name):
    with pytest.raises(UnknownRobotError, match=r"did you mean ur5e\?"):
        read(name)


def test_robot_is_read_by_name_and_renamed():
    assert read("irb120", name="mine").name == "mine"


def test_group_for_a_robot_file_is_rejected():
    with pytest.raises(DescriptionError, match=r"group.*files that end in \.urdf.*found 'arm'"):
        read("ur5e", group="arm")


def test_text_of_unknown_format_is_rejected():
    with pytest.raises(DescriptionError, match=r"format.*'toml' or 'urdf'"):
        read_text("", format="mjcf")
