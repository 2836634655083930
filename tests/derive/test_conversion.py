"""Conversions keep the tool pose, names and limits, or raise an error."""

import csv
from math import nan
from random import Random

import pytest

from chasles.contract.errors import InputValueError
from chasles.derive import Coupling, Joint, SerialRobot, Translation, convert, read, read_text
from chasles.derive.description.conventions import dh, poe
from tests.campaigns.convert import ACCURACY, differences
from tests.support.command_line import run
from tests.support.convention_robots import sagging_ur5e
from tests.support.generators.convertible_arms import convertible_arm
from tests.support.generators.coupled_arms import coupled_arm
from tests.support.oracles.described_fk import distance, tool_pose

SCREW_ARM = SerialRobot(
    "screw_arm",
    (
        Joint("a", "revolute", *dh("revolute", a="0.3", alpha="pi/2"), direction=-1),
        Joint("b", "helical", *dh("helical", d="0.2", theta="0.4"), pitch="0.01"),
        Joint("c", "revolute", *dh("revolute", a="0.1")),
        Joint("d", "prismatic", *dh("prismatic", alpha="1/3"), limits=(0, "0.7")),
    ),
    couplings=(Coupling("c", (("b", "-1/2"),), "0.1"),),
)


def arm_with_parallel_axes(dice):
    """Return a seven-joint arm whose axes 4, 6 and 7 are parallel to the preceding axis."""
    joints = [
        f"[[joints]]\naxis = [0, 0, 1]\nxyz = {[dice.randint(-999, 999) for _ in range(3)]}\n"
        f"rpy = {[0, 0, 0] if k in (3, 5, 6) else [dice.randint(1, 89) for _ in range(3)]}\n"
        for k in range(7)
    ]
    units = 'units = { length = "mm", angle = "deg" }\n'
    return read_text(f'name = "arm"\nconvention = "urdf"\n{units}{"".join(joints)}')


@pytest.mark.parametrize("seed", range(4))
def test_parallel_axes_stay_exactly_parallel(seed):
    arm = convert(arm_with_parallel_axes(Random(seed)), "dh").robot
    twists = [dict(joint.given)["alpha"] for joint in arm.moving]
    assert [k + 1 for k, twist in enumerate(twists[:-1]) if twist == 0] == [3, 5, 6]


@pytest.mark.parametrize("to", ["toml", "urdf", "dh", "mdh", "poe"])
@pytest.mark.parametrize(
    "robot", [SCREW_ARM, read("ur5e"), convertible_arm(7)], ids=["screws", "ur5e", "errors"]
)
def test_conversion_keeps_tool_pose_and_limits(robot, to):
    conversion = convert(robot, to)
    stated = 2 * max(conversion.error)
    for kind, found in differences(robot, conversion, Random(4)).items():
        assert found < max(ACCURACY, stated if kind == to else 0), kind
    found = read_text(conversion.text, format="urdf" if to == "urdf" else "toml")
    assert [j.name for j in found.coordinates] == [j.name for j in robot.coordinates]
    for one, other in zip(robot.coordinates, found.coordinates, strict=True):
        limits = [[nan if x is None else float(x) for x in j.limits] for j in (one, other)]
        assert limits[0] == pytest.approx(limits[1], rel=1e-15, nan_ok=True)


def test_exact_numbers_stay_exact():
    text = convert(read("panda"), "dh").text
    assert 'alpha = "pi/2"' in text
    assert "d = 0.333" in text
    assert convert(read("ur5e"), "toml").robot == read("ur5e")


SPRINGS = (
    "".join(
        f"""
[[springs]]
coordinate = "{joint.name}"
compliance = 1e-6
axis = [0, 0, 1]
point = [0, 0, 0.1]
mass = 3.5
center = [0.1, 0, 0.2]
"""
        for joint in read("ur5e").moving
    )
    + """
[[transmissions]]
coordinate = "elbow"
gain = 1.0002
sin1 = 0.0003
cos2 = -0.0001
"""
)


@pytest.mark.parametrize("more", ["", SPRINGS], ids=["masses", "springs"])
def test_robot_file_keeps_masses_springs_and_transmissions(more):
    text = convert(read("ur5e"), "toml").text + SPRINGS if more else sagging_ur5e()
    robot = read_text(text)
    assert convert(robot, "toml").robot == robot


def test_robot_file_keeps_couplings_and_motors():
    robot = coupled_arm(3).robot
    found = convert(robot, "toml").robot
    assert (found.couplings, found.motors) == (robot.couplings, robot.motors)


def test_robot_file_keeps_numbers_that_the_reader_would_snap():
    joint = Joint("a", "revolute", *dh("revolute", a="0.123456000456", alpha="1.5708"))
    robot = SerialRobot("arm", (joint,))
    found = read_text(convert(robot, "mdh").text)
    assert distance(tool_pose(found, [1]), tool_pose(robot, [1])) < 1e-16


def test_nearly_parallel_axes_have_long_rows_with_more_digits():
    tilted = {"axis": ("0.00000123", "0.00000321", 1), "point": ("0.7", "0.1", "0.3")}
    joints = (
        Joint("a", "revolute", *poe("revolute", axis=(0, 0, 1))),
        Joint("b", "revolute", *poe("revolute", **tilted)),
    )
    robot = SerialRobot("arm", joints, tool=(Translation(("0.4", "0.5", "0.6")),))
    conversion = convert(robot, "dh")
    assert any("nearly parallel" in note for note in conversion.notes)
    assert max(differences(robot, conversion, Random(1)).values()) < 1e-15


def test_urdf_states_error_of_snapped_numbers():
    joint = Joint("a", "revolute", *dh("revolute", a="0.1234560000456"))
    robot = SerialRobot("arm", (joint,))
    conversion = convert(robot, "urdf")
    found = read_text(conversion.text, format="urdf")
    snapped = distance(tool_pose(found, [0]), tool_pose(robot, [0]))
    assert 4e-11 < snapped < 1.001 * conversion.error[0] < 1e-10
    assert "exact=True keeps noisy decimals" in conversion.notes[-1]


def test_note_names_joints_that_the_urdf_reader_would_leave_out():
    assert any("tip='ee'" in note for note in convert(read("stanford"), "urdf").notes)


def test_robot_with_loops_is_refused():
    with pytest.raises(InputValueError, match="only serial robots"):
        convert(read("four_bar"), "toml")


def test_unknown_format_is_refused():
    with pytest.raises(InputValueError, match="expected one of toml, urdf, dh, mdh, poe"):
        convert(read("scara"), "sdf")


def test_masses_refuse_a_table_that_moves_link_frames():
    text = convert(read("scara"), "toml").text
    mass = '\n[[masses]]\nlink = "ee_link"\nmass = 1\nat = [0, 0, 0]\n'
    link = read("scara").link_names[-1]
    loaded = read_text(text + mass.replace("ee_link", link))
    assert convert(loaded, "toml").robot.load == loaded.load
    with pytest.raises(InputValueError, match="masses are positioned in link frames"):
        convert(loaded, "poe")


def test_command_writes_the_format_that_the_file_name_states(tmp_path):
    for name in ("arm.toml", "arm.urdf", "arm.mdh.toml", "arm.poe.csv", "arm.dh.tex"):
        done = run("convert", "panda", "--to", tmp_path / name)
        assert done.exit_code == 0, done.output
    assert read(tmp_path / "arm.mdh.toml").joints[1].convention.name == "mdh"
    with (tmp_path / "arm.poe.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["axis_y"] for row in rows[1:4]] == ["0", "1", "0"]
    assert r"$q_{7} - \pi/4$ & $0.107$ & $0$ & $0$" in (tmp_path / "arm.dh.tex").read_text()


def test_command_asks_for_the_convention_of_a_table(tmp_path):
    done = run("convert", "panda", "--to", tmp_path / "arm.csv")
    assert done.exit_code == 1
    assert "arm.dh.csv" in done.stderr
    assert not (tmp_path / "arm.csv").exists()
