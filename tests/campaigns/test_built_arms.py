"""Arms driven by cylinders, rods and cranks: fixed samples of the campaign ``as_built``."""

from tests.campaigns.as_built.built_arms import BARS, judged, judged_arm
from tests.support.generators.driven_arms import drawn_arm


def test_inverse_of_built_arm_stays_within_error_limits():
    assert_within_bars(judged(141))


def test_inverse_with_tool_on_last_axis_stays_within_error_limits():
    """The last joint of the three-joint arm rotates about the tool origin."""
    assert_within_bars(judged_arm(drawn_arm(1, tool=()).mechanism, 1))


def test_inverse_of_designed_arm_stays_within_error_limits():
    """A crank drives the joint whose value is an input of the inverse kinematics function."""
    assert_within_bars(judged_arm(drawn_arm(2, tool=()).mechanism, 2))


def test_inverse_of_built_arm_is_complete_near_singularities():
    """The as-built arm has several solutions for poses that the nominal arm cannot reach."""
    assert_within_bars(judged(99150880000001))


def test_as_built_arm_without_loops_has_an_inverse():
    assert_within_bars(judged(251648512000001))


def assert_within_bars(found):
    assert {key: vars(found)[key] <= bar for key, bar in BARS.items()} == dict.fromkeys(BARS, True)
