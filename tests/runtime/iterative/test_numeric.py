"""Iterative IK functions stay within limits, report their error, and are reproducible."""

import re

import numpy as np
import pytest

import chasles
from chasles import se3
from chasles.iterative import numeric_inverse
from tests.support.iteration import (
    PLATFORMS,
    POSITION,
    ROUNDING,
    TOLERANCE,
    away,
    configurations,
    distance,
    same,
    within,
)
from tests.support.pages import examples

PAGE = "how-to/numeric.md"
CLOSED = 1e-12
"""Closure tolerance (meter or radian) for loops that are closed by iteration."""
DIRECTION = (1, 1, 1, 1, 1, 0)
SERIAL = ("ur5e", "puma560", "panda", "iiwa14", "photo_robot", "jaco2", "lynxmotion", "stanford")
LOOPS = ("well_manipulator", "board_installer", "excavator", "delta")
ROBOTS = (*SERIAL, *LOOPS, *PLATFORMS)
ENDLESS = ("photo_robot",)
"""Robots on a track without limits, so that they reach any distance."""
PLACED = ("ur5e", "puma560", "panda", "jaco2", "lynxmotion", "well_manipulator")


@pytest.fixture(params=ROBOTS)
def robot(request):
    return chasles.load(request.param)


@pytest.fixture
def ur5e():
    return chasles.load("ur5e")


def beyond(robot, count):
    T = robot.fk(configurations(robot, 500))
    reach = np.linalg.norm(T[:, :3, 3], axis=1)
    T = T[:count].copy()
    T[:, :3, 3] *= 1.1 * reach.max() / reach[:count, None]
    return T


def test_reachable_poses_are_solved_within_limits(robot):
    T = robot.fk(configurations(robot, 200))
    found = robot.ik_numeric(T)
    assert found.valid.all()
    assert (found.reason == "").all()
    assert within(robot, found.q)
    assert found.residual.max() <= TOLERANCE * robot.unit_length
    rounding = CLOSED if robot.name in (*LOOPS, *PLATFORMS) else ROUNDING
    np.testing.assert_allclose(
        away(robot.fk(found.q), T, robot.unit_length), found.residual, rtol=0, atol=rounding
    )


@pytest.mark.parametrize("name", [name for name in ROBOTS if name not in ENDLESS])
def test_unreachable_poses_report_true_residual(name):
    robot = chasles.load(name)
    T = beyond(robot, 10)
    found = robot.ik_numeric(T)
    assert not found.valid.any()
    assert (found.reason != "").all()
    assert within(robot, found.q)
    assert found.iterations.max() <= 10_000
    rounding = CLOSED if robot.name in (*LOOPS, *PLATFORMS) else ROUNDING
    np.testing.assert_allclose(
        away(robot.fk(found.q), T, robot.unit_length), found.residual, rtol=0, atol=rounding
    )
    assert found.residual.min() > 0.01


def test_limits_hold_exactly_if_nearest_configuration_touches_them():
    robot = chasles.load("puma560")
    found = robot.ik_numeric(beyond(robot, 100), robot.upper + 1)
    at_limits = (found.q == robot.lower) | (found.q == robot.upper)
    assert within(robot, found.q)
    assert at_limits.any()
    np.testing.assert_array_equal(at_limits.any(axis=1) | (found.reason != "limits"), True)


@pytest.mark.parametrize("name", PLACED)
def test_unreachable_position_ends_at_local_minimum(name):
    robot = chasles.load(name)
    T = beyond(robot, 10)
    found = robot.ik_numeric(T, task_weights=POSITION)
    assert not found.valid.any()
    assert set(found.reason) <= {"limits", "stalled"}
    np.testing.assert_allclose(distance(robot.fk(found.q), T), found.residual, rtol=1e-12)
    generator = np.random.default_rng(0)
    checked = 0
    for q, pose, residual in zip(found.q, T, found.residual, strict=True):
        for size in (1e-4, 1e-2, 0.3):
            near = q + size * generator.standard_normal((200, robot.n))
            near = robot.fk(np.clip(near, robot.lower, robot.upper))
            assert np.nanmin(distance(near, pose)) >= residual - 1e-9
            checked += 1
    assert checked == 30


def test_arm_stretches_towards_unreachable_position():
    # The nearest position may be on the outer boundary of the reach.
    robot = chasles.load("lynxmotion")
    table, arm = np.array([0, 0, 0.1]), 0.3
    towards = np.array([np.cos(0.7), 0, np.sin(0.7)])
    T = np.eye(4)
    T[:3, 3] = table + 2 * arm * towards
    found = robot.ik_numeric(T, task_weights=POSITION)
    assert found.residual == pytest.approx(arm, abs=1e-9)
    np.testing.assert_allclose(robot.fk(found.q)[:3, 3], table + arm * towards, atol=1e-6)


@pytest.mark.parametrize("limit", [1, 2, 7, 40, 5000])
def test_maximum_of_evaluations_is_respected(ur5e, limit):
    T = np.concatenate([ur5e.fk(configurations(ur5e, 50)), beyond(ur5e, 50)])
    found = ur5e.ik_numeric(T, max_evaluations=limit)
    assert found.iterations.max() <= limit
    assert found.iterations.min() >= 1
    assert np.isfinite(found.q).all()
    assert within(ur5e, found.q)
    np.testing.assert_array_equal(found.valid, found.reason == "")
    np.testing.assert_array_equal(found.valid, found.residual <= TOLERANCE)


def test_maximum_of_evaluations_is_respected_where_branches_meet(ur5e):
    q = configurations(ur5e, 50)
    q[:, 2] = 0.0  # a stretched elbow
    for limit in range(2, 24):
        found = ur5e.ik_numeric(ur5e.fk(q), max_evaluations=limit)
        assert found.iterations.max() <= limit


def test_spent_evaluations_are_reported(ur5e):
    for limit in (1, 2, 5):
        found = ur5e.ik_numeric(ur5e.fk(configurations(ur5e, 50)), max_evaluations=limit)
        unsolved = found.reason == "max_evaluations"
        assert unsolved.any()
        assert (found.iterations[unsolved] == limit).all()
        assert (found.restarts == 0).all()
    assert not found.valid[found.reason == "max_evaluations"].any()


def test_looser_tolerance_needs_fewer_iterations(ur5e):
    T = ur5e.fk(configurations(ur5e, 100))
    loose, tight = (ur5e.ik_numeric(T, tolerance=tolerance) for tolerance in (1e-3, 1e-11))
    assert loose.valid.all()
    assert tight.valid.all()
    assert TOLERANCE < loose.residual.max() <= 1e-3
    assert tight.residual.max() <= 1e-11
    assert loose.iterations.sum() < tight.iterations.sum()


@pytest.mark.parametrize("name", ["ur5e", "panda", "well_manipulator", "stewart_gough"])
def test_same_rng_gives_same_results_on_any_thread_count(name):
    robot = chasles.load(name)
    T = np.concatenate([robot.fk(configurations(robot, 80)), beyond(robot, 5)])
    first = robot.ik_numeric(T, rng=7)
    for threads in (2, 3, "all"):
        assert same(robot.ik_numeric(T, rng=7, threads=threads), first)
    alone = [robot.ik_numeric(pose, rng=7) for pose in T]
    for field in first._fields:
        assert np.array_equal([getattr(one, field) for one in alone], getattr(first, field))


def test_rng_determines_start_configurations(ur5e):
    T = ur5e.fk(configurations(ur5e, 50))
    one, other = ur5e.ik_numeric(T, rng=1), ur5e.ik_numeric(T, rng=2)
    assert one.valid.all()
    assert other.valid.all()
    assert (np.abs(one.q - other.q).max(axis=1) > 0.1).any()
    generators = [np.random.default_rng(5) for _ in range(2)]
    assert same(*(ur5e.ik_numeric(T, rng=generator) for generator in generators))
    # The second call with the same random generator uses other start configurations.
    again = [ur5e.ik_numeric(T, rng=generators[0]), ur5e.ik_numeric(T, rng=generators[1])]
    assert same(*again)
    assert not same(again[0], ur5e.ik_numeric(T, rng=np.random.default_rng(5)))


def test_nearby_seed_converges_to_nearby_solution(robot):
    q = np.clip(configurations(robot, 100), robot.lower + 0.02, robot.upper - 0.02)
    q = q[np.isfinite(robot.fk(q)).all((1, 2))]
    step = 1e-3 * np.random.default_rng(1).uniform(-1, 1, q.shape)
    found = robot.ik_numeric(robot.fk(q), q + step)
    assert found.valid.all()
    # Only a few poses near singularities need a restart of the iteration.
    assert (found.restarts == 0).mean() >= 0.95
    moved = np.abs(found.q - q).max(axis=1)
    assert np.median(moved) <= (0.01 if robot.n > 6 else 1e-6)


def test_iteration_starts_at_the_table_configuration_with_the_nearest_pose(ur5e):
    q = numeric_inverse.starts(ur5e, 0)
    found = ur5e.ik_numeric(ur5e.fk(q))
    np.testing.assert_array_equal(found.q, q)
    assert (found.iterations == 1).all()


def test_seed_at_solution_is_returned_unchanged(ur5e):
    q = configurations(ur5e, 20)
    found = ur5e.ik_numeric(ur5e.fk(q), q)
    np.testing.assert_array_equal(found.q, q)
    assert (found.iterations == 1).all()
    assert (found.restarts == 0).all()


def test_seed_beyond_limits_is_clipped(ur5e):
    q = configurations(ur5e, 20)
    T = ur5e.fk(q)
    outside = np.where(q > 0, 1, -1) * 50.0
    clipped = np.clip(outside, ur5e.lower, ur5e.upper)
    assert same(ur5e.ik_numeric(T, outside), ur5e.ik_numeric(T, clipped))


def test_leading_dimensions_broadcast(ur5e):
    q = configurations(ur5e, 6)
    T, seeds = ur5e.fk(q[:3])[:, None], q[3:5]
    found = ur5e.ik_numeric(T, seeds)
    assert found.q.shape == (3, 2, 6)
    for field in found._fields[1:]:
        assert getattr(found, field).shape == (3, 2)
    for i, j in np.ndindex(3, 2):
        one = ur5e.ik_numeric(T[i, 0], seeds[j])
        np.testing.assert_array_equal(one.q, found.q[i, j])
        assert one.residual == found.residual[i, j]
    assert ur5e.ik_numeric(T[0, 0], seeds).q.shape == (2, 6)
    assert ur5e.ik_numeric(T, q[0]).q.shape == (3, 1, 6)
    empty = ur5e.ik_numeric(np.zeros((0, 4, 4)))
    assert empty.q.shape == (0, 6)
    assert str(empty).startswith("0 poses")


def test_single_pose_gives_scalar_results(ur5e):
    found = ur5e.ik_numeric(ur5e.fk(configurations(ur5e, 1)[0]).tolist())
    assert found.q.shape == (6,)
    assert found.valid
    assert found.reason == ""
    assert np.ndim(found.residual) == np.ndim(found.iterations) == np.ndim(found.restarts) == 0
    assert str(found).startswith(f"solved after {found.iterations} iterations, residual ")
    assert found.iterations > 1
    assert str(ur5e.ik_numeric(ur5e.fk(found.q), found.q)).startswith("solved after 1 iteration,")


def test_memory_layout_of_poses_and_seeds_is_irrelevant(ur5e):
    q = configurations(ur5e, 20)
    T = ur5e.fk(q)
    wide = np.zeros((20, 5, 8))
    wide[:, :4, ::2] = T
    expected = ur5e.ik_numeric(T, q[::-1])
    assert same(ur5e.ik_numeric(wide[:, :4, ::2], q[::-1].copy()), expected)
    assert same(ur5e.ik_numeric(np.asfortranarray(T), np.asfortranarray(q[::-1])), expected)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_non_finite_poses_fail_without_affecting_other_poses(robot, bad):
    T = robot.fk(configurations(robot, 4))
    T[1, 0, 3], T[3, 1, 1] = bad, bad
    found = robot.ik_numeric(T)
    np.testing.assert_array_equal(found.valid, [True, False, True, False])
    assert np.isnan(found.q[[1, 3]]).all()
    assert np.isnan(found.residual[[1, 3]]).all()
    assert (found.reason[[1, 3]] != "converged").all()
    np.testing.assert_array_equal(found.q[0], robot.ik_numeric(T[0]).q)


def test_nan_seed_does_not_prevent_success(ur5e):
    T = ur5e.fk(configurations(ur5e, 3))
    found = ur5e.ik_numeric(T, np.full(6, np.nan))
    assert found.valid.all()
    assert within(ur5e, found.q)


@pytest.mark.parametrize("frame", ["tool", "base"])
@pytest.mark.parametrize("name", PLACED)
def test_position_only_weights_ignore_orientation(name, frame):
    robot = chasles.load(name)
    T = robot.fk(configurations(robot, 100))
    T[:, :3, :3] = np.diag([-1.0, 1, -1])
    found = robot.ik_numeric(T, task_weights=POSITION, frame=frame)
    assert found.valid.all()
    assert within(robot, found.q)
    there = distance(robot.fk(found.q), T)
    np.testing.assert_allclose(there, found.residual, rtol=0, atol=ROUNDING)


def test_direction_weights_leave_tool_roll_free():
    robot = chasles.load("lynxmotion")
    q = configurations(robot, 100)
    T = robot.fk(q)
    turned = T @ se3.exp([0, 0, 0, 0, 0, 2.0])
    found = robot.ik_numeric(turned, q * [1, 1, 1, 1, 0], task_weights=DIRECTION)
    assert found.valid.all()
    reached = robot.fk(found.q)
    assert distance(reached, T).max() <= TOLERANCE + ROUNDING
    assert np.abs(reached[:, :3, 2] - T[:, :3, 2]).max() <= 2 * TOLERANCE


def test_weighted_components_follow_named_axes(ur5e):
    T = ur5e.fk(configurations(ur5e, 50))
    for frame, part in (("base", lambda A, B: (B - A)[:, :3, 3]), ("tool", in_tool)):
        found = ur5e.ik_numeric(T, task_weights=(1, 0, 1, 0, 0, 0), frame=frame)
        assert found.valid.all()
        gap = part(ur5e.fk(found.q), T)
        assert np.abs(gap[:, [0, 2]]).max() <= 2 * TOLERANCE
        assert np.abs(gap[:, 1]).max() > 0.1


def in_tool(A, B):
    return (se3.inverse(A) @ B)[:, :3, 3]


def test_weights_trade_position_against_orientation(ur5e):
    T = beyond(ur5e, 20)
    place = ur5e.ik_numeric(T, task_weights=(100, 100, 100, 1, 1, 1))
    turn = ur5e.ik_numeric(T, task_weights=(1, 1, 1, 100, 100, 100))
    near, upright = ur5e.fk(place.q), ur5e.fk(turn.q)
    assert distance(near, T).mean() < distance(upright, T).mean()
    angle = np.linalg.norm(se3.log(se3.inverse(upright) @ T)[:, 3:], axis=1)
    assert angle.max() < 0.01


@pytest.mark.parametrize(
    ("name", "small"), [("panda", 1e-3), ("ur5e", 1e-6), ("panda", 1e-9), ("ur5e", 1e-9)]
)
def test_small_weights_still_count_for_success(name, small):
    robot = chasles.load(name)
    T = robot.fk(configurations(robot, 30))
    for weights in ((1, 1, 1, small, small, small), (small, small, small, 1, 1, 1)):
        found = robot.ik_numeric(T, task_weights=weights)
        np.testing.assert_allclose(
            away(robot.fk(found.q), T, robot.unit_length), found.residual, rtol=0, atol=1e-12
        )
        np.testing.assert_array_equal(found.valid, found.residual <= TOLERANCE * robot.unit_length)
        np.testing.assert_array_equal(found.valid, found.reason == "")


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"T": np.eye(3)}, chasles.ShapeError, r"poses T \(..., 4, 4\), got shape \(3, 3\)"),
        ({"T": np.zeros(4)}, chasles.ShapeError, r"got shape \(4,\)"),
        ({"q_seed": np.zeros(5)}, chasles.ShapeError, r"q_seed \(..., 6\), got shape \(5,\)"),
        ({"q_seed": 0.0}, chasles.ShapeError, r"got shape \(\)"),
        (
            {"T": np.zeros((3, 4, 4)), "q_seed": np.zeros((2, 6))},
            chasles.ShapeError,
            r"do not broadcast: \(3,\) of T and \(2,\) of q_seed",
        ),
        ({"task_weights": np.ones(3)}, chasles.ShapeError, r"six task_weights, got shape \(3,\)"),
        ({"task_weights": np.zeros(6)}, chasles.InputError, "at least one must be positive"),
        (
            {"task_weights": (1, 1, 1, 1, 1, -1)},
            chasles.InputError,
            "task_weights must be finite and nonnegative",
        ),
        ({"task_weights": (1, 1, 1, 1, 1, np.nan)}, chasles.InputError, "weights"),
        ({"task_weights": (1, 1, 1, 1, 1, np.inf)}, chasles.InputError, "weights"),
        ({"tip": "hand"}, chasles.InputError, "unknown tip link 'hand'; expected one of ee, link1"),
        (
            {"max_evaluations": 0},
            chasles.InputError,
            "integer from 1 to 2147483647, got 0",
        ),
        ({"max_evaluations": 2**40}, chasles.InputError, "max_evaluations to be an integer from 1"),
        (
            {"max_evaluations": 10.5},
            chasles.InputError,
            r"to be an integer .*, got 10\.5",
        ),
        ({"threads": 0}, chasles.InputError, "threads to be an integer of at least 1, got 0"),
        ({"threads": "two"}, chasles.InputError, "threads to be .*, got 'two'"),
        ({"rng": -1}, chasles.InputError, "rng to be an integer of at least 0, got -1"),
        ({"rng": 1.5}, chasles.InputError, "rng to be an integer"),
        ({"T": "here"}, chasles.InputError, "T must hold real numbers, got dtype <U4"),
        (
            {"T": np.eye(4) * 1j},
            chasles.InputError,
            "T must hold real numbers, got dtype complex128",
        ),
        ({"tolerance": "a"}, chasles.InputError, "tolerance above 0, got 'a'"),
        ({"tolerance": 0.0}, chasles.InputError, "tolerance above 0, got 0.0"),
        ({"tolerance": np.nan}, chasles.InputError, "tolerance above 0"),
        ({"frame": "world"}, chasles.InputError, '"tool" or "base", got \'world\''),
    ],
)
def test_invalid_arguments_are_rejected_by_name(ur5e, arguments, error, message):
    with pytest.raises(error, match=rf"^ur5e\.ik_numeric: .*{message}"):
        ur5e.ik_numeric(**{"T": np.eye(4), **arguments})


@pytest.mark.parametrize(
    "T",
    [np.zeros((4, 4)), 2 * np.eye(4), np.diag([1.0, 1, -1, 1])],
    ids=["zeros", "scaled", "mirrored"],
)
def test_non_rigid_pose_has_no_solution(ur5e, T):
    found = ur5e.ik_numeric(T)
    assert not found.valid
    assert found.iterations == 0
    assert np.isnan(found.q).all()


def test_rng_accepts_every_integer_type(ur5e):
    T = ur5e.fk(configurations(ur5e, 20))
    np.testing.assert_array_equal(
        ur5e.ik_numeric(T, rng=np.int64(3)).q, ur5e.ik_numeric(T, rng=3, threads=np.int64(2)).q
    )


def test_start_configurations_cover_joint_ranges_evenly(ur5e):
    q = numeric_inverse.starts(ur5e, 3)
    assert within(ur5e, q)
    for joint in q.T:
        share = (np.sort(joint) - joint.min()) / np.ptp(joint)
        assert np.diff(share).max() < 0.05
    np.testing.assert_array_equal(q, numeric_inverse.starts(ur5e, 3))
    assert not np.array_equal(q, numeric_inverse.starts(ur5e, 4))


def test_inputs_are_not_modified(ur5e):
    q = configurations(ur5e, 5)
    T, seed = ur5e.fk(q), q + 10
    kept = T.copy(), seed.copy()
    ur5e.ik_numeric(T, seed, threads=2)
    np.testing.assert_array_equal(T, kept[0])
    np.testing.assert_array_equal(seed, kept[1])


def test_numeric_page_examples_print_documented_output(capsys):
    blocks = examples(PAGE)
    names, seen = {}, []
    for block in blocks:
        exec(compile(block, PAGE, "exec"), names)
        seen.append(dict(names))
    printed = [line for block in blocks for line in re.findall(r"print\(.*\)  # (.*)", block)]
    assert capsys.readouterr().out.splitlines() == printed
    _, far, near, _, parts, link, fixed, _ = seen
    arm, q_now = far["arm"], far["q_now"]
    np.testing.assert_array_equal(far["found"].valid, [True, False, False])
    assert away(far["reached"], far["targets"][1]) > 0.5
    assert near["found"].restarts == 0
    assert np.abs(near["found"].q - q_now).max() < 0.02
    assert parts["place"].valid
    assert parts["point"].valid
    assert fixed["found"].valid
    assert fixed["found"].q[2] == q_now[2] + 0.1
    assert distance(arm.link_poses(link["found"].q)[3], link["elbow"]) <= TOLERANCE


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_seed_rotated_by_half_turn_converges(ur5e, axis):
    # For a rotation by pi, the logarithm contains a limit of the form 0 / 0.
    rng = np.random.default_rng(0)
    seed = rng.uniform(-2, 2, (3000, 6))
    T = ur5e.fk(seed) @ np.diag([1.0 if k in (axis, 3) else -1.0 for k in range(4)])
    T[:, :3, 3] += 0.05 * rng.normal(size=(3000, 3))
    within_reach = ur5e.ik(T).valid.any(-1)
    assert within_reach.sum() > 2000
    found = ur5e.ik_numeric(T[within_reach], q_seed=seed[within_reach])
    assert found.valid.all()


def test_fixed_coordinates_have_the_given_values(ur5e):
    """Fixed joint values broadcast with the poses and the seeds."""
    q = np.array([[0.3, -1.2, 1.1, -0.4, 0.7, 0.2], [0.1, -0.9, 0.8, 0.3, -0.6, 1.0]])
    elbow, last = ur5e.coordinate_names[2], 5
    found = ur5e.ik_numeric(ur5e.fk(q), q + 0.05, fixed={elbow: q[:, 2], last: q[:, last]})
    assert found.valid.all()
    np.testing.assert_array_equal(found.q[:, [2, last]], q[:, [2, last]])
    np.testing.assert_allclose(found.q, q, atol=1e-9)


def test_fixed_joint_of_a_loop_moves_its_actuator():
    excavator = chasles.load("excavator")
    q = np.add(excavator.q_reference, [0.2, 0.05, -0.03, 0.02])
    boom = excavator.chain(q)[1]
    found = excavator.ik_numeric(excavator.fk(q), excavator.q_reference, fixed={"boom": boom})
    assert found.valid
    assert excavator.chain(found.q)[1] == pytest.approx(boom, abs=1e-12)
    np.testing.assert_allclose(found.q, q, atol=1e-9)


def test_fixed_values_that_do_not_broadcast_are_rejected(ur5e):
    seeds = np.zeros((3, 6))
    with pytest.raises(chasles.ShapeError, match=r"got shape \(2,\) for 2, expected"):
        ur5e.ik_numeric(ur5e.fk(seeds), seeds, fixed={2: [0.1, 0.2]})
