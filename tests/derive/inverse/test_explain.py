"""`explain` states the steps of an IK function, or the conditions that the joint axes violate."""

import re
from functools import cache

import pytest

from chasles.derive import explain, read, read_text
from chasles.derive.inverse.explanation import notes
from chasles.derive.inverse.structure.lines import Lines, axes_of
from chasles.derive.inverse.structure.self_motion import self_motion
from chasles.derive.terms.terms import Terms
from tests.support.command_line import run
from tests.support.derivations import ROBOTS

NAMES = (
    *("ur5e", "puma560", "iiwa14", "panda", "scara", "jaco2", "lynxmotion", "photo_robot"),
    "bricklaying_planar",
)
"""Serial robots of each closed-form structure, a general arm, and arms with fixed joints."""
LOOPED = ("slider_crank", "excavator", "planar_3rrr", "stewart_gough")
"""Mechanisms with and without a main-chain structure."""


@cache
def explained(name):
    return explain(read(ROBOTS / f"{name}.toml"))


@cache
def text_of(name):
    return str(explained(name))


def arm(lifts):
    """Return six revolute joints with perpendicular axes at various heights."""
    joints = "\n".join(
        f'[[joints]]\nd = "{lift}"\na = "0.1"\nalpha = "{angle}"\n'
        for lift, angle in zip(lifts, (1.1, 0.7, 1.3, 0.9, 1.2, 0.4), strict=True)
    )
    return read_text(f'name = "arm"\nconvention = "dh"\n{joints}', file="arm.toml")


@pytest.mark.parametrize("name", [*NAMES, *LOOPED])
def test_explanation_states_structure_or_missing_inverse(name):
    found, text = explained(name), text_of(name)
    if found.inverses is None:
        assert "The actuators follow from the main chain" in text
    else:
        there = found.inverses.functions or found.inverses.written
        assert (found.max_solutions == 0) == (not there)
        no_structure = found.inverses.classification.found is None
        is_general = found.inverses.general is not None
        assert (no_structure and not is_general) == ("No closed-form inverse: " in text)
        assert is_general == ("so the general method below solves the arm" in text)
        assert no_structure != ("Structure: " in text)
    assert max(map(len, text.splitlines())) < 260


ASIDE = """[[joints]]
name = "aside"
parent = "0"
link = "aside"
type = "prismatic"
axis = [0, 0, 1]

[reference]"""


TELESCOPE = """
name = "telescope"
convention = "urdf"
actuated = ["ram", "extend", "tilt", "reach"]
joints = [
  { name = "turn", link = "boom", axis = [0, 0, 1] },
  { name = "extend", type = "prismatic", link = "tube", xyz = [1, "0.2", 0], axis = [1, 0, 0] },
  { name = "tilt", link = "hand", xyz = [1, 0, 0], axis = [0, 1, 0] },
  { name = "reach", type = "prismatic", link = "tip", axis = [1, 0, 0] },
]
[[cylinders]]
name = "ram"
a = { body = "0", xyz = ["0.5", "-0.5", 0] }
b = { body = "boom", xyz = [1, 0, 0] }
limits = ["0.6", 1]
"""


def test_distant_structure_is_reported_with_its_angle_deviation():
    wrist = '{ name = "roll", link = "wrist", xyz = [0, 1, 0], axis = [1, 1, 0] },'
    arm = TELESCOPE.replace('  { name = "reach"', f'  {wrist}\n  {{ name = "reach"').replace(
        '"tilt", "reach"]', '"tilt", "roll", "reach"]'
    )
    assert explain(read_text(arm)).line.startswith(
        "no closed-form inverse: the nearest structure is"
    )


def test_slider_crank_explanation_states_its_inverse():
    assert explained("slider_crank").line == (
        "inverse of the main chain: joints that a pose determines one by one, at most 2 solutions"
    )


def test_explanation_names_actuator_that_does_not_move_the_tool():
    text = (ROBOTS / "five_bar.toml").read_text().replace("[reference]", ASIDE)
    found = explain(read_text(text.replace('"right"]', '"right", "aside"]'), file="five_bar.toml"))
    assert found.line == "no closed-form inverse: the tool on left_coupler does not depend on aside"
    assert "The tool on left_coupler does not depend on aside." in str(found)


@pytest.mark.parametrize(
    ("name", "structure", "most"),
    [
        ("ur5e", "three parallel axes 2, 3, 4 and intersecting axes 5, 6", 8),
        ("puma560", "spherical wrist", 8),
        ("iiwa14", "spherical shoulder and spherical wrist", 8),
        ("panda", "spherical wrist, solved from tool to base, with joint7 fixed", 8),
        ("scara", "parallel axes", 2),
    ],
)
def test_explanation_states_structure_and_solution_count(name, structure, most):
    found, text = explained(name), text_of(name)
    assert found.max_solutions == most
    assert f"Structure: {structure}.\n" in text
    assert "Tier: exact" in text
    assert structure in found.line


@pytest.mark.parametrize("name", NAMES)
def test_explanation_has_a_step_for_every_joint(name):
    """The explanation states that a joint is fixed, solved, or computed from an angle sum."""
    found = explained(name)
    if found.inverses.written or not found.inverses.functions:
        return
    text = text_of(name).split("\n\nik_")[0]
    for joint in read(ROBOTS / f"{name}.toml").moving:
        fixed = f"with {joint.name} " in text or f"and {joint.name} fixed." in text
        assert fixed or f" {joint.name}, by " in text or f"{joint.name} follows from " in text, text


def test_explanation_states_signs_and_degenerate_cases():
    text = text_of("ur5e")
    assert text.count("Two solutions, sign ") == 3
    assert "Two solutions, sign 3 of 3; they coincide at the boundary" in text
    assert "shoulder_lift + elbow + wrist_1, by subproblem 2: " in text
    assert "Degenerate: if axis 6 is parallel to axes 2 to 4, the sum is arbitrary" in text
    assert (
        "wrist_1 follows from shoulder_lift + elbow + wrist_1, with shoulder_lift and elbow known."
        in text
    )


def test_explanation_measures_deviation_from_nearest_structure():
    text = str(explain(arm((0.2, 0.1, 0.3, 0.1, 0.2, 0.1))))
    missed = (
        r"No known structure fits the axes, so the general method below solves the arm\. The "
        r"nearest structure is .* \(off by up to \d[\d.]* (mm|mrad|deg)\)\.\n"
    )
    assert re.search(missed, text)
    _, table = text.split("off by\n---")
    assert " mm\n" in table
    assert " deg\n" in table
    assert "solved from tool to base" in table


def test_deviation_of_nearly_meeting_axes_is_a_length():
    """Joint axes 5 and 6 of the test arm are 100 mm apart."""
    text = str(explain(arm((0.2, 0.1, 0.3, 0.1, 0.0, 0.1))))
    rows = [line for line in text.splitlines() if line.startswith("  axes joint5 and joint6 ")]
    assert rows
    assert all(row.endswith(" 100 mm") for row in rows)


def test_deviation_of_nearly_parallel_axes_is_the_largest_angle_between_consecutive_axes():
    """Axes 2 and 3 form an angle of 10 degrees, and axes 3 and 4 an angle of 25 degrees."""
    joints = [f"{{ a = 0.2, d = 0.1, alpha = {alpha} }}," for alpha in (80, 10, 25, 70, 65, 0)]
    head = 'name = "arm"\nconvention = "dh"\nunits = { length = "m", angle = "deg" }\n'
    text = str(explain(read_text("\n".join([f"{head}joints = [", *joints, "]"]))))
    rows = [row for row in text.splitlines() if row.startswith("  axes joint2, joint3 and joint4 ")]
    assert [row.split("parallel")[1].strip() for row in rows if "parallel" in row] == [
        "up to 25 deg"
    ] * 2


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("stewart_gough", "Gruebler-Kutzbach: 6 (14 - 1 - 18) + 42 = 12"),
        ("slider_crank", "connecting_rod (planar, 2 equations): crank, rod_angle, conn"),
        ("planar_3rrr", "by Newton's iteration at run time"),
        ("excavator", "boom_cylinder: two pins and a prismatic joint"),
    ],
)
def test_mechanism_explanation_states_mobility_and_loop_steps(name, words):
    text = text_of(name)
    assert "Degrees of freedom: " in text
    assert words in text


def test_mechanism_explanation_lists_actuator_steps():
    assert "through the loops in 4 steps" in text_of("excavator")
    text = text_of("stewart_gough")
    assert text.startswith(
        "Stewart-Gough platform\n======================\n\nDegrees of freedom: 6, "
    )
    steps = [f"  {k}. leg_{k}: a distance, for leg_{k}" for k in range(1, 7)]
    message = (
        "The actuators follow from the main chain in closed form, through the loops in 6 steps."
    )
    message = f"{message} ik solves a pose in this way."
    assert text.endswith("\n".join(["\nJoints from the main chain:", *steps, "", message]))
    assert not re.search("Structure: |Tier: ", text)
    assert explained("excavator").line.startswith("inverse of the main chain: a turntable")


def test_general_arm_explanation_states_solution_method():
    text = text_of("jaco2")
    assert "ik(T): at most 16 solutions in 16 slots, by the roots of a determinant." in text
    missed = (
        r"spherical wrist\n  axes joint_4, joint_5 and joint_6 pass through one point +up to 37 mm"
    )
    assert re.search(missed, text)
    assert explained("jaco2").line.startswith("inverse: an arm of six revolute joints")


def test_command_line_explains_and_writes_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = run("explain", "ur5e")
    assert done.exit_code == 0, done.output
    assert "Structure: three parallel axes" in done.output
    assert list(tmp_path.iterdir()) == []


def general_arm(last):
    """Return an arm without a closed-form inverse kinematics function.

    Joint axes 5 and 6 are parallel at the distance ``last`` (meter).
    """
    rows = [(0.3, 0.1, -90), (0.05, 0.4, 20), (0.02, 0.1, 70), (0.4, 0.05, -60), (0.1, last, 0)]
    joints = "".join(
        f"[[joints]]\nd = {d}\na = {a}\nalpha = {alpha}\n" for d, a, alpha in [*rows, (0.1, 0, 0)]
    )
    text = f'name = "arm"\nconvention = "dh"\nunits = {{ length = "m", angle = "deg" }}\n{joints}'
    return read_text(text, file="arm.toml")


def test_arm_singular_everywhere_names_joints_of_self_motion():
    text = (
        "singular in every configuration: the tool depends on joint5 + joint6 alone; the value of "
        "joint6 is an input of ik"
    )
    collinear, regular = explain(general_arm(last=0)), explain(general_arm(last=0.1))
    assert text in str(collinear)
    assert text in collinear.line
    (note,) = notes(collinear.inverses)
    assert text in note
    assert "singular in every" not in str(regular)
    assert notes(regular.inverses) == ()


def test_self_motion_of_four_parallel_axes_names_them():
    rows = [(0.3, 0.1, -90), (0, 0.4, 0), (0.1, 0.3, 0), (0, 0.2, 0), (0.1, 0.1, -90), (0.1, 0, 0)]
    joints = "".join(f"[[joints]]\nd = {d}\na = {a}\nalpha = {alpha}\n" for d, a, alpha in rows)
    text = f'name = "arm"\nconvention = "dh"\nunits = {{ length = "m", angle = "deg" }}\n{joints}'
    robot = read_text(text, file="arm.toml")
    lines = Lines(Terms({}), axes_of(robot, Terms({})))
    words = "joint2, joint3, joint4 and joint5 can move without moving the tool"
    assert self_motion(lines) == words
    assert self_motion(lines, (4,)) == ""


def test_mechanism_without_a_loop_is_explained():
    text = """
name = "two_links"
title = "Two links with a side link"
convention = "urdf"
tool = { body = "second", xyz = [0.2, 0, 0] }
actuated = ["a", "b", "c"]
units = { length = "m", angle = "rad" }
joints = [
  { name = "a", link = "first", axis = [0, 0, 1] },
  { name = "b", link = "second", axis = [0, 0, 1], xyz = [0.3, 0, 0] },
  { name = "c", link = "side", parent = "first", axis = [0, 0, 1], xyz = [0.1, 0, 0] },
]
"""
    said = str(explain(read_text(text)))
    assert "The actuators follow from the main chain by constant ratios." in said
