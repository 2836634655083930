"""Rounded poses are projected and solved. Matrices that are not poses are reported."""

import functools

import mpmath
import numpy as np
import pytest
import sympy as sp

import chasles
from chasles import se3
from chasles.call._call import rounded_residuals
from chasles.derive import read
from tests.support.compiling import compiled
from tests.support.optional import OptionalPackage
from tests.support.scaled import scaled

transform = OptionalPackage("scipy.spatial.transform")
pinocchio = OptionalPackage("pinocchio")

array = OptionalPackage("dask.array")
dask = OptionalPackage("dask")


ARMS = {
    **{name: {} for name in ("ur5e", "puma560", "jaco2", "scara", "lynxmotion")},
    "panda": {"joint7": 0.3},
}
POSES = 40
FREEDOMS = 6
CLEAR = 1e-3
"""Minimum absolute margin of all solution slots of a tested pose."""
SAME_POSE = 1e-14
"""Tolerance of the entries of a projected pose, compared with the oracle."""
REACHED = 1e-12
"""Maximum residual of a solution relative to the requested rigid pose."""
SOLVED = 1e-9
"""Below this residual, a solution slot or an iteration counts as solved."""

ROUNDED_AS_FAR = 10
"""Maximum residual for a rounded pose, divided by the deviation of this pose from a rigid pose."""
TILTED = 1e-5
"""Tolerance for the nearest pose of arms with few joints, which amplify the rounding of single
precision."""


ALIKE = 1e-4
"""Largest coordinate difference (radian) between the solutions of a pose and of its
single-precision copy."""


def sampled(robot, count, rng):
    lower, upper = np.maximum(robot.lower, -2.5), np.minimum(robot.upper, 2.5)
    return rng.uniform(lower, upper, (count, robot.n))


@functools.cache
def arm_and_poses(name):
    """Return an arm and poses in its workspace."""
    arm = chasles.load(name)
    rng = np.random.default_rng(sum(map(ord, name)))
    T = arm.fk(rng.uniform(-2.5, 2.5, (40 * POSES, arm.n)))
    found = arm.ik(T, fixed=ARMS[name])
    return arm, T[found.valid.any(-1) & (np.abs(found.margin) > CLEAR).all(-1)][:POSES]


def polar(T):
    P = np.array(T, np.float64)
    R = P[..., :3, :3]
    square, V = np.linalg.eigh(R.mT @ R)
    P[..., :3, :3] = R @ (V / np.sqrt(square)[..., None, :]) @ V.mT
    return P


def noisy(T, size, rng):
    """Add random errors of at most ``size`` to the first three rows of poses."""
    noise = np.zeros(T.shape)
    noise[..., :3, :] = rng.uniform(-size, size, noise[..., :3, :].shape)
    return T + noise


STEP = se3.exp(np.arange(6) / 7).astype(np.float32)
THERE_AND_BACK = [STEP] * 4 + [se3.inverse(STEP).astype(np.float32)] * 4
ROUNDED = {
    "float32": lambda T: T.astype(np.float32),
    **{f"{k} digits": functools.partial(np.round, decimals=k) for k in range(6, 11)},
    **{
        f"noise {size:g}": functools.partial(noisy, size=size, rng=np.random.default_rng(1))
        for size in (1e-12, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 3e-6)
    },
    "product": lambda T: functools.reduce(np.matmul, [T.astype(np.float32), *THERE_AND_BACK]),
}


@pytest.mark.parametrize("rounded", ROUNDED.values(), ids=ROUNDED)
@pytest.mark.parametrize("name", ARMS)
def test_rounded_poses_are_solved_like_nearest_rigid_poses(name, rounded):
    arm, T = arm_and_poses(name)
    assert len(T) == POSES
    given = rounded(T)
    nearest = polar(given)
    found = arm.ik(given, fixed=ARMS[name])
    assert found.valid.any(-1).all()
    allowed = np.full((POSES, 1), SOLVED)
    if arm.n >= FREEDOMS:
        wanted = arm.ik(nearest, fixed=ARMS[name])
        np.testing.assert_array_equal(found.valid, wanted.valid)
        assert found.residual[found.valid].max() < REACHED
    else:
        np.testing.assert_array_equal(found.count, arm.ik(T).count)
        allowed = np.maximum(allowed, ROUNDED_AS_FAR * se3.deviation(given)[:, None])
    assert (found.residual <= allowed * arm.unit_length)[found.valid].all()
    again = np.abs(arm.fk(found.q) - nearest[:, None]).max((-2, -1))
    assert (again <= 2 * allowed)[found.valid].all()
    for k in range(0, POSES, 8):
        single = arm.ik(given[k], fixed=ARMS[name])
        np.testing.assert_array_equal(single.valid, found.valid[k])
        np.testing.assert_allclose(single.residual, found.residual[k], atol=1e-12)


RIGHT_ANGLES = {"ur5e": 12, "puma560": 0, "scara": 0, "lynxmotion": 0, "stanford": 0}
"""Maximum number of missed poses among 1000 rounded poses of each arm. The joint angles are
multiples of 90 degrees, where singularities can coincide."""


@pytest.mark.parametrize("rounded", ["float32", "6 digits"])
@pytest.mark.parametrize("name", RIGHT_ANGLES)
def test_rounded_right_angle_poses_are_reached_to_input_precision(name, rounded):
    arm, rng = chasles.load(name), np.random.default_rng(0)
    q = np.pi / 2 * rng.integers(-1, 3, (1000, arm.n))
    for k, coordinate in enumerate(arm.coordinates):
        if coordinate.kind == "prismatic":
            q[:, k] = rng.uniform(coordinate.lower, coordinate.upper, len(q))
    T = arm.fk(q)
    found = arm.ik(ROUNDED[rounded](T))
    assert (found.count == 0).sum() <= RIGHT_ANGLES[name]
    off = np.abs(arm.fk(found.q) - T[:, None]).max((-2, -1))
    assert off[found.valid].max() < (1e-6 if rounded == "float32" else 1e-5)


def test_translation_beyond_reach_is_not_treated_as_rounding():
    scara = chasles.load("scara")
    T = scara.fk(np.zeros(4))
    T[0, 3] = np.round(T[0, 3], 5)
    assert scara.ik(T).count > 0
    for beyond in (1e-5, 1e-4):
        further = T.copy()
        further[0, 3] += beyond
        assert scara.ik(further).count == 0


def test_far_single_precision_poses_stay_unreachable():
    arm = chasles.load("ur5e")
    T = arm.fk(np.pi / 2 * np.random.default_rng(1).integers(-1, 3, (500, 6)))
    T[:, :3, 3] *= 1.0 + 2.0 / np.linalg.norm(T[:, :3, 3], axis=-1, keepdims=True)
    assert not arm.ik(T.astype(np.float32)).valid.any()


@pytest.mark.parametrize("size", [0, 1e-12, 1e-9, 1e-7, 3e-6])
def test_rounded_batch_results_do_not_depend_on_layout(size):
    arm, T = arm_and_poses("ur5e")
    rng = np.random.default_rng(2)
    T = np.concatenate([T] * 20)[: 600 + 7]
    given = noisy(T, size, rng)
    # Only some poses are rounded, so that blocks of the C loop contain rounded and exact poses.
    exact = rng.random(len(T)) < 0.5
    given[exact] = T[exact]
    whole = arm.ik(given)
    assert whole.valid.all(-1).any()
    layouts = {
        "Fortran": arm.ik(np.asfortranarray(given)),
        "reversed": arm.ik(given[::-1]),
        "threads": arm.ik(given, threads=2),
        "dask": dask.compute(*arm.ik(array.from_array(given, chunks=(100, 4, 4)))),
        "nested": arm.ik(given.reshape(1, -1, 4, 4)),
        "list": arm.ik(given.tolist()),
        "out": arm.ik(given, out=(np.empty((607, 8, 6)), np.empty((607, 8)), np.empty((607, 8)))),
    }
    for layout, found in layouts.items():
        valid = np.asarray(found[3]).reshape(-1, 8)
        q = np.asarray(found[0]).reshape(-1, 8, 6)
        if layout == "reversed":
            valid, q = valid[::-1], q[::-1]
        np.testing.assert_array_equal(valid, whole.valid, layout)
        np.testing.assert_allclose(q, whole.q, atol=1e-9, err_msg=layout)


def test_poses_from_scipy_and_pinocchio_are_solved():
    arm, T = arm_and_poses("ur5e")
    count = arm.ik(T).count
    for k, pose in enumerate(T):
        of_scipy = np.eye(4)
        of_scipy[:3, :3] = transform.Rotation.from_matrix(pose[:3, :3]).as_matrix()
        of_scipy[:3, 3] = pose[:3, 3]
        quaternion = np.round(transform.Rotation.from_matrix(pose[:3, :3]).as_quat(), 7)
        of_pinocchio = pinocchio.SE3(pinocchio.Quaternion(quaternion).matrix(), pose[:3, 3])
        for given in (of_scipy, pose.tolist(), of_pinocchio.homogeneous, pose.astype(">f8")):
            assert arm.ik(given).count == count[k]


def test_fixed_joints_broadcast_against_rounded_poses():
    arm, T = arm_and_poses("panda")
    q7 = np.linspace(-2, 2, 9)
    found = arm.ik(T[:, None].astype(np.float32), fixed={"joint7": q7})
    wanted = arm.ik(polar(T[:, None].astype(np.float32)), fixed={"joint7": q7})
    np.testing.assert_array_equal(found.valid, wanted.valid)
    one = arm.ik(T[0].astype(np.float32), fixed={"joint7": q7})
    np.testing.assert_array_equal(one.valid, wanted.valid[0])


def test_projection_matches_40_digit_polar_decomposition():
    _, T = arm_and_poses("ur5e")
    rng = np.random.default_rng(3)
    with mpmath.workdps(40):
        for size in (1e-7, 1e-5, 1e-3, 1e-1):
            for pose in noisy(T[:6], size, rng):
                U, _, V = mpmath.svd_r(mpmath.matrix(pose[:3, :3].tolist()))
                exact = np.array((U * V).tolist(), dtype=float)
                found = se3.project(pose, tolerance=0.5)
                assert np.abs(found[:3, :3] - exact).max() < SAME_POSE
                np.testing.assert_array_equal(found[:3, 3], pose[:3, 3])
                np.testing.assert_array_equal(found[3], [0, 0, 0, 1])
                assert se3.deviation(found) < SAME_POSE


def test_deviation_is_distance_to_nearest_rotation():
    _, T = arm_and_poses("ur5e")
    for size in (1e-9, 1e-6, 1e-4):
        given = noisy(T, size, np.random.default_rng(4))
        distance = np.linalg.norm((given - polar(given))[:, :3, :3], axis=(-2, -1)) / 2**0.5
        np.testing.assert_allclose(se3.deviation(given), distance, rtol=1e-3, atol=1e-15)


def test_projection_keeps_rigid_poses_and_passes_nan():
    _, T = arm_and_poses("ur5e")
    np.testing.assert_array_equal(se3.project(T), T)
    lost = T.astype(np.float32)
    lost[3, 1, 1] = np.nan
    found = se3.project(lost)
    assert np.isnan(found[3]).all()
    np.testing.assert_allclose(np.delete(found, 3, 0), np.delete(T, 3, 0), atol=1e-6)


def rotation_only(f):
    def changed(T):
        T = T.copy()
        T[:3, :3] = f(T[:3, :3])
        return T

    return changed


def with_row(*row):
    def changed(T):
        T = T.copy()
        T[3] = row
        return T

    return changed


NO_POSE = {
    "transposed": (np.transpose, "transposed: the last row holds the translation"),
    "mirrored": (rotation_only(lambda R: -R), "determinant -1, the axes are left-handed"),
    "exchanged": (rotation_only(lambda R: R[:, [1, 0, 2]]), "left-handed"),
    "scaled": (rotation_only(lambda R: 1000 * R), "axes have lengths 1000 1000 1000"),
    "millimeters": (lambda T: 1000 * T, "its last row is 0 0 0 1000, not 0 0 0 1"),
    "zeros": (np.zeros_like, "its last row is 0 0 0 0"),
    "no rotation": (rotation_only(np.zeros_like), "is it a rotation matrix"),
    "row": (with_row(0, 0, 0, 0), "its last row is 0 0 0 0"),
    "rest": (with_row(0, 0, 0.1, 1), "its last row is 0 0 0.1 1"),
    "squashed": (rotation_only(lambda R: R @ np.diag([1, 1, 0.1])), "lengths 1 1 0.1"),
    **{
        f"off by {size:g}": (
            functools.partial(noisy, size=size, rng=np.random.default_rng(5)),
            r"deviation .* rounding limit 1e-05; chasles.se3.project\(T, tolerance=",
        )
        for size in (1e-4, 1e-3, 1e-2)
    },
}


@pytest.mark.parametrize(("change", "message"), NO_POSE.values(), ids=NO_POSE)
@pytest.mark.parametrize("name", ["ur5e", "scara", "jaco2"])
def test_non_rigid_matrix_error_names_cause_and_index(name, change, message):
    arm, T = arm_and_poses(name)
    rng = np.random.default_rng(6)
    for k in rng.choice(POSES, 8, replace=False):
        bad = change(T[k])
        with pytest.raises(chasles.InputError, match=f"{name}.ik: T is .*{message}") as caught:
            arm.ik(bad)
        assert "reach" not in str(caught.value)
        batch = T.copy()
        batch[k] = bad
        others = "" if k == POSES - 1 else f"; 1 more of {POSES} "
        batch[-1] = bad
        with pytest.raises(chasles.InputError, match=rf"T\[{k}\] is .*{message}.*{others}"):
            arm.ik(batch)
        with pytest.raises(chasles.InputError, match=message):
            arm.ik(batch, threads=2)
        with pytest.raises(chasles.InputError, match=message):
            se3.project(bad)
        with pytest.raises(chasles.InputError, match=message):
            arm.ik_path(batch, np.zeros(arm.n))
        assert arm.ik_numeric(bad, max_evaluations=10).reason == "not a pose"


def test_tolerance_in_error_message_suffices_for_projection():
    arm, T = arm_and_poses("ur5e")
    rng = np.random.default_rng(7)
    for size in 10 ** rng.uniform(-4.5, -1.2, 60):
        given = noisy(T[0], size, rng)
        if se3.deviation(given) <= se3.NEARLY_RIGID:
            continue
        with pytest.raises(chasles.InputError) as caught:
            arm.ik(given)
        named = float(str(caught.value).split("tolerance=")[1].split(")")[0])
        assert se3.deviation(given) <= named <= 3 * se3.deviation(given)
        rigid = se3.project(given, tolerance=named)
        np.testing.assert_allclose(rigid, polar(given), atol=SAME_POSE)
        arm.ik(rigid)


def test_out_of_reach_error_explains_rounding_for_few_joints():
    arm = chasles.load("lynxmotion")
    q = np.random.default_rng(8).uniform(-1.5, 1.5, (60, arm.n))
    poses = se3.project(arm.fk(q).astype(np.float32))
    text = 0
    for pose, there in zip(poses, q, strict=True):
        found = arm.ik(pose)
        if found.count:
            continue
        with pytest.raises(chasles.OutOfReachError, match=r"rounded pose.*within_tolerance\("):
            found.nearest(there)
        assert np.abs(arm.fk(found.least_squares().q) - pose).max() < TILTED
        near = found.within_tolerance(3 * found.least_squares().residual)
        assert near.count
        assert np.abs(near.nearest(there) - there).max() < ALIKE
        text += 1
    assert text > 20


@pytest.mark.parametrize("name", ["delta", "excavator", "lynxmotion"])
def test_rounded_poses_keep_all_branches_for_few_joints(name):
    robot = chasles.load(name)
    rng = np.random.default_rng(9)
    T = robot.fk(sampled(robot, 400, rng))
    exact = robot.ik(T)
    known = exact.valid.any(-1) & (np.abs(exact.margin) > CLEAR).all(-1)
    T, count = T[known], exact.count[known]
    assert len(T) > POSES
    for size in (1e-8, 1e-7, 1e-6):
        found = robot.ik(noisy(T, size, rng))
        np.testing.assert_array_equal(found.count, count)
    turned = T @ se3.exp(np.array([0, 0, 0, 0.001, 0.001, 0.001]))
    assert not robot.ik(noisy(turned, 1e-8, rng)).valid.any()


def test_dask_valid_flags_match_numpy_for_rounded_poses():
    arm, T = arm_and_poses("lynxmotion")
    given = T.astype(np.float32).astype(float)
    lazy = arm.ik(array.from_array(given, chunks=(7, 4, 4)))
    assert lazy.valid.dtype == bool
    np.testing.assert_array_equal(lazy.valid.compute(), arm.ik(given).valid)


def test_ik_path_follows_rounded_poses_with_few_joints():
    arm = chasles.load("lynxmotion")
    q = np.linspace([0.1, 0.8, -0.4, 0.3, -0.5], [0.6, 1.2, -0.9, 0.4, 0.4], 50)
    path = arm.ik_path(arm.fk(q).astype(np.float32), q[0])
    assert path.complete
    np.testing.assert_allclose(path.q, q, atol=ALIKE)


@pytest.mark.parametrize("name", ["delta", "excavator", "lynxmotion"])
def test_ik_numeric_reaches_rounded_poses_with_few_joints(name):
    robot = chasles.load(name)
    rng = np.random.default_rng(10)
    q = sampled(robot, 200, rng)
    T = robot.fk(q)
    closed = np.isfinite(T).all((-2, -1))
    q, T = q[closed], T[closed]
    for size in (1e-8, 1e-7, 1e-6):
        given = noisy(T, size, rng)
        found = robot.ik_numeric(given, q)
        assert found.valid.all()
        assert (found.residual <= ROUNDED_AS_FAR * robot.unit_length * se3.deviation(given)).all()
    turned = T @ se3.exp(np.array([0, 0, 0, 0.001, 0.001, 0.001]))
    assert not robot.ik_numeric(noisy(turned, 1e-8, rng), q).valid.any()


def test_nan_pose_is_invalid_without_error():
    arm, T = arm_and_poses("ur5e")
    others = np.delete(arm.ik(T).valid, 2, 0)
    for value in (np.nan, np.inf):
        for row, column in np.ndindex(4, 4):
            batch = T.copy()
            batch[2, row, column] = value
            found = arm.ik(batch)
            assert not found.valid[2].any()
            assert np.isnan(found.residual[2]).all()
            np.testing.assert_array_equal(np.delete(found.valid, 2, 0), others)
            assert not arm.ik(batch[2]).valid.any()


def test_far_translations_are_unreachable_without_error():
    arm, T = arm_and_poses("ur5e")
    for far in (10, 1e6, 1e200):
        given = T[0].copy()
        given[:3, 3] *= far
        assert not arm.ik(given).valid.any()


def test_ik_numeric_accepts_rounded_poses():
    arm, T = arm_and_poses("ur5e")
    for given in (T.astype(np.float32), np.round(T, 6)):
        found = arm.ik_numeric(given)
        assert found.valid.all()
        assert np.abs(arm.fk(found.q) - polar(given)).max() < SOLVED


def test_ik_path_and_track_accept_rounded_poses():
    arm = chasles.load("ur5e")
    q = np.array([0.3, -1.2, 1.5, -0.4, 0.9, 0.2]) + np.linspace(0, 0.5, 50)[:, None]
    given = arm.fk(q).astype(np.float32)
    path = arm.ik_path(given, q[0])
    assert path.complete
    assert np.abs(arm.fk(path.q) - polar(given)).max() < SOLVED
    followed = arm.track(given, q[0], 0.01)
    assert followed.max_angle < 1e-2


@pytest.mark.parametrize("name", ["four_bar", "five_bar", "slider_crank"])
@pytest.mark.parametrize("kind", ["float32", "6 digits"])
def test_planar_loops_reach_every_rounded_pose(name, kind):
    robot = chasles.load(name)
    rng = np.random.default_rng(4)
    q = np.array(robot.reference.q) + rng.uniform(-0.01, 0.01, (2000, robot.n))
    T = robot.fk(q)
    found = robot.ik(ROUNDED[kind](T))
    assert found.valid.any(-1).all()
    near = found.valid & (np.abs(found.q - q[:, None]).max(-1) < ALIKE)
    assert near.any(-1).all()
    assert robot.ik_numeric(ROUNDED[kind](T[:200]), q_seed=q[:200]).valid.all()


def test_rounding_estimate_detects_accidentally_rigid_rotations():
    T = turned_about_z(np.linspace(0.1, 1.4, 20_000)).round(6)
    by_chance = T[se3.deviation(T) < 1e-9]
    assert len(by_chance) > 3
    np.testing.assert_allclose(rounded_residuals(by_chance), 10 * 0.5e-6)
    single = turned_about_z(np.linspace(0.1, 1.4, 20_000)).astype(np.float32).astype(float)
    assert rounded_residuals(single[se3.deviation(single) < 1e-9]).min() > 1e-7


def test_residual_of_a_rounded_pose_is_the_angle_to_the_nearest_pose(tmp_path):
    small = scaled(read("scara"), sp.Rational(1, 1000), "small_scara")
    arm = compiled(small, tmp_path / "small_scara", ["fk", "ik"], ["c"])
    T = arm.fk(arm.random_q(50)) @ se3.exp(np.array([0, 0, 0, 0.01, 0, 0]))
    T[:, :3, :3] = T[:, :3, :3].astype(np.float32)
    assert arm.unit_length == 0.001
    np.testing.assert_allclose(arm.ik(T).residual, 0.01 * arm.unit_length, rtol=1e-3)


def test_full_precision_rotations_have_no_rounding_residual():
    T = turned_about_z(np.linspace(0.1, 1.4, 500))
    assert not rounded_residuals(T).any()
    T[:, 0, 0] += 1e-9
    np.testing.assert_allclose(rounded_residuals(T), 10 * se3.deviation(T), rtol=1e-6)
    left_handed = np.round(T, 6)
    left_handed[:, 2, 2] = -1
    assert not rounded_residuals(left_handed).any()


def turned_about_z(angles):
    T = np.zeros((len(angles), 4, 4)) + np.eye(4)
    T[:, :3, :3] = transform.Rotation.from_rotvec(angles[:, None] * [0, 0, 1]).as_matrix()
    return T
