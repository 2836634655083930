"""Planar platforms on legs of joints that turn or slide: modes, both directions, velocities."""

import numpy as np
import pytest

from bench.accuracy import planar_modes
from bench.cases.planar_platforms import drawn_platform
from chasles.derive import loads
from chasles.derive.loops.hybrid import Hybrid
from chasles.derive.loops.modes.planar_legs import legs_of

FUNCTIONS = ("modes", "actuators", "actuators_all", "velocity_relation", "chain_fk")
STARTS = 300
STEP = 1e-6
THREE_SLIDES = (("PRP", 0), ("PRP", 2), ("PRP", 0))
A_CRANK_AND_TWO_LINES = (("RRR", 0), ("RPR", 2), ("PRR", 2))


def test_no_mode_of_newtons_iteration_is_missed():
    generator = np.random.default_rng(6)
    platform = drawn_platform(generator, A_CRANK_AND_TWO_LINES)
    found = planar_modes.judged(platform, generator, STARTS)
    assert sum(row.modes for row in found) >= 4
    assert not any(row.missed or row.wrong or row.unsure for row in found)


@pytest.fixture(scope="module")
def slides(tmp_path_factory):
    platform = drawn_platform(np.random.default_rng(4), THREE_SLIDES)
    return platform, planar_modes.derived(platform, tmp_path_factory.mktemp("slides"), FUNCTIONS)


def test_three_slides_have_four_modes_at_most(slides):
    platform, robot = slides
    generator = np.random.default_rng(5)
    counts = set()
    for q in robot.reference.q + generator.uniform(-0.3, 0.3, (6, 3)):
        row = planar_modes.compared(robot, platform, q, generator, STARTS)
        assert (row.missed, row.wrong, row.unsure) == (0, 0, False)
        counts.add(row.modes)
    assert counts <= {0, 2, 4}
    assert max(counts) > 0


def test_the_inverse_leads_back_to_the_mode(slides):
    _, robot = slides
    found = robot.fk_all(robot.reference.q)
    assert found.sure
    assert found.valid.any()
    for theta in found.theta[found.valid]:
        q, valid, _ = robot.ik_planar(theta)
        assert np.abs(q[valid] - robot.reference.q).max(-1).min() < 1e-11


def test_rates_are_those_of_the_modes(slides):
    _, robot = slides
    q = np.array(robot.reference.q)
    found = robot.fk_all(q)
    for slot in np.flatnonzero(found.valid):
        theta = found.theta[slot]
        J_x, J_q = robot.velocity_relation(theta, q)
        for qd in np.eye(3):
            ahead, behind = (robot.fk_all(q + side * STEP * qd).theta for side in (1, -1))
            near = [x[np.nanargmin(np.abs(x - theta).max(-1))] for x in (ahead, behind)]
            rate = (near[0] - near[1]) / (2 * STEP)
            # The tool is the platform's origin: the rates of theta are its twist.
            size = np.abs(J_x).max() * np.abs(rate).max()
            np.testing.assert_allclose(J_x @ rate, J_q @ qd, rtol=0, atol=1e-6 * size)


def test_a_leg_that_slides_twice_leaves_no_equation_of_a_position():
    turned = (("RPP", 0), *THREE_SLIDES[:2])
    for kinds, count in ((turned, 0), (THREE_SLIDES, 3), (A_CRANK_AND_TWO_LINES, 2)):
        platform = drawn_platform(np.random.default_rng(4), kinds)
        triad = legs_of(Hybrid(loads(platform.text("legs"))))
        assert (len(triad.lines) if triad else 0) == count
