"""Mutated URDFs keep the robot's structure, and their poses agree with Pinocchio."""

from dataclasses import replace

import pytest

from tests.campaigns.mutants import classified, excess, findings, read_mutant, serial_robots
from tests.support.generators.mutated_urdfs import MUTATIONS, arm_of_robot, arm_of_urdf, mutated

pytest.importorskip("pinocchio", reason="the oracle needs the extra `crosscheck`")
MUTANTS = 8


def arm_named(name):
    return next(arm_of_robot(robot) for robot in serial_robots() if robot.name == name)


def test_mutated_urdfs_keep_structure_and_pose_bounds():
    arms = [arm_of_robot(robot) for robot in serial_robots()]
    found = list(findings(arms, range(MUTANTS)))
    for finding in found:
        assert finding.excess <= 1, str(finding)
        assert finding.kept, str(finding)
    assert {name for finding in found for name in finding.mutant.made} == set(MUTATIONS)
    assert sum(bool(finding.cleaning) for finding in found) > MUTANTS / 2


def test_pose_check_detects_robot_that_differs_from_file(tmp_path):
    path = tmp_path / "arm.urdf"
    arm = arm_named("ur5e")
    robot = read_mutant(path, arm)
    assert excess(robot, path) <= 1
    shifted = replace(arm.joints[1], xyz=("0", "0", "1e-10"))
    read_mutant(path, replace(arm, joints=(arm.joints[0], shifted, *arm.joints[2:])))
    assert excess(robot, path) > 1


def test_mutations_are_deterministic_and_distinct(tmp_path):
    arm = arm_named("panda")
    assert arm_of_urdf("panda", arm.text) == arm
    assert len({mutated(arm, seed).text for seed in range(20)}) == 20
    assert mutated(arm, 3) == mutated(arm, 3)
    wanted = classified(read_mutant(tmp_path / "panda.urdf", arm))
    assert wanted.method == "exact"
