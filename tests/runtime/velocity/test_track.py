"""`track` follows pose paths through singularities and at limits, for every robot."""

import pickle
import subprocess
import sys

import numpy as np
import pytest

import chasles
from chasles import se3, so3
from chasles.velocity._track import BORDER, DAMPING
from tests.support.handwritten import snake
from tests.support.optional import OptionalPackage
from tests.support.rate_inputs import span
from tests.support.waiting import SECONDS

optimize = OptionalPackage("scipy.optimize")

STEPS = 100_000
REGULAR = np.array([0.3, -1.2, 1.5, -0.4, 0.9, 0.2])
IN_LINE = np.array([0.3, -1.2, 1.5, -0.4, 0.0, 0.2])
"""The second wrist joint is at 0, so the first and third wrist axes are parallel."""
RATE = np.pi
AWAY = 0.05
"""A pose counts as regular above this singular value, which corresponds to a wrist angle of five
degrees."""


@pytest.fixture(scope="module")
def arm():
    return chasles.load("ur5e")


def lost(arm, q):
    """Return the left singular vector of the body Jacobian for the smallest singular value.

    At a singularity, the arm cannot perform the tool twist that this singular vector describes.
    """
    return np.linalg.svd(arm.jacobian_body(q))[0][:, -1]


def through(arm, q, twist, m=STEPS + 1):
    """Return poses of a screw motion through the pose of q, and a start configuration."""
    poses = arm.fk(q) @ se3.exp(np.linspace(-1, 1, m)[:, None] * twist)
    return poses, arm.ik(poses[0]).within_limits().nearest(q)


def load_snake(path, *shape):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CHASLES_CACHE", str(path / "cache"))
        return chasles.load(snake.write(path / "snake", *shape).path)


def assert_sound(robot, track, dt, rate=np.inf):
    """Assert properties that hold exactly for every tracked path."""
    assert np.isfinite(track.q).all()
    assert np.isfinite(track.error).all()
    np.testing.assert_array_equal(track.q, np.clip(track.q, robot.lower, robot.upper))
    np.testing.assert_array_equal(track.qd, np.diff(track.q, axis=0) / dt)
    assert (np.abs(track.qd) <= rate).all()
    assert (np.abs(np.diff(track.q, axis=0)) <= np.asarray(rate) * dt).all()


def test_track_of_regular_path_matches_inverse(arm):
    poses = se3.interpolate_straight(
        arm.fk(REGULAR),
        arm.fk(np.add(REGULAR, [0.5, 0.2, -0.3, 0.1, 0.3, 0.4])),
        np.linspace(0, 1, 5001),
    )
    track = arm.track(poses, REGULAR, 1e-3)
    assert_sound(arm, track, 1e-3)
    path = arm.ik_path(poses, REGULAR)
    assert path.complete
    np.testing.assert_allclose(track.q, path.q, rtol=0, atol=1e-7)
    assert track.error.max() < 1e-7
    assert (len(track.at_rate_limit), len(track.at_limit), len(track.shortened_steps)) == (0, 0, 0)
    T = arm.fk(track.q)
    distance = np.linalg.norm((T - poses)[:, :3, 3], axis=-1)
    np.testing.assert_allclose(track.error[:, 0], distance, rtol=0, atol=1e-15)
    angle = np.linalg.norm(se3.log(se3.inverse(T) @ poses)[:, 3:], axis=-1)
    np.testing.assert_allclose(track.error[:, 1], angle, rtol=0, atol=1e-15)
    again = pickle.loads(pickle.dumps(track))
    np.testing.assert_array_equal(again.q, track.q)
    assert track.max_angle == track.error[track.max_angle_index, 1] == track.error[:, 1].max()


def test_track_passes_wrist_singularity_accurately(arm):
    s = np.linspace(-1, 1, STEPS + 1)
    q = IN_LINE + s[:, None] * [0.2, 0.3, -0.2, 0.1, 0.6, 0.3]
    track = arm.track(arm.fk(q), q[0], 1e-3, rate_limits=RATE)
    assert_sound(arm, track, 1e-3, RATE)
    assert track.min_singular_value < 1e-6
    assert abs(track.min_singular_value_index - STEPS // 2) <= 1
    np.testing.assert_allclose(track.q, q, rtol=0, atol=1e-3)
    away = track.singular_value > AWAY
    assert 0.8 < away.mean() < 1
    np.testing.assert_allclose(track.q[away], q[away], rtol=0, atol=1e-8)
    assert track.error[away].max() < 1e-9
    assert track.error.max() < 1e-5
    assert not track.at_rate_limit


@pytest.mark.parametrize(
    ("offset", "rate"), [(0.0, RATE), (1e-6, 0.5), (1e-3, RATE), (0.01, 0.5), (0.03, RATE)]
)
def test_track_passes_near_wrist_singularity_within_error_bound(arm, offset, rate):
    # The smaller the distance from the singularity, the faster the wrist rotates.
    q = np.add(IN_LINE, [0, 0, 0, 0, offset, 0])
    poses, q0 = through(arm, q, 0.5 * lost(arm, IN_LINE))
    track = arm.track(poses, q0, 1e-3, rate_limits=rate)
    assert_sound(arm, track, 1e-3, rate)
    away = track.singular_value > AWAY
    assert 0.7 < away.mean() < 1
    assert track.error[away].max() < 1e-6
    assert track.error[-1].max() < 1e-9
    assert track.error.max() < 0.015
    assert track.min_singular_value < 0.03


def test_track_leaves_initial_wrist_singularity(arm):
    twist = lost(arm, IN_LINE) * 0.6
    poses = arm.fk(IN_LINE) @ se3.exp(np.linspace(0, 1, STEPS + 1)[:, None] * twist)
    track = arm.track(poses, IN_LINE, 1e-3, rate_limits=RATE)
    assert_sound(arm, track, 1e-3, RATE)
    assert track.singular_value[0] < 1e-14
    assert track.error.max() < 0.005
    assert track.error[track.singular_value > AWAY].max() < 1e-6
    assert "At its rate limit: wrist_1 in" in str(track)


def test_track_error_at_wrist_singularity_respects_documented_bound(arm):
    rng = np.random.default_rng(5)
    checked = 0
    while checked < 20:
        q = IN_LINE + rng.uniform(-0.5, 0.5, 6) * [1, 0.5, 0.5, 1, 0, 1]
        q[4] = rng.choice([0, 1e-4, 1e-3, 0.01, 0.03])
        twist = rng.normal(size=6) * [0.1, 0.1, 0.1, 0.2, 0.2, 0.2]
        twist = lost(arm, q) * 0.3 if rng.random() < 0.4 else twist
        poses, q0 = through(arm, q, twist, 4001)
        if not arm.ik(poses[::50]).valid.all():
            continue
        dt, length = rng.choice([1e-3, 1e-2]), 0.5
        rate = rng.choice([RATE, 1.0])
        track = arm.track(poses, q0, dt, rate_limits=rate, characteristic_length=length)
        assert_sound(arm, track, dt, rate)
        step = np.hypot(np.linalg.norm(twist[:3]), length * np.linalg.norm(twist[3:])) / 2000
        error = np.hypot(track.error[:, 0], length * track.error[:, 1])
        bound = step / dt * np.pi / rate + (432 * (DAMPING * length) ** 2 * step) ** (1 / 3)
        assert error.max() < bound
        checked += 1
    assert checked == 20


def costs(robot, q, target, rate, dt, length):
    """Return the cost of a tracking step, and the smallest cost that SciPy finds.

    The third result is the number of joints at their rate limits.
    """
    T, J = robot.fk_jacobian_mixed(q)
    track = robot.track([T, target], q, dt, rate_limits=rate, characteristic_length=length)
    assert_sound(robot, track, dt, rate)
    turn = so3.log((target @ se3.inverse(T))[:3, :3])
    scale = np.array([1, 1, 1, length, length, length])
    b = scale * np.concatenate([(target - T)[:3, 3], turn])
    A = scale[:, None] * J
    unit = np.linalg.norm(A, axis=0)
    s, Vt = np.linalg.svd(A / unit, full_matrices=False)[1:]
    damping = DAMPING * np.sqrt(np.maximum(1 - (s / BORDER) ** 2, 0))
    A = np.concatenate([A, (damping * (s > 1e-9))[:, None] * Vt * unit])
    b = np.append(b, np.zeros(len(s)))
    least = optimize.lsq_linear(A, b, (-rate * dt, rate * dt), tol=1e-14).cost
    return np.sum((A @ (track.q[1] - q) - b) ** 2) / 2, least, len(track.at_rate_limit)


def test_track_step_solves_bounded_least_squares(arm):
    rng = np.random.default_rng(11)
    held = 0
    for _ in range(60):
        q = rng.uniform(-2, 2, 6)
        q[4] *= rng.choice([1, 0.01])
        target = arm.fk(q) @ se3.exp(rng.normal(size=6) * 0.02)
        cost, least, touched = costs(arm, q, target, rng.uniform(0.5, 3, 6), 0.01, 0.4)
        assert cost <= least * (1 + 1e-6) + 1e-14
        held += touched
    assert held > 30


def test_joints_stop_at_their_limits(arm):
    # On the path, the elbow would exceed its limit. The arm follows the path as far as possible,
    # and later returns to the path.
    s = np.concatenate([np.linspace(0, 1, 501), np.linspace(1, 0, 501)])
    q = REGULAR + [0, 0, 1.3, 0, 0, 0] + s[:, None] * [0.1, 0.2, 0.6, 0, 0, 0]
    assert q[:, 2].max() > arm.upper[2]
    track = arm.track(arm.fk(q), q[0], 0.01)
    assert_sound(arm, track, 0.01)
    assert track.q[:, 2].max() == arm.upper[2]
    assert list(track.at_limit) == ["elbow"]
    held = track.at_limit["elbow"]
    np.testing.assert_array_equal(track.q[held + 1, 2], arm.upper[2])
    assert track.error[held + 1].max(-1).max() > 0.01
    assert "At a limit: elbow in" in str(track)
    np.testing.assert_allclose(track.q[-1], q[-1], atol=1e-4)


def test_track_of_unreachable_pose_comes_to_rest(arm):
    # The target is ten centimeters out of reach: the stretched arm points to the target and stops.
    q0 = np.array([0.1, -0.6, 0.9, -0.8, 1.2, 0.0])
    T = arm.fk(q0)
    out = np.append(T[:2, 3] / np.linalg.norm(T[:2, 3]), 0)
    end = T.copy()
    end[:3, 3] += 0.5 * out
    m = 20_001
    poses = se3.interpolate_straight(T, end, np.minimum(np.linspace(0, 2, m), 1))
    track = arm.track(poses, q0, 1e-3, rate_limits=RATE)
    assert_sound(arm, track, 1e-3, RATE)
    assert not arm.ik(end).valid.any()
    assert 0.01 < track.error[-1, 0] < 0.5
    assert np.abs(track.qd[-m // 4 :]).mean() < 0.01


def test_track_converges_from_offset_start(arm):
    poses = np.broadcast_to(arm.fk(REGULAR), (200, 4, 4))
    track = arm.track(poses, REGULAR + 0.4, 0.01)
    assert_sound(arm, track, 0.01)
    np.testing.assert_allclose(track.q[-1], REGULAR, atol=1e-12)
    slow = arm.track(poses, REGULAR + 0.4, 0.01, gain=2.0)
    # Each time step dt multiplies the error by 1 - gain dt.
    np.testing.assert_allclose(slow.error[101] / slow.error[100], 0.98, atol=1e-3)


@pytest.mark.parametrize("name", chasles.robots())
def test_every_robot_with_jacobian_tracks_its_own_path(name):
    robot = chasles.load(name)
    if "fk_jacobian_mixed" not in robot.functions:
        with pytest.raises(AttributeError, match="has no 'track'"):
            robot.track([np.eye(4)], np.zeros(robot.n), 0.01)
        return
    q = start_and_end(robot)
    poses = robot.fk_jacobian_mixed(q)[0]
    track = robot.track(poses, q[0], 0.01)
    assert_sound(robot, track, 0.01)
    assert track.error.max() < 1e-4
    assert track.error[-1].max() < 1e-4


def start_and_end(robot):
    """Return a short joint motion that starts at a regular pose.

    Forward kinematics is finite along the motion.
    """
    rng = np.random.default_rng(1)
    lower, upper = span(robot, 2.0)
    for _ in range(1000):
        q0 = lower + rng.uniform(0.3, 0.7, robot.n) * (upper - lower)
        if robot.reference is not None:
            margin = 0.1 * (upper - lower)
            q0 = np.clip(robot.reference.q, lower + margin, upper - margin)
        ahead = rng.uniform(-0.05, 0.05, robot.n) * np.minimum(upper - lower, 1)
        q = q0 + np.linspace(0, 1, 1001)[:, None] * ahead
        inside = ((q >= robot.lower) & (q <= robot.upper)).all()
        T, J = robot.fk_jacobian_mixed(q)
        J = J[0] / np.linalg.norm(J[0], axis=0)
        if inside and np.isfinite(T).all() and rank(J, 0.02) == rank(J, 1e-9):
            return q
    raise AssertionError(robot.name)


def rank(J, tolerance):
    return np.linalg.matrix_rank(J, tolerance)


@pytest.mark.parametrize("n", [1, 3, 64])
def test_track_works_for_few_and_many_joints(tmp_path, n):
    robot = load_snake(tmp_path, n, 0.8)
    q0 = np.full(n, 0.4 / n)
    q = q0 + np.linspace(0, 1, 501)[:, None] * np.linspace(-0.3, 0.4, n)
    rate = np.linspace(0.1, 1, n)
    track = robot.track(robot.fk_jacobian_mixed(q)[0], q0, 0.01, rate_limits=rate)
    assert_sound(robot, track, 0.01, rate)
    assert track.error[-1].max() < 1e-3
    # The joints need two steps to the target, even at full speed.
    target = robot.fk_jacobian_mixed(q0 + 0.02 * rate)[0]
    cost, least, touched = costs(robot, q0, target, rate, 0.01, 1.0)
    assert cost <= least * (1 + 1e-3) + 1e-12
    assert touched >= n // 2


def test_track_stops_at_end_of_fk_domain(tmp_path):
    robot = load_snake(tmp_path, 3)
    q = np.linspace([0.9, 0.5, 0.5], [0.99, 0.4, 0.5], 101)
    poses = robot.fk_jacobian_mixed(q)[0]
    more = se3.interpolate(poses[0], poses[-1], np.linspace(0, 3, 301))
    track = robot.track(more, q[0], 0.01)
    assert_sound(robot, track, 0.01)
    assert len(track.shortened_steps)
    assert track.q[-1, 0] <= snake.WALL
    assert track.q[-1, 0] == pytest.approx(snake.WALL, abs=1e-3)
    assert "forward kinematics is not defined further on" in str(track)
    with pytest.raises(chasles.InputError, match="not defined at q_start"):
        robot.track(more, [1.1, 0, 0], 0.01)


def test_single_pose_gives_valid_track(arm):
    track = arm.track([arm.fk(REGULAR)], REGULAR, 0.01)
    assert (track.q.shape, track.qd.shape) == ((1, 6), (0, 6))
    assert str(track).startswith("1 poses followed within")


BAD = [
    ({"T": np.zeros((0, 4, 4))}, chasles.ShapeError, r"T \(m, 4, 4\)"),
    ({"T": np.eye(4)}, chasles.ShapeError, r"T \(m, 4, 4\)"),
    ({"T": [np.eye(4), np.full((4, 4), np.nan)]}, chasles.InputError, "1. is not finite"),
    ({"T": [np.diag([1, 1, -1, 1])]}, chasles.InputError, "left-handed"),
    ({"T": [np.eye(4) * 1.1]}, chasles.InputError, r"T\[0\] is no pose: its last"),
    ({"q_start": np.zeros(5)}, chasles.ShapeError, r"q_start \(6,\)"),
    ({"q_start": np.array([0, 0, 4, 0, 0, 0])}, chasles.InputError, "elbow is outside its limits"),
    ({"q_start": np.array([np.nan, 0, 0, 0, 0, 0])}, chasles.InputError, "shoulder_pan is outside"),
    ({"dt": 0.0}, chasles.InputError, "dt must be a positive number"),
    ({"dt": np.nan}, chasles.InputError, "dt must be a positive number"),
    ({"gain": 101.0}, chasles.InputError, "gain must be in"),
    (
        {"characteristic_length": -1.0},
        chasles.InputError,
        "track: characteristic_length must be positive",
    ),
    ({"rate_limits": [1.0, 2.0]}, chasles.ShapeError, r"expected rate_limits of shape"),
    ({"rate_limits": 0.0}, chasles.InputError, "every rate limit is 0"),
    ({"rate_limits": -1.0}, chasles.InputError, "expected rate_limits >= 0"),
    ({"rate_limits": np.nan}, chasles.InputError, "expected rate_limits >= 0"),
]


@pytest.mark.parametrize(
    ("change", "error", "message"),
    BAD,
    ids=[
        "no poses",
        "single pose",
        "nan pose",
        "left-handed pose",
        "scaled pose",
        "short q_start",
        "q_start beyond limit",
        "nan q_start",
        "zero dt",
        "nan dt",
        "large gain",
        "negative length",
        "short rate limits",
        "zero rate limits",
        "negative rate limits",
        "nan rate limits",
    ],
)
def test_invalid_track_arguments_are_rejected(arm, change, error, message):
    given = {"T": [arm.fk(REGULAR)], "q_start": REGULAR, "dt": 0.01, **change}
    with pytest.raises(error, match=message):
        arm.track(**given)


ENDLESS = """
import numpy as np, chasles
from chasles import se3, so3
arm = chasles.load("ur5e")
q = np.array([0.3, -1.2, 1.5, -0.4, 0.9, 0.2])
start = arm.fk(q)
poses = se3.interpolate_straight(
    start, start @ se3.exp([0.1, 0.2, -0.1, 0, 0.3, 0.4]), np.linspace(0, 1, 101)
)
poses[:, :3, 3] *= 5
track = arm.track(poses, q, 0.01, rate_limits=3.0)
assert np.abs(track.qd).max() <= 3.0
assert np.abs(track.q).min() < 1e-12
"""


def test_step_that_ends_near_zero_terminates():
    subprocess.run([sys.executable, "-c", ENDLESS], check=True, timeout=SECONDS)
