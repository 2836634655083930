"""Robots with loops and rounded numbers: fixed samples of the campaign ``as_built``."""

import pytest

from tests.campaigns.as_built.rounded_numbers import trial


@pytest.mark.parametrize("number", [7, 15, 35, 55])
def test_rounded_robot_keeps_closed_form_and_closes_decimals(number):
    assert trial(number).failures == ()
