"""Assembly modes and velocities of planar platforms with revolute and prismatic joints."""

from dataclasses import replace

import numpy as np
import pytest

from chasles.derive import read_text
from tests.campaigns import planar
from tests.support.compiling import compiled
from tests.support.generators.planar_platforms import drawn_platform

FUNCTIONS = ("modes", "velocity_relation", "chain_fk", "actuators_all")
LINE_FUNCTIONS = ("modes", "actuators_all")
STARTS = 30
STEP = 1e-6
A_CRANK_AND_TWO_LINES = (("RRR", 0), ("RPR", 2), ("PRR", 2))
THREE_LINES = (("PRP", 2), ("RRP", 0), ("RPP", 1))
"""Leg types, and for each type the number of lines fixed on the platform."""
CLOSED, SAME, FAR = 1e-12, 1e-6, 20.0


@pytest.fixture(scope="module")
def lines(tmp_path_factory):
    platform = drawn_platform(np.random.default_rng(7), THREE_LINES)
    return platform, derived(platform, tmp_path_factory.mktemp("lines"), LINE_FUNCTIONS)


@pytest.fixture(scope="module")
def legs(tmp_path_factory):
    platform = drawn_platform(np.random.default_rng(6), A_CRANK_AND_TWO_LINES)
    return platform, derived(platform, tmp_path_factory.mktemp("legs"), FUNCTIONS)


def derived(platform, folder, functions):
    described = read_text(platform.text("platform"))
    return compiled(described, folder / "platform", functions, planar.LANGUAGES)


def test_modes_contain_every_newton_solution(legs):
    platform, robot = legs
    generator = np.random.default_rng(5)
    q = np.array(robot.reference.q)
    row = planar.compared(robot, platform, q, generator, STARTS)
    assert row.modes >= 2
    assert (row.missed, row.wrong, row.unsure) == (0, 0, False)


def test_velocity_relation_matches_mode_differences(legs):
    _, robot = legs
    q = np.array(robot.reference.q)
    found = robot.fk_all(q)
    assert found.complete
    for slot in np.flatnonzero(found.valid):
        theta = found.theta[slot]
        J_x, J_q = robot.functions["velocity_relation"](theta, q)
        for qd in np.eye(3):
            ahead, behind = (robot.fk_all(q + side * STEP * qd).theta for side in (1, -1))
            near = [x[np.nanargmin(np.abs(x - theta).max(-1))] for x in (ahead, behind)]
            rate = (near[0] - near[1]) / (2 * STEP)
            # The tool is the origin of the platform, so the rates of theta are the tool's twist.
            size = np.abs(J_x).max() * np.abs(rate).max()
            np.testing.assert_allclose(J_x @ rate, J_q @ qd, rtol=0, atol=1e-6 * size)


def test_assembly_polynomial_vanishes_at_every_mode(legs):
    _, robot = legs
    q = np.array(robot.reference.q)
    found = robot.fk_all(q)
    a0, *rest = robot.functions["assembly_polynomial"](q)
    for phi in found.theta[found.valid, 2]:
        value = a0 + sum(
            a * np.cos(k * phi) + b * np.sin(k * phi)
            for k, (a, b) in enumerate(zip(rest[::2], rest[1::2], strict=True), 1)
        )
        assert abs(value) < 1e-10 * np.abs([a0, *rest]).max()


def test_modes_are_complete_for_three_line_platform(lines):
    platform, robot = lines
    generator = np.random.default_rng(7)
    q = platform.q + generator.uniform(-0.2, 0.2, 3)
    row = planar.compared(robot, platform, q, generator, STARTS)
    assert (row.missed, row.wrong, row.unsure) == (0, 0, False)
    assert row.modes >= 2


@pytest.mark.parametrize("name", ["legs", "lines"])
def test_ik_planar_contains_every_newton_leg_solution(name, request):
    generator = np.random.default_rng(2)
    platform, robot = request.getfixturevalue(name)
    # The legs of the platform with a crank reach only two of the three poses.
    poses = platform.pose + generator.uniform(-0.1, 0.1, (3, 3))
    q, _, _, valid = robot.ik_planar(poses)
    counted = 0
    for pose, rows in zip(poses, [a[b] for a, b in zip(q, valid, strict=True)], strict=True):
        expected = [leg_inverse(platform, k, pose, generator) for k in range(3)]
        assert len(rows) == np.prod([len(values) for values in expected])
        for leg, values in enumerate(expected):
            distances = apart(rows[:, leg, None], values, platform.legs[leg])
            if len(rows):
                np.testing.assert_allclose(distances.min(1), 0, atol=SAME)
                np.testing.assert_allclose(distances.min(0), 0, atol=SAME)
        counted += len(rows)
    assert counted >= 3


def apart(one, other, leg):
    """Return the absolute differences between actuator values of a leg (radian or meter)."""
    turns = leg.kinds[leg.actuated] == "R"
    return np.abs(np.angle(np.exp(1j * (one - other))) if turns else one - other)


def leg_inverse(platform, k, pose, generator, starts=60):
    """Compute the actuator values of a leg at a platform pose by Newton's method."""
    leg = platform.legs[k]
    turns = np.array([leg.kinds[i] == "R" for i in (leg.actuated, leg.passive)])
    x = np.where(turns, generator.uniform(-np.pi, np.pi, (starts, 2)), 0)
    x = np.where(turns, x, generator.normal(size=(starts, 2)) * 3)

    alone = replace(platform, legs=(leg,))

    def gaps(x):
        whole = np.concatenate([np.broadcast_to(pose, (len(x), 3)), x[:, 1:]], 1)
        found, facing = alone.excess(whole, x[None, :, 0])
        return found, facing[:, 0]

    for _ in range(60):
        found, _ = gaps(np.concatenate([x + 1e-30j * e for e in np.eye(2)]))
        J = np.stack(np.split(found.imag / 1e-30, 2), -1)
        step = np.linalg.solve(J + 1e-14 * np.eye(2), -found.real[: len(x), :, None])[..., 0]
        x = x + step * np.minimum(1, 0.5 / np.maximum(np.abs(step).max(1, keepdims=True), 0.5))
    found, facing = gaps(x)
    values = x[(np.abs(found).max(1) < CLOSED) & (facing > 0), 0]
    kept = []
    for value in values[np.abs(values) < FAR] if not turns[0] else values:
        if all(apart(value, other, leg) > SAME for other in kept):
            kept.append(value)
    return np.array(kept)
