"""Inverse kinematics by iteration for links other than the tool."""

import numpy as np
import pytest

import chasles
from chasles.derive import load
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
    for k, link in enumerate(robot.frames.links):
        found = robot.ik_numeric(poses[:, k], tip=link)
        assert found.success.all(), link
        assert within(robot, found.q)
        assert robot.ik_numeric(poses[:, k], found.q, tip=link).success.all(), link
        reached = robot.link_poses(found.q)[:, k]
        unit = robot.unit_length
        assert away(reached, poses[:, k], unit).max() <= TOLERANCE * unit + ROUNDING
        far = poses[:, k].copy()
        far[:, :3, 3] += 100
        found = robot.ik_numeric(far[:3], tip=link, weights=POSITION, budget=500)
        gap = distance(robot.link_poses(found.q)[:, k], far[:3])
        np.testing.assert_allclose(gap, found.residual, rtol=1e-12)
        checked += 1
    assert checked == len(robot.frames.links)
    assert same(
        robot.ik_numeric(robot.fk(configurations(robot, 5)), tip=robot.frames.tip),
        robot.ik_numeric(robot.fk(configurations(robot, 5))),
    )


def test_tool_is_only_tip_without_link_poses(tmp_path):
    wanted = ["fk", "chain", *numeric_inverse._KERNELS["platform"]]
    read = load(description("planar_3rrr"))
    platform = compiled(read, tmp_path / "platform", wanted, ["c"])
    T = platform.fk(np.array(platform.reference.q))
    assert platform.ik_numeric(T, tip="ee").success
    assert platform.ik_numeric(T, np.array(platform.reference.q) + 0.01).success
    with pytest.raises(chasles.InputError, match=r"no link 'platform_x' for a tip; there are: ee$"):
        platform.ik_numeric(T, tip="platform_x")


def test_unknown_tip_error_lists_links():
    platform = chasles.load("stewart_gough")
    with pytest.raises(chasles.InputError, match=r"no link 'hand' .*: ee, platform_x, platform_y,"):
        platform.ik_numeric(np.eye(4), tip="hand")
