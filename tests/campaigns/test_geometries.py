"""The inverse of general arms with intersecting, parallel or skew axes misses no pose."""

import numpy as np
import pytest

from chasles.derive import read, read_text
from chasles.derive.inverse.general.general_inverse import general_inverse
from tests.campaigns import geometries as any_geometry
from tests.support.derivations import description
from tests.support.generators.geometric_errors import displaced
from tests.support.generators.random_arms import long_arm, random_arm, sliding_arm

PATTERNS = ["//////", "/=/==/", "==x/=/", "x/x=//"]
"""Axis patterns.

The second axis pattern has three parallel axes after two other axes.
"""


@pytest.mark.parametrize("links", PATTERNS[:2])
def test_axis_patterns_miss_no_configuration(links):
    found = any_geometry.judged(random_arm(11, links), 100)
    assert found is not None
    assert not any(found)


@pytest.mark.parametrize("place", [2, 3])
def test_prismatic_joint_at_any_position_misses_no_configuration(place):
    links = PATTERNS[place % len(PATTERNS)]
    found = any_geometry.judged(random_arm(20 + place, links, {place}), 100)
    assert found is not None
    assert not any(found)


def test_adjacent_prismatic_joints_miss_no_configuration():
    found = any_geometry.judged(random_arm(40, slides={1, 2}), 100)
    assert found is not None
    assert not any(found)


def test_longer_arm_misses_no_configuration():
    found = any_geometry.judged(long_arm(3000), 100)
    assert found is not None
    assert not any(found)


def test_remaining_prismatic_joints_miss_no_configuration():
    found = any_geometry.judged(sliding_arm(0), 100)
    assert found is not None
    assert not any(found)


TELESCOPE = """
name = "telescope"
convention = "urdf"
tool = { xyz = [0.1, 0, 0] }
joints = [
  { name = "j1", xyz = [0, 0, 0.3], axis = [0, 0, 1] },
  { name = "j2", axis = [0, 1, 0] },
  { name = "j3", xyz = [0.2, 0, 0], axis = [1, 0, 0] },
  { name = "j4", type = "prismatic", xyz = [0.2, 0, 0], axis = [1, 0, 0] },
  { name = "j5", xyz = [0.2, 0, 0], axis = [1, 0, 0] },
  { name = "j6", axis = [0, 1, 0] },
  { name = "j7", axis = [1, 0, 0] },
]
"""
"""An arm with two coincident revolute axes and, between these joints, a prismatic joint along the
axes."""


def test_essential_prismatic_joint_is_not_fixed(monkeypatch):
    arm = displaced(read_text(TELESCOPE), 1e-3)
    general = general_inverse(arm)
    assert general is not None
    assert general.given != ("j4",)
    monkeypatch.setattr(any_geometry, "general_inverse", lambda _: general)
    random, _ = any_geometry.judged(arm, 100)
    assert not random


def test_parallel_adjacent_prismatic_joints_are_rejected():
    assert any_geometry.judged(random_arm(1, "/=////", {1, 2}), 10) is None
    eight = general_inverse(random_arm(1547, "xx=xx==/", {1, 2, 3, 5}))
    assert eight is None or not {2, 3} <= {*range(8)} - {*eight.choice.given}


def test_judge_detects_missed_configurations(monkeypatch):
    message = any_geometry._arm_of

    def without_orders(tables):
        arm = message(tables)
        arm.orders = 0
        return arm

    monkeypatch.setattr(any_geometry, "_arm_of", without_orders)
    random, _ = any_geometry.judged(random_arm(11), 60)
    assert random.lost > 0


def test_errors_on_a_self_motion_leave_a_solution():
    """On the exact arm, joints 1 and 4 have a self-motion, which does not move the tool.

    On the arm with geometric errors, the self-motion of the exact arm moves the tool.
    """
    arm = displaced(read(description("crx10")), 1.83181e-4, 375254000000)
    q = np.array([[3, 0, 1, 1, 2, 1]]) * (np.pi / 2)
    found = any_geometry.judged_at(arm, q)
    assert found is not None
    assert found.none == 0
