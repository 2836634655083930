"""Iterative inverse kinematics for links other than the tool."""

import numpy as np
import pytest

import chasles
from chasles import se3
from chasles.derive import read, read_text
from chasles.iterative import numeric_inverse
from tests.support.compiling import compiled
from tests.support.derivations import description
from tests.support.iteration import (
    PLATFORMS,
    POSITION,
    ROUNDING,
    TOLERANCE,
    away,
    configurations,
    distance,
    same,
    within,
)


@pytest.mark.parametrize(
    "name",
    [
        *("ur5e", "panda", "photo_robot", "stanford", "well_manipulator", "excavator", "delta"),
        *PLATFORMS,
    ],
)
def test_ik_numeric_solves_for_every_link_as_tip(name):
    robot = chasles.load(name)
    poses = robot.link_poses(configurations(robot, 40))
    checked = 0
    for k, link in enumerate(robot.link_names):
        found = robot.ik_numeric(poses[:, k], tip=link)
        assert found.valid.all(), link
        assert within(robot, found.q)
        assert robot.ik_numeric(poses[:, k], found.q, tip=link).valid.all(), link
        reached = robot.link_poses(found.q)[:, k]
        unit = robot.unit_length
        assert away(reached, poses[:, k], unit).max() <= TOLERANCE * unit + ROUNDING
        far = poses[:, k].copy()
        far[:, :3, 3] += 100
        found = robot.ik_numeric(far[:3], tip=link, task_weights=POSITION, max_evaluations=500)
        gap = distance(robot.link_poses(found.q)[:, k], far[:3])
        np.testing.assert_allclose(gap, found.residual, rtol=1e-12)
        checked += 1
    assert checked == len(robot.link_names)
    assert same(
        robot.ik_numeric(robot.fk(configurations(robot, 5)), tip=robot.tip_frame),
        robot.ik_numeric(robot.fk(configurations(robot, 5))),
    )


def test_tool_is_only_tip_without_link_poses(tmp_path):
    wanted = ["fk", *numeric_inverse._TOOL]
    arm = compiled(read(description("scara")), tmp_path / "scara", wanted, ["c"])
    T = arm.fk(np.full(arm.n, 0.1))
    assert arm.ik_numeric(T, tip="ee").valid
    with pytest.raises(chasles.InputError, match=r"unknown tip link 'link1'; expected one of ee$"):
        arm.ik_numeric(T, tip="link1")


def test_unknown_tip_error_lists_links():
    platform = chasles.load("stewart_gough")
    with pytest.raises(
        chasles.InputError, match=r"unknown tip link 'hand'.* ee, platform_x, platform_y,"
    ):
        platform.ik_numeric(np.eye(4), tip="hand")


SPINDLE = """
name = "spindle"
convention = "dh"
joints = [
  { name = "lift", type = "helical", pitch = 0.02, direction = -1, a = 0.3, d = 0.1, alpha = 0.4 },
  { name = "arm", a = 0.25, theta = 0.3, alpha = -0.7 },
  { name = "quill", type = "prismatic", direction = -1, a = 0.1 },
]
"""


def moves(poses, steps):
    """Return the twists of a link in the link frame, by finite differences of poses."""
    ahead, behind = poses[: len(poses) // 2], poses[len(poses) // 2 :]
    return se3.log(se3.inverse(behind) @ ahead) / (2 * steps)


def check_screws(robot):
    """Compare the screws of each link with central differences of its poses."""
    n, step = robot.n, 1e-5
    q = np.array(robot.reference.q) if robot.reference else np.full(n, 0.3)
    around = q + step * np.concatenate([np.eye(n), -np.eye(n)])
    rates = robot.chain_D_q(q) if robot.loops else np.eye(n)
    poses, here = robot.link_poses(around), robot.link_poses(q)
    for link in range(len(robot.link_names)):
        expected = moves(poses[:, link], step)
        found = np.zeros((n, 6))
        for frame, joint, *axis in numeric_inverse.screws_up_to(robot.manifest, link):
            to_link = se3.inverse(here[link]) @ here[int(frame)]
            R, p = to_link[:3, :3], to_link[:3, 3]
            omega = R @ axis[3:]
            moved = np.concatenate([R @ axis[:3] + np.cross(p, omega), omega])
            found += rates[int(joint)][:, None] * moved
        np.testing.assert_allclose(found, expected, atol=1e-8)


@pytest.mark.parametrize("name", ["jaco2", "photo_robot", "excavator", "stewart_gough"])
def test_screws_of_the_manifest_move_links_as_their_poses_do(name):
    check_screws(chasles.load(name))


def test_screws_of_helical_and_reversed_joints_move_links_as_their_poses_do(tmp_path):
    check_screws(compiled(read_text(SPINDLE), tmp_path / "spindle", ["fk", "link_poses"], ["c"]))
