"""Import kinematic chains between any two links.

On the path from the base link up to the common ancestor of both links, joints are inverted.
"""

import random

import numpy as np
import pytest

from chasles.derive import DescriptionError, Mechanism, SerialRobot, derive, read
from chasles.derive.description.chain_between import inverse_convention, inverted
from chasles.derive.description.conventions import urdf
from chasles.derive.terms.casadi_graph import lower
from tests.support.command_line import run
from tests.support.compiling import compiled
from tests.support.generators.random_trees import RandomTree, pose_gap
from tests.support.mjcf_models import oracle, poses_of
from tests.support.pages import examples
from tests.support.pages import run as run_page
from tests.support.tolerances import ORACLE

PAGE = "how-to/relative-chains.md"
FUNCTIONS = ["fk", "jacobian_mixed", "fk_jacobian_mixed", "ik"]
TREES = 4
CELL = """<robot name="cell"><link name="world"/><link name="base"/><link name="l1"/>
<link name="l2"/><link name="l3"/><link name="l4"/><link name="l5"/><link name="l6"/>
<link name="tool0"/><link name="tilt_link"/><link name="table"/>
<joint name="mount" type="fixed"><parent link="world"/><child link="base"/></joint>
<joint name="j1" type="revolute"><parent link="base"/><child link="l1"/>
  <origin xyz="0 0 0.4"/><axis xyz="0 0 1"/><limit lower="-3" upper="2"/></joint>
<joint name="j2" type="revolute"><parent link="l1"/><child link="l2"/>
  <origin xyz="0.1 0 0"/><axis xyz="0 1 0"/><limit lower="-3" upper="3"/></joint>
<joint name="j3" type="revolute"><parent link="l2"/><child link="l3"/>
  <origin xyz="0 0 0.5"/><axis xyz="0 1 0"/><limit lower="-3" upper="3"/></joint>
<joint name="j4" type="revolute"><parent link="l3"/><child link="l4"/>
  <origin xyz="0.2 0 0.05"/><axis xyz="1 0 0"/><limit lower="-3" upper="3"/></joint>
<joint name="j5" type="revolute"><parent link="l4"/><child link="l5"/>
  <origin xyz="0.3 0 0"/><axis xyz="0 1 0"/><limit lower="-3" upper="3"/></joint>
<joint name="j6" type="revolute"><parent link="l5"/><child link="l6"/>
  <origin xyz="0.1 0 0"/><axis xyz="1 0 0"/><limit lower="-3" upper="3"/></joint>
<joint name="jt" type="fixed"><parent link="l6"/><child link="tool0"/></joint>
<joint name="tilt" type="revolute"><parent link="world"/><child link="tilt_link"/>
  <origin xyz="1.2 0 0.5"/><axis xyz="1 0 0"/><limit lower="-1" upper="3"/></joint>
<joint name="turn" type="continuous"><parent link="tilt_link"/><child link="table"/>
  <origin xyz="0 0 0.1"/><axis xyz="0 0 1"/></joint></robot>"""
LEG = """<robot name="leg"><link name="pelvis"/><link name="l1"/><link name="l2"/><link name="l3"/>
<link name="l4"/><link name="l5"/><link name="foot"/>
<joint name="hy" type="continuous"><parent link="pelvis"/><child link="l1"/>
  <origin xyz="0 0.1 0"/><axis xyz="0 0 1"/></joint>
<joint name="hr" type="continuous"><parent link="l1"/><child link="l2"/><axis xyz="1 0 0"/></joint>
<joint name="hp" type="continuous"><parent link="l2"/><child link="l3"/><axis xyz="0 1 0"/></joint>
<joint name="k" type="continuous"><parent link="l3"/><child link="l4"/>
  <origin xyz="0 0 -0.3"/><axis xyz="0 1 0"/></joint>
<joint name="ap" type="continuous"><parent link="l4"/><child link="l5"/>
  <origin xyz="0 0 -0.3"/><axis xyz="0 1 0"/></joint>
<joint name="ar" type="continuous"><parent link="l5"/><child link="foot"/><axis xyz="1 0 0"/>
</joint></robot>"""
LEG_Q = {"hy": 0.1, "hr": 0.2, "hp": -0.3, "k": 0.6, "ap": -0.3, "ar": -0.2}
LOOP = """<mujoco model="four_bar"><worldbody>
<body name="crank"><joint name="a" axis="0 0 1"/><geom size="0.1"/>
<body name="coupler" pos="0.2 0 0"><joint name="b" axis="0 0 1" ref="0"/><geom size="0.1"/></body>
</body>
<body name="rocker" pos="0.4 0 0"><joint name="c" axis="0 0 1"/><geom size="0.1"/></body>
</worldbody><equality><connect name="d" body1="coupler" body2="rocker" anchor="0.3 0.3 0"/>
<connect name="e" body1="coupler" body2="rocker" anchor="0.3 0.3 0.1"/></equality>
<actuator><motor joint="a"/></actuator></mujoco>"""


def fk_of(robot):
    """Return a function that computes a robot's tool pose (4, 4) from its coordinates q."""
    (fk,) = lower(derive(robot, functions=("fk",)).functions, "r")
    return lambda q: np.array(fk(q)).reshape(4, 4)


@pytest.fixture
def cell(tmp_path):
    path = tmp_path / "cell.urdf"
    path.write_text(CELL)
    return path


@pytest.mark.parametrize("ending", ["urdf", "toml"])
def test_chains_between_random_links_match_pinocchio(tmp_path, ending):
    dice = random.Random(ending)
    for seed in range(TREES):
        tree = RandomTree(dice)
        path = tmp_path / f"tree.{ending}"
        path.write_text(getattr(tree, ending))
        assert pose_gap(tree, path, *tree.ends(dice), seed) <= ORACLE, (ending, seed)


def test_chain_from_table_to_tool_keeps_names_limits_and_frames(cell):
    robot = read(cell, base="table", tip="tool0")
    names = ("turn", "tilt", "j1", "j2", "j3", "j4", "j5", "j6")
    assert tuple(joint.name for joint in robot.coordinates) == names
    assert (robot.base_frame, robot.tool_frame) == ("table", "tool0")
    assert robot.link_names[:4] == ("tilt_link", "world", "base", "l1")
    assert [joint.limits for joint in robot.coordinates][:3] == [(None, None), (-1, 3), (-3, 2)]
    T = fk_of(robot)([0.8, 0.7, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    np.testing.assert_allclose(T[:3, 3], (-0.237739264, 0.448695127, -0.071428248), atol=1e-9)
    np.testing.assert_allclose(T[0, :3], (0.133131773, 0.982304176, 0.131736242), atol=1e-9)


def test_chain_from_foot_to_pelvis_has_closed_form(tmp_path):
    path = tmp_path / "leg.urdf"
    path.write_text(LEG)
    leg = compiled(read(path, base="foot", tip="pelvis"), tmp_path / "leg", FUNCTIONS, ["c"])
    q = np.array([LEG_Q[name] for name in leg.coordinate_names])
    T = leg.fk(q)
    np.testing.assert_allclose(T[:3, 3], (-0.009983342, -0.213378053, 0.561776018), atol=1e-9)
    found = leg.ik(T)
    gaps = np.abs(np.exp(1j * found.q[found.valid]) - np.exp(1j * q)).max(-1)
    assert gaps.min() <= 1e-9


@pytest.fixture
def arm(cell, tmp_path):
    return compiled(read(cell, base="table", tip="tool0"), tmp_path / "arm", FUNCTIONS, ["c"])


def test_closed_form_of_relative_chain_finds_eight_solutions(arm):
    q = np.array([0.8, 0.7, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    found = arm.ik(arm.fk(q), fixed={"turn": 0.8, "tilt": 0.7})
    assert found.valid.sum() == 8
    np.testing.assert_allclose(np.abs(found.q[found.valid] - q).max(-1).min(), 0, atol=1e-9)


def test_relative_jacobian_is_derivative_of_relative_pose(arm):
    q, qd, h = arm.random_q(rng=3), np.linspace(-1, 1, 8), 1e-6
    rate = (arm.fk(q + h * qd) - arm.fk(q - h * qd))[:3, 3] / (2 * h)
    np.testing.assert_allclose(arm.jacobian_mixed(q)[:3] @ qd, rate, atol=1e-8)


def test_two_arms_of_documentation_hold_a_shared_object(tmp_path, monkeypatch):
    (file,) = examples(PAGE, "toml")
    (tmp_path / "duo.toml").write_text(file)
    monkeypatch.chdir(tmp_path)
    seen = run_page(PAGE)
    assert seen["duo"].coordinate_names == (
        *("left_3", "left_2", "left_1"),
        *("right_1", "right_2", "right_3"),
    )
    assert np.abs(seen["J"] @ [*seen["left"], *seen["right"]]).max() <= 1e-15
    later = seen["duo"].fk(seen["q"] + 1e-6 * np.array([*seen["left"], *seen["right"]]))
    np.testing.assert_allclose(later, seen["T"], atol=1e-11)


def test_command_line_reads_chains_between_two_links(cell):
    shown = run("fk", str(cell), "--base", "table", "--tip", "base", "--q", "0.8,0.7").output
    assert "pose of base in table" in shown
    assert "turn 45.8366 deg, tilt 40.107 deg" in shown


def test_robot_file_of_serial_arm_is_read_between_any_frames():
    arm = read("ur5e")
    whole, back = fk_of(arm), fk_of(read("ur5e", base=arm.tool_frame, tip=arm.base_frame))
    q = np.linspace(-1, 1, 6)
    np.testing.assert_allclose(back(q[::-1]) @ whole(q), np.eye(4), atol=1e-14)
    links = arm.link_names
    part = read("ur5e", base=links[3], tip=links[0])
    assert [joint.name for joint in part.coordinates] == [j.name for j in arm.joints[3:0:-1]]


def test_robot_with_loops_is_read_from_another_body():
    arm = read("excavator")
    assert isinstance(arm, Mechanism)
    back = read("excavator", base=arm.tool_frame, tip=arm.base_frame)
    assert isinstance(back, Mechanism)
    assert back.actuated == arm.actuated
    q = [float(arm.reference_of(name)) + 0.05 for name in arm.actuated]
    np.testing.assert_allclose(fk_of(back)(q) @ fk_of(arm)(q), np.eye(4), atol=1e-12)


def test_part_of_tree_without_loops_is_serial():
    arm = read("excavator")
    boom = arm.main_chain.link_names[0]
    part = read("excavator", base=boom, tip=arm.base_frame)
    assert isinstance(part, SerialRobot)


def test_mjcf_chain_between_two_branches_matches_mujoco(tmp_path):
    path = tmp_path / "model.xml"
    text = LOOP[: LOOP.index("<equality>")] + "</mujoco>"
    path.write_text(text)
    robot = read(path, base="coupler", tip="rocker")
    values = {"b": 0.3, "a": -0.4, "c": 0.7}
    assert [joint.name for joint in robot.coordinates] == ["b", "a", "c"]
    expected = poses_of(oracle(text), values)
    T = np.linalg.inv(expected["coupler"]) @ expected["rocker"]
    np.testing.assert_allclose(fk_of(robot)([*values.values()]), T, atol=1e-12)


def test_mjcf_loops_are_read_from_another_body(tmp_path):
    path = tmp_path / "model.xml"
    path.write_text(LOOP)
    model = oracle(LOOP)
    expected = poses_of(model, {})
    robot = read(path, base="coupler", tip="rocker")
    assert isinstance(robot, Mechanism)
    assert (robot.base_frame, robot.actuated) == ("coupler", ("a",))
    T = np.linalg.inv(expected["coupler"]) @ expected["rocker"]
    np.testing.assert_allclose(fk_of(robot)([0.0]), T, atol=1e-12)


def test_inverting_a_joint_twice_restores_it(cell):
    joint = read(cell, tip="l1").joints[1]
    once = inverted(joint)
    assert (once.direction, once.name, once.limits) == (-1, joint.name, joint.limits)
    assert inverted(once) == joint
    assert inverse_convention(inverse_convention(urdf)) is urdf


@pytest.mark.parametrize(
    ("base", "tip", "words"),
    [
        ("table", "tool", "a link of the file, such as tool0"),
        ("table", "table", "a link other than the base"),
    ],
)
def test_unknown_or_equal_ends_are_errors(cell, base, tip, words):
    with pytest.raises(DescriptionError, match=words):
        read(cell, base=base, tip=tip)


def test_links_of_separate_trees_have_no_chain(cell):
    cell.write_text(CELL.replace("</robot>", '<link name="camera"/></robot>'))
    with pytest.raises(DescriptionError, match="a link that is connected to table by joints"):
        read(cell, base="table", tip="camera")


def test_unknown_link_of_robot_file_is_an_error():
    with pytest.raises(DescriptionError, match="base: expected a link of the file"):
        read("ur5e", base="table")
