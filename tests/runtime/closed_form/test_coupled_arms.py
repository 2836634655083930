"""Arms with couplings: nearest solutions, and limits of motors and joints."""

import itertools
import pickle

import numpy as np
import pytest

from chasles.calibration.calibrated_file import robot_file
from chasles.derive import read_text
from chasles.drawing import skeleton
from tests.support.compiling import compiled

WRIST = """\
name = "bevel_wrist"
convention = "dh"
joints = [
  { name = "waist", d = "0.3", alpha = "pi/2", limits = [-3, 3] },
  { name = "shoulder", a = "0.4" },
  { name = "elbow", alpha = "pi/2" },
  { name = "forearm", d = "0.3", alpha = "-pi/2" },
  { name = "pitch", alpha = "pi/2", limits = [-2, 2] },
  { name = "roll", d = "0.1" },
]
[couplings]
elbow = { elbow = 1, shoulder = -1, offset = "0.2" }
pitch = { left = "1/2", right = "1/2" }
roll = { left = "1/2", right = "-1/2" }
[motors]
left = { limits = [-9, 9] }
right = { limits = [-9, 9] }
"""
PALLETIZER = """\
name = "palletizer"
convention = "urdf"
joints = [
  { name = "j1", axis = [0, 0, 1], xyz = [0, 0, "0.5"] },
  { name = "j2", axis = [0, 1, 0], xyz = ["0.15", 0, 0], limits = [-2, 2] },
  { name = "j3", axis = [0, 1, 0], xyz = [0, 0, "0.9"] },
  { name = "level", axis = [0, 1, 0], xyz = [1, 0, 0], limits = [-1, 2] },
  { name = "j4", axis = [0, 0, 1], xyz = ["0.2", 0, "-0.15"] },
]
[couplings]
j3 = { j3 = 1, j2 = -1 }
level = { j3 = -1 }
"""
BELTS = """\
name = "belt_scara"
convention = "dh"
units = { length = "m", angle = "rad" }
joints = [
  { name = "j1", d = "0.4", a = "0.25" },
  { name = "j2", a = "0.2" },
  { name = "hand", theta = 0 },
  { name = "slide", type = "prismatic" },
]
[couplings]
hand = { spindle = 1, j1 = -1, j2 = -1 }
slide = { nut = "0.0032", spindle = "-0.0032" }
[motors]
nut = { limits = [-60, 60] }
spindle = { limits = [-10, 10] }
"""
VARIED = {"joint", "axis", "transmission", "coupling"}


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bevel_wrist")
    return compiled(read_text(WRIST), folder)


def test_nearest_solution_takes_full_turns_of_joints(arm):
    q = np.random.default_rng(1).uniform(-2, 2, (300, 6))
    q[:, 4:] += 2 * np.pi * np.array([[1, -1]])
    T = arm.fk(q)
    batch = arm.ik_nearest(T, q + 1e-3)
    one = [arm.ik_nearest(T[k], q[k] + 1e-3).q for k in range(20)]
    refined = arm.ik_nearest(T[:20], q[:20] + 1e-3, fixed=None, weights=np.ones(6))
    for found, own in ((batch.q, q), (one, q[:20]), (refined.q, q[:20])):
        np.testing.assert_allclose(found, own, atol=1e-8)


def test_limits_of_motors_and_joints_are_both_checked(arm):
    assert arm.coordinate_names == ("waist", "shoulder", "elbow", "forearm", "left", "right")
    assert arm.joint_names == ("waist", "shoulder", "elbow", "forearm", "pitch", "roll")
    np.testing.assert_array_equal(arm.limits[4:], [[-9, 9], [-9, 9]])
    np.testing.assert_array_equal(arm.joint_limits[4], [-2, 2])
    q = np.zeros((3, 6))
    q[1, 4:], q[2, 4:] = (4.5, 0.0), (8.0, -9.5)
    np.testing.assert_array_equal(arm.is_within_limits(q), [True, False, False])
    assert arm.is_within_limits(arm.random_q(100)).all()


def test_nearest_solution_is_within_limits_of_motors_and_joints(arm):
    T, seeds = arm.fk(arm.random_q(2000)), arm.random_q(2000, rng=7)
    found = arm.ik_nearest(T, seeds)
    assert found.valid.all()
    assert arm.is_within_limits(found.q).all()
    np.testing.assert_allclose(arm.fk(found.q), T, atol=1e-9)
    one = np.array([arm.ik_nearest(*row).q for row in zip(T[:50], seeds[:50], strict=True)])
    np.testing.assert_allclose(one, found.q[:50], atol=1e-12)
    rounded = arm.ik_nearest(T.round(6), seeds)
    assert arm.is_within_limits(rounded.q[rounded.valid]).all()
    assert rounded.valid.mean() > 0.99


def test_no_winding_within_limits_is_nearer_than_the_nearest_solution(arm):
    T, seeds = arm.fk(arm.random_q(40)), arm.random_q(40, rng=7)
    turns = np.array(list(itertools.product(range(-2, 3), repeat=arm.n)))
    steps = 2 * np.pi * turns @ arm.actuators_D_chain(np.zeros(arm.n)).T
    found, solutions = arm.ik_nearest(T, seeds), arm.ik(T)
    for k, seed in enumerate(seeds):
        wound = (solutions.at(k).valid_q()[:, None] + steps).reshape(-1, arm.n)
        wound = wound[arm.is_within_limits(wound)]
        assert np.abs(found.q[k] - seed).max() <= np.abs(wound - seed).max(-1).min() + 1e-12


def test_filtered_solutions_are_within_limits_of_motors_and_joints(arm):
    T = arm.fk(arm.random_q(500))
    every, kept = arm.ik(T), arm.ik(T).within_limits()
    assert not arm.is_within_limits(every.q[every.valid]).all()
    assert arm.is_within_limits(kept.q[kept.valid]).all()
    assert (kept.count > 0).all()
    again = pickle.loads(pickle.dumps(every)).within_limits()
    np.testing.assert_array_equal(again.valid, kept.valid)


def test_limits_of_a_joint_that_follows_several_joints_are_respected(tmp_path):
    palletizer = compiled(read_text(PALLETIZER), tmp_path)
    T, seeds = palletizer.fk(palletizer.random_q(500)), palletizer.random_q(500, rng=7) + 9
    found, free = palletizer.ik_nearest(T, seeds), palletizer.ik_nearest(T, seeds, limits=None)
    assert found.valid.all()
    assert palletizer.is_within_limits(found.q).all()
    assert not palletizer.is_within_limits(free.q).any()


def test_joint_limits_apply_to_explicit_motor_limits_but_not_to_none(arm):
    q = np.array([[0.3, 0.4, 1.2, 0.5, 4.6, 4.4]])
    T, wide = arm.fk(q), arm.limits.copy()
    wide[4:] = -20, 20
    assert abs(arm.chain(q)[0, 4]) > arm.joint_limits[4, 1]
    near = arm.ik_nearest(T, q, limits=wide).q
    assert not np.allclose(near, q)
    np.testing.assert_allclose(arm.ik_nearest(T, q, limits=None).q, q, atol=1e-9)
    some, every = (arm.ik(T).within_limits(limits) for limits in (wide, None))
    assert 0 < some.count < every.count
    assert (np.abs(arm.chain(some.q[some.valid])[:, 4]) <= arm.joint_limits[4, 1]).all()
    assert arm.is_within_limits(near).all()


def test_maps_convert_positions_rates_and_accelerations(arm):
    q, qd, qdd = np.random.default_rng(2).uniform(-1, 1, (3, 6))
    theta = arm.chain(q)
    np.testing.assert_allclose(theta[[2, 4, 5]], [q[2] - q[1] + 0.2, *_differential(q)], atol=1e-15)
    np.testing.assert_allclose(arm.actuators(theta), q, atol=1e-15)
    C, L = arm.chain_D_q(q), arm.actuators_D_chain(theta)
    np.testing.assert_allclose(C @ L, np.eye(6), atol=1e-15)
    np.testing.assert_allclose(arm.chain_rates(q, qd), C @ qd, atol=1e-15)
    np.testing.assert_allclose(arm.actuator_accelerations(theta, qd, qdd), L @ qdd, atol=1e-15)


def test_calibrated_arm_keeps_couplings_and_inverse(tmp_path):
    functions = ["fk", "fk_p", "jacobian_p", "chain", "actuators", "actuators_D_chain"]
    arm = compiled(read_text(WRIST), tmp_path / "nominal", functions, ["c"])
    p = np.array([g.value for g in arm.geometry])
    varied = np.array([g.part in VARIED for g in arm.geometry])
    rng = np.random.default_rng(5)
    p += np.where(varied, rng.normal(0, 1e-4, len(p)), 0)
    text = robot_file(arm, p, "calibrated", "test")
    functions = ["fk", "fk_jacobian_mixed", "ik", "coordinates_from_readings"]
    own = compiled(read_text(text, exact=True), tmp_path / "own", functions, ["c"])
    readings = rng.uniform(-1.5, 1.5, (50, 6))
    q = own.coordinates_from_readings(readings)
    T = own.fk(q)
    np.testing.assert_allclose(T, arm.fk_p(readings, p), atol=1e-13)
    np.testing.assert_allclose(own.ik_nearest(T, q + 1e-4).q, q, atol=1e-8)
    np.testing.assert_array_equal(own.limits, arm.limits)


def test_coupled_arm_with_few_functions_checks_limits_of_joints(tmp_path):
    arm = compiled(read_text(WRIST), tmp_path, ("fk", "ik"), ["c"])
    found = arm.ik(arm.fk(np.zeros(6)))
    assert found.within_limits().valid.any()
    np.testing.assert_array_equal(arm.chain(np.eye(6)[4])[4:6], [0.5, 0.5])
    for name in ("actuators", "actuators_D_chain"):
        with pytest.raises(AttributeError) as error:
            getattr(arm, name)
        assert "no loops" not in str(error.value)


def _differential(q):
    return (q[4] + q[5]) / 2, (q[4] - q[5]) / 2


def test_bodies_follow_all_coordinates_of_their_joint(arm):
    q = arm.random_q(50)
    bones = skeleton(arm)
    names = [body.name for body in bones.bodies]
    poses = bones.poses(q)[:, [names.index(name) for name in arm.link_names]]
    np.testing.assert_allclose(poses, arm.link_poses(q), atol=1e-14)


def test_numeric_inverse_reaches_links_behind_coupled_joints(arm):
    q = arm.random_q(rng=4)
    for link, T in zip(arm.link_names[2:], arm.link_poses(q)[2:], strict=True):
        found = arm.ik_numeric(T, q + 0.02, tip=link)
        assert found.valid
        reached = arm.link_poses(found.q)[arm.link_names.index(link)]
        np.testing.assert_allclose(reached, T, atol=1e-8)


def test_path_ends_at_the_limit_of_a_coupled_joint(arm):
    start, along = np.array([0.3, 0.4, 1.2, 0.5, 1.0, 1.0]), np.linspace(0, 2, 200)[:, None]
    q = start + along * [0, 0, 0, 0, 1, 1]
    path = arm.ik_path(arm.fk(q), start)
    assert path.ended_at == np.argmin(arm.is_within_limits(q)) > 0
    assert (path.reason, path.coordinate) == ("limit", "pitch")
    assert path.next_value == pytest.approx(arm.chain(q)[path.ended_at, 4])
    assert "pitch would go to 2.0" in str(path)
    turned = start + along * [0, 0, 0, 0, 3, -3]
    np.testing.assert_allclose(arm.ik_path(arm.fk(turned), start).q, turned, atol=1e-9)


def test_path_starts_within_the_limits_of_joints(tmp_path):
    """A full motor turn towards the seed would violate the limit of the joint `level`."""
    palletizer = compiled(read_text(PALLETIZER), tmp_path)
    towards = np.array([6, 0, 6, 6])
    for row in palletizer.random_q(50):
        path = palletizer.ik_path(palletizer.fk(row[None]), row + towards)
        assert path.complete
        assert palletizer.is_within_limits(path.q).all()
        np.testing.assert_allclose(palletizer.fk(path.q), palletizer.fk(row[None]), atol=1e-9)


@pytest.mark.parametrize("text", [WRIST, PALLETIZER, BELTS], ids=["wrist", "palletizer", "belts"])
def test_a_solution_moves_into_limits_by_full_turns_of_coupled_joints(text, tmp_path):
    arm = compiled(read_text(text), tmp_path)
    T = arm.fk(arm.random_q(2000, rng=3))
    for windings in (True, False):
        found = arm.ik(T).within_limits(windings=windings)
        assert (found.count > 0).all()
        assert arm.is_within_limits(found.q[found.valid]).all()
        poses = T[np.nonzero(found.valid)[0]]
        np.testing.assert_allclose(arm.fk(found.q)[found.valid], poses, atol=1e-9)
    single = arm.ik(T[7]).within_limits()
    np.testing.assert_allclose(single.q, arm.ik(T).within_limits().q[7], atol=1e-12)
    seeds = arm.random_q(30, rng=7)
    starts = [arm.ik_path(row[None], seed).q[0] for row, seed in zip(T[:30], seeds, strict=True)]
    nearest = arm.ik_nearest(T[:30], seeds).q
    np.testing.assert_allclose(*(np.abs(q - seeds).max(-1) for q in (starts, nearest)), atol=1e-9)


def test_position_of_a_palletizer_keeps_its_hand_level(tmp_path):
    palletizer = compiled(read_text(PALLETIZER), tmp_path)
    q = np.random.default_rng(4).uniform(-1.5, 1.5, (200, 4))
    T = palletizer.fk(q)
    found = palletizer.ik_position(T[:, :3, 3])
    assert palletizer.free_coordinates["position"] == ("j4",)
    apart = np.remainder(found.q - q[:, None] + np.pi, 2 * np.pi) - np.pi
    apart = np.where(found.valid, np.abs(apart[..., :3]).max(-1), np.inf)
    assert apart.min(1).max() < 1e-9
    reached = palletizer.fk(found.q)[found.valid]
    wanted = np.broadcast_to(T[:, None], (*found.valid.shape, 4, 4))[found.valid]
    np.testing.assert_allclose(reached[:, :3, 3], wanted[:, :3, 3], atol=1e-12)
    np.testing.assert_allclose(reached[:, :3, 2], wanted[:, :3, 2], atol=1e-12)
