"""Arms that are derived on first use agree with independent poses and joint limits.

The file `shelf_poses.json` states the source of each arm and its constant base and tool rotations.
The file `shelf_poses.json` also states the rounding of angles (1.5708 for pi/2).
"""

import json
from pathlib import Path

import numpy as np
import pytest

from chasles.derive import SerialRobot, read
from tests.support.derivations import ALL, ROBOTS
from tests.support.oracles.screws import screws_of
from tests.support.tolerances import LIMIT, PRINTED_9

SIZES = {"planar_3rrr_170"}
"""Robots in ``shelf`` that differ from a generated and tested robot only in size."""
SHELF = [file for file in sorted((ROBOTS / "shelf").glob("*.toml")) if file.stem not in SIZES]
REFERENCE = json.loads(Path(__file__).with_name("shelf_poses.json").read_text(encoding="utf-8"))
WIDEST = 1.0
"""Bound on the tool displacement per rounding error of a joint angle (meter per radian)."""


def test_every_shelf_arm_has_reference_poses():
    assert [file.stem for file in SHELF] == sorted(REFERENCE)
    assert len(SHELF) >= 35
    assert not {file.stem for file in SHELF} & set(ALL)


@pytest.mark.parametrize("file", SHELF, ids=lambda file: file.stem)
def test_shelf_arm_poses_match_source(file):
    robot = read(file)
    assert isinstance(robot, SerialRobot)
    assert (robot.name, bool(robot.title), bool(robot.source)) == (file.stem, True, True)
    reference = REFERENCE[robot.name]
    screws = screws_of(robot)
    rounded = len(robot.joints) * reference.get("rounded", 0) * WIDEST
    poses = reference["poses"]
    worst = max(
        np.abs(screws.fk(np.array(pose["q"])).ravel()[:12] - np.ravel(pose["T"])).max()
        for pose in poses
    )
    assert len(poses) == 3
    assert worst <= PRINTED_9 + rounded


@pytest.mark.parametrize("file", SHELF, ids=lambda file: file.stem)
def test_shelf_arm_limits_match_source(file):
    robot = read(file)
    compared = 0
    for joint, limits in zip(robot.joints, REFERENCE[robot.name].get("limits", ()), strict=False):
        assert (joint.limits[0] is None) == (limits is None), joint.name
        if limits is not None:
            assert [float(value) for value in joint.limits] == pytest.approx(limits, abs=LIMIT)
        compared += 1
    assert compared == (0 if robot.name in ("ur3", "ur10") else len(robot.joints))
