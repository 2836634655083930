"""Cleaning of robot files with rounded values: list of changes, error bound and unit warnings."""

import random

import mpmath
import numpy as np
import pytest
import sympy as sp

from chasles.derive import DescriptionError, read, read_text
from chasles.derive.description.conventions import CONVENTIONS
from chasles.derive.description.pose_error import pose_error
from chasles.derive.model.cleaning import places
from chasles.derive.model.placements import Rotation
from tests.support.command_line import run

R = sp.Rational
ARM = """\
name = "arm"
convention = "dh"

[parameters]
d1 = "0.20249999999999999"
twist = {{ value = "1.5708", unit = "rad" }}

[tool]
xyz = [0, "6.1e-17", "0.1"]
rpy = [0, "-1.571", 0]

[[joints]]
name = "turn"
d = "d1"
alpha = "twist"
limits = [-3.1415, 3.1415]

[[joints]]
name = "bend"
a = "0.4"
alpha = "3.1416"
theta = "{theta}"
"""


def numbers(robot):
    return {places([number]): (number.found, number.taken) for number in robot.cleaning.numbers}


def test_noise_removal_lists_all_changes_and_stores_exact_numbers():
    text = ARM.format(theta="0.3")
    robot = read_text(text)
    assert numbers(robot) == {
        "parameter d1": (R("0.20249999999999999"), R("0.2025")),
        "parameter twist": (R("1.5708"), sp.pi / 2),
        "alpha of bend": (R("3.1416"), sp.pi),
        "y of tool": (R("6.1e-17"), 0),
        "pitch of tool": (R("-1.571"), -sp.pi / 2),
    }
    turn, bend = robot.joints
    assert turn.limits == (R("-3.1415"), R("3.1415"))
    assert dict(bend.given)["alpha"] == sp.pi == bend.after[-1].angle
    assert [p.value for p in robot.parameters] == [R("0.2025"), sp.pi / 2]
    assert robot.tool[0].vector == (0, 0, R("0.1"))
    assert robot.notes[0] == robot.cleaning.line
    assert robot.notes[1:] == (
        "1.5708 interpreted as pi/2: parameter twist",
        "3.1416 interpreted as pi: alpha of bend",
        "-1.571 interpreted as -pi/2: pitch of tool",
    )


LONG = """\
<robot name="long"><link name="base"/><link name="boom"/><link name="tool0"/>
<joint name="turn" type="continuous"><parent link="base"/><child link="boom"/>
<origin xyz="0 0 0.5" rpy="{angle} 0 0"/><axis xyz="0 0 1"/></joint>
<joint name="mount" type="fixed"><parent link="boom"/><child link="tool0"/>
<origin xyz="{length} 0 0"/></joint></robot>
"""


LONG_TOML = """\
name = "long"
convention = "dh"
joints = [{ alpha = "1.57" }, { a = 2 }]
"""


def test_large_effect_of_noise_removal_is_a_warning_that_names_the_option(tmp_path):
    path = tmp_path / "long.urdf"
    path.write_text(LONG.format(angle="1.57", length=2))
    words = (
        r"move the tool by up to 0\.\d+ m and .*1\.57 interpreted as pi/2.*; --exact, or exact=True"
    )
    for reader in (read, lambda _: read_text(LONG_TOML)):
        with pytest.warns(UserWarning, match=words):
            robot = reader(path)
        assert robot.cleaning.position > 5e-4
    assert read(path, exact=True).cleaning.warning == ""


@pytest.mark.parametrize(("angle", "length"), [("1.57", 0.5), ("1.5708", 100)])
def test_small_effect_of_noise_removal_is_a_note(tmp_path, angle, length):
    path = tmp_path / "long.urdf"
    path.write_text(LONG.format(angle=angle, length=length))
    robot = read(path)
    assert robot.cleaning.warning == ""
    assert f"{angle} interpreted as pi/2: roll of turn" in robot.notes


@pytest.mark.parametrize(
    "words",
    [("explain",), ("explain", "--conventions"), ("derive", "--to", "out", "--functions", "fk")],
    ids=" ".join,
)
def test_command_line_warns_on_standard_error(tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "long.urdf"
    path.write_text(LONG.format(angle="1.57", length=2))
    done = run(*words, path)
    assert done.exit_code == 0
    assert done.stderr.startswith(
        f"warning: {path}: exact values for rounded numbers move the tool"
    )
    assert "--exact" in done.stderr
    assert "warning" not in done.stdout
    assert run(*words, path, "--exact").stderr == ""


def test_exact_files_and_exact_option_keep_numbers_as_written():
    text = ARM.format(theta="0.3")
    as_written = read_text(text, exact=True)
    assert as_written.cleaning.numbers == as_written.notes == ()
    assert [p.value for p in as_written.parameters] == [R("0.20249999999999999"), R("1.5708")]
    exact = text.replace('"1.5708"', '"pi/2"').replace('"-1.571"', '"-pi/2"')
    exact = exact.replace('"3.1416"', '"pi"').replace('"6.1e-17"', "0")
    exact = exact.replace("0.20249999999999999", "0.2025")
    assert read_text(exact) == read_text(exact, exact=True)
    assert repr(read_text(exact)) == repr(read_text(text)).replace(
        repr(read_text(text).notes), "()"
    )


def test_equal_numbers_are_snapped_alike_in_every_field():
    robot = read_text(ARM.format(theta="3.1416"))
    assert dict(robot.joints[1].given)["theta"] == dict(robot.joints[1].given)["alpha"] == sp.pi
    assert "3.1416 interpreted as pi: alpha, theta of bend" in robot.notes


VALUES = ("0", "1.5708", "-1.571", "3.1416", "0.7854", "0.3", "-1.2", "1.57079632", "2e-10")
LENGTHS = ("0", "0.4", "-0.25", "0.1250000004", "3e-10", "0.07")
AXES = ("[0, 0, 1]", '[0, "2e-10", 1]', '["0.866", 0, "0.5"]', '["0.707", "-0.5", "0.5"]')


def random_file(dice):
    """Return the robot file of a random arm with two to six joints and rounded values."""
    parts = ['name = "random"', 'convention = "dh"']
    for _ in range(dice.randint(2, 6)):
        convention = dice.choice(CONVENTIONS)
        kind = dice.choice(("revolute", "revolute", "prismatic", "fixed"))
        parts += ["[[joints]]", f'type = "{kind}"', f'convention = "{convention.name}"']
        if kind == "prismatic":
            parts.append("limits = [-0.5, 0.75]")
        for field in convention.fields:
            if field.kind == "direction":
                value = dice.choice(AXES)
            else:
                known = VALUES if "angle" in field.kind else LENGTHS
                drawn = [f'"{dice.choice(known)}"' for _ in field.components]
                value = f"[{', '.join(drawn)}]" if field.is_vector else drawn[0]
            parts.append(f"{field.name} = {value}")
    return "\n".join([*parts, "[[joints]]", 'd = "0.2"'])


def pose(robot, q):
    T = mpmath.eye(4)
    values = iter(q)
    for joint in robot.joints:
        motions = [*joint.before]
        if joint.kind == "revolute":
            motions.append(Rotation("z", R(next(values))))
        T = T * of(motions)
        if joint.kind == "prismatic":
            step = mpmath.eye(4)
            step[2, 3] = next(values)
            T = T * step
        T = T * of(joint.after)
    return T * of(robot.tool)


def of(motions):
    T = mpmath.eye(4)
    for motion in motions:
        step = mpmath.eye(4)
        if isinstance(motion, Rotation):
            angle = mpmath.mpmathify(sp.N(motion.angle, 30))
            j, k = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[motion.axis]
            step[j, j] = step[k, k] = mpmath.cos(angle)
            step[k, j], step[j, k] = mpmath.sin(angle), -mpmath.sin(angle)
        else:
            for i in range(3):
                step[i, 3] = mpmath.mpmathify(sp.N(motion.vector[i], 30))
        T = T * step
    return T


def distances(one, other):
    turned = mpmath.norm(list(one[:3, :3] - other[:3, :3])) / mpmath.sqrt(8)
    return mpmath.norm(one[:3, 3] - other[:3, 3]), 2 * mpmath.asin(turned)


@pytest.mark.filterwarnings("ignore:.*exact values for rounded:UserWarning")
def test_pose_error_bound_holds_and_is_tight_in_every_convention():
    shares, conventions = [], set()
    with mpmath.workdps(30):
        for seed in range(9):
            dice = random.Random(seed)
            text = random_file(dice)
            robot, written = read_text(text), read_text(text, exact=True)
            if not robot.cleaning.numbers:
                assert repr(robot.joints) == repr(written.joints)
                continue
            bounds = robot.cleaning.position, robot.cleaning.orientation
            worst = [0.0, 0.0]
            for _ in range(3):
                q = [
                    dice.uniform(-0.5, 0.75) if joint.kind == "prismatic" else dice.uniform(-3, 3)
                    for joint in robot.coordinates
                ]
                found = distances(pose(robot, q), pose(written, q))
                worst = [max(a, float(b)) for a, b in zip(worst, found, strict=True)]
            for found, bound in zip(worst, bounds, strict=True):
                assert found <= bound * (1 + 1e-12), (seed, found, bound)
            shares.append(worst[0] / bounds[0] if bounds[0] else 1)
            conventions |= {joint.convention.name for joint in robot.joints}
    assert len(shares) > 4
    assert conventions == {convention.name for convention in CONVENTIONS}
    # The bound on the pose error has the right order of magnitude, although the errors due to
    # single rounded values rarely add up.
    assert np.median(shares) > 0.2


def test_equal_robots_have_no_pose_error():
    robot = read_text(ARM.format(theta="0.3"))
    assert pose_error(robot, robot) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('theta = "0.3"', "theta = -90", "joints[2].theta: expected an angle of at most 6.5 rad"),
        ('theta = "0.3"', "theta = -90", 'units = { angle = "deg" }'),
        ('a = "0.4"', "a = 290", "<text>:20: joints[2].a: expected a length of at most 20 m"),
        ('a = "0.4"', "a = 290", 'units = { length = "mm" }, or "m" to keep this value'),
        ('"0.20249999999999999"', "290", "parameters.d1: expected a length of at most 20 m"),
    ],
    ids=["angle", "angle hint", "length", "length hint", "parameter"],
)
def test_implausible_numbers_without_stated_unit_are_rejected(old, new, words):
    text = ARM.format(theta="0.3")
    assert old in text
    with pytest.raises(DescriptionError) as caught:
        read_text(text.replace(old, new))
    assert words in str(caught.value)


@pytest.mark.filterwarnings("ignore:.*exact values for rounded:UserWarning")
def test_stated_unit_allows_implausible_lengths():
    text = ARM.format(theta="0.3").replace('a = "0.4"', "a = 2900")
    stated = text.replace("[parameters]", 'units = { length = "m" }\n[parameters]')
    assert dict(read_text(stated).joints[1].given)["a"] == 2900
    small = stated.replace('"m"', '"mm"').replace("2900", '"0.0029"')
    assert dict(read_text(small).joints[1].given)["a"] == R("2.9e-6")


URDF = """\
<robot name="r"><link name="a"/><link name="b"/><link name="c"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/>
<origin xyz="{x} 0 0" rpy="0 0 {yaw}"/><axis xyz="0 0 1"/></joint>
<joint name="k" type="fixed"><parent link="b"/><child link="c"/>
<origin xyz="{x} 0 0"/></joint></robot>
"""


def test_urdf_limits_that_look_like_degrees_get_a_note(tmp_path):
    path, asked = tmp_path / "r.urdf", "joint j: limits of -180 and 180 rad: are they in degrees?"
    for limit, notes in (("3.1", ()), ("180", (asked,))):
        text = URDF.format(x="0.3", yaw="0").replace("continuous", "revolute")
        path.write_text(text.replace("<axis", f'<limit lower="-{limit}" upper="{limit}"/><axis'))
        assert read(path).notes == notes


@pytest.mark.parametrize(
    ("x", "yaw", "notes"),
    [
        ("0.29", "1.2", ()),
        ("290", "1.2", ("a length of 290 m: is the file in millimeters?",)),
        ("0.29", "90", ("joint j: an angle of 90 rad: is it in degrees?",)),
        ("2e-4", "1.2", ("all lengths together are 0.0004 m: are they in another unit?",)),
    ],
    ids=["plausible", "millimeters", "degrees", "tiny"],
)
def test_implausible_urdf_lengths_and_angles_get_a_note(tmp_path, x, yaw, notes):
    path = tmp_path / "r.urdf"
    path.write_text(URDF.format(x=x, yaw=yaw))
    assert read(path).notes == notes
    assert dict(read(path).joints[0].given)["xyz_x"] == R(x)
