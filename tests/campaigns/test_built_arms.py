"""Arms driven by cylinders, rods and cranks: fixed samples of the campaign ``as_built``."""

import pytest

from tests.campaigns.as_built.built_arms import BARS, judged, judged_arm
from tests.support.generators.driven_arms import drawn_arm

BUILT = {
    44: "near a dead point",
    141: "a parallelogram that folds, after a fixed joint",
}


@pytest.mark.parametrize("number", BUILT, ids=BUILT.values())
def test_inverse_of_built_arm_stays_within_error_limits(number):
    assert_within_bars(judged(number))


def test_inverse_with_tool_on_last_axis_stays_within_error_limits():
    """A column and two joints; the last joint rotates the tool about its own origin."""
    assert_within_bars(judged_arm(drawn_arm(1, tool=()).mechanism, 1))


@pytest.mark.parametrize("number", [2, 81], ids=["crank", "few that close"])
def test_inverse_of_designed_arm_stays_within_error_limits(number):
    """In one arm a crank drives a fixed joint; in the other, loops close in few configurations."""
    assert_within_bars(judged_arm(drawn_arm(number, tool=()).mechanism, number))


def assert_within_bars(found):
    assert {key: vars(found)[key] <= bar for key, bar in BARS.items()} == dict.fromkeys(BARS, True)
