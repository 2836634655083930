"""Fixed joints agree with Pinocchio's reduced models, which lack these joints."""

import random

import numpy as np
import pytest

import chasles
from chasles.velocity import _rates

pin = pytest.importorskip("pinocchio", reason="the oracle needs the extra `crosscheck`")

SERIAL = ["ur5e", "puma560", "panda", "iiwa14", "stanford", "scara", "lynxmotion", "photo_robot"]
BORDER = 0.05
"""Singular value below which the solver damps the joint rates in these tests. Many random
configurations have singular values below 0.05."""
AGREES = 1e-9
"""Allowed relative difference from NumPy's joint rates at a condition number of 1 / BORDER."""
CHAINS, POSES = 300, 4
MIXED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


def model_of(S, M):
    """Build the Pinocchio model of a chain with home screws S (6, n) and tool home pose M."""
    model, parent, at = pin.Model(), 0, pin.SE3.Identity()
    for k, (v, w) in enumerate(zip(S[:3].T, S[3:].T, strict=True)):
        turns = np.linalg.norm(w) > 0.5
        here = pin.SE3(np.eye(3), np.cross(w, v) if turns else np.zeros(3))
        axis = w if turns else v
        kind = pin.JointModelRevoluteUnaligned if turns else pin.JointModelPrismaticUnaligned
        parent = model.addJoint(parent, kind(axis), at.inverse() * here, f"j{k}")
        frame = model.addJointFrame(parent)
        at = here
    placement = at.inverse() * pin.SE3(M[:3, :3], M[:3, 3])
    tool = pin.Frame("tool", parent, frame, placement, pin.FrameType.OP_FRAME)
    model.addFrame(tool)
    return model


def reduced_jacobian(model, q, locked):
    """Return the tool's mixed Jacobian (6, free) without the fixed joints."""
    reduced = pin.buildReducedModel(model, [int(k) + 1 for k in np.flatnonzero(locked)], q)
    data = reduced.createData()
    return pin.computeFrameJacobian(
        reduced, data, q[~locked], reduced.getFrameId("tool"), MIXED
    ).reshape(6, -1)


def damped(J, V, unit, length, rank):
    """Solve the damped least-squares equation of rates.py.

    Returns joint rates and the smallest singular value of the Jacobian.
    """
    row = np.repeat([1 / length, 1.0], 3)
    U, sigma, W = np.linalg.svd(row[:, None] * J * unit, full_matrices=False)
    U, sigma, W = U[:, :rank], sigma[:rank], W[:rank]
    factor = np.where(sigma < BORDER, sigma / BORDER**2, 1 / np.maximum(sigma, BORDER))
    return unit * (W.T @ (factor * (U.T @ (row * V)))), sigma[-1]


def random_locks(rng, n):
    locked = np.zeros(n, bool)
    locked[rng.choice(n, rng.integers(1, n), replace=False)] = True
    return locked


@pytest.mark.parametrize("name", SERIAL)
def test_rates_with_fixed_joints_match_reduced_model(name):
    robot = chasles.load(name)
    zero = np.zeros(robot.n)
    model = model_of(robot.jacobian_space(zero), robot.fk(zero))
    rng = np.random.default_rng(robot.n)
    length = robot.characteristic_length
    compared = 0
    for q in rng.uniform(-2, 2, (30, robot.n)):
        locked, V = random_locks(rng, robot.n), rng.normal(size=6)
        chosen = [robot.coordinates[k].name if k % 2 else int(k) for k in np.flatnonzero(locked)]
        free = np.array([c.kind != "revolute" for c in robot.coordinates])[~locked]
        found = robot.joint_rates(q, V, fixed=chosen, damping_threshold=BORDER)
        J = reduced_jacobian(model, q, locked)
        rank = np.linalg.matrix_rank(J, tol=1e-9)
        wanted, smallest = damped(J, V, np.where(free, length, 1.0), length, rank)
        if found.scale < 1:
            continue
        compared += 1
        assert (found.qd[locked] == 0).all()
        assert np.signbit(found.qd[locked]).sum() == 0
        assert found.limited[locked].all()
        assert np.abs(found.qd[~locked] - wanted).max() <= AGREES * (1 + np.abs(wanted).max())
        assert abs(found.min_singular_value - smallest) <= AGREES
        assert np.abs(found.twist - J @ wanted).max() <= AGREES * (1 + np.abs(wanted).max())
        limits = np.where(locked, 0, np.inf)
        same = robot.joint_rates(q, V, rate_limits=limits, damping_threshold=BORDER)
        assert np.array_equal(found.qd, same.qd)
    assert compared >= 15


def test_random_chain_rates_with_fixed_joints_match_reduced_model():
    dice, compared, singular = random.Random(5), 0, 0
    for seed in range(CHAINS):
        rng = np.random.default_rng(seed)
        n = dice.randint(2, 9)
        model = model_of(random_screws(dice, rng, n), np.eye(4))
        data = model.createData()
        for q in rng.uniform(-np.pi, np.pi, (POSES, n)):
            locked, V = random_locks(rng, n), rng.normal(size=6)
            J = pin.computeFrameJacobian(model, data, q, model.getFrameId("tool"), MIXED)
            reach = np.where(locked, 0.0, np.inf)
            rank, free = min(6, n), n - locked.sum()
            qd, twist, _, smallest, _, scale, limited = _rates.solve(
                J, V, -reach, reach, rng.normal(size=n) * 0, np.ones(n), np.ones(6), BORDER, rank
            )
            wanted, least = damped(
                reduced_jacobian(model, q, locked), V, np.ones(free), 1.0, min(6, free)
            )
            assert (qd[locked] == 0).all()
            assert scale == 1
            assert np.array_equal(limited, locked)
            assert np.abs(qd[~locked] - wanted).max() <= AGREES * (1 + np.abs(wanted).max())
            assert abs(smallest - least) <= AGREES
            assert np.abs(twist - J @ qd).max() <= AGREES * (1 + np.abs(wanted).max())
            compared, singular = compared + 1, singular + (least < BORDER)
    assert compared == CHAINS * POSES
    assert singular > 40


def random_screws(dice, rng, n):
    """Return random screws (6, n), of which many axes are parallel or intersect."""
    columns = []
    for _ in range(n):
        axis = np.eye(3)[dice.randrange(3)] if dice.random() < 0.6 else rng.normal(size=3)
        axis = axis / np.linalg.norm(axis)
        point = rng.uniform(-1, 1, 3) * (dice.random() < 0.7)
        turns = dice.random() < 0.75
        columns.append(np.hstack([np.cross(point, axis), axis] if turns else [axis, 0, 0, 0]))
    return np.array(columns).T


@pytest.mark.parametrize("name", SERIAL)
def test_track_keeps_fixed_joints_exactly(name):
    """The robot tracks the path with its free joints only.

    The values of the fixed joints do not change.
    """
    robot = chasles.load(name)
    rng = np.random.default_rng(3)
    for _ in range(4):
        locked = random_locks(rng, robot.n)
        lower, upper = np.maximum(robot.lower, -1.5), np.minimum(robot.upper, 1.5)
        q0, q1 = lower + rng.uniform(0.2, 0.8, (2, robot.n)) * (upper - lower)
        q1 = np.where(locked, q0, q0 + 0.2 * (q1 - q0))
        way = q0 + np.linspace(0, 1, 200)[:, None] * (q1 - q0)
        track = robot.track(robot.fk(way), q0, 0.01, fixed=np.flatnonzero(locked))
        assert (track.q[:, locked] == q0[locked]).all()
        assert (track.qd[:, locked] == 0).all()
        assert not set(track.at_rate_limit) & {
            robot.coordinates[k].name for k in locked.nonzero()[0]
        }
        if track.min_singular_value > 0.03 and not track.at_limit:
            assert track.max_distance < 2e-3
            assert track.max_angle < 2e-3
        limited = robot.track(robot.fk(way), q0, 0.01, rate_limits=np.where(locked, 0.0, np.inf))
        assert np.array_equal(track.q, limited.q)


@pytest.mark.parametrize("name", [*SERIAL, "well_manipulator", "excavator", "board_installer"])
def test_ik_numeric_with_fixed_joints_solves_reachable_poses(name):
    """The start configurations are random and can be far from the solutions."""
    robot = chasles.load(name)
    rng = np.random.default_rng(11)
    lower = np.where(np.isfinite(robot.lower), robot.lower, -2.5)
    upper = np.where(np.isfinite(robot.upper), robot.upper, 2.5)
    solved = 0
    for _ in range(25):
        locked = random_locks(rng, robot.n)
        q, seed = lower + rng.uniform(0.05, 0.95, (2, robot.n)) * (upper - lower)
        seed = np.where(locked, q, seed)
        T = robot.fk(q[None])[0]
        if not np.isfinite(T).all():
            continue
        found = robot.ik_numeric(T, seed, fixed=np.flatnonzero(locked))
        assert np.array_equal(found.q[locked], q[locked])
        reached = robot.fk(found.q[None])[0]
        assert np.abs(reached - T).max() <= 3 * found.residual + 1e-12
        solved += bool(found.valid)
    assert solved >= 20


def test_fixed_values_are_kept_per_pose_on_any_thread_count():
    robot = chasles.load("ur5e")
    q = np.random.default_rng(0).uniform(-2, 2, (300, 6))
    seed = q + np.random.default_rng(1).uniform(-0.5, 0.5, q.shape)
    seed[:, 1] = q[:, 1]
    one = robot.ik_numeric(robot.fk(q), seed, fixed="shoulder_lift")
    many = robot.ik_numeric(robot.fk(q), seed, fixed=[1], threads=4)
    assert np.array_equal(one.q, many.q)
    assert np.array_equal(one.q[:, 1], q[:, 1])
    assert one.valid.mean() > 0.99
    # A fixed value stays fixed even if it violates a joint limit.
    beyond = np.array([0.0, 9.0, 0.4, 0.1, 0.2, 0.3])
    kept = robot.ik_numeric(robot.fk(beyond), beyond + 0.1 * np.eye(6)[0], fixed=1)
    assert kept.q[1] == 9.0
    assert kept.valid


def test_fixed_chain_joint_equals_fixed_cylinder():
    robot = chasles.load("well_manipulator")
    q = np.array(robot.reference.q)
    V = np.array([0.01, 0, 0.02, 0, 0.1, 0])
    by_joint = robot.joint_rates(q, V, fixed=["theta2", "theta1"])
    by_cylinder = robot.joint_rates(q, V, fixed=["cylinder_1", 0])
    assert np.array_equal(by_joint.qd, by_cylinder.qd)
    assert (robot.chain_rates(q, by_joint.qd)[[0, 1]] == 0).all()


BAD = [
    ("elbov", chasles.InputValueError, "expected a coordinate to fix, got 'elbov'; coordinates: "),
    ([0, 6], chasles.InputValueError, "no coordinate 6; the 6 coordinates are numbered from 0"),
    (1.5, chasles.InputTypeError, "fixed (must hold|expects) names .* got 1.5"),
    ([True], chasles.InputTypeError, "fixed (must hold|expects) names .* got .*True"),
    (range(6), chasles.InputValueError, "all coordinates are fixed"),
]


@pytest.mark.parametrize(
    ("fixed", "error", "message"),
    BAD,
    ids=["unknown name", "index too large", "float", "bool", "all joints"],
)
def test_invalid_fixed_joint_is_rejected_by_name(fixed, error, message):
    robot, q = chasles.load("ur5e"), np.array([0.3, -1.2, 1.5, -0.4, 0.9, 0.2])
    for call in (
        lambda: robot.joint_rates(q, np.ones(6), fixed=fixed),
        lambda: robot.track(robot.fk(q)[None], q, 0.01, fixed=fixed),
        lambda: robot.ik_numeric(robot.fk(q), q, fixed=fixed),
    ):
        with pytest.raises(error, match=message):
            call()


def test_missing_seed_or_coupled_fixed_joint_is_explained():
    arm = chasles.load("ur5e")
    with pytest.raises(chasles.InputValueError, match="fixed= without values requires q_seed"):
        arm.ik_numeric(np.eye(4), fixed=0)
    installer = chasles.load("board_installer")
    message = "joint elbow depends on slider, crank; fix coordinates by name"
    with pytest.raises(chasles.InputValueError, match=message):
        installer.joint_rates(installer.reference.q, np.ones(6), fixed="elbow")


def test_zero_rate_limits_stop_all_motion():
    robot = chasles.load("ur5e")
    found = robot.joint_rates(np.full(6, 0.4), np.ones(6), rate_limits=0)
    assert (found.qd == 0).all()
    assert (found.twist == 0).all()
    assert found.scale == 0
    assert found.limited.all()


def test_fixed_joint_overrides_acceleration_limits():
    robot = chasles.load("ur5e")
    q, fast = np.full(6, 0.4), np.full(6, 0.8)
    found = robot.joint_rates(
        q, np.ones(6), fixed=2, acceleration_limits=1.0, qd_previous=fast, dt=0.01
    )
    assert found.qd[2] == 0
    assert (np.abs(found.qd - fast)[[0, 1, 3, 4, 5]] <= 0.01 + 1e-15).all()


@pytest.mark.parametrize("redundancy", ["limits", "manipulability"])
def test_null_space_motion_keeps_fixed_joints(redundancy):
    robot, rng = chasles.load("panda"), np.random.default_rng(4)
    for q in rng.uniform(0.3, 0.7, (20, 7)) * (robot.upper - robot.lower) + robot.lower:
        V = rng.normal(size=6) / 10
        plain = robot.joint_rates(q, V, components="linear", fixed=[1, 4])
        moved = robot.joint_rates(q, V, components="linear", fixed=[1, 4], redundancy=redundancy)
        assert (moved.qd[[1, 4]] == 0).all()
        assert np.abs(moved.qd - plain.qd).max() > 1e-6
        np.testing.assert_allclose(moved.twist[:3], plain.twist[:3], atol=1e-12)
        if redundancy == "manipulability":
            # The null-space motion increases the manipulability.
            null = moved.qd - plain.qd

            def measure(x):
                J = np.delete(robot.jacobian_mixed(x)[:3], [1, 4], 1)
                return np.sqrt(np.linalg.det(J @ J.T))

            assert measure(q + 1e-4 * null) > measure(q - 1e-4 * null)
