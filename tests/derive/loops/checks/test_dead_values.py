"""Dead points of a four-bar linkage, found numerically, agree with the law of cosines."""

import math

import numpy as np
import pytest

from chasles.derive import read_text
from chasles.derive.loops.checks.dead_values import dead_values
from tests.support.derivations import ROBOTS
from tests.support.loops.solved import solved


def drawn_four_bar(rng):
    """Return random link lengths (mm) of a four-bar linkage.

    The loop of the linkage closes with the crank perpendicular to the ground link.
    """
    while True:
        a, b, c, d = rng.integers(50, 500, 4)
        if abs(b - c) + 5 < math.hypot(a, d) < b + c - 5:
            return a, b, c, d


@pytest.mark.parametrize("seed", range(8))
def test_four_bar_dead_points_align_coupler_and_rocker(seed):
    a, b, c, d = drawn_four_bar(np.random.default_rng(seed))
    text = (ROBOTS / "four_bar.toml").read_text()
    for name, old, new in zip("abcd", (100, 300, 250, 350), (a, b, c, d), strict=True):
        text = text.replace(f"\n{name} = {{ value = {old},", f"\n{name} = {{ value = {new},")
    (found,) = dead_values(solved(read_text(text, file="four_bar.toml")))
    assert found.coordinate == 0
    cosines = [(a * a + d * d - far**2) / (2 * a * d) for far in (b + c, abs(b - c))]
    stops = [sign * math.acos(x) for x in cosines if abs(x) < 1 for sign in (1, -1)]
    np.testing.assert_allclose(found.zeros, sorted(stops), atol=1e-9)
    # The crank angle varies the distance between the outer ends of coupler and rocker. The margin
    # is sin^2 of the angle between coupler and rocker.
    sides = np.abs(np.linspace(abs(a - d), a + d, 2001))
    cosine = (b * b + c * c - sides**2) / (2 * b * c)
    assert found.least == pytest.approx((1 - cosine**2).min(), abs=1e-5)


def test_dead_points_of_multi_coordinate_margins_are_not_listed():
    (far,) = dead_values(
        solved(read_text((ROBOTS / "five_bar.toml").read_text(), file="five_bar.toml"))
    )
    assert far is None
