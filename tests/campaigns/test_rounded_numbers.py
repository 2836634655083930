"""Fixed samples of the campaign ``as_built``: robots with loops and rounded numbers."""

import pytest

from tests.campaigns.as_built.rounded_numbers import trial


@pytest.mark.parametrize("number", [35, 55], ids=["slider_crank", "delta"])
def test_rounded_robot_keeps_closed_form_and_closes_decimals(number):
    assert trial(number).failures == ()
