"""`ik_nearest` returns the solution nearest to a start configuration within limits."""

import itertools
import pickle

import numpy as np
import pytest

import chasles
from chasles.errors import (
    InputTypeError,
    InputValueError,
    MissingFunctionError,
    ShapeError,
)
from tests.support.tolerances import AGREEMENT

TURN = 2 * np.pi
CLOSURE = 1e-9


@pytest.fixture(scope="module")
def arm():
    return chasles.load("ur5e")


@pytest.fixture(scope="module")
def panda():
    return chasles.load("panda")


Q = np.array([0.3, -1.2, 1.5, -0.4, 0.9, 0.2])
Q7 = np.array([0.1, 0.2, 0.3, -1.5, 0.4, 1.6, 0.5])


def by_hand(robot, T, seed, limits=None, weights=None):
    """Loop over all solution slots and full turns to find the solution nearest to a seed."""
    low, high = np.stack([robot.lower, robot.upper], -1).T if limits is None else limits
    weights = np.ones(robot.n) if weights is None else weights
    solutions = robot.ik(T)
    best = None
    for q in solutions.q[solutions.valid]:
        listed = [
            [v for v in (q[j] + TURN * k for k in range(-3, 4)) if low[j] <= v <= high[j]]
            for j in range(robot.n)
        ]
        if all(listed):
            near = np.array(
                [min(v, key=lambda x: abs(x - s)) for v, s in zip(listed, seed, strict=True)]
            )
            distance = (weights * np.abs(near - seed)).max()
            if best is None or distance < best[0] - 1e-13:
                best = distance, near
    return best


def test_nearest_solution_is_the_one_found_by_trying_all_turns(arm):
    rng = np.random.default_rng(1)
    for _ in range(60):
        T, seed = arm.fk(rng.uniform(-3, 3, 6)), rng.uniform(-7, 7, 6)
        found, (distance, q) = arm.ik_nearest(T, seed), by_hand(arm, T, seed)
        assert found.valid
        assert np.abs(found.q - seed).max() == pytest.approx(distance, abs=1e-12)
        assert np.abs(found.q - q).max() < 1e-12


def test_answers_equal_those_of_the_filters(arm):
    rng = np.random.default_rng(2)
    T = arm.fk(rng.uniform(-np.pi, np.pi, (2000, 6)))
    seeds = rng.uniform(-TURN, TURN, (2000, 6))
    found = arm.ik_nearest(T, seeds)
    assert found.valid.all()
    expected = arm.ik(T).within_limits().nearest(seeds)
    assert np.abs(found.q - expected).max() <= 1e-12


def test_rounded_poses_near_singularities_have_the_answers_of_the_filters(arm):
    rng = np.random.default_rng(0)
    q = rng.integers(-2, 3, (500, 6)) * (np.pi / 2)
    T = arm.fk(q)
    T[:, :3] += rng.uniform(-1e-7, 1e-7, (500, 3, 4))
    expected = arm.ik(T).within_limits()
    assert (expected.valid.any(-1) & (arm.functions["ik"].ufunc(T)[1] > 1e-9).all(-1)).sum() > 20
    np.testing.assert_array_equal(arm.ik_nearest(T, q).valid, expected.valid.any(-1))


def test_single_result_has_scalars_and_reaches_the_pose(arm):
    T = arm.fk(Q)
    found = arm.ik_nearest(T, Q + 0.01)
    q, residual, margin, valid = found
    assert q.shape == (6,)
    assert np.ndim(residual) == np.ndim(margin) == np.ndim(valid) == 0
    assert valid
    assert found.reason == ""
    assert np.abs(q - Q).max() < AGREEMENT
    assert residual < CLOSURE
    slot = np.abs(arm.ik(T).q - Q).max(-1).argmin()
    assert margin == pytest.approx(arm.ik(T).margin[slot])


def test_batch_broadcasts_poses_with_seeds_and_equals_single_calls(arm):
    rng = np.random.default_rng(3)
    T, seeds = arm.fk(rng.uniform(-2, 2, (3, 1, 6))), rng.uniform(-2, 2, (4, 6))
    found = arm.ik_nearest(T, seeds)
    assert found.q.shape == (3, 4, 6)
    assert found.valid.shape == found.reason.shape == (3, 4)
    for i, j in itertools.product(range(3), range(4)):
        single = arm.ik_nearest(np.ascontiguousarray(T[i, 0]), seeds[j])
        assert np.abs(found.q[i, j] - single.q).max() < 1e-12
    one = arm.ik_nearest(np.ascontiguousarray(T[:, 0]), Q)
    assert one.q.shape == (3, 6)
    assert arm.ik_nearest(np.empty((0, 4, 4)), Q).q.shape == (0, 6)


def test_threads_change_nothing(arm):
    rng = np.random.default_rng(4)
    T, seeds = arm.fk(rng.uniform(-3, 3, (3000, 6))), rng.uniform(-3, 3, (3000, 6))
    one, many = arm.ik_nearest(T, seeds, threads=1), arm.ik_nearest(T, seeds, threads=2)
    assert all(np.array_equal(a, b) for a, b in zip(one, many, strict=True))


def test_move_from_the_seed_is_at_most_half_a_turn_without_limits(arm):
    seed = Q + TURN * np.array([3, -2, 5, 0, 1, -4])
    found = arm.ik_nearest(arm.fk(Q), seed, limits=None)
    assert np.abs(found.q - seed).max() < AGREEMENT
    assert (
        not arm.ik_nearest(arm.fk(Q), seed).valid
        or (np.abs(arm.ik_nearest(arm.fk(Q), seed).q) <= arm.upper + 1e-12).all()
    )


def test_seed_outside_limits_gives_a_solution_inside(arm):
    seed = Q.copy()
    seed[0] += TURN
    found = arm.ik_nearest(arm.fk(Q), seed)
    assert found.valid
    assert (found.q >= arm.lower).all()
    assert (found.q <= arm.upper).all()


def test_joint_that_rounding_put_outside_is_set_to_its_limit(arm):
    limits = np.stack([arm.lower, arm.upper], -1)
    limits[0] = Q[0] + 1e-13, 2
    found = arm.ik_nearest(arm.fk(Q), Q, limits=limits)
    assert found.valid
    assert found.q[0] == limits[0, 0]
    limits[0] = Q[0] + 1e-10, 2
    assert arm.ik_nearest(arm.fk(Q), Q, limits=limits).reason == "limits"


def test_weights_select_another_solution(arm):
    rng = np.random.default_rng(5)
    weights = np.array([0, 1, 0.2, 0, 3, 1])
    limits = np.array([np.full(6, -7.0), np.full(6, 7.0)])
    for _ in range(20):
        T, seed = arm.fk(rng.uniform(-3, 3, 6)), rng.uniform(-3, 3, 6)
        found = arm.ik_nearest(T, seed, weights=weights, limits=limits.T)
        distance, _ = by_hand(arm, T, seed, limits, weights)
        assert (weights * np.abs(found.q - seed)).max() == pytest.approx(distance, abs=1e-12)


@pytest.mark.parametrize("weights", [[1, 1, 1, 1, 1, -1], [0] * 6, [1, 1, 1, 1, 1, np.nan]])
def test_unusable_weights_are_refused(arm, weights):
    with pytest.raises(InputValueError, match="weights"):
        arm.ik_nearest(arm.fk(Q), Q, weights=weights)


def test_equal_distances_give_the_lower_slot(arm):
    T = arm.fk(Q)
    far = Q + np.array([2.5, 0, 0, 0, 0, 0])
    # Only joint 0 has a nonzero weight, and four solution slots have the same value of joint 0.
    found = arm.ik_nearest(T, far, weights=[1, 0, 0, 0, 0, 0])
    solutions = arm.ik(T)
    distance = np.abs(np.angle(np.exp(1j * (solutions.q[:, 0] - far[0]))))
    slot = np.flatnonzero(np.isclose(distance, distance.min(), atol=1e-12))[0]
    assert np.abs(np.angle(np.exp(1j * (found.q - solutions.q[slot])))).max() < 1e-12


@pytest.mark.parametrize("name", ["ur5e", "scara"])
def test_seeds_between_two_solutions_give_the_same_slot_as_the_filters(name):
    robot, rng = chasles.load(name), np.random.default_rng(5)
    T = robot.fk(rng.uniform(robot.lower / 2, robot.upper / 2, (400, robot.n)))
    solutions = robot.ik(T)
    moves = solutions.q[:, 1] - solutions.q[:, 0]
    wraps = np.array(solutions.wraps)
    moves[:, wraps] -= TURN * np.rint(moves[:, wraps] / TURN)
    seeds = solutions.q[:, 0] + moves / 2
    found = robot.ik_nearest(T, seeds, limits=None).q
    expected = robot.ik(T).nearest(seeds)
    apart = found - expected
    apart[:, wraps] -= TURN * np.rint(apart[:, wraps] / TURN)
    assert np.abs(apart).max() < 1e-12


@pytest.mark.parametrize("ulps", [-3, 3])
def test_filters_take_the_lower_slot_of_distances_equal_but_for_rounding(arm, ulps):
    q = np.array([[0.3, *[0.0] * 5], [-0.3 * (1 + ulps * np.finfo(float).eps), *[0.0] * 5]])
    slots = type(arm.ik(arm.fk(Q)))(q, np.zeros(2), np.ones(2), np.ones(2, bool))
    np.testing.assert_array_equal(slots.nearest(np.zeros(6)), q[0])
    np.testing.assert_array_equal(slots.sorted_by_distance(np.zeros(6)).q, q)


def test_nothing_found_states_the_reason(arm):
    T, far = arm.fk(Q), arm.fk(Q)
    far[:3, 3] *= 10
    out = arm.ik_nearest(far, Q)
    assert (out.reason, bool(out.valid), np.isnan(out.q).all()) == ("out of reach", False, True)
    assert out.residual == pytest.approx(arm.ik(far).residual.min())
    assert out.margin < 0
    limited = arm.ik_nearest(T, Q, limits=[[-0.1, 0.1]] * 6)
    assert limited.reason == "limits"
    assert limited.residual < CLOSURE
    T[0, 3] = np.nan
    lost = arm.ik_nearest(T, Q)
    assert lost.reason == "not a pose"
    assert np.isnan(lost.residual)
    batch = arm.ik_nearest(np.stack([arm.fk(Q), far, T]), Q)
    assert batch.reason.tolist() == ["", "out of reach", "not a pose"]
    assert arm.ik_nearest(arm.fk(Q), [np.nan, *Q[1:]]).reason == "not a pose"


def test_bad_input_is_refused_as_by_ik(arm):
    T = arm.fk(Q)
    with pytest.raises(ShapeError):
        arm.ik_nearest(T, Q[:5])
    with pytest.raises(ShapeError):
        arm.ik_nearest(T[:3], Q)
    with pytest.raises(ShapeError, match="broadcast"):
        arm.ik_nearest(np.stack([T] * 3), np.stack([Q] * 2))
    with pytest.raises(InputTypeError):
        arm.ik_nearest(T, "home")
    with pytest.raises(InputValueError):
        arm.ik_nearest(2 * T, Q)
    with pytest.raises(InputValueError):
        arm.ik_nearest(np.stack([T, T.T]), Q)
    with pytest.raises(InputTypeError, match="threads"):
        arm.ik_nearest(T, Q, threads=0)
    with pytest.raises(InputValueError, match="redundancy"):
        arm.ik_nearest(T, Q, redundancy="best")
    with pytest.raises(InputValueError, match="limits"):
        arm.ik_nearest(T, Q, limits=np.array([[1.0, -1.0]] * 6))


def test_poses_in_single_precision_are_solved(arm):
    T = arm.fk(Q).astype(np.float32).astype(np.float64)
    found = arm.ik_nearest(T, Q)
    assert found.valid
    assert np.abs(found.q - Q).max() < 1e-5
    batch = arm.ik_nearest(np.stack([T, arm.fk(Q)]), Q)
    assert batch.valid.all()


def test_rounded_poses_outside_limits_state_the_limits():
    lynx = chasles.load("lynxmotion")
    q = np.array([0.1, 0.6, -0.5, 0.3, 0.2])
    T = lynx.fk(q).astype(np.float32).astype(np.float64)
    assert lynx.ik_nearest(T, q).valid
    tight = lynx.ik_nearest(T, q, limits=[[2.0, 2.1]] * 5)
    assert tight.reason == "limits"
    assert pickle.loads(pickle.dumps(tight)).reason == "limits"


def test_results_go_into_given_arrays(arm):
    T = arm.fk(np.stack([Q, Q + 0.1]))
    out = np.empty((2, 6)), None, np.empty(2), np.empty(2, np.bool_)
    found = arm.ik_nearest(T, Q, out=out)
    assert found.q is out[0]
    assert out[3].all()
    with pytest.raises(ShapeError, match="out"):
        arm.ik_nearest(T, Q, out=(np.empty(6), None, None, None))


def test_own_parameter_keeps_its_value_to_the_last_bit(panda):
    T = panda.fk(Q7)
    seed = Q7 + 0.013
    assert panda.ik_nearest(T, seed).q[6] == seed[6]
    for fixed in ({"joint7": 0.31}, {"joint7": 0.31}, {6: 0.31}):
        found = panda.ik_nearest(T, seed, fixed=fixed)
        assert found.q[6] == 0.31
        assert np.abs(panda.fk(found.q) - T).max() < CLOSURE
    kept = panda.ik_nearest(T, seed, fixed="joint7")
    assert np.array_equal(kept.q, panda.ik_nearest(T, seed).q)
    outside = panda.ik_nearest(T, seed, fixed={"joint7": 3.0})
    assert outside.reason in ("limits", "out of reach")
    assert not outside.valid


def test_unknown_fixed_joint_is_refused(panda):
    with pytest.raises(InputValueError, match="joint9"):
        panda.ik_nearest(panda.fk(Q7), Q7, fixed={"joint9": 1.0})
    with pytest.raises(InputTypeError, match="fixed"):
        panda.ik_nearest(panda.fk(Q7), Q7, fixed=1.5)


def test_swivel_angle_is_that_of_the_seed():
    iiwa = chasles.load("iiwa14")
    T, seed = iiwa.fk(Q7), Q7 + 0.01
    found = iiwa.ik_nearest(T, seed)
    assert found.valid
    assert iiwa.swivel(found.q) == pytest.approx(float(iiwa.swivel(seed)), abs=1e-9)
    batch = iiwa.ik_nearest(T[None], seed[None])
    assert np.abs(batch.q[0] - found.q).max() < 1e-12


def test_surplus_freedom_reaches_the_best_value_of_a_dense_scan(panda):
    T, seed = panda.fk(Q7), Q7 + np.array([0.1, -0.1, 0.2, 0.05, -0.2, 0.1, 0.3])
    values = np.linspace(panda.lower[6], panda.upper[6], 20_001)
    scan = panda.ik_nearest(np.broadcast_to(T, (len(values), 4, 4)), seed, fixed={"joint7": values})
    q = scan.q[scan.valid]
    middle, half = (panda.lower + panda.upper) / 2, (panda.upper - panda.lower) / 2
    objectives = {
        "nearest": lambda q: -np.abs(q - seed).max(-1),
        "limits": lambda q: -(np.abs(q - middle) / half).max(-1),
        "manipulability": lambda q: panda.manipulability(q).measure,
    }
    for name, objective in objectives.items():
        found = panda.ik_nearest(T, seed, redundancy=name)
        assert found.valid
        assert np.abs(panda.fk(found.q) - T).max() < CLOSURE
        assert objective(found.q) >= objective(q).max() - 1e-6


def test_nearest_over_the_self_motion_finds_narrow_minima_near_wrist_singularities():
    """Near the wrist singularity, small changes of the swivel angle rotate joints by half a
    turn."""
    iiwa, rng = chasles.load("iiwa14"), np.random.default_rng(2)
    coarse = np.linspace(-np.pi, np.pi, 2001)
    for k in range(30):
        q = iiwa.random_q(rng=rng)
        q[5] = rng.choice([-1, 1]) * 10.0 ** rng.uniform(-4, -1)
        T, seed = iiwa.fk(q), np.clip(q + rng.normal(0, 0.3, 7), *iiwa.limits.T)
        around = np.geomspace(1e-7, 0.1, 300)
        swivel = float(iiwa.swivel(q)) + np.concatenate([-around, around, coarse])
        poses = np.broadcast_to(T, (len(swivel), 4, 4))
        scan = iiwa.ik_nearest(poses, seed, fixed={"swivel": swivel})
        found = iiwa.ik_nearest(T, seed, redundancy="nearest")
        assert np.abs(iiwa.fk(found.q) - T).max() < CLOSURE
        best = np.abs(scan.q[scan.valid] - seed).max(-1).min()
        assert np.abs(found.q - seed).max() <= best + 1e-6, k


def test_two_surplus_freedoms_reach_the_best_value_of_a_dense_scan():
    photo, rng = chasles.load("photo_robot"), np.random.default_rng(5)
    q = rng.uniform(-1, 1, photo.n)
    T, seed = photo.fk(q), q + rng.uniform(-0.1, 0.1, photo.n)
    values = np.stack(np.meshgrid(*(seed[k] + np.linspace(-1, 1, 51) for k in (0, 3))), -1)
    fixed = {"r1": values[..., 0], "r4": values[..., 1]}
    scan = photo.ik_nearest(np.broadcast_to(T, (51, 51, 4, 4)), seed, fixed=fixed)
    assert scan.valid.sum() > 1000
    objectives = {
        "nearest": lambda q: -np.abs(q - seed).max(-1),
        "manipulability": lambda q: photo.manipulability(q).measure,
    }
    for name, objective in objectives.items():
        found = photo.ik_nearest(T, seed, redundancy=name)
        assert np.abs(photo.fk(found.q) - T).max() < CLOSURE
        assert objective(found.q) >= objective(scan.q[scan.valid]).max() - 1e-6


def test_three_surplus_freedoms_stay_within_limits_and_near_the_seed():
    well, rng = chasles.load("well_manipulator"), np.random.default_rng(6)
    q = np.array(well.reference.q)
    seed = np.clip(q * rng.uniform(0.98, 1.02, well.n), well.lower, well.upper)
    T = well.fk(q)
    for name in ("nearest", "limits", "manipulability"):
        found = well.ik_nearest(T, seed, redundancy=name)
        assert found.valid
        assert well.is_within_limits(found.q)
        assert np.abs(well.fk(found.q) - T).max() < CLOSURE
        if name == "nearest":
            assert np.abs(found.q - seed).max() <= np.abs(q - seed).max() + 1e-9


def test_loops_close_on_the_reference_branch():
    excavator = chasles.load("excavator")
    q = np.array(excavator.reference.q)
    T = excavator.fk(q)
    found = excavator.ik_nearest(T, q + 0.01)
    assert found.valid
    assert np.abs(found.q - q).max() < CLOSURE
    assert np.abs(excavator.fk(found.q) - T).max() < CLOSURE
    well = chasles.load("well_manipulator")
    q = np.array(well.reference.q)
    found = well.ik_nearest(well.fk(q), q)
    assert found.valid
    assert np.abs(found.q - q).max() < CLOSURE


def test_task_leaves_free_coordinates_at_zero():
    lynx = chasles.load("lynxmotion")
    q = np.array([0.1, 0.6, -0.5, 0.3, 0.7])
    T = lynx.fk(q)
    for task in ("position", "position_pitch", "position_direction"):
        found = lynx.ik_nearest(T, q, task=task)
        assert found.valid
        assert found.q[4] == 0
        assert np.abs(lynx.fk(found.q)[:3, 3] - T[:3, 3]).max() < CLOSURE
    own = lynx.ik_nearest(T[:3, 3], q, task="position")
    assert np.array_equal(own.q, lynx.ik_nearest(T, q, task="position").q)
    with pytest.raises(InputValueError, match="task"):
        lynx.ik_nearest(T, q, task="planar")


def test_robot_without_closed_form_names_the_substitute():
    platform = chasles.load("planar_3rrr")
    with pytest.raises(MissingFunctionError, match=r"ik_numeric|ik_planar"):
        _ = platform.ik_nearest


def test_pickled_method_and_result_are_restored(arm):
    found = arm.ik_nearest(arm.fk(Q), Q)
    again = pickle.loads(pickle.dumps(found))
    assert np.array_equal(again.q, found.q)
    method = pickle.loads(pickle.dumps(arm.ik_nearest))
    assert np.array_equal(method(arm.fk(Q), Q).q, found.q)
    assert "q_seed" in method.__doc__
