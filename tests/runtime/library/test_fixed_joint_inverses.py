"""`ik(T, fixed={...})` with IK functions for fixed joints, which are derived on first use."""

import inspect
from types import MappingProxyType

import numpy as np
import pytest

import chasles
from chasles import se3
from chasles.closed_form import fixed_joints
from chasles.closed_form.complete_inverse import CompleteInverse
from chasles.derive import write
from chasles.library import derived as described
from tests.support.compiling import COMPILER, TCC, derived_here, loaded
from tests.support.generators.drawn_arms import random_arm

DEG, MM = np.pi / 180, 1e-3


@pytest.fixture(scope="module")
def shipped():
    """Return installed robots, keyed by name."""
    names = ("well_manipulator", "panda", "ur5e", "board_installer", "delta")
    return {name: chasles.load(name) for name in names}


@pytest.fixture(scope="module", autouse=True)
def cache(shipped, tmp_path_factory):
    """Prepare a separate cache and fast compilation."""
    fixed_joints._inverse_of.cache_clear()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CHASLES_CACHE", str(tmp_path_factory.mktemp("given")))
        patch.setenv("CHASLES_CFLAGS", "-O0")
        if compiler := TCC or COMPILER:
            patch.setenv("CC", compiler)
        patch.setattr(described, "_finished", derived_here)
        yield


@pytest.fixture(scope="module")
def well(shipped):
    return shipped["well_manipulator"]


@pytest.fixture(scope="module")
def panda(shipped):
    return shipped["panda"]


def stages(well):
    """Return times, poses, theta1 and theta2 of the paper's 49 s motion in steps of 0.1 s."""
    t = np.arange(0, 49, 0.1)
    upright = np.array([[0, 1, 0], [0, 0, -1], [-1, 0, 0]])
    start = np.array([0, 88.79, -49.2, 0, -86.76, 0, -40.62]) * DEG
    ready = np.array([0, 88.79, -11.25844509, 0, -129.76606998, 0, -35.55548493]) * DEG
    theta = start + np.clip((t - 15) / 10, 0, 1)[:, None] * (ready - start)
    theta[:, 0] = np.interp(t, [0, 5, 10, 15], [0, 30, 30, 0]) * DEG
    T = well.fk(well.actuators(theta))
    down = t > 25
    T[down] = np.eye(4)
    T[down, :3, :3] = upright
    T[down, 0, 3] = 1.237
    depth = np.interp(t, [27, 37, 39, 49], [1020, -1146, -1146, -1146 - 2166])
    T[down, 2, 3] = depth[down] * MM
    theta2 = np.interp(t, [39, 49], [88.79, 30]) * DEG
    return t, T, theta[:, 0], theta2


def test_well_manipulator_follows_paper_with_fixed_theta2(well, capfd):
    t, T, theta1, theta2 = stages(well)
    found = well.ik(T, fixed={"theta2": theta2, "l_HI": 0.0, "l_MN": 0.0})
    assert "deriving well_manipulator with theta2, l_HI, l_MN fixed once" in capfd.readouterr().err
    valid = found.valid.any(-1)
    assert valid[t <= 39].all()
    q = found.q[np.arange(len(t)), found.valid.argmax(-1)][valid]
    np.testing.assert_allclose(well.fk(q), T[valid], atol=1e-10)
    theta = well.chain(q)
    np.testing.assert_allclose(theta[:, 1], theta2[valid], atol=1e-10)
    np.testing.assert_allclose(theta[:, 0], theta1[valid], atol=1e-10)
    assert np.abs(theta[:, [3, 5]]).max() == 0
    # For the motion from 27 s to 37 s, `track` also follows the poses with fixed values of theta2,
    # l_HI and l_MN.
    part = (t >= 27) & (t <= 37)
    track = well.track(T[part], q[part[valid]][0], 0.1, fixed=["theta2", "l_HI", "l_MN"])
    locked = [1, 3, 5]
    assert (track.q[:, locked] == track.q[0, locked]).all()
    assert track.max_distance < 2e-3
    assert np.abs(well.chain(track.q)[:, 2] - theta[part[valid], 2]).max() < 2e-2
    # In each free coordinate, the iteration starts 2 cm or 0.02 rad away from a known solution.
    seed = q[::20] + 0.02
    seed[:, locked] = q[::20][:, locked]
    numeric = well.ik_numeric(T[valid][::20], seed, fixed=["theta2", "l_HI", "l_MN"])
    assert (numeric.q[:, locked] == q[::20][:, locked]).all()
    assert numeric.valid.mean() > 0.9


def test_fixed_cylinder_equals_fixed_joint_that_it_drives(well):
    q = np.array(well.reference.q)
    theta = well.chain(q)
    others = {"l_HI": theta[3], "l_MN": theta[5]}
    by_joint = well.ik(well.fk(q), fixed={"theta2": theta[1], **others})
    by_cylinder = well.ik(well.fk(q), fixed={"cylinder_1": q[1], **others})
    np.testing.assert_allclose(by_cylinder.q, by_joint.q, atol=1e-14)
    np.testing.assert_allclose(by_joint.nearest(q), q, atol=1e-12)
    nearest = well.ik_nearest(well.fk(q), q, fixed={"theta2": theta[1], **others})
    np.testing.assert_allclose(nearest.q, q, atol=1e-12)
    # At this value of cylinder_1, the loop does not close.
    assert not well.ik(well.fk(q), fixed={"cylinder_1": [9.0], **others}).valid.any()
    with pytest.raises(chasles.OutOfReachError, match="cylinder_1: the loop does not close"):
        well.ik(well.fk(q), fixed={"cylinder_1": 9.0, **others})
    installer = chasles.load("board_installer")
    message = (
        "crank: the coordinate does not determine a single joint; fix one of these joints: waist"
    )
    with pytest.raises(chasles.InputValueError, match=message):
        installer.ik(np.eye(4), fixed={"crank": 0.1})


def test_fixing_default_redundant_joints_needs_no_derivation(panda, well, capfd):
    q = np.random.default_rng(0).uniform(-1, 1, (20, 7))
    T = panda.fk(q)
    found = panda.ik(T, fixed={"joint7": q[:, 6]})
    wanted = panda.ik.ufunc(T, q[:, 6])
    for own, expected in zip(found, wanted, strict=False):
        np.testing.assert_array_equal(own, expected)
    theta = well.chain(well.reference.q)
    T = well.fk(well.reference.q)
    # Fixed joints may be stated in any order.
    chosen = {"theta7": theta[6], "l_HI": theta[3], "l_MN": theta[5]}
    wanted, _, _ = well.ik.ufunc(T, theta[3], theta[5], theta[6])
    np.testing.assert_array_equal(well.ik(T, fixed=chosen).q, wanted)
    assert "fixed" not in capfd.readouterr().err


def test_seven_joint_ik_with_fixed_elbow_recovers_configuration(panda):
    rng = np.random.default_rng(1)
    q = panda.lower + rng.uniform(size=(200, 7)) * (panda.upper - panda.lower)
    T = panda.fk(q)
    found = panda.ik(T, fixed={"joint4": q[:, 3]})
    assert found.valid.any(-1).all()
    rows = np.nonzero(found.valid)[0]
    np.testing.assert_allclose(panda.fk(found.q[found.valid]), T[rows], atol=1e-8)
    assert (found.q[..., 3] == q[:, None, 3]).all()
    away = np.where(found.valid[..., None], found.distances_from(q), np.inf)
    assert np.abs(away).max(-1).min(-1).max() < 1e-6
    # Fixed joint values and poses are broadcast against each other.
    one = panda.ik(T[0], fixed={"joint4": q[:3, 3]}, threads=2)
    assert one.q.shape == (3, 8, 7)
    out = tuple(np.empty(shape) for shape in ((8, 7), (8,), (8,)))
    assert panda.ik(T=T[0], fixed={"joint4": q[0, 3]}, out=out).q is out[0]
    again = panda.ik(T[0], fixed={"joint4": q[0, 3]})
    np.testing.assert_array_equal(out[0], again.q)
    np.testing.assert_allclose(out[0], one.q[0], atol=1e-12)
    # The fixed joint value of the nearest solution is bitwise exact.
    nearest = panda.ik_nearest(T, q + 1e-3, fixed={"joint4": q[:, 3]}, limits=None)
    assert nearest.valid.all()
    assert (nearest.q[:, 3] == q[:, 3]).all()
    np.testing.assert_allclose(panda.fk(nearest.q), T, atol=1e-8)


def test_fixed_joint_ik_contains_all_scipy_solutions(panda):
    """SciPy finds roots of the pose error from random start values."""
    from scipy.optimize import root

    rng = np.random.default_rng(2)
    free, searched = [0, 1, 2, 4, 5, 6], 0
    for q in rng.uniform(-1.2, 1.2, (2, 7)):
        T = panda.fk(q)
        found = panda.ik(T, fixed={"joint4": q[3]})

        def error(x, q=q, T=T):
            there = panda.fk(np.insert(x, 3, q[3]))
            return se3.log(se3.inverse(T) @ there)

        for start in rng.uniform(-np.pi, np.pi, (12, 6)):
            answer = root(error, start, tol=1e-12)
            if np.abs(answer.fun).max() > 1e-9:
                continue
            searched += 1
            moves = found.distances_from(np.insert(answer.x, 3, q[3]))[found.valid][:, free]
            assert np.abs(moves).max(-1).min() < 1e-5
    assert searched > 5


def test_fixed_joints_at_right_angles_miss_no_pose(tmp_path):
    """With an inner joint at a multiple of 90 degrees, other axes are parallel or intersect."""
    robot, names = random_arm(332), ("j2", "j3")
    functions = ("fk", "fk_jacobian_mixed", "ik")
    write(robot, tmp_path / "arm", functions=functions, fixed=names, languages=("c",))
    arm = loaded(tmp_path / "arm")
    q = np.random.default_rng(0).integers(-1, 3, (60, arm.n)) * np.pi / 2
    T = arm.fk(q)
    _, residual, _ = arm.ik.ufunc(T, q[:, 1], q[:, 2])
    lost = np.flatnonzero((residual > 1e-9).all(-1))
    found = arm.ik(T, fixed={"j3": q[:, 2], "j2": q[:, 1]})
    assert len(lost)
    assert found.valid.any(-1).all()
    rows = np.nonzero(found.valid)[0]
    np.testing.assert_allclose(arm.fk(found.q[found.valid]), T[rows], atol=1e-8)
    assert (found.q[found.valid][:, [1, 2]] == q[rows][:, [1, 2]]).all()
    k = lost[0]
    one = arm.ik(T[k], fixed={"j2": q[k, 1], "j3": q[k, 2]})
    np.testing.assert_array_equal(one.valid, found.valid[k])
    with pytest.raises(chasles.DerivationError, match="chasles derive FILE --fixed j1 --to FOLDER"):
        arm.ik(T[0], fixed={"j1": 0.2})


PARALLEL_AT_ZERO = {
    830591000001: [[-np.pi / 2, 0, -np.pi / 2, -0.3, 0, np.pi], [np.pi / 2, 0, 0, 0.5, np.pi, 0]],
    4471000019: [[np.pi, 0, 0.5, 0], [-np.pi / 2, 0, -0.1, -np.pi / 2]],
}


@pytest.mark.parametrize("seed", PARALLEL_AT_ZERO)
def test_degenerate_values_of_fixed_joint_lose_and_repeat_no_solution(seed, tmp_path):
    functions = ("fk", "fk_jacobian_mixed", "ik")
    write(random_arm(seed), tmp_path / "arm", functions=functions, fixed=("j2",), languages=("c",))
    arm = loaded(tmp_path / "arm")
    q = np.array(PARALLEL_AT_ZERO[seed])
    T = arm.fk(q)
    found = arm.ik(T, fixed={"j2": 0.0})
    np.testing.assert_array_equal(found.count, found.distinct().count)
    rows = np.nonzero(found.valid)[0]
    np.testing.assert_allclose(arm.fk(found.q[found.valid]), T[rows], atol=1e-8)
    away = np.where(found.valid[..., None], found.distances_from(q), np.inf)
    assert np.abs(away).max(-1).min(-1).max() < 1e-6
    assert len(found.labels) == found.q.shape[-2]
    for row in range(len(q)):
        one = arm.ik(T[row], fixed={"j2": 0.0})
        np.testing.assert_allclose(one.valid_q(), found.at(row).valid_q(), atol=1e-9)


def test_values_near_a_degenerate_value_lose_no_solution(panda):
    rng, joint = np.random.default_rng(5), 2
    steps = [sign * 10.0**-decade for decade in range(1, 13) for sign in (1, -1)]
    values = np.add.outer([0.0, np.pi / 2, np.pi / 4], [0.0, *steps]).ravel()
    q = rng.uniform(-2, 2, (2, len(values), 7))
    q[..., joint] = values
    found = panda.ik(panda.fk(q), fixed={"joint3": values})
    apart = np.abs(np.angle(np.exp(1j * (found.q - q[..., None, :])))).max(-1)
    near = np.where(found.valid, apart, np.inf).min(-1) < 1e-6
    J = np.delete(panda.jacobian_mixed(q), joint, -1)
    regular = np.linalg.svd(J, compute_uv=False)[..., -1] > 1e-3
    assert regular.sum() > 100
    assert near[regular].all()


def test_generic_values_of_fixed_joints_need_no_search(panda, monkeypatch):
    searched = []
    search = CompleteInverse._found
    monkeypatch.setattr(
        CompleteInverse, "_found", lambda *args: searched.append(args) or search(*args)
    )
    q = np.random.default_rng(6).uniform(0.1, 1.4, (1000, 7))
    assert panda.ik(panda.fk(q), fixed={"joint3": q[:, 2]}).valid.any(-1).all()
    assert not searched
    panda.ik(panda.fk(q[0] * [1, 1, 0, 1, 1, 1, 1]), fixed={"joint3": 0.0})
    assert len(searched) == 1


def test_invalid_fixed_joint_arguments_are_explained(shipped, panda):
    T, wanted = np.eye(4), {"joint4": 0.0}
    with pytest.raises(
        chasles.InputValueError, match="cannot fix 'joint8'; expected one of joint1"
    ):
        panda.ik(T, fixed={"joint8": 0.0})
    for wrong in (0.3, "joint7", ["joint7"]):
        with pytest.raises(chasles.InputTypeError, match=r'expected fixed=\{"joint7": value\}'):
            panda.ik(T, fixed=wrong)
    for call in (lambda: panda.ik(T, 0.3), lambda: panda.ik(T, 0.3, fixed=wanted)):
        with pytest.raises(
            chasles.InputTypeError, match=r"takes 1 input \(T\), got 2; fixed= takes"
        ):
            call()
    with pytest.raises(chasles.InputTypeError, match=r"takes 1 input \(T\), got 0"):
        panda.ik(fixed=wanted)
    with pytest.raises(chasles.InputTypeError, match="unknown argument 'fast'; it takes T, out"):
        panda.ik(T, fixed=wanted, fast=True)
    with pytest.raises(chasles.InputTypeError, match="unknown argument 'given'; pass fixed=;"):
        panda.ik(T, **{"given": wanted})
    with pytest.raises(chasles.InputTypeError, match="unknown argument 'fixed'"):
        panda.fk(np.zeros(7), fixed={"joint4": 0.0})
    arm = chasles.load("iiwa14")
    message = "if A4 is fixed: the other joints could move .* can be fixed: A1; .*; ik_numeric with"
    with pytest.raises(chasles.DerivationError, match=message):
        arm.ik(arm.fk(np.zeros(7)), fixed={"A4": 0.3})


def test_redundant_ik_without_fixed_joints_names_parameters_and_ik_nearest(panda, well):
    for robot, names in ((panda, ["joint7"]), (well, ["l_HI", "l_MN", "theta7"])):
        expected = ", ".join(f'"{name}": value' for name in names)
        for options in ({}, {"fixed": None}, {"fixed": {}}, {"threads": 2}):
            with pytest.raises(chasles.InputTypeError) as caught:
                robot.ik(np.eye(4), **options)
            assert f"pass fixed={{{expected}}}, or call ik_nearest(T, q_seed)" in str(caught.value)


def test_mapping_that_is_no_dict_gives_the_same_solutions(panda):
    q = np.array([0.1, 0.2, 0.3, -1.5, 0.4, 1.6, 0.5])
    T = panda.fk(q)
    found = panda.ik(T, fixed=MappingProxyType({"joint7": q[6]}))
    np.testing.assert_array_equal(found.q, panda.ik(T, fixed={"joint7": q[6]}).q)


def test_help_lists_joints_that_can_be_fixed(panda):
    assert "fixed" in inspect.signature(panda.ik).parameters
    assert "fixed" not in inspect.signature(panda.fk).parameters
    doc = panda.ik.__doc__
    assert "Joints: joint1, joint2, joint3, joint4, joint5, joint6, joint7." in doc


@pytest.mark.parametrize("name", ["board_installer", "delta"])
def test_coupled_loop_joints_are_rejected_without_derivation(shipped, name, capfd):
    robot = shipped[name]
    T = robot.fk(robot.reference.q)
    text = "no other joint can be fixed: loops couple .*; with ik_numeric.* can be fixed: "
    with pytest.raises(chasles.DerivationError, match=text + robot.coordinates[0].name):
        robot.ik(T, fixed={robot.chain_joints[0].name: 0.1})
    assert capfd.readouterr().err == ""


def test_nearest_solution_keeps_other_fixed_joints_to_the_last_bit(panda):
    q = np.array([0.1, 0.2, 0.3, -1.5, 0.4, 1.6, 0.5])
    T, seed = panda.fk(q), q + 0.02
    found = panda.ik_nearest(T, seed, fixed={"joint4": q[3]})
    assert found.valid
    assert found.q[3] == q[3]
    np.testing.assert_allclose(panda.fk(found.q), T, atol=1e-9)
    solutions = panda.ik(T, fixed={"joint4": q[3]}).within_limits()
    assert np.abs(found.q - seed).max() <= np.abs(solutions.nearest(seed) - seed).max() + 1e-12
    kept = panda.ik_nearest(T, np.where(np.arange(7) == 3, q, seed), fixed="joint4")
    np.testing.assert_allclose(kept.q, found.q, atol=1e-9)
    assert not panda.ik_nearest(T, seed, fixed={"joint4": 1.0}).valid
