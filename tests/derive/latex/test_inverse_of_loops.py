"""LaTeX articles explain the inverse kinematics of robots with loops."""

from pathlib import Path

import pytest

from chasles.derive import derive, read
from chasles.derive.latex.inverse.inverse_of_loops import inverse_of_loops
from chasles.derive.latex.loops.loop_page import LoopPage
from tests.support.generators.carried_platforms import drawn_platform
from tests.support.generators.leg_platforms import LEG_KINDS, drawn_as

BOOM = Path(__file__).parents[1] / "inverse" / "mechanisms" / "skew_boom.toml"


def printed(robot):
    """Return the section of a LaTeX article about the inverse kinematics."""
    return inverse_of_loops(LoopPage.of(derive(robot, functions=["ik"])))


def test_general_main_chain_is_solved_before_the_actuators():
    text = printed(read(BOOM))
    assert "method for a general arm (Raghavan and Roth)" in text
    assert r"The function \texttt{ik\_chain} solves the main chain." in text
    assert r"\texttt{ik} has 16 slots" in text


def test_moving_part_of_the_chain_is_solved_before_the_actuators():
    text = printed(drawn_platform(13))
    assert "The actuators follow from these joints" in text
    assert r"so \texttt{ik} has one slot" in text
    assert "degrees of freedom" not in text


@pytest.mark.parametrize("kind", ["tripteron", "exechon"])
def test_legs_that_are_serial_arms_are_named(kind):
    text = printed(drawn_as(LEG_KINDS[kind], 1))
    assert "are solved as serial arms whose last link has the pose" in text
    assert "The tool has 3 degrees of freedom: the residual of an unreachable pose" in text
