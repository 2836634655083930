"""Refinement makes approximate closed-form solutions accurate, but only for reachable poses."""

from dataclasses import replace

import numpy as np
import pytest

import chasles
import chasles.call.threads
from chasles.closed_form.refinement import Refinement, refinement_of
from chasles.contract import read_manifest
from chasles.tolerances import REFINED, SOLVED
from tests.support.fixed import fixed_values
from tests.support.handwritten import scara
from tests.support.optional import OptionalPackage

array = OptionalPackage("dask.array")
dask = OptionalPackage("dask")


SPOILT = 1e-7
"""Error (radian) that the test adds to the shoulder angle in the IK function for poses with a z
coordinate above HIGH."""
HIGH = 0.2

# At this configuration, the Panda is near two singularities at once.
PANDA = [
    -0.677318948519789,
    0.012915840615937757,
    2.4223413549967567,
    2.674590239937054,
    -1.5713133048953427,
    -2.650074398270638,
    0.22335271335619034,
]


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """Return a SCARA arm whose IK function has an error for poses with z above HIGH."""
    line = "q[0] = atan2(sin(q[0]), cos(q[0]));"
    spoilt = f"{line}\n        if (z > {HIGH}) q[0] += {SPOILT};"
    assert line in scara.SOURCE
    path = tmp_path_factory.mktemp("spoilt") / "scara"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scara, "SOURCE", scara.SOURCE.replace(line, spoilt))
        patch.setenv("CHASLES_CACHE", str(path.parent / "cache"))
        return chasles.load(scara.write(path).path)


@pytest.fixture
def q():
    """Return SCARA coordinates (60, 4), of which the first 20 reach z coordinates above HIGH."""
    rng = np.random.default_rng(2)
    q = rng.uniform([-3, 0.2, -0.4, -3], [3, 2.4, HIGH, 3], (60, 4))
    q[:20, 2] += 0.6
    return q


def check(arm, solutions, T, slots=2):
    assert solutions.valid.shape == (*T.shape[:-2], slots)
    assert solutions.valid.all()
    assert (solutions.residual <= 1e-13).all()
    assert np.abs(arm.fk(solutions.q) - T[..., None, :, :]).max() < 1e-13


def test_unrefined_inverse_misses_nearly_singular_poses(arm, q):
    _, residual, _ = arm.ik.ufunc(arm.fk(q))
    assert (residual[:20] > 10 * SOLVED).all()
    assert (residual[:20] < REFINED).all()
    assert (residual[20:] < SOLVED).all()


def test_refinement_solves_every_nearly_singular_pose(arm, q):
    T = arm.fk(q)
    solutions = arm.ik(T)
    check(arm, solutions, T)
    np.testing.assert_allclose(solutions.q[:, 0], arm.ik.ufunc(T)[0][:, 0], atol=1e-6)
    np.testing.assert_allclose(solutions.q[:, 0, 1], q[:, 1], atol=1e-12)
    for found, expected in zip(solutions, arm.ik(T[20:]), strict=False):
        np.testing.assert_array_equal(found[20:], expected)
    for index in (0, 30):
        single = arm.ik(T[index])
        check(arm, single, T[index])
        np.testing.assert_allclose(single.q, solutions.q[index], atol=1e-12)


@pytest.mark.parametrize("batch", [(3, 20), (60, 1), (2, 1, 30)], ids=str)
def test_refinement_accepts_any_leading_dimensions(arm, q, batch):
    T = arm.fk(q).reshape(*batch, 4, 4)
    for given in (T, T.tolist(), np.asfortranarray(T)):
        check(arm, arm.ik(given), T)
    assert arm.ik(T[:0]).valid.shape == (0, *batch[1:], 2)


def test_refinement_writes_into_out_arrays(arm, q):
    T = arm.fk(q)
    out = (np.empty((60, 2, 4)), np.empty((60, 4))[:, ::2], None)
    solutions = arm.ik(T, out=out)
    assert solutions.q is out[0]
    assert solutions.residual is out[1]
    check(arm, solutions, T)
    one = (np.empty((2, 4)), np.empty(2), np.empty(2))
    check(arm, arm.ik(T[0], out=one), T[0])
    assert (one[1] < 1e-13).all()


def test_refinement_gives_same_results_with_threads(arm, q, monkeypatch):
    monkeypatch.setattr(chasles.call.threads, "_MIN", 1)
    monkeypatch.setattr(chasles.call.threads, "count_cores", lambda: 4)
    T = arm.fk(q)
    solutions = arm.ik(T, threads=3)
    check(arm, solutions, T)
    for found, expected in zip(solutions, arm.ik(T), strict=True):
        np.testing.assert_array_equal(found, expected)


def test_refinement_works_with_dask_arrays(arm, q):
    T = arm.fk(q)
    lazy = arm.ik(array.from_array(T, chunks=(7, 4, 4)))
    fields = dask.compute(*lazy, scheduler="sync")
    check(arm, arm.ik.solutions(*fields), T)


def test_unreachable_poses_stay_invalid_and_unchanged(arm, q):
    T = arm.fk(q)
    T[:5, :2, 3] *= 0.75 / np.linalg.norm(T[:5, :2, 3], axis=-1, keepdims=True)
    # For poses closer to the boundary of the workspace, rounding decides whether a solution is
    # valid.
    beyond = np.array([1e-7, 3e-9, 1e-6])[:, None]
    T[5:8, :2, 3] *= (0.7 + beyond) / np.linalg.norm(T[5:8, :2, 3], axis=-1, keepdims=True)
    T[8, 0, 3] = np.nan
    # A SCARA arm cannot reach a tilted tool pose.
    T[9] = T[9] @ [
        [1, 0, 0, 0],
        [0, np.cos(1e-6), -1e-6, 0],
        [0, 1e-6, np.cos(1e-6), 0],
        [0, 0, 0, 1],
    ]
    # The matrix is nearly a rigid pose, and the nearest rigid pose is within reach.
    T[10, :3, :3] *= 1 + 1e-8
    solutions = arm.ik(T)
    np.testing.assert_array_equal(solutions.valid[:8], False)
    np.testing.assert_array_equal(solutions.valid[8:10], False)
    np.testing.assert_array_equal(solutions.valid[10], True)
    assert solutions.valid[11:].all()
    assert np.isnan(solutions.q[8]).any()
    assert np.isfinite(np.delete(solutions.q, 8, axis=0)).all()
    raw, residual, _ = arm.ik.ufunc(T)
    np.testing.assert_array_equal(solutions.q[:10], raw[:10])
    np.testing.assert_array_equal(solutions.residual[:10], residual[:10])


def test_panda_is_solved_at_double_singularity():
    arm = chasles.load("panda")
    q = np.tile(PANDA, (5, 1))
    q[[0, 2, 4]] = np.random.default_rng(1).uniform(-2, 2, (3, 7))
    T = arm.fk(q)
    solutions = arm.ik(T, fixed={"joint7": q[:, 6]})
    assert solutions.valid.any(-1).all()
    assert (solutions.residual[solutions.valid] < 1e-13).all()
    assert (
        np.abs(arm.fk(solutions.q) - T[:, None]).max(axis=(-1, -2))[solutions.valid].max() < 1e-13
    )
    assert arm.ik(T[1], fixed={"joint7": q[1, 6]}).valid.any()
    # A pose is solved for several values of the fixed joint.
    several = arm.ik(T[1], fixed={"joint7": np.array([q[1, 6], 2.5])})
    np.testing.assert_array_equal(several.valid.any(-1)[0], True)
    np.testing.assert_array_equal(several.q[0, :, 6], q[1, 6])


def test_poses_just_beyond_stretched_arm_stay_invalid():
    arm = chasles.load("ur5e")
    q = np.random.default_rng(4).uniform(-3, 3, (200, 6))
    q[:, 2] = 0.0
    T = arm.fk(q)
    assert arm.ik(T).valid.any(-1).all()
    # Direction of the stretched arm, from the second axis to the fourth.
    links = arm.link_poses(q)
    along = links[:, 3, :3, 3] - links[:, 1, :3, 3]
    along -= (along * links[:, 1, :3, 2]).sum(-1, keepdims=True) * links[:, 1, :3, 2]
    T[:, :3, 3] += 1e-7 * along / np.linalg.norm(along, axis=-1, keepdims=True)
    beyond = arm.ik(T)
    least = beyond.residual.min(-1)
    missed = ~beyond.valid.any(-1)
    assert missed.sum() > 50
    assert (least[missed] > 2e-8).all()
    assert (least[missed] < 1.1e-7).sum() > 50
    assert np.isfinite(beyond.q).all()


def test_only_wrist_singularity_fixes_a_joint():
    """The pose error is quadratic in a singular joint motion unless axes 4 and 6 are aligned."""
    arm = chasles.load("ur5e")
    refinement = refinement_for(arm)
    q = np.random.default_rng(4).uniform(-3, 3, (400, 6))
    q[:, 2] = 0.0
    regular = np.abs(np.sin(q[:, 4])) > 0.1
    assert regular.sum() > 300
    assert not refinement.turning(arm.fk(q[regular]), q[regular]).any()
    q[:, 4] = 0.0
    assert refinement.turning(arm.fk(q), q).any(-1).all()
    q[:, 2] = 1.0
    np.testing.assert_array_equal(refinement.turning(arm.fk(q), q).sum(-1), 1)


def spoilt_slots(robot, q, *given):
    """Perturb and refine all solutions, and return the refinement and both sets of solutions."""
    T = robot.fk(q)
    solutions = robot.ik(T, fixed=fixed_values(robot, given))
    refinement = refinement_for(robot)
    free = [i for i in range(robot.n) if i not in refinement.fixed]
    moved = solutions.q.copy()
    moved[..., free] += np.random.default_rng(9).uniform(-SPOILT, SPOILT, moved[..., free].shape)
    residual = np.where(solutions.valid, SPOILT, 1.0)
    valid = np.zeros_like(solutions.valid)
    refinement((T, *given), moved, residual, valid)
    np.testing.assert_array_equal(valid, solutions.valid)
    assert (residual[valid] < 1e-13).all()
    assert np.abs(robot.fk(moved) - T[:, None])[valid].max() < 1e-12
    return refinement, moved, solutions


def refinement_for(robot):
    manifest = read_manifest(robot.folder)
    info = next(info for info in manifest.functions if info.name == "ik")
    refinement = refinement_of(manifest, info, robot.functions)
    assert isinstance(refinement, Refinement)
    return refinement


@pytest.mark.parametrize("name", ["ur5e", "puma560", "stanford", "lynxmotion", "scara"])
def test_perturbed_slots_are_refined_for_every_arm_type(name):
    robot = chasles.load(name)
    q = np.random.default_rng(3).uniform(0.1, 1, (50, robot.n))
    refinement, moved, solutions = spoilt_slots(robot, q)
    assert refinement.fixed == ()
    assert np.abs(moved - solutions.q)[solutions.valid].max() < 1e-9


def test_fixed_joints_keep_their_values_in_refinement():
    for name, fixed in (("panda", (6,)), ("photo_robot", (0, 3))):
        robot = chasles.load(name)
        q = np.random.default_rng(3).uniform(0.1, 1, (50, robot.n))
        refinement, moved, solutions = spoilt_slots(robot, q, *(q[:, i] for i in fixed))
        assert refinement.fixed == fixed
        np.testing.assert_array_equal(moved[..., fixed], solutions.q[..., fixed])


def test_refinement_nearly_keeps_swivel_angle():
    robot = chasles.load("iiwa14")
    q = np.random.default_rng(3).uniform(0.3, 1, (50, 7))
    refinement, moved, solutions = spoilt_slots(robot, q, robot.swivel(q))
    assert refinement.fixed == ()
    assert np.abs(moved - solutions.q)[solutions.valid].max() < 1e-5


def test_fixed_loop_joints_are_fixed_through_their_actuators():
    robot = chasles.load("well_manipulator")
    manifest = read_manifest(robot.folder)
    info = manifest.with_role("inverse", "pose")
    assert [item.name for item in info.inputs] == ["T", "l_HI", "l_MN", "theta7"]
    rows = [joint.name for joint in robot.chain_joints]
    moves = robot.chain_D_q(robot.reference.q)
    fixed_names = {
        int(k) for item in info.inputs[1:] for k in np.flatnonzero(moves[rows.index(item.name)])
    }
    assert info.role.fixed == (3, 5, 6) == tuple(sorted(fixed_names))
    assert refinement_of(manifest, info, robot.functions).fixed == (3, 5, 6)
    assert (
        refinement_of(
            manifest, replace(info, role=replace(info.role, fixed=())), robot.functions
        ).fixed
        == ()
    )


def test_only_pose_inverses_get_refinement(arm):
    manifest = read_manifest(arm.folder)
    ik, position = (
        next(info for info in manifest.functions if info.name == name)
        for name in ("ik", "ik_position")
    )
    assert refinement_of(manifest, ik, arm.functions) is not None
    assert refinement_of(manifest, position, arm.functions) is None
    without = replace(manifest, functions=(manifest.functions[0], ik))
    assert refinement_of(without, ik, arm.functions) is None


def test_exception_in_refinement_propagates(arm, q, monkeypatch):
    def fail(*_):
        raise RuntimeError("no step can be taken")

    T = arm.fk(q)
    monkeypatch.setattr("chasles.closed_form.refinement.iterate", fail)
    for poses in (T, T[0], T[::-1]):
        with pytest.raises(RuntimeError, match="no step"):
            arm.ik(poses)
    assert arm.ik(T[20:]).valid.all()
