"""Motions follow their curves exactly, and their derivatives match finite differences."""

import numpy as np
import pytest

import chasles
from chasles import so3
from chasles.errors import InputValueError, OutOfReachError
from chasles.study.motion import (
    Motion,
    Trajectory,
    arc,
    blend,
    concatenate,
    joint_line,
    limit_violations,
    line,
    parabola,
    spline,
    time_optimal,
    time_scaling,
)
from chasles.study.motion.time_optimal import _stretch


@pytest.fixture(scope="module")
def arm():
    return chasles.load("ur5e")


HOME = np.array([0, -1, 1.2, -0.4, 0.5, 0])


def curves(robot, rng, count):
    made = 0
    while made < count:
        q = HOME + rng.uniform(-0.5, 0.5, 6)
        T = robot.fk(q + np.cumsum(np.r_[np.zeros((1, 6)), rng.uniform(-0.15, 0.15, (3, 6))], 0))
        made_of = (
            line(T[0], T[2]),
            arc(T[0], T[1, :3, 3], T[2]),
            spline(T),
            parabola(T[:3]),
        )
        yield made_of[made % 4], q
        made += 1


def test_motion_stays_on_curve_with_exact_derivatives(arm):
    checked = 0
    for curve, q in curves(arm, np.random.default_rng(1), 4):
        motion = Motion(arm, curve, time_scaling("quintic", curve.length, duration=2.0), q)
        t, h = np.linspace(0, 2, 1001, retstep=True)
        try:
            found = motion.at(t)
        except OutOfReachError:
            continue
        np.testing.assert_allclose(found.T, curve.at(motion.time_scaling.at(t)[0]).T, atol=1e-9)
        rates = (found.q[2:] - found.q[:-2]) / (2 * h)
        most = np.abs(found.qd).max()
        np.testing.assert_allclose(rates, found.qd[1:-1], atol=1e-3 * most)
        slopes = (found.qd[2:] - found.qd[:-2]) / (2 * h)
        most = np.abs(found.qdd).max()
        np.testing.assert_allclose(slopes, found.qdd[1:-1], atol=1e-2 * most)
        checked += 1
    assert checked >= 3


def test_curve_arc_length_derivatives_match_differences():
    rng = np.random.default_rng(2)
    arm = chasles.load("ur5e")
    h = 1e-5
    for curve, _ in curves(arm, rng, 4):
        s = np.linspace(0.1, 0.9, 5) * curve.length
        T, V, A = curve.at(s)
        before, after = curve.at(s - h), curve.at(s + h)
        moved = (after.T[:, :3, 3] - before.T[:, :3, 3]) / (2 * h)
        turned = so3.log(after.T[:, :3, :3] @ np.swapaxes(before.T[:, :3, :3], 1, 2))
        np.testing.assert_allclose(np.hstack([moved, turned / (2 * h)]), V, atol=1e-6)
        np.testing.assert_allclose((after.V - before.V) / (2 * h), A, atol=1e-4)
        assert np.isfinite(T).all()


def test_lines_are_straight_and_arcs_round(arm):
    rng = np.random.default_rng(3)
    T_a, T_b = arm.fk(HOME), arm.fk(HOME + rng.uniform(-0.2, 0.2, 6))
    found = Motion(
        arm, straight := line(T_a, T_b), time_scaling("s_curve", straight.length, duration=1), HOME
    )
    p = found.sample(1000).T[:, :3, 3]
    along = (T_b - T_a)[:3, 3] / straight.length
    off = (p - p[0]) - ((p - p[0]) @ along)[:, None] * along
    assert np.linalg.norm(off, axis=1).max() < 1e-9
    via = (T_a + T_b)[:3, 3] / 2 + 0.1 * np.cross(along, [0, 0, 1])
    curve = arc(T_a, via, T_b)
    points = curve.at(np.linspace(0, curve.length, 50)).T[:, :3, 3]
    np.testing.assert_allclose(np.linalg.norm(points - curve.center, axis=1), curve.radius)
    np.testing.assert_allclose(points[-1], T_b[:3, 3], atol=1e-12)
    assert np.linalg.norm(points - via, axis=1).min() < 0.01


def test_unreachable_curve_raises_with_progress(arm):
    T = arm.fk(HOME)
    far = T.copy()
    far[0, 3] += 2
    curve = line(T, far)
    with pytest.raises(OutOfReachError, match=r"% of the curve the motion stops: ended"):
        Motion(arm, curve, time_scaling("cubic", curve.length, duration=1), HOME).sample()


def test_time_optimal_motion_saturates_but_respects_limits(arm):
    checked = 0
    for curve, q in curves(arm, np.random.default_rng(4), 4):
        motion = Motion(arm, curve, time_scaling("cubic", curve.length, duration=1), q)
        rates, accelerations = np.full(6, 1.5), np.linspace(2, 6, 6)
        try:
            fast = time_optimal(
                motion, rate_limits=rates, acceleration_limits=accelerations, tool_speed=0.3
            )
        except OutOfReachError:
            continue
        found = fast.at(np.linspace(0, fast.duration, 10 * 400))
        assert not limit_violations(
            arm, found, rate_limits=rates * 1.000001, acceleration_limits=accelerations * 1.000001
        )
        speed = np.linalg.norm(found.V[:, :3], axis=1)
        assert speed.max() <= 0.3 * 1.000001
        # At each time at least one limit is active, so no faster time scaling exists.
        used = np.maximum(np.abs(found.qd) / rates, np.abs(found.qdd) / accelerations).max(1)
        assert np.quantile(np.maximum(used, speed / 0.3), 0.1) > 0.95
        checked += 1
    assert checked >= 4


def test_time_optimal_single_joint_motion_is_trapezoidal(arm):
    to = HOME + np.eye(6)[1]
    motion = Motion(arm, joint_line(HOME, to), time_scaling("cubic", 1, duration=9), HOME)
    fast = time_optimal(motion, rate_limits=0.5, acceleration_limits=2)
    assert fast.duration == pytest.approx(1 / 0.5 + 0.5 / 2, rel=1e-3)


def test_time_scaling_longer_than_curve_is_rejected(arm):
    with pytest.raises(
        InputValueError, match="time scaling and the curve have different lengths: 2 and 1"
    ):
        Motion(arm, joint_line(HOME, HOME + 0.1), time_scaling("cubic", 2, duration=1), HOME)


def test_limit_violations_are_reported_with_amount_and_time(arm):
    motion = Motion(
        arm, joint_line(HOME, HOME + 3 * np.eye(6)[2]), time_scaling("cubic", 1, duration=1), HOME
    )
    found = limit_violations(
        arm, motion.sample(), rate_limits=4, acceleration_limits=[99, 99, 10, 99, 99, 99]
    )
    assert [(own.coordinate, own.limit) for own in found] == [
        ("elbow", "upper"),
        ("elbow", "rate"),
        ("elbow", "acceleration"),
    ]
    assert found[1].amount == pytest.approx(0.5, rel=1e-3)
    assert found[1].t == pytest.approx(0.5)
    assert "elbow exceeds its rate limit by 0.5 at 0.5" in str(found[1])


def test_trajectory_plot_has_time_axis(arm):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    timed = time_scaling("quintic", 1, duration=1)
    axes = Motion(arm, joint_line(HOME, HOME + 0.1), timed, HOME).sample(20).plot()
    assert axes[2].get_xlabel() == "time [s]"


def test_concatenate_needs_trajectories():
    with pytest.raises(
        InputValueError, match="expected one or more trajectories of the same robot"
    ):
        concatenate([])


def test_parabolas_and_blends_pass_through_their_poses(arm):
    rng = np.random.default_rng(7)
    for _ in range(5):
        T = arm.fk(HOME + np.cumsum(rng.uniform(-0.3, 0.3, (5, 6)), 0))
        bent = parabola(T[:3])
        s = np.r_[0, np.cumsum(np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1))]
        np.testing.assert_allclose(bent.at(s[:3]).T, T[:3], atol=1e-12)
        radius = 0.4 * np.diff(s).min()
        cut = blend(T, radius)
        np.testing.assert_allclose(cut.at(s[[0, -1]]).T, T[[0, -1]], atol=1e-12)
        corners = cut.at(s[1:-1])
        np.testing.assert_allclose(corners.T[:, :3, :3], T[1:-1, :3, :3], atol=1e-12)
        assert np.linalg.norm(corners.T[:, :3, 3] - T[1:-1, :3, 3], axis=1).max() <= radius / 2
        for near in (s[1:-1] - radius, s[1:-1] + radius):
            before, after = cut.at(near - 1e-9), cut.at(near + 1e-9)
            np.testing.assert_allclose(before.V[:, :3], after.V[:, :3], atol=1e-6)
    with pytest.raises(InputValueError, match="blend: expected a radius above 0, at most"):
        blend(T, 9.0)


def test_rates_near_singularity_match_curve_differences():
    """The tool moves on a line near the configuration with a stretched elbow."""
    arm, checked = chasles.load("iiwa14"), 0
    rng = np.random.default_rng(3)
    while checked < 2:
        q = arm.lower + (arm.upper - arm.lower) * rng.uniform(0.3, 0.7, arm.n)
        if arm.manipulability(q).min_singular_value > 0.03:
            continue
        curve = line(arm.fk(q), arm.fk(q + rng.uniform(-0.02, 0.02, arm.n)))
        motion = Motion(arm, curve, time_scaling("cubic", curve.length, duration=1), q, fixed=2)
        try:
            found = motion.sample(2000)
        except OutOfReachError:
            continue
        differences = (found.q[2:] - found.q[:-2]) * 1000
        atol = 2e-3 * np.abs(found.qd).max()
        np.testing.assert_allclose(differences, found.qd[1:-1], atol=atol)
        checked += 1


class Peak:
    """A one-joint motion with a velocity peak between two samples."""

    def __init__(self, at, width=0.01):
        self.time_scaling, self.middle, self.width = (
            time_scaling("constant", 1.0, duration=1.0),
            at,
            width,
        )

    def at(self, t):
        rate = 1 + 3 * np.exp(-(((t - self.middle) / self.width) ** 2))
        zero = np.zeros((len(t), 1))
        return Trajectory("", ("q",), t, zero, rate[:, None], zero, zero, zero, zero)


@pytest.mark.parametrize("at", [0.185, 0.415, 0.73])
def test_narrow_rate_peaks_between_samples_are_found(at):
    factor, beyond = _stretch(Peak(at), [np.ones(1), np.ones(1)], None)
    assert factor == pytest.approx(4, rel=0.02)
    assert np.abs(beyond - at).min() < 0.01
