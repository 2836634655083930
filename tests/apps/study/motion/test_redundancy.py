"""Minimum-norm steps agree with SciPy's least squares, and joint velocities agree with finite
differences."""

import numpy as np
import pytest
from scipy.linalg import lstsq
from scipy.spatial.transform import Rotation

import chasles
from chasles.errors import InputValueError, OutOfReachError
from chasles.study.motion import Motion, joint_line, line, task_line, time_scaling
from chasles.study.motion.redundancy import _require_no_jump, minimum_norm

ARMS = ("iiwa14", "panda")


def lines(robot, rng, count):
    while count:
        q = robot.lower + (robot.upper - robot.lower) * rng.uniform(0.2, 0.8, robot.n)
        if robot.manipulability(q).min_singular_value < 0.1:
            continue
        count -= 1
        yield q, line(robot.fk(q), robot.fk(q + rng.uniform(-0.15, 0.15, robot.n)))


def by_least_squares(robot, T, q):
    """Repeat the iteration with LAPACK's minimum-norm least squares."""
    for _ in range(20):
        reached = robot.fk(q)
        turn = Rotation.from_matrix(T[:3, :3] @ reached[:3, :3].T).as_rotvec()
        error = np.r_[T[:3, 3] - reached[:3, 3], turn]
        q = q + lstsq(robot.jacobian_mixed(q), error)[0]
    return q


@pytest.mark.parametrize("name", ARMS)
def test_minimum_norm_configuration_matches_scipy(name):
    robot, rng, checked = chasles.load(name), np.random.default_rng(1), 0
    for q_0, curve in lines(robot, rng, 3):
        motion = Motion(
            robot,
            curve,
            time_scaling("quintic", curve.length, duration=1),
            q_0,
            redundancy="minimum_norm",
        )
        found = motion.sample(10)
        poses = curve.at(motion.time_scaling.at(found.t)[0]).T
        np.testing.assert_allclose(found.T, poses, atol=1e-12)
        np.testing.assert_allclose(found.q[0], q_0, atol=1e-12)
        for T, q in zip(poses[[4, 10]], found.q[[4, 10]], strict=True):
            np.testing.assert_allclose(q, by_least_squares(robot, T, q_0), atol=1e-9)
            checked += 1
        np.testing.assert_allclose(motion.at(found.t[[3, 9]]).q, found.q[[3, 9]], atol=1e-12)
    assert checked == 6


@pytest.mark.parametrize("name", ARMS)
def test_minimum_norm_derivatives_match_differences(name):
    robot, rng = chasles.load(name), np.random.default_rng(2)
    for q_0, curve in lines(robot, rng, 2):
        motion = Motion(
            robot,
            curve,
            time_scaling("quintic", curve.length, duration=1),
            q_0,
            redundancy="minimum_norm",
        )
        t, h = np.linspace(0, 1, 401, retstep=True)
        found = motion.at(t)
        for values, rates in ((found.q, found.qd), (found.qd, found.qdd)):
            differences = (values[2:] - values[:-2]) / (2 * h)
            most = np.abs(rates).max()
            np.testing.assert_allclose(differences, rates[1:-1], atol=1e-3 * most)
        s, sd, sdd = motion.time_scaling.at(t)
        _, V, A = curve.at(s)
        np.testing.assert_allclose(found.V, V * sd[:, None], atol=1e-12)
        achieved = robot.acceleration_mixed(found.q, found.qd, found.qdd)
        expected = A * (sd**2)[:, None] + V * sdd[:, None]
        np.testing.assert_allclose(achieved, expected, atol=1e-9)


class Bounded:
    """A curve that raises an error outside its parameter range."""

    def __init__(self, curve):
        self.curve, self.length = curve, curve.length

    def at(self, s):
        assert (s >= 0).all()
        assert (s <= self.length * (1 + 1e-12)).all()
        return self.curve.at(s)


@pytest.mark.parametrize("name", ARMS)
def test_minimum_norm_never_evaluates_curve_beyond_ends(name):
    robot = chasles.load(name)
    for q_0, curve in lines(robot, np.random.default_rng(5), 3):
        s = curve.length * np.array([0, 1e-4, 2e-3, 3.9e-3, 0.5, 0.9961, 0.998, 0.9999, 1])
        one, other = (minimum_norm(robot, own, s, q_0) for own in (curve, Bounded(curve)))
        np.testing.assert_array_equal(one.q, other.q)
        # With the extended curve, central differences are possible at both ends of the original
        # curve.
        step = 1e-3 * curve.length
        nodes = s[:, None] + step * np.arange(-2, 3)
        wide = line(*curve.at(np.array([-0.1, 1.1]) * curve.length).T)
        around = minimum_norm(robot, wide, nodes.ravel() + 0.1 * curve.length, q_0).q
        around = around.reshape(*nodes.shape, -1)
        rates = np.einsum("k,mkj->mj", [1 / 12, -2 / 3, 0, 2 / 3, -1 / 12], around) / step
        np.testing.assert_allclose(one.by_s, rates, atol=1e-6 * np.abs(rates).max())


def test_fixed_joint_reduces_minimum_norm_to_nearest_inverse():
    robot = chasles.load("iiwa14")
    q_0, curve = next(lines(robot, np.random.default_rng(3), 1))
    timed = time_scaling("cubic", curve.length, duration=1)
    locked = [
        Motion(robot, curve, timed, q_0, fixed=2, redundancy=chosen).sample(20)
        for chosen in ("minimum_norm", "fixed")
    ]
    np.testing.assert_allclose(locked[0].q, locked[1].q, atol=1e-9)
    np.testing.assert_allclose(locked[0].qd, locked[1].qd, atol=1e-8)


@pytest.mark.parametrize(("name", "parameter"), [("iiwa14", "swivel"), ("panda", "joint7")])
def test_redundancy_parameters_keep_their_values_with_matching_rates(name, parameter):
    robot, checked = chasles.load(name), 0
    for q_0, curve in lines(robot, np.random.default_rng(6), 6):
        timed = time_scaling("quintic", curve.length, duration=1)
        try:
            found = Motion(robot, curve, timed, q_0).sample(400)
        except OutOfReachError:
            continue
        values = robot.swivel(found.q) if parameter == "swivel" else found.q[:, 6]
        np.testing.assert_allclose(values, values[0], atol=1e-9)
        for values, rates in ((found.q, found.qd), (found.qd, found.qdd)):
            differences = (values[2:] - values[:-2]) * 200
            np.testing.assert_allclose(differences, rates[1:-1], atol=1e-3 * np.abs(rates).max())
        stated = float(robot.swivel(q_0) if parameter == "swivel" else q_0[6])
        same = Motion(robot, curve, timed, q_0, fixed={parameter: stated}).sample(400)
        np.testing.assert_allclose(same.q, found.q, atol=1e-9)
        checked += 1
    assert checked >= 2


@pytest.mark.parametrize("redundancy", ["fixed", "minimum_norm"])
def test_mapping_sets_value_of_fixed_joint(redundancy):
    robot = chasles.load("iiwa14")
    q_0, curve = next(lines(robot, np.random.default_rng(3), 1))
    timed, value = time_scaling("cubic", curve.length, duration=1), q_0[2] + 0.02
    motion = Motion(robot, curve, timed, q_0, fixed={"A3": value}, redundancy=redundancy)
    found = motion.sample(20)
    np.testing.assert_allclose(found.q[:, 2], value, atol=1e-12)
    np.testing.assert_allclose(found.T, curve.at(timed.at(found.t)[0]).T, atol=1e-9)


def test_fixed_joints_need_curve_of_pose():
    robot = chasles.load("iiwa14")
    timed = time_scaling("cubic", 1, duration=1)
    with pytest.raises(InputValueError, match="fixed requires a curve of the tool pose"):
        Motion(robot, joint_line(np.zeros(7), np.ones(7)), timed, np.zeros(7), fixed="A3")


def test_invalid_minimum_norm_requests_are_rejected():
    robot = chasles.load("iiwa14")
    q_0, curve = next(lines(robot, np.random.default_rng(4), 1))
    timed = time_scaling("cubic", curve.length, duration=1)
    far = robot.fk(q_0)
    far[0, 3] += 3
    beyond = line(robot.fk(q_0), far)
    long = time_scaling("cubic", beyond.length, duration=1)
    with pytest.raises(
        OutOfReachError,
        match=r"minimum-norm steps from the start do not reach the tool pose at .*% of the curve",
    ):
        Motion(robot, beyond, long, q_0, redundancy="minimum_norm").at([1.0])
    with pytest.raises(InputValueError, match="expected redundancy as one of fixed, minimum_norm"):
        Motion(robot, curve, timed, q_0, redundancy="shortest")
    for other in (joint_line(q_0, q_0), task_line("position", [0, 0, 0], [0, 0, 1])):
        with pytest.raises(
            InputValueError, match=r"a curve of the tool pose for redundancy minimum_norm"
        ):
            Motion(robot, other, timed, q_0, redundancy="minimum_norm")
    installer = chasles.load("board_installer")
    T = installer.fk(installer.reference.q)
    T_up = T.copy()
    T_up[2, 3] += 0.01
    q_0, timed = np.array(installer.reference.q), time_scaling("cubic", 0.01, duration=1)
    motion = Motion(installer, line(T, T_up), timed, q_0, redundancy="minimum_norm")
    with pytest.raises(InputValueError, match="8 joints for 6 coordinates"):
        motion.sample()


def test_jump_between_adjacent_samples_is_rejected():
    """Adjacent samples converge to configurations that are not connected."""
    robot = chasles.load("iiwa14")
    _, curve = next(lines(robot, np.random.default_rng(4), 1))
    theta = np.zeros((3, 5, 7))
    s = curve.length * np.array([0.1, 0.5, 0.9])
    _require_no_jump(robot, curve, s, theta)
    theta[1, 3:, 2] = 1.0
    with pytest.raises(OutOfReachError, match=r"a joint jumps by 1 at 50.0% of the curve$"):
        _require_no_jump(robot, curve, s, theta)
