"""Joints that are converted to suitable link conventions keep their exact kinematics."""

import numpy as np
import pytest
import sympy as sp

from chasles.derive import (
    DescriptionError,
    Mechanism,
    product_of_exponentials,
    read,
    read_text,
    with_suitable_conventions,
)
from chasles.derive.description.conventions.neighbours import neighbours
from tests.support.derivations import ROBOTS, SAMPLE

AUTO = """
name = "arm"
convention = "auto"
units = { length = "mm", angle = "deg" }
tool = { xyz = [850, 0, 200], rpy = [0, 90, 0] }
[[joints]]
axis = [0, 0, 1]
[[joints]]
axis = [0, 1, 0]
point = [0, 0, 300]
limits = [-90, 90]
[[joints]]
axis = [0.001, 1, 0]
point = [400, 0, 300]
direction = -1
[[joints]]
type = "prismatic"
axis = [1, 0, 0]
[[joints]]
axis = [1, 0, 0.0001]
point = [0, 10, 250]
"""


def chain(robot):
    return robot.main_chain if isinstance(robot, Mechanism) else robot


def screws_and_home(robot):
    values = {p.symbol: p.value for p in robot.parameters}
    return [
        np.array(sp.N(M.xreplace(values), 30), dtype=float) for M in product_of_exponentials(robot)
    ]


def conventions(robot):
    return [joint.convention.name for joint in robot.joints]


@pytest.mark.parametrize("name", SAMPLE)
def test_suited_conventions_keep_axes_and_home_pose(name):
    robot = chain(read(ROBOTS / f"{name}.toml"))
    for found, expected in zip(
        screws_and_home(with_suitable_conventions(robot)), screws_and_home(robot), strict=True
    ):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-16)


def test_auto_convention_keeps_kinematics_of_axis_lines():
    robot = read_text(AUTO)
    assert conventions(robot) == ["mdh", "mdh", "hayati5", "mdh", "hayati5"]
    plain = read_text(AUTO.replace('"auto"', '"poe"'))
    for found, expected in zip(screws_and_home(robot), screws_and_home(plain), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-15)
    assert [joint.limits for joint in robot.joints] == [joint.limits for joint in plain.joints]
    assert [joint.direction for joint in robot.joints] == [1, 1, -1, 1, 1]


def test_known_arms_get_textbook_conventions():
    ur5e = with_suitable_conventions(read(ROBOTS / "ur5e.toml"))
    assert conventions(ur5e) == ["mdh", "mdh", "hayati5", "hayati5", "mdh", "mdh"]
    well = with_suitable_conventions(chain(read(ROBOTS / "well_manipulator.toml")))
    assert conventions(well) == ["mdh", "mdh", "hayati5", "mdh", "mdh", "mdh", "mdh"]


def test_adjacent_axes_of_ur5e_have_expected_distances_and_angles():
    pairs = neighbours(read(ROBOTS / "ur5e.toml"))
    assert [pair.distance for pair in pairs[1:]] == [0, 0.425, 0.3922, 0, 0]
    right = np.pi / 2
    np.testing.assert_allclose([pair.angle for pair in pairs[1:]], [right, 0, 0, right, right])


def test_auto_convention_is_rejected_per_joint_and_for_loops():
    with pytest.raises(DescriptionError, match="convention"):
        read_text(
            AUTO.replace('"auto"', '"poe"').replace("point = [0, 0, 300]", 'convention = "auto"')
        )
    loops = (ROBOTS / "four_bar.toml").read_text().replace('"urdf"', '"auto"')
    with pytest.raises(DescriptionError, match="convention"):
        read_text(loops)
