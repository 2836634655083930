"""Tests the joint coordinates at which the example programs of exported code start."""

from dataclasses import replace

import pytest

from chasles.derive import derive
from chasles.derive.emit.printed import example_start
from tests.support.derivations import robot_of


@pytest.mark.parametrize(
    ("limits", "start"),
    [
        ((None, None), 0.4),
        ((-1, "0.45"), 0.4),
        ((-1, "0.4"), -0.3),
        (("0.5", 2), 1.25),
        ((1, None), 1.05),
        ((None, "0.2"), 0.15),
    ],
)
def test_example_starts_within_the_limits_of_a_coordinate(limits, start):
    robot = robot_of("scara")
    joints = (replace(robot.joints[0], limits=limits), *robot.joints[1:])
    derivation = derive(replace(robot, joints=joints), functions=["fk"])
    assert example_start(derivation, 0.05)[0] == pytest.approx(start)


def test_example_of_a_robot_with_loops_starts_at_its_reference():
    derivation = derive(robot_of("excavator"), functions=["fk"])
    assert example_start(derivation) == pytest.approx(derivation.hybrid.q_at_reference, abs=1e-8)
