"""Planar platforms on legs of joints that turn or slide: modes and velocities."""

import numpy as np
import pytest

from bench.accuracy import planar_modes
from bench.cases.planar_platforms import drawn_platform

FUNCTIONS = ("modes", "velocity_relation", "chain_fk")
STARTS = 100
STEP = 1e-6
A_CRANK_AND_TWO_LINES = (("RRR", 0), ("RPR", 2), ("PRR", 2))


@pytest.fixture(scope="module")
def legs(tmp_path_factory):
    platform = drawn_platform(np.random.default_rng(6), A_CRANK_AND_TWO_LINES)
    return platform, planar_modes.derived(platform, tmp_path_factory.mktemp("legs"), FUNCTIONS)


def test_no_mode_of_newtons_iteration_is_missed(legs):
    platform, robot = legs
    generator = np.random.default_rng(5)
    q = np.array(robot.reference.q)
    row = planar_modes.compared(robot, platform, q, generator, STARTS)
    assert row.modes >= 2
    assert (row.missed, row.wrong, row.unsure) == (0, 0, False)


def test_rates_are_those_of_the_modes(legs):
    _, robot = legs
    q = np.array(robot.reference.q)
    found = robot.fk_all(q)
    assert found.sure
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


def test_the_polynomial_is_zero_at_every_mode(legs):
    _, robot = legs
    q = np.array(robot.reference.q)
    found = robot.fk_all(q)
    a0, *rest = robot.assembly_polynomial(q)
    for phi in found.theta[found.valid, 2]:
        value = a0 + sum(
            a * np.cos(k * phi) + b * np.sin(k * phi)
            for k, (a, b) in enumerate(zip(rest[::2], rest[1::2], strict=True), 1)
        )
        assert abs(value) < 1e-10 * np.abs([a0, *rest]).max()
