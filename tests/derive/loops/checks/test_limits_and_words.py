"""Test the reports on mechanisms, for example about actuator limits at which loops cannot close."""

import re
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from chasles import InputValueError
from chasles.derive import DescriptionError, explain, kutzbach, read
from chasles.derive.loops.checks.closable import limits_of, moved_reference
from tests.support.derivations import ROBOTS
from tests.support.loops.solved import solved


def limited(name, **limits):
    """Return a shipped robot with other limits (radian or meter)."""
    robot = read(ROBOTS / f"{name}.toml")
    exact = {key: tuple(map(sp.nsimplify, pair)) for key, pair in limits.items()}
    return replace(
        robot,
        joints=tuple(replace(j, limits=exact.get(j.name, j.limits)) for j in robot.joints),
        struts=tuple(replace(s, limits=exact.get(s.name, s.limits)) for s in robot.struts),
    )


def test_reachable_limits_give_no_note():
    for name in ("four_bar", "excavator", "well_manipulator"):
        assert limits_of(solved(read(ROBOTS / f"{name}.toml"))) == ()


def test_note_on_unreachable_limits_states_closing_range():
    # The stretched cylinder length is the sum of the distances of both cylinder pins from the boom
    # pin.
    reach = 1000 * (np.hypot(0.55, 0.65) + np.hypot(2.6, 0.85)) - 1980
    (message,) = limits_of(solved(limited("excavator", boom_cylinder=("0", "3"))))
    found = re.fullmatch(
        r"limits of boom_cylinder, 0 to 3000 mm: with the others at the reference the loops close "
        r"from 0 to (\S+) mm",
        message,
    )
    assert float(found.group(1)) == pytest.approx(reach, abs=1)


def test_closing_range_is_found_within_very_wide_limits():
    pins = np.hypot(0.55, 0.65), np.hypot(2.6, 0.85)
    *_, message = limits_of(solved(limited("excavator", boom_cylinder=("-1.9", "3000"))))
    found = re.search(r"the loops close from (\S+) to (\S+) mm$", message)
    ends = [1000 * (pins[1] - pins[0]) - 1980, 1000 * (pins[1] + pins[0]) - 1980]
    assert [float(end) for end in found.groups()] == pytest.approx(ends, abs=1)


def test_note_states_share_of_limits_in_which_loops_close():
    robot = limited("five_bar", left=("1.9", "3.1"), right=("0", "1.25"))
    short = tuple(
        replace(p, value=sp.Rational(18, 100)) if p.name == "b" else p for p in robot.parameters
    )
    message = limits_of(solved(replace(robot, parameters=short)))
    part = float(re.match(r"limits: the loops close in (\d+) % of 500 random", message[0]).group(1))
    # The loops close if the distance between the elbows is at most the sum of both coupler lengths,
    # 360 mm. The expected fraction of configurations with closed loops is computed on a grid of
    # crank angles.
    left, right = np.meshgrid(np.linspace(1.9, 3.1, 400), np.linspace(0, 1.25, 400))
    apart = 0.2 + 0.2 * np.exp(1j * right) - 0.2 * np.exp(1j * left)
    assert part < 50
    assert np.mean(np.abs(apart) <= 0.36) == pytest.approx(part / 100, abs=0.07)
    assert len(message) == 3


def test_closing_range_of_platform_limits_is_searched():
    message = limits_of(solved(limited("planar_3rrr", theta_1=("-3", "3"))))
    assert re.match(r"limits: the loops close in \d+ % of 60 random", message[0])
    low, high = map(float, re.search(r"close from (\S+) to (\S+) deg", message[1]).groups())
    assert -171.9 < low < 76.28 < high < 171.9


def test_explanation_of_underactuated_mechanism_raises_error():
    robot = read(ROBOTS / "five_bar.toml")
    with pytest.raises(DescriptionError, match="2 degrees of freedom and 1 actuated coordinate"):
        str(explain(replace(robot, actuated=("left",))))


# --- links and joints as numbers ---


def test_kutzbach_matches_textbook_counts():
    assert kutzbach(links=14, joints=15, freedom=15) == 3
    assert kutzbach(4, 4, 4, order=3) == 1
    assert kutzbach(14, 18, 36) == 6
    assert kutzbach(4, 4, 4) == -2
    assert kutzbach(1, 0, 0) == 0


@pytest.mark.parametrize(
    ("numbers", "words"),
    [
        ({"order": 7, "links": 4, "joints": 4, "freedom": 4}, "order from 1 to 6, found 7"),
        ({"order": 6, "links": 4, "joints": 2, "freedom": 2}, "at least 1 link and 3 joints"),
        ({"order": 3, "links": 4, "joints": 4, "freedom": 13}, "freedom from 4 to 12"),
        ({"order": 3, "links": 4, "joints": 4, "freedom": 3}, r"\(1 to 3 for each of 4 joints\)"),
    ],
    ids=["order", "joints", "freedom above", "freedom below"],
)
def test_impossible_numbers_of_kutzbach_are_rejected(numbers, words):
    with pytest.raises(InputValueError, match=words):
        kutzbach(**numbers)


def test_note_reports_reference_far_from_closed_configuration():
    for name in ("excavator", "five_bar", "four_bar"):
        assert moved_reference(solved(read(ROBOTS / f"{name}.toml"))) == ""
    robot = read(ROBOTS / "four_bar.toml")
    other = tuple((name, x + 1 if name == "coupler" else x) for name, x in robot.reference)
    assert moved_reference(solved(replace(robot, reference=other))) == (
        "reference: coupler is -7.704 deg in the file, and -63.05 deg where the loops close at "
        "crank = 90 deg"
    )


def test_reference_defaults_to_middle_of_limits_that_exclude_zero():
    def start(low, high, reference=()):
        robot = limited("four_bar", crank=(low, high))
        return replace(robot, reference=reference).reference_of("crank")

    assert start("pi/3", "2*pi/3") == sp.pi / 2
    assert start("-2", "-1") == sp.Rational(-3, 2)
    assert start("-1", "1") == 0
    assert start("1", "2", (("crank", sp.Integer(1)),)) == 1
