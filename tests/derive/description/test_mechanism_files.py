"""Robot files with loops: fields, errors, and files that extend other files."""

import numpy as np
import pytest
import sympy as sp

from chasles.derive import DescriptionError, Rotation, SerialRobot, read, read_text
from chasles.derive.build import freshness
from chasles.derive.model.mechanism import Closure, Mechanism
from tests.support.loops.closed_in_numbers import Model, pose

# --- fields ---

LOOP = """\
name = "loop"
convention = "urdf"
units = { length = "mm", angle = "deg" }
actuated = ["motor", "jack", "slide"]
tool = { name = "tcp", body = "arm", xyz = [10, 0, 0], rpy = [0, 0, 90] }

[base]
name = "ground"

[parameters]
l = 300
n = { value = "1/50", unit = "1" }

[[joints]]
name = "turn"
link = "arm"
axis = [0, 0, 1]
limits = [-90, 45]

[[joints]]
name = "slide"
parent = "ground"
link = "sled"
type = "prismatic"
axis = [1, 0, 0]

[[joints]]
name = "hinge"
link = "flap"
axis = [0, 0, 1]

[[closures]]
name = "latch"
kind = "slider"
a = { body = "arm", xyz = ["l", 0, 0], rpy = [0, 90, 0] }
b = { body = "flap" }

[[rods]]
name = "stay"
length = "2*l"
a = { body = "ground" }
b = { body = "sled", xyz = [0, 0, 5] }
swing = "lean"

[[cylinders]]
name = "jack"
retracted = "l"
limits = [-100, 50]
a = { body = "ground", xyz = [0, 1, 0] }
b = { body = "flap" }
ends = "ball"

[[drives]]
name = "motor"
joint = "turn"
ratio = "-n"

[reference]
motor = 90
jack = 25
lean = "atan2(l, l)"
"""


def test_mechanism_file_fields_are_read_with_units():
    robot = read_text(LOOP)
    (length,) = (p.symbol for p in robot.parameters if p.name == "l")
    assert isinstance(robot, Mechanism)
    assert robot.bodies == ("ground", "arm", "sled", "flap")
    assert [joint.parent for joint in robot.joints] == ["ground", "ground", "sled"]
    latch, stay, jack = robot.loop_joints
    assert isinstance(latch, Closure)
    assert (latch.kind, latch.a.body, latch.b.body) == ("slider", "arm", "flap")
    assert latch.a.placement[0].vector == (length, 0, 0)
    assert latch.a.placement[1] == Rotation("y", sp.pi / 2)
    assert (stay.length, stay.swing_name, stay.ends) == (2 * length, "lean", "pin")
    assert (jack.is_cylinder, jack.ends, jack.length) == (True, "ball", length)
    assert jack.limits == (sp.Rational(-1, 10), sp.Rational(1, 20))
    motor, extension, slide = robot.coordinates
    assert (motor.kind, motor.moves, motor.unit) == ("revolute", "turn", "rad")
    # The motor rotates by fifty times the joint angle, in the opposite direction.
    assert motor.limits == (-50 * sp.pi / 4, 50 * sp.pi / 2)
    assert (extension.name, extension.unit, slide.unit) == ("jack", "m", "m")
    assert (robot.tool_body, robot.tool_frame, robot.base_frame) == ("arm", "tcp", "ground")
    assert robot.reference_of("motor") == sp.pi / 2
    assert robot.reference_of("jack") == sp.Rational(1, 40)
    assert robot.reference_of("lean") == sp.pi / 4
    assert robot.reference_of("hinge") == 0
    assert robot.passive == ("hinge", "lean")


def test_drive_of_prismatic_joint_takes_a_radius():
    text = LOOP.replace('joint = "turn"\nratio = "-n"', 'joint = "slide"\nradius = "l/10"')
    robot = read_text(text.replace('"jack", "slide"]', '"jack", "turn"]'))
    assert robot.coordinates[0].ratio.xreplace({sp.Symbol("l", real=True): sp.Rational(3, 10)}) == (
        sp.Rational(3, 100)
    )


@pytest.mark.parametrize(
    "signs", ["parent", "closures", "rods", "cylinders", "drives", "actuated", "reference"]
)
def test_loop_fields_make_the_file_a_mechanism(signs):
    serial = 'name = "r"\nconvention = "dh"\n'
    joints = '[[joints]]\nname = "j"\n'
    assert isinstance(read_text(serial + joints), SerialRobot)
    if signs == "actuated":
        assert isinstance(read_text(f'{serial}actuated = ["j"]\n{joints}'), Mechanism)
        return
    text = joints + 'parent = "0"\n' if signs == "parent" else f"{signs} = []\n{joints}"
    with pytest.raises(DescriptionError, match=r"actuated: expected a list of names.*missing"):
        read_text(serial + (text if signs != "reference" else f"reference = {{}}\n{joints}"))


PLATFORM = """\
name = "p"
convention = "urdf"
actuated = ["crank"]
units = { angle = "deg" }
[[joints]]
name = "crank"
axis = [0, 0, 1]
[[joints]]
name = "plate"
type = "%s"
parent = "0"
xyz = [1, 2, 3]
rpy = [0, 0, 90]
link = "top"
"""


def test_planar_joint_expands_into_three_named_joints():
    extra = 'coordinates = ["u", "v", "turn"]\nlimits = [[-1, 1], [-2, 2], [-90, 90]]\n'
    m = Model(read_text(PLATFORM % "planar" + extra))
    assert m.unknown == ["u", "v", "turn"]
    joints = m.mechanism.joints[1:]
    assert [joint.link for joint in joints] == ["plate_u", "plate_v", "top"]
    assert [joint.parent for joint in joints] == ["0", "plate_u", "plate_v"]
    assert [joint.limits for joint in joints] == [(-1, 1), (-2, 2), (-sp.pi / 2, sp.pi / 2)]
    expected = np.array([[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1.0]])
    assert np.allclose(m.tip([0], np.zeros(3)), expected, atol=1e-15)
    c, s = np.cos(0.3), np.sin(0.3)
    step = np.array([[c, -s, 0, 0.5], [s, c, 0, 0.7], [0, 0, 1, 0], [0, 0, 0, 1]])
    assert np.allclose(m.tip([0], np.array([0.5, 0.7, 0.3])), expected @ step, atol=1e-15)


def test_free_joint_expands_into_six_named_joints():
    m = Model(read_text((PLATFORM % "free").replace("rpy = [0, 0, 90]\n", "")))
    assert m.unknown == ["x", "y", "z", "yaw", "pitch", "roll"]
    assert [joint.link for joint in m.mechanism.joints[1:]][-2:] == ["plate_pitch", "top"]

    def turn(axis, angle):
        return pose((Rotation(axis, sp.Rational(angle, 10)),), {})

    T = m.tip([0], np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6]))
    expected = turn("z", 4) @ turn("y", 5) @ turn("x", 6)
    expected[:3, 3] = 1.1, 2.2, 3.3
    assert np.allclose(T, expected, atol=1e-15)


# Each invalid edit of a robot file is a tuple: line number, new line, field that the error names,
# and part of the error message.
WRONG = [
    (4, 'actuated = ["moto", "jack"]', "actuated[1]", "did you mean 'motor'?"),
    (4, 'actuated = ["motor", "turn"]', "actuated[2]", "a joint that motor does not move"),
    (4, "actuated = []", "actuated", "a list of names"),
    (4, 'actuator = ["motor"]', "actuator", "did you mean 'actuated'?"),
    (5, 'tool = { body = "am" }', "tool.body", "did you mean 'arm'?"),
    (5, 'tool = { link = "arm" }', "tool.link", "one of the fields name, body, xyz, rpy"),
    (8, 'name = "arm"', "joints[1].link", "a link other than the link of base"),
    (22, 'parent = "groud"', "joints[2].parent", "did you mean 'ground'?"),
    (22, 'parent = "flap"', "joints[2].parent", "one of ground, arm"),
    (24, 'type = "planer"', "joints[2].type", "did you mean 'planar'?"),
    (24, 'kind = "prismatic"', "joints[2].kind", "did you mean 'type'?"),
    (24, 'type = "slider"', "joints[2].type", "did you mean 'prismatic'?"),
    (
        24,
        'type = "universal"',
        "joints[2].type",
        "this joint consists of two revolute joints in series",
    ),
    (34, 'type = "pin"', "closures[1].type", "did you mean 'kind'?"),
    (30, 'mimics = { joint = "turn" }', "joints[3].mimics", "did you mean 'mimic'?"),
    (33, 'name = "turn"', "closures[1].name", "a name other than the name of joints[1]"),
    (
        34,
        'kind = "hinge"',
        "closures[1].kind",
        "weld (did you mean 'pin'?",
    ),
    (35, 'a = { body = "arms" }', "closures[1].a.body", "did you mean 'arm'?"),
    (35, 'a = { xyz = ["l", 0, 0] }', "closures[1].a.body", "it is missing"),
    (35, 'a = { body = "arm", at = 1 }', "closures[1].a.at", "one of the fields body, xyz, rpy"),
    (35, 'a = "arm"', "closures[1].a", "a table"),
    (
        36,
        'b = { body = "arm" }',
        "closures[1].b.body",
        "a body other than the body of closures[1].a",
    ),
    (39, "nam = 5", "rods[1].nam", "did you mean 'name'?"),
    (40, "length = 0", "rods[1].length", "a length above 0"),
    (40, 'length = "l*l"', "rods[1].length", "a length; with length parameters"),
    (41, 'a = { body = "ground", xyz = [0, 0] }', "rods[1].a.xyz", "a list of three numbers"),
    (43, 'swing = "hinge"', "rods[1].swing", "a name other than the name of joints[3]"),
    (43, 'ends = "pins"', "rods[1].ends", "did you mean 'pin'?"),
    (43, "limits = [0, 1]", "rods[1].limits", "one of the fields name, length"),
    (47, 'retracted = "2*m"', "cylinders[1].retracted", "unknown parameter 'm'"),
    (
        48,
        "limits = [-300, 50]",
        "cylinders[1].limits[1]",
        "a limit that keeps the cylinder length above 0",
    ),
    (48, 'swing = "s"', "cylinders[1].swing", "no swing: a member with a ball"),
    (54, 'name = "jack"', "drives[1].name", "a name other than the name of cylinders[1]"),
    (55, 'joint = "stay"', "drives[1].joint", "one of turn, slide, hinge, jack"),
    (56, "radius = 5", "drives[1].radius", "no radius: turn is revolute"),
    (56, "ratio = 0", "drives[1].ratio", "a nonzero number"),
    (56, "", "drives[1].ratio", "the motion of turn per motor radian"),
    (59, "moto = 90", "reference.moto", "did you mean 'motor'?"),
    (59, "stay = 90", "reference.stay", "a coordinate, a joint or a swing"),
    (60, 'jack = "m"', "reference.jack", "unknown parameter"),
]


@pytest.mark.parametrize(
    ("line", "text", "field", "words"),
    WRONG,
    ids=[f"{field}-{words}" for _, _, field, words in WRONG],
)
def test_invalid_mechanism_field_error_names_line_and_field(line, text, field, words):
    lines = LOOP.splitlines()
    lines[line - 1] = text
    with pytest.raises(DescriptionError) as caught:
        read_text("\n".join(lines), file="loop.toml")
    error = caught.value
    assert (error.field, words in str(error)) == (field, True), str(error)
    assert str(error).startswith(f"loop.toml:{error.line}: {field}: expected ")
    # The error about a missing field reports the line of the table that should contain the field.
    elsewhere = {"joints[1].link": 16, "drives[1].ratio": line if text else 53}
    assert error.line == elsewhere.get(field, line)


def test_invalid_field_cases_number_at_least_thirty():
    assert len(WRONG) >= 30


@pytest.mark.parametrize(
    ("extra", "field", "words"),
    [
        ('coordinates = ["x", "y"]', "joints[2].coordinates", "a list of 3 names"),
        ('coordinates = ["x", "y", "crank"]', "joints[2].coordinates[3]", "a name other than"),
        ('coordinates = ["x", "y", "x"]', "joints[2].coordinates[3]", "a name other than"),
        ("limits = [-1, 1]", "joints[2].limits", "a list of 3 pairs"),
        ("limits = [[-1, 1], [2, -2], [0, 1]]", "joints[2].limits[2]", "a minimum below"),
        ("axis = [0, 0, 1]", "joints[2].axis", "one of the fields name, type, parent"),
    ],
    ids=["few names", "name in use", "repeated name", "one pair", "reversed limits", "axis"],
)
def test_invalid_planar_joint_error_names_line_and_field(extra, field, words):
    with pytest.raises(DescriptionError) as caught:
        read_text(PLATFORM % "planar" + extra, file="p.toml")
    assert (caught.value.field, caught.value.line) == (field, 15)
    assert words in str(caught.value)


@pytest.mark.parametrize("field", ["closures", "rods", "cylinders", "drives"])
def test_mechanism_fields_must_be_lists(field):
    text = f'name = "r"\nconvention = "dh"\nactuated = ["j"]\n{field} = 5\n[[joints]]\nname = "j"\n'
    with pytest.raises(DescriptionError, match=f":4: {field}: expected a list") as caught:
        read_text(text)
    assert caught.value.value == 5


# --- files that extend other files ---

PARENT = """\
name = "short"
title = "Short arm"
source = "our shop"
convention = "dh"
units = { length = "mm" }

[parameters]
l = { value = 300, meaning = "arm" }
h = 20
n = { value = 2, unit = "1" }

[[joints]]
a = "n*l"
d = "h"
"""


def extended(tmp_path, text, parent=PARENT):
    (tmp_path / "short.toml").write_text(parent)
    child = tmp_path / "long.toml"
    child.write_text(text)
    return child


def test_extending_file_overrides_names_and_parameter_values(tmp_path):
    text = (
        'extends = "short.toml"\nname = "long"\ntitle = "Long arm"\n'
        "[parameters]\nl = { value = 450 }\nh = 25\nn = 3\n"
    )
    robot = read(extended(tmp_path, text))
    short = read(tmp_path / "short.toml")
    assert (robot.name, robot.title, robot.source) == ("long", "Long arm", "our shop")
    assert [p.value for p in robot.parameters] == [sp.Rational(9, 20), sp.Rational(1, 40), 3]
    assert [p.kind for p in robot.parameters] == [p.kind for p in short.parameters]
    assert robot.parameters[0].meaning == "arm"
    assert robot.joints == short.joints
    assert [p.value for p in short.parameters] == [sp.Rational(3, 10), sp.Rational(1, 50), 2]


@pytest.mark.parametrize(
    ("text", "line", "field", "words"),
    [
        ('extends = "short.toml"\n', None, "name", "it is missing"),
        ('name = "l"\nextends = 5\n', 2, "extends", "one line of text"),
        ('name = "l"\nextends = "no.toml"\n', 2, "extends", "no.toml: expected a readable file"),
        (
            'name = "l"\nextends = "long.toml"\n',
            2,
            "extends",
            "a file that does not extend another file",
        ),
        ('extends = "short.toml"\nname = "2"\n', 2, "name", "a letter"),
        ('extends = "short.toml"\nname = "l"\njoints = []\n', 3, "joints", "one of the fields"),
        ('extends = "short.toml"\nname = "l"\nparameters = 1\n', 3, "parameters", "a table"),
        (
            'extends = "short.toml"\nname = "l"\n[parameters]\nm = 1\n',
            *(4, "parameters.m", "one of the parameters of"),
        ),
        (
            'extends = "short.toml"\nname = "l"\n[parameters]\nh = { value = 1, unit = "m" }\n',
            *(4, "parameters.h.unit", "one of the fields value"),
        ),
        (
            'extends = "short.toml"\nname = "l"\n[parameters]\n\nl = "x"\n',
            *(5, "parameters.l.value", "a number"),
        ),
        (
            'extends = "short.toml"\nname = "l"\n[parameters]\nl = {}\n',
            *(4, "parameters.l.value", "the parameter's value"),
        ),
    ],
    ids=[
        "no name",
        "number",
        "missing file",
        "itself",
        "bad name",
        "joints",
        "parameters",
        "unknown parameter",
        "unit",
        "not a number",
        "no value",
    ],
)
def test_invalid_extending_file_error_names_line_and_field(tmp_path, text, line, field, words):
    child = extended(tmp_path, text)
    with pytest.raises(DescriptionError) as caught:
        read(child)
    assert (caught.value.line, caught.value.field) == (line, field)
    assert caught.value.file == str(child)
    assert words in str(caught.value)


def test_error_in_extended_file_names_that_file(tmp_path):
    child = extended(tmp_path, 'extends = "short.toml"\nname = "l"\n', PARENT + "alpha = true\n")
    with pytest.raises(DescriptionError, match=r"short.toml:15: joints\[1\].alpha"):
        read(child)


def test_change_of_extended_file_makes_output_stale(tmp_path):
    child = extended(tmp_path, 'extends = "short.toml"\nname = "long"\n')
    folder = tmp_path / "out" / "long"
    folder.mkdir(parents=True)
    job = freshness.Job(child, folder.parent)
    assert not freshness.is_up_to_date(job)
    freshness.stamp(job, folder)
    assert freshness.is_up_to_date(job)
    (tmp_path / "short.toml").write_text(PARENT + "alpha = 1\n")
    assert not freshness.is_up_to_date(job)
    for broken in ('extends = "gone.toml"\n', "extends = 5\n", "extends = \n"):
        child.write_text(broken)
        assert not freshness.is_up_to_date(job)
