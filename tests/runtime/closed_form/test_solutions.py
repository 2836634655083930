"""Inverse kinematics with all branches: the returned solutions, and their filters."""

import copy
import itertools
import pickle

import numpy as np
import pytest

import chasles
from chasles.closed_form.solutions import Solutions, solutions_of
from chasles.contract import Coordinate
from tests.support.handwritten import scara
from tests.support.leaks import assert_no_leaks

N = 1000
LIMITS = np.array([6.5, 2.5, 10.0, np.inf])


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    folder = scara.write(tmp_path_factory.mktemp("scara") / "scara")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CHASLES_CACHE", str(folder.path.parent / "cache"))
        return chasles.load(folder.path)


@pytest.fixture
def q():
    """Return SCARA coordinates (N, 4) within one turn, with the elbow to the left."""
    rng = np.random.default_rng(7)
    return rng.uniform([-3, 0.1, -0.5, -3], [3, 2.4, 0.5, 3], (N, 4))


def wrapped(difference):
    return difference - 2 * np.pi * np.round(difference / (2 * np.pi))


def apart(a, b, turning=(True, True, False, True)):
    return np.where(turning, wrapped(a - b), a - b)


# ------------------------------------------------------------------ the call


def test_single_pose_returns_all_branches(arm, q):
    solutions = arm.ik(scara.fk(q[0]))
    assert isinstance(solutions, Solutions)
    assert isinstance(solutions, tuple)
    found, residual, margin, valid = solutions
    assert [found.shape, residual.shape, margin.shape, valid.shape] == [(2, 4), (2,), (2,), (2,)]
    assert solutions.q is found
    assert solutions.valid is valid
    assert valid.dtype == np.bool_
    assert valid.all()
    assert np.abs(scara.fk(found) - scara.fk(q[0])).max() < 1e-14
    assert np.abs(apart(found[0], q[0])).max() < 1e-14


def everything(arm, T, how):
    if how == "dense":
        return arm.ik(T)
    if how == "strided":
        return arm.ik(np.asfortranarray(T))
    if how == "list":
        return arm.ik(T.tolist())
    if how == "threads":
        return arm.ik(T, threads=2)
    return arm.ik(T=T)


@pytest.mark.parametrize("how", ["dense", "strided", "list", "threads", "keyword"])
@pytest.mark.parametrize("batch", [(N,), (20, 50), (0,), ()], ids=str)
def test_every_call_form_gives_same_solutions(arm, q, how, batch):
    if how == "list" and 0 in batch:
        pytest.skip("an empty list has no shape")
    T = scara.fk(q)[: int(np.prod(batch))].reshape(*batch, 4, 4)
    solutions = everything(arm, T, how)
    assert isinstance(solutions, Solutions)
    assert solutions.q.shape == (*batch, 2, 4)
    assert solutions.valid.shape == (*batch, 2)
    assert solutions.valid.all()
    assert (
        np.abs(apart(solutions.q[..., 0, :], q[: len(T.reshape(-1, 16))].reshape(*batch, 4))).max(
            initial=0
        )
        < 1e-12
    )


def test_threads_do_not_change_solutions(arm, q):
    T = np.tile(scara.fk(q), (200, 1, 1))
    for one, two in zip(arm.ik(T), arm.ik(T, threads=2), strict=True):
        np.testing.assert_array_equal(one, two)


def test_out_arrays_receive_solutions(arm, q):
    T = scara.fk(q)
    for given in (T, T[0]):
        batch = given.shape[:-2]
        expected = arm.ik(given)
        out = tuple(np.full((*batch, *shape), 7.0) for shape in ((2, 4), (2,), (2,)))
        solutions = arm.ik(given, out=out)
        assert all(field is array for field, array in zip(solutions, out, strict=False))
        partly = arm.ik(given, out=(None, out[1], None))
        assert partly.residual is out[1]
        strided = np.empty((*batch, 4))[..., ::2]
        assert arm.ik(given, out=(None, strided, None)).residual is strided
        np.testing.assert_array_equal(strided, expected.residual)
        for found in (solutions, partly):
            for field, other in zip(found, expected, strict=True):
                np.testing.assert_array_equal(field, other)
    with pytest.raises(chasles.InputError, match="a tuple of 3"):
        arm.ik(T, out=out[0])


def test_further_inputs_broadcast(arm, q):
    q = q[:50]
    p, phi = scara.fk(q)[:, :3, 3], q[:, [0, 1, 3]].sum(-1)
    solutions = arm.ik_position(p, phi[:, None, None] * np.ones((3, 1)))
    assert solutions.q.shape == (50, 3, 50, 2, 4)
    one = arm.ik_position(p[5], float(phi[5]))
    np.testing.assert_allclose(apart(one.q[0], q[5]), 0, atol=1e-12)


def test_unreachable_and_non_finite_poses_are_invalid(arm):
    T = np.array([scara.fk([0.1, 0.2, 0.3, 0.4])] * 3)
    T[1, 0, 3] = 2.0
    T[2, 0, 3] = np.nan
    solutions = arm.ik(T)
    np.testing.assert_array_equal(solutions.valid, [[True, True], [False, False], [False, False]])
    assert np.isfinite(solutions.q[1]).all()
    assert (solutions.margin[0] > 0).all()
    assert (solutions.margin[1] < 0).all()
    assert np.isnan(solutions.residual[2]).all()
    for k in range(3):
        np.testing.assert_array_equal(arm.ik(T[k]).valid, solutions.valid[k])


def test_tolerance_decides_validity(arm):
    # Some poses are out of reach by less than the tolerance, and other poses by more.
    reach = scara.A1 + scara.A2
    for beyond, valid in ((0.5e-9, True), (2e-9, False)):
        T = scara.fk(np.zeros(4))
        T[0, 3] = reach + beyond
        assert (arm.ik(T).valid == valid).all()


def test_solutions_survive_pickle_and_copy(arm, q):
    for solutions in (arm.ik(scara.fk(q)), arm.ik(scara.fk(q[0])).within_limits()):
        for again in (pickle.loads(pickle.dumps(solutions)), copy.copy(solutions)):
            assert type(again) is type(solutions)
            for a, b in zip(solutions, again, strict=True):
                np.testing.assert_array_equal(a, b)


def test_dask_poses_give_lazy_solutions(arm, q):
    array = pytest.importorskip("dask.array")
    dask = pytest.importorskip("dask")
    T = array.from_array(scara.fk(q), chunks=(300, 4, 4))
    lazy = arm.ik(T)
    assert isinstance(lazy, Solutions)
    assert all(isinstance(field, array.Array) for field in lazy)
    assert lazy.q.chunks == ((300, 300, 300, 100), (2,), (4,))
    assert lazy.valid.dtype == np.bool_
    (computed,) = dask.compute(lazy)
    assert type(computed) is type(lazy)
    for a, b in zip(computed, arm.ik(scara.fk(q)), strict=True):
        np.testing.assert_array_equal(a, b)


def test_inverse_calls_leak_no_references_or_memory(arm, q, few_objects):
    T, batch = scara.fk(q[0]), scara.fk(q[:3])
    out = (np.empty((2, 4)), np.empty(2), np.empty(2))
    calls = [
        lambda: arm.ik(T),
        lambda: arm.ik(T, out=out),
        lambda: arm.ik(batch),
        lambda: arm.ik(batch.tolist()),
        lambda: arm.ik(batch, out=(None, np.empty((3, 4))[:, ::2], None)),
    ]
    assert_no_leaks(calls, [T, batch, *out, arm.ik, type(arm.ik(T))])


def test_inverse_exposes_its_solutions_class(arm):
    assert arm.ik.solutions is solutions_of(
        arm.coordinates, (True, True, False, True), ("elbow +", "elbow -"), 1.0
    )
    assert arm.fk.solutions is None


@pytest.mark.parametrize(
    "bad",
    [int, 3, type("Fat", (tuple,), {}), tuple],
    ids=["int class", "number", "tuple subclass", "plain tuple"],
)
def test_invalid_solutions_class_is_rejected(tmp_path, cache, bad):
    from chasles.call import _call
    from chasles.contract import read_manifest
    from chasles.library.cache import build, make_recipe

    manifest = read_manifest(scara.write(tmp_path / "scara").path)
    build(manifest)
    recipe = make_recipe(manifest)
    library = _call.open(recipe.path, recipe.key)
    ik = manifest.functions[2]
    rest = {"label": "x", "doc": "", "signature": None, "operations": {}, "reduced": ()}
    rest |= {"guard": None, "solutions": bad, "rescue": None, "poses": 0, "fk": None, "unit": 1.0}
    rest |= {"general": None, "parameters": ()}
    with pytest.raises((TypeError, AttributeError)):
        library.function("ik", ik.inputs, ik.outputs, **rest)
    fk, rest["solutions"] = manifest.functions[0], Solutions
    with pytest.raises(TypeError, match="for a function of 3 outputs"):
        library.function("fk", fk.inputs, fk.outputs, **rest)


def test_docstring_documents_valid_output(arm):
    assert "q: (..., 2, 4) [rad or m]" in arm.ik.__doc__
    assert "valid: (..., 2) whether residual <= 1e-09" in arm.ik.__doc__
    assert "valid" not in arm.fk.__doc__


# ------------------------------------------------------------------- filters


def test_count_and_array_return_valid_solutions(arm, q):
    T = scara.fk(q)
    T[3, 0, 3] = 5.0
    solutions = arm.ik(T)
    assert solutions.count.shape == (N,)
    assert solutions.count[3] == 0
    assert solutions.count.sum() == 2 * (N - 1)
    assert arm.ik(T[0]).count == 2
    assert arm.ik(T[0]).valid_q().shape == (2, 4)
    assert arm.ik(T[3]).valid_q().shape == (0, 4)
    with pytest.raises(chasles.InputError, match=r"of one pose, got shape \(1000,\)"):
        solutions.valid_q()


def test_at_selects_single_pose_of_batch(arm, q):
    T = scara.fk(q).reshape(20, 50, 4, 4)
    one = arm.ik(T).at(3, 7)
    assert type(one) is type(arm.ik(T))
    for a, b in zip(one, arm.ik(T[3, 7]), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-15)
    for index in [(3,), (3, 7, 1), ()]:
        with pytest.raises(
            chasles.InputError,
            match=r"one index for each leading dimension, got .* for shape \(20, 50\)",
        ):
            arm.ik(T).at(*index)


def windings(value, lower, upper):
    """Find all values in [lower, upper] that differ from a value by full turns.

    The function tries differences of -5 to 5 full turns.
    """
    turned = value + 2 * np.pi * np.arange(-5, 6)
    return turned[(turned >= lower) & (turned <= upper)]


def test_within_limits_enumerates_all_windings(arm, q):
    lower, upper = np.array([-7.0, -2.5, -0.3, -20.0]), np.array([12.0, 3.0, 0.4, 1.5])
    T = scara.fk(q)
    before = arm.ik(T)
    after = before.within_limits(np.stack([lower, upper], -1))
    assert after.q.shape == (N, 2 * 4 * 1 * 1 * 4, 4)
    n_found = 0
    for pose in range(N):
        expected = {
            tuple(np.round(combination, 9) + 0.0)
            for row in before.q[pose]
            if lower[2] <= row[2] <= upper[2]
            for combination in itertools.product(
                windings(row[0], lower[0], upper[0]),
                windings(row[1], lower[1], upper[1]),
                [row[2]],
                windings(row[3], lower[3], upper[3]),
            )
        }
        found = [tuple(np.round(row, 9) + 0.0) for row in after.q[pose][after.valid[pose]]]
        assert len(found) == len(set(found))
        assert set(found) == expected
        n_found += len(found)
    assert n_found > 4 * N
    reached = after.q[after.valid]
    assert (reached >= lower).all()
    assert (reached <= upper).all()
    held = np.broadcast_to(T[:, None], (*after.valid.shape, 4, 4))[after.valid]
    assert np.abs(scara.fk(reached) - held).max() < 1e-12
    again = after.within_limits(np.stack([lower, upper], -1))
    np.testing.assert_array_equal(again.valid, after.valid)


def test_every_winding_gets_its_own_slot(arm):
    solutions = arm.ik(scara.fk([0.5, 0.7, 0.0, 0.0])).within_limits()
    # The shoulder has a range of 13 rad. Each branch has three solution slots in ascending order of
    # shoulder angles, which differ by full turns.
    assert solutions.q.shape == (6, 4)
    np.testing.assert_allclose(solutions.q[:3, 0], [0.5 - 4 * np.pi, 0.5 - 2 * np.pi, 0.5])
    np.testing.assert_array_equal(solutions.valid[:3], [False, True, True])
    np.testing.assert_array_equal(solutions.residual[:3], [solutions.residual[0]] * 3)


def test_within_limits_without_windings_keeps_slot_count(arm, q):
    solutions = arm.ik(scara.fk(q + np.array([2 * np.pi, 0, 0, 0])))
    low, high = [3.2, -9.0, -1.0, -np.inf], [12.0, np.inf, 1.0, -3.3]
    after = solutions.within_limits(np.stack([low, high], -1), windings=False)
    assert after.q.shape == solutions.q.shape
    assert after.valid.all()
    assert (after.q >= low).all()
    assert (after.q <= high).all()
    np.testing.assert_array_equal(after.q[..., 1], solutions.q[..., 1])
    np.testing.assert_allclose(apart(after.q, solutions.q), 0, atol=1e-12)
    assert (np.abs(after.q - solutions.q)[..., [0, 3]] <= 4 * np.pi + 1e-9).all()
    # A joint with a single limit also has solutions that differ by whole turns.
    turns = 2 * np.pi * np.array([0, 1, 0, -1])
    moves = after.distances_from(after.q[:, 0] + turns)[:, 0]
    np.testing.assert_allclose(np.abs(moves), np.tile(np.abs(turns), (len(q), 1)), atol=1e-12)


def test_joint_exactly_at_limit_stays_valid(arm):
    q = np.array([np.pi / 2, 1.0, 0.25, 0.0])
    solutions = arm.ik(scara.fk(q))
    for by in (0.0, 1e-13, -1e-13):
        upper = solutions.q[0] + by
        after = solutions.within_limits(np.stack([np.full(4, -3.0), upper], -1))
        assert after.valid[0]
        assert (after.q[0] <= upper).all()
    assert not solutions.within_limits(
        np.stack([np.full(4, -3.0), solutions.q[0] - 1e-6], -1)
    ).valid.any()


def test_full_turn_limits_keep_values_unchanged(arm):
    turn = np.array([np.pi, np.pi, 1.0, np.pi])
    grid = itertools.product([-2, -1, 0, 1, 2], [0, 1], [0], [0, 1, 2])
    T = scara.fk(np.array(list(grid)) * np.pi / 2)
    solutions = arm.ik(T)
    after = solutions.within_limits(np.stack([-turn, turn], -1))
    assert len(T) == 30
    np.testing.assert_array_equal(after.q, solutions.q)
    np.testing.assert_array_equal(after.valid, solutions.valid)


def test_invalid_limits_are_rejected(arm):
    solutions = arm.ik(scara.fk(np.zeros(4)))
    with pytest.raises(chasles.InputError, match="elbow has limits 1 to -1 rad"):
        solutions.within_limits([[0, 1], [1, -1], [0, 1], [0, 1]])
    with pytest.raises(chasles.InputError, match="shoulder has limits nan"):
        solutions.within_limits(np.full((4, 2), np.nan))
    with pytest.raises(chasles.ShapeError, match=r"limits must have shape \(4, 2\)"):
        solutions.within_limits(np.zeros(3))


def test_sorted_by_distance_orders_by_distance_to_seed(arm, q):
    T = scara.fk(q)
    T[5, 0, 3] = 9.0
    seed = q + np.random.default_rng(3).uniform(-1, 1, q.shape)
    solutions = arm.ik(T)
    for start in (seed, seed[0]):
        after = solutions.sorted_by_distance(start)
        largest = np.abs(apart(after.q, np.broadcast_to(start, q.shape)[:, None])).max(-1)
        reached = np.delete(largest, 5, axis=0)
        assert (np.diff(reached, axis=-1) >= 0).all()
        np.testing.assert_array_equal(np.sort(after.q, axis=1), np.sort(solutions.q, axis=1))
        np.testing.assert_allclose(after.nearest(start), solutions.nearest(start))
    single = arm.ik(T[0]).sorted_by_distance(q[0] + [2 * np.pi, 0, 0, -4 * np.pi])
    np.testing.assert_allclose(apart(single.q[0], q[0]), 0, atol=1e-12)
    swapped = (solutions.q[:, 0] != after.q[:, 0]).any(-1)
    np.testing.assert_array_equal(after.margin[swapped], solutions.margin[swapped][:, ::-1])


def test_prismatic_joints_never_wrap():
    coordinates = tuple(Coordinate(f"j{i}", "prismatic", "m", None, None) for i in range(2))
    kind = solutions_of(coordinates, (False, False))
    q = np.array([[0.0, 0.0], [2 * np.pi, 0.0], [0.0, 3.0]])
    solutions = kind._judged(q, np.zeros(3), np.ones(3))
    np.testing.assert_array_equal(solutions.nearest([2 * np.pi, 0.1]), q[1])
    np.testing.assert_array_equal(solutions.distances_from([0, 0])[1], q[1])
    assert solutions.distinct().count == 3
    assert solutions.within_limits([[-9, 9], [-9, 9]]).q.shape == (3, 2)


def test_invalid_slots_are_never_nearest(arm):
    kind = type(arm.ik(scara.fk(np.zeros(4))))
    q = np.array([[0.0] * 4, [2.0] * 4, [1.0] * 4])
    solutions = kind._judged(q, np.array([1.0, 0.0, 0.0]), np.ones(3))
    np.testing.assert_array_equal(solutions.nearest(np.zeros(4)), q[2])
    after = solutions.sorted_by_distance(np.zeros(4))
    np.testing.assert_array_equal(after.q, q[[2, 1, 0]])
    np.testing.assert_array_equal(after.valid, [True, True, False])


def test_within_limits_counts_full_turns_as_motion(arm):
    T = scara.fk([3.0, 0.5, 0.0, 0.0])
    seed = [-3.2, 0.5, 0.0, 0.0]
    np.testing.assert_allclose(arm.ik(T).nearest(seed), [3.0, 0.5, 0, 0], atol=1e-12)
    turned = arm.ik(T).within_limits()
    np.testing.assert_allclose(turned.nearest(seed), [3.0 - 2 * np.pi, 0.5, 0, 0], atol=1e-12)
    only = arm.ik(T).within_limits([[-3.1, 3.1], [-3, 3], [-1, 1], [-np.inf, np.inf]])
    assert only.distances_from(seed)[0, 0] == pytest.approx(6.2)
    assert np.abs(turned.distances_from([0, 0, 0, 100.0])[:, 3]).max() <= np.pi


def test_distinct_removes_duplicate_solutions(arm, q):
    stretched = np.array(q[:3])
    stretched[:, 1] = [0.0, 1e-8, 0.5]
    solutions = arm.ik(scara.fk(stretched)).distinct()
    np.testing.assert_array_equal(solutions.count, [1, 1, 2])
    assert solutions.valid[:, 0].all()
    np.testing.assert_array_equal(arm.ik(scara.fk(stretched)).distinct(2.0).count, [1, 1, 1])
    # The values pi and -pi differ by a whole turn.
    kind = type(solutions)
    q = np.array([[np.pi, 0, 1, 0], [-np.pi, 0, 1, 0], [np.pi, 0, 1, 2 * np.pi], [0, 0, 1, 0]])
    assert kind._judged(q, np.zeros(4), np.ones(4)).distinct().count == 2
    # `distinct` keeps a valid solution even if an invalid slot contains the same joint values.
    left = kind(q, np.zeros(4), np.ones(4), np.array([False, True, True, True]))
    np.testing.assert_array_equal(left.distinct().valid, [False, True, False, True])


def test_nearest_recovers_seed_and_explains_failure(arm, q):
    T = scara.fk(q)
    T[7, 0, 3] = 9.0
    found = arm.ik(T).nearest(q)
    assert np.isnan(found[7]).all()
    np.testing.assert_allclose(np.delete(apart(found, q), 7, axis=0), 0, atol=1e-12)
    with pytest.raises(chasles.OutOfReachError, match=r"out of reach, by \d.*least_squares"):
        arm.ik(T[7]).nearest(q[7])
    with pytest.raises(chasles.OutOfReachError, match="filters removed all 2"):
        arm.ik(T[0]).within_limits([[5.0, 5.1]] * 4).nearest(q[0])
    with pytest.raises(chasles.OutOfReachError, match="not a finite rigid pose"):
        arm.ik(np.full((4, 4), np.nan)).nearest(q[0])


@pytest.mark.parametrize(
    "seed", [np.zeros(3), np.zeros((2, 4)), 1.0], ids=["three values", "wrong batch", "scalar"]
)
def test_seed_with_wrong_shape_or_type_is_rejected(arm, q, seed):
    with pytest.raises(chasles.ShapeError, match=r"nearest: q_seed must have shape \(4,\)"):
        arm.ik(scara.fk(q)).nearest(seed)
    with pytest.raises(chasles.InputError, match="real numbers"):
        arm.ik(scara.fk(q)).nearest(["a"] * 4)


def test_least_squares_returns_best_unreachable_answer(arm, q):
    T = scara.fk(q[:4])
    T[1, :2, 3] = [1.0, 0.0]
    T[2] = np.nan
    solutions = arm.ik(T)
    best = solutions.least_squares()
    assert np.isnan(best.q[[0, 2, 3]]).all()
    assert np.isnan(best.residual[[0, 2, 3]]).all()
    assert best.residual[1] == pytest.approx(1.0 - scara.A1 - scara.A2)
    np.testing.assert_allclose(best.q[1, :2], 0, atol=1e-9)
    filtered = solutions.within_limits([[5.0, 5.1]] * 4).least_squares()
    assert np.isnan(filtered.residual[[0, 2, 3]]).all()
    single = arm.ik(T[1]).least_squares()
    assert single.q.shape == (4,)
    assert float(single.residual) == best.residual[1]


def test_filters_do_not_modify_their_input(arm, q):
    solutions = arm.ik(scara.fk(q))
    before = [field.copy() for field in solutions]
    (solutions.within_limits().distinct().sorted_by_distance(q).nearest(q))
    for field, other in zip(solutions, before, strict=True):
        np.testing.assert_array_equal(field, other)


def test_repetitions_are_removed_among_turns_of_several_branches():
    arm = chasles.load("ur5e")
    folded = [0, -np.pi / 2, 0, -np.pi / 2, 0, 0]
    for T in arm.fk([[0.3, -1.1, 0.0, 0.4, 0.7, -0.5], np.zeros(6), folded]):
        listed = arm.ik(T).within_limits()
        expected = np.zeros_like(listed.valid)
        for k in np.flatnonzero(listed.valid):
            apart = np.abs(listed.q[expected] - listed.q[k])
            expected[k] = not (apart <= 1e-6).all(-1).any()
        assert 0 < expected.sum() < listed.valid.sum()
        np.testing.assert_array_equal(listed.distinct().valid, expected)
