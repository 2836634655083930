"""Joint rates and accelerations: tool motion, damping, limits and null-space objectives."""

import numpy as np
import pytest

import chasles
from chasles.velocity import _rates
from tests.support.rate_inputs import CLOSURE, WITH_RATES, inside, pure, reached, twists
from tests.support.tolerances import ORACLE_RATES

DAMPING = 0.04


# ---------------------------------------------------------------- closed loops and damping


@pytest.mark.parametrize("name", WITH_RATES)
def test_feasible_twist_is_reached_with_minimum_norm_rates(name):
    robot = chasles.load(name)
    q = inside(robot, 300)
    given = np.random.default_rng(2).normal(size=q.shape)
    V = reached(robot, q, given)
    found = robot.joint_rates(q, V)
    away = found.damping_squared == 0
    assert away.mean() > 0.5
    assert (found.scale == 1).all()
    scale = 1 + np.abs(V).max(-1)
    assert (np.abs(found.twist - V).max(-1) / scale)[away].max() <= CLOSURE
    np.testing.assert_allclose(reached(robot, q, found.qd), found.twist, rtol=0, atol=1e-12)
    _, _, unit = pure(robot, q)
    sizes = [np.linalg.norm(x / unit, axis=-1) for x in (found.qd, given)]
    assert (sizes[0] <= sizes[1] * (1 + 1e-9)).all()


@pytest.mark.parametrize("representation", ["space", "body", "mixed"])
@pytest.mark.parametrize("name", ["ur5e", "board_installer"])
def test_joint_rates_are_correct_in_every_representation(name, representation):
    robot = chasles.load(name)
    q = inside(robot, 100)
    qd = np.random.default_rng(3).normal(size=q.shape)
    V = robot.functions[f"twist_{representation}"](q, qd)
    found = robot.joint_rates(q, V, representation=representation)
    away = found.damping_squared == 0
    assert away.sum() > 50
    np.testing.assert_allclose(found.qd[away], qd[away], rtol=0, atol=1e-10)
    np.testing.assert_allclose(found.twist[away], V[away], rtol=0, atol=1e-11)
    lost = robot.functions[f"jacobian_{representation}"](q)
    _, _, unit = pure(robot, q)
    # Joint rates of norm 1 in the singular direction give a twist of norm sigma.
    back = np.linalg.lstsq(
        lost[0] * unit, found.singular_direction[0] * found.min_singular_value[0], rcond=None
    )[0]
    assert abs(np.linalg.norm(back) - 1) < 1e-9


def test_damping_follows_smallest_singular_value_formula(ur5e):
    q = np.tile([0.3, -1.2, 1.5, -0.4, 0.0, 0.2], (40, 1))
    q[:, 4] = np.geomspace(1e-9, 0.5, 40)
    V = twists(40)
    found = ur5e.joint_rates(q, V)
    J, row, _ = pure(ur5e, q)
    u, sigma, vt = np.linalg.svd(J)
    np.testing.assert_allclose(found.min_singular_value, sigma[:, -1], rtol=1e-6, atol=1e-15)
    damping = np.maximum(DAMPING**2 - sigma**2, 0)
    np.testing.assert_allclose(found.damping_squared, damping[:, -1], rtol=1e-9, atol=1e-15)
    assert 10 < (damping[:, -1] > 0).sum() < 38
    assert (damping[:, :-1] == 0).all()
    along = np.einsum("Nij,Ni->Nj", u, V * row) * sigma / (sigma**2 + damping)
    expected = np.einsum("Nji,Nj->Ni", vt, along)
    np.testing.assert_allclose(found.qd, expected, rtol=0, atol=1e-9)
    # Only the singular direction is damped.
    missed = (found.twist - V) * row
    direction = found.singular_direction * row
    np.testing.assert_allclose(np.linalg.norm(direction, axis=-1), 1, rtol=1e-12)
    across = missed - (missed * direction).sum(-1, keepdims=True) * direction
    assert np.abs(across).max() < 1e-12


def test_largest_entry_of_the_singular_direction_is_positive(ur5e):
    q = inside(ur5e, 100)
    _, row, _ = pure(ur5e, q)
    direction = ur5e.joint_rates(q, twists(100)).singular_direction * row
    largest = np.take_along_axis(direction, np.abs(direction).argmax(-1)[:, None], -1)
    assert (largest > 0).all()


@pytest.mark.parametrize("threshold", [0.01, 0.04, 0.3])
def test_rates_are_bounded_at_singularities(ur5e, threshold):
    rng = np.random.default_rng(4)
    q = inside(ur5e, 3000)
    q[:1000, 4] = 0.0  # wrist
    q[1000:2000, 2] = 0.0  # elbow
    q[2000:] = rng.integers(-4, 5, (1000, 6)) * np.pi / 2
    V = twists(3000)
    found = ur5e.joint_rates(q, V, damping_threshold=threshold)
    _, row, _ = pure(ur5e, q)
    bound = np.linalg.norm(V * row, axis=-1) / threshold
    assert (found.min_singular_value < 1e-12).sum() > 2000
    assert (np.linalg.norm(found.qd, axis=-1) <= bound * (1 + 1e-12)).all()
    assert all(np.isfinite(getattr(found, name)).all() for name in chasles.Rates.__slots__)


def test_rates_are_continuous_through_a_singularity(ur5e):
    q = np.tile([0.3, -1.2, 1.5, -0.4, 0.0, 0.2], (20001, 1))
    q[:, 4] = np.linspace(-0.2, 0.2, 20001)
    found = ur5e.joint_rates(q, twists(1)[0])
    assert np.abs(np.diff(found.qd, axis=0)).max() < 0.02
    assert np.abs(found.qd).max() > 1


def test_batch_rates_equal_single_rates(panda):
    q, V = inside(panda, 20), twists(20)
    options = {"redundancy": "limits", "rate_limits": 0.3}
    batch = panda.joint_rates(q, V, **options)
    for i in range(20):
        single = panda.joint_rates(q[i], V[i], **options)
        for name in chasles.Rates.__slots__:
            # The batch code uses other machine instructions than a single call.
            np.testing.assert_allclose(
                getattr(single, name), getattr(batch, name)[i], rtol=0, atol=1e-13
            )
    assert panda.joint_rates(q[:, None], V).qd.shape == (20, 20, 7)


def test_partial_twist_is_reached_with_smaller_rates(ur5e):
    q, V = inside(ur5e, 200), twists(200)
    for components, part in (("linear", slice(0, 3)), ("angular", slice(3, 6))):
        found = ur5e.joint_rates(q, V, components=components)
        away = found.damping_squared == 0
        assert away.sum() > 150
        np.testing.assert_allclose(found.twist[away, part], V[away, part], rtol=0, atol=1e-12)
        whole = ur5e.joint_rates(q, V)
        both = away & (whole.damping_squared == 0)
        size = [np.linalg.norm(x.qd[both], axis=-1) for x in (found, whole)]
        assert (size[0] <= size[1]).all()
        three = ur5e.joint_rates(q, V[:, part], components=components)
        np.testing.assert_array_equal(three.qd, found.qd)
        A = ur5e.joint_accelerations(q, found.qd, V[:, part], components=components)
        whole = ur5e.joint_accelerations(q, found.qd, V, components=components)
        np.testing.assert_array_equal(A.qdd, whole.qdd)


def test_minimum_norm_is_the_default_redundancy(panda):
    q, V = inside(panda, 20), twists(20)
    named = panda.joint_rates(q, V, redundancy="minimum_norm")
    np.testing.assert_array_equal(named.qd, panda.joint_rates(q, V).qd)


# ---------------------------------------------------------------- limits


@pytest.mark.parametrize("name", ["ur5e", "panda", "photo_robot", "stanford", "board_installer"])
def test_rate_limits_scale_twist_without_changing_direction(name):
    robot = chasles.load(name)
    q = inside(robot, 2000, seed=5)
    V = 20 * twists(len(q))
    limits = np.linspace(0.2, 0.6, robot.n)
    free = robot.joint_rates(q, V)
    found = robot.joint_rates(q, V, rate_limits=limits)
    assert (np.abs(found.qd) <= limits).all()
    assert ((found.scale >= 0) & (found.scale <= 1)).all()
    held = found.scale < 1
    assert held.sum() > 100
    assert found.limited[held].any(-1).all()
    at_bound = np.isclose(np.abs(found.qd), limits, rtol=1e-9)
    assert (at_bound | ~found.limited).all()
    away = found.damping_squared == 0
    expected = found.scale[:, None] * free.twist
    difference = np.abs(found.twist - expected)[away].max(-1)
    assert (difference <= 1e-10 * (1 + np.abs(V[away]).max(-1))).all()
    slow = robot.joint_rates(q, V * 1e-4, rate_limits=limits)
    assert (slow.scale == 1).all()
    assert not slow.limited.any()


def test_redundant_joints_compensate_for_saturated_joint(panda):
    q, V = inside(panda, 2000, seed=6), 3 * twists(2000)
    limits = np.full(7, 1.0)
    free = panda.joint_rates(q, V)
    found = panda.joint_rates(q, V, rate_limits=limits)
    most = np.abs(free.qd).max(-1)
    scaled = np.minimum(1, 1 / most)
    away = found.damping_squared == 0
    assert (found.scale >= scaled - 1e-12)[away].all()
    helped = away & (most > 1) & (found.scale == 1)
    assert helped.sum() > 50
    np.testing.assert_allclose(found.twist[helped], V[helped], rtol=0, atol=1e-10)


def test_scale_is_maximal_without_redundancy(ur5e):
    q, V = inside(ur5e, 500, seed=7), 5 * twists(500)
    found = ur5e.joint_rates(q, V, rate_limits=1.0)
    most = np.abs(ur5e.joint_rates(q, V).qd).max(-1)
    np.testing.assert_allclose(found.scale, np.minimum(1, 1 / most), rtol=1e-12)
    blamed = found.limited[found.scale < 1]
    assert (blamed.sum(-1) == 1).all()


@pytest.mark.parametrize("dt", [None, 1e-3])
def test_joint_at_limit_never_moves_outward(panda, dt):
    rng = np.random.default_rng(8)
    q = inside(panda, 1000, seed=9)
    at = rng.integers(0, 7, 1000)
    up = rng.random(1000) < 0.5
    rows = np.arange(1000)
    q[rows, at] = np.where(up, panda.upper[at], panda.lower[at])
    found = panda.joint_rates(q, twists(1000), dt=dt)
    outward = np.where(up, 1, -1) * found.qd[rows, at]
    assert (outward <= 0).all()
    assert (outward == 0).sum() > 100
    # A joint outside its limits is not forced back.
    q[rows, at] += np.where(up, 0.1, -0.1)
    outside = panda.joint_rates(q, twists(1000), dt=dt)
    assert (np.where(up, 1, -1) * outside.qd[rows, at] <= 0).all()
    assert np.abs(outside.qd).max() < 100


def test_position_rate_and_acceleration_limits_always_hold(panda):
    """Random joint rates at 250 Hz move joints to their limits."""
    rng = np.random.default_rng(10)
    dt, count = 4e-3, 30
    rate, acceleration = np.linspace(1.5, 2.5, 7), np.linspace(5.0, 15.0, 7)
    q, qd = inside(panda, count, margin=0.05), np.zeros((count, 7))
    touched = np.zeros((count, 7), bool)
    target = np.zeros((count, 7))
    for tick in range(500):
        if tick % 250 == 0:
            target = rng.uniform(-3, 3, (count, 7))
        V = reached(panda, q, target)
        found = panda.joint_rates(
            q, V, rate_limits=rate, acceleration_limits=acceleration, qd_previous=qd, dt=dt
        )
        assert (np.abs(found.qd) <= rate).all()
        assert (np.abs(found.qd - qd) <= acceleration * dt * (1 + 1e-9)).all()
        q, qd = q + found.qd * dt, found.qd
        assert ((panda.lower <= q) & (q <= panda.upper)).all()
        touched |= (q - panda.lower < 1e-3) | (panda.upper - q < 1e-3)
    assert touched.any(0).sum() >= 5


def test_rounding_never_carries_joint_beyond_limit():
    rng = np.random.default_rng(16)
    limit, dt = rng.uniform(-3, 3, (2, 100000, 1))
    dt = np.abs(dt[:, 0]) / 100
    q = limit - 0.01 * rng.random((100000, 1))
    ends = np.full(1, np.inf)
    _, up = _rates.bounds(q, -ends, limit, ends, ends, np.zeros(1), dt)
    assert (q + up * dt[:, None] <= limit).all()
    down, _ = _rates.bounds(-q, -limit, ends, ends, ends, np.zeros(1), dt)
    assert (-q + down * dt[:, None] >= -limit).all()
    naive = (limit - q) / dt[:, None]
    assert (q + naive * dt[:, None] > limit).any()
    np.testing.assert_allclose(up, naive, rtol=1e-11, atol=1e-12)


def test_joint_that_brakes_at_zero_stays_within_its_limit():
    # The joint brakes until it stops at its position limit 0.
    rng = np.random.default_rng(3)
    n, dt = 2000, 1e-3
    acceleration, rate = rng.uniform(1, 20, n), rng.uniform(0.5, 3, n)
    q, qd = -rng.uniform(0.001, 0.2, n), np.zeros(n)
    for _ in range(700):
        _, up = _rates.bounds(q, -np.ones(n), np.zeros(n), rate, acceleration, qd, dt)
        assert (np.abs(up - qd) <= acceleration * dt * (1 + 1e-9)).all()
        q, qd = q + up * dt, up
        assert (q <= 0).all()
    assert (q == 0).mean() > 0.9


def test_joint_brakes_as_late_as_possible_before_limit():
    """A joint moves toward its limit as fast as allowed, and stops at the limit."""
    robot = chasles.load("scara")
    q = (robot.lower + robot.upper) / 2
    q[2] = robot.lower[2] + 0.01
    qd, dt, most = np.zeros(4), 1e-3, 2.0
    ticks = 0
    while robot.upper[2] - q[2] > 1e-9:
        found = robot.joint_rates(
            q,
            robot.jacobian_mixed(q) @ [0, 0, 1.0, 0],
            acceleration_limits=most,
            qd_previous=qd,
            dt=dt,
        )
        assert np.abs(found.qd - qd).max() <= most * dt * (1 + 1e-9)
        q, qd = q + dt * found.qd, found.qd
        assert q[2] <= robot.upper[2]
        ticks += 1
        assert ticks < 5000
    stroke = robot.upper[2] - robot.lower[2] - 0.01
    top = min(1.0, np.sqrt(most * stroke))
    least = 2 * top / most + (stroke - top**2 / most) / top
    assert ticks * dt < least + 5 * dt
    assert np.abs(qd).max() < 3 * most * dt


def test_acceleration_limits_give_closest_feasible_twist(ur5e):
    q = np.array([0.3, -1.2, 1.5, -0.4, 0.9, 0.2])
    V, change = twists(1)[0], 4e-3
    wanted = ur5e.joint_rates(q, V).qd
    limits = {"acceleration_limits": 4.0, "dt": 1e-3}
    # The previous joint rates are a tenth of the desired rates, so the acceleration limit of one
    # joint applies.
    found = ur5e.joint_rates(q, V, qd_previous=0.1 * wanted, **limits)
    np.testing.assert_allclose(found.scale, 0.1 + change / np.abs(wanted).max(), rtol=1e-12)
    np.testing.assert_allclose(found.twist, found.scale * V, rtol=0, atol=1e-12)
    # If the robot first moves in the opposite direction, all joints brake at their acceleration
    # limits.
    found = ur5e.joint_rates(q, -V, qd_previous=wanted, **limits)
    assert found.scale < 1e-9
    braked = np.sign(wanted) * np.maximum(np.abs(wanted) - change, 0)
    np.testing.assert_allclose(found.qd, braked, rtol=0, atol=1e-9)
    aside = wanted + np.array([0, 0, 0, 0, 0, 0.01])
    found = ur5e.joint_rates(q, V, qd_previous=aside, **limits)
    assert found.limited.tolist() == [False] * 5 + [True]
    assert found.scale > 0.95
    assert np.abs(found.qd - wanted).max() < 0.0065


# ---------------------------------------------------------------- secondary objectives


def objective(robot, name, q):
    if not isinstance(name, str):
        return 0.5 * ((q - name) ** 2).sum(-1)
    if name == "limits":
        half, middle = (robot.upper - robot.lower) / 2, (robot.upper + robot.lower) / 2
        return 0.5 * (((q - middle) / half) ** 2).sum(-1)
    return -robot.manipulability(q).measure


@pytest.mark.parametrize("robot_name", ["panda", "iiwa14"])
@pytest.mark.parametrize("name", ["limits", "manipulability", "configuration"])
def test_secondary_objective_improves_without_changing_task(robot_name, name):
    robot = chasles.load(robot_name)
    q, V = inside(robot, 300, seed=11), twists(300)
    redundancy = inside(robot, 1, seed=12)[0] if name == "configuration" else name
    plain = robot.joint_rates(q, V)
    found = robot.joint_rates(q, V, redundancy=redundancy, gain=2.0)
    np.testing.assert_allclose(found.twist, plain.twist, rtol=0, atol=1e-12)
    step = 1e-6 * (found.qd - plain.qd)
    gained = objective(robot, redundancy, q + step) - objective(robot, redundancy, q - step)
    assert (gained < 1e-14).all()
    assert (gained < 0).mean() > 0.95
    # Doubling the gain doubles the null-space motion.
    twice = robot.joint_rates(q, V, redundancy=redundancy, gain=4.0)
    np.testing.assert_allclose(twice.qd - plain.qd, 2 * (found.qd - plain.qd), atol=1e-10)


def test_rest_configuration_is_approached_with_fixed_tool(panda):
    rest = inside(panda, 1, seed=13, margin=0.3)[0]
    q = rest + 0.05 * np.sin(np.arange(7))
    T = panda.fk(q)
    start = np.abs(q - rest).max()
    for _ in range(3000):
        q = q + 1e-3 * panda.joint_rates(q, np.zeros(6), redundancy=rest, gain=5.0).qd
    assert np.abs(panda.fk(q) - T).max() < 1e-3
    assert np.abs(q - rest).max() < start
    # The difference between q and the rest configuration has no component in the null space of the
    # Jacobian.
    _, _, vt = np.linalg.svd(panda.jacobian_mixed(q))
    assert abs(vt[6] @ (q - rest)) < 1e-5


def test_secondary_objective_never_reduces_task_scale(panda):
    q, V = inside(panda, 1000, seed=14), 3 * twists(1000)
    limits = np.full(7, 0.5)
    plain = panda.joint_rates(q, V, rate_limits=limits)
    for redundancy in ("limits", "manipulability", np.zeros(7)):
        found = panda.joint_rates(q, V, redundancy=redundancy, gain=10.0, rate_limits=limits)
        assert (np.abs(found.qd) <= limits).all()
        np.testing.assert_array_equal(found.scale, plain.scale)
        np.testing.assert_allclose(found.twist, plain.twist, rtol=0, atol=1e-12)


def test_secondary_objective_uses_remaining_freedom_at_saturation():
    robot = chasles.load("photo_robot")
    q = inside(robot, 200, seed=17)
    z = 3.0 * np.random.default_rng(18).normal(size=q.shape)
    free = robot.joint_rates(q, np.zeros(6), redundancy=q + z)
    J, _, unit = pure(robot, q)
    checked = 0
    for i in range(200):
        held = int(np.argmax(np.abs(free.qd[i])))
        limits = np.full(robot.n, 100.0)
        limits[held] = 0.3 * abs(free.qd[i, held])
        found = robot.joint_rates(q[i], np.zeros(6), redundancy=q[i] + z[i], rate_limits=limits)
        first = null_part(J[i], z[i] / unit)
        rest = null_part(J[i] * (np.arange(robot.n) != held), z[i] / unit, held)
        np.testing.assert_allclose(free.qd[i], first * unit, rtol=0, atol=1e-10)
        np.testing.assert_allclose(found.qd, (0.3 * first + 0.7 * rest) * unit, atol=1e-10)
        assert found.limited.tolist() == [k == held for k in range(robot.n)]
        checked += 1
    assert checked == 200


def null_part(J, z, held=None):
    if held is not None:
        z = np.where(np.arange(len(z)) == held, 0.0, z)
    return z - np.linalg.pinv(J) @ (J @ z)


def test_non_redundant_robot_ignores_secondary_objective(ur5e):
    q, V = inside(ur5e, 100), twists(100)
    q[:50, 4] = 0.0
    plain = ur5e.joint_rates(q, V)
    for redundancy in ("limits", "manipulability", np.ones(6)):
        found = ur5e.joint_rates(q, V, redundancy=redundancy)
        np.testing.assert_array_equal(found.qd, plain.qd)


# ---------------------------------------------------------------- accelerations


@pytest.mark.parametrize("representation", ["space", "body", "mixed"])
@pytest.mark.parametrize("name", ["ur5e", "panda", "board_installer", "scara"])
def test_joint_accelerations_reproduce_tool_acceleration(name, representation):
    robot = chasles.load(name)
    q = inside(robot, 100)
    rng = np.random.default_rng(15)
    qd, qdd = rng.normal(size=(2, *q.shape))
    function = robot.functions[f"acceleration_{representation}"]
    A = function(q, qd, qdd)
    found = robot.joint_accelerations(q, qd, A, representation=representation)
    away = found.damping_squared == 0
    assert away.sum() > 50
    np.testing.assert_allclose(found.acceleration[away], A[away], rtol=0, atol=ORACLE_RATES)
    np.testing.assert_allclose(
        function(q, qd, found.qdd), found.acceleration, rtol=0, atol=ORACLE_RATES
    )
    limited = robot.joint_accelerations(
        q, qd, A, representation=representation, acceleration_limits=0.3
    )
    assert (np.abs(limited.qdd) <= 0.3).all()
    assert limited.limited.any()


@pytest.mark.parametrize("name", ["panda", "board_installer"])
def test_fixed_joint_is_excluded_from_joint_accelerations(name):
    robot = chasles.load(name)
    q, lock = inside(robot, 100), 2
    rng = np.random.default_rng(16)
    qd, qdd = rng.normal(size=(2, *q.shape))
    qdd[:, lock] = 0
    A = robot.acceleration_mixed(q, qd, qdd)
    found = robot.joint_accelerations(q, qd, A, fixed=robot.coordinates[lock].name)
    assert (found.qdd[:, lock] == 0).all()
    rates = robot.joint_rates(q, A, fixed=lock)
    np.testing.assert_array_equal(found.min_singular_value, rates.min_singular_value)
    np.testing.assert_array_equal(found.damping_squared, rates.damping_squared)
    away = found.damping_squared == 0
    assert away.sum() > 50
    again = robot.acceleration_mixed(q, qd, found.qdd)
    np.testing.assert_allclose(again[away], A[away], rtol=0, atol=ORACLE_RATES)
    limits = np.where(np.arange(robot.n) == lock, 0, np.inf)
    same = robot.joint_accelerations(q, qd, A, acceleration_limits=limits)
    np.testing.assert_array_equal(same.qdd, found.qdd)
    if robot.n > 6:
        assert np.abs(robot.joint_accelerations(q, qd, A).qdd - found.qdd).max() > 1e-3
