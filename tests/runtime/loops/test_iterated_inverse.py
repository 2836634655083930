"""IK solutions of robots whose loops are closed by iteration agree with forward kinematics."""

import numpy as np
import pytest

import chasles
from tests.support.compiling import compiled
from tests.support.loops.assembly_modes import closes_at, followed, reference
from tests.support.loops.closures import Model
from tests.support.loops.legs_of_joints import agile_eye, driven_by_a_leg

FUNCTIONS = ["fk", "ik", "fk_jacobian_mixed"]
POSES, SAME = 3, 1e-8


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """Return a robot, its numeric loop model, and configurations (N, n_z) with closed loops."""
    mechanism = agile_eye()
    robot = compiled(mechanism, tmp_path_factory.mktemp("agile_eye"), FUNCTIONS, ["c"])
    model = Model(mechanism)
    middle = reference(model)[0, model.actuated]
    reach = np.where([c.unit == "m" for c in robot.coordinates], 0.05, 0.5)
    q = middle + reach * np.random.default_rng(3).uniform(-1, 1, (POSES, robot.n))
    z, regular = followed(model, q)
    assert regular.sum() > POSES / 2
    return robot, model, z[regular]


def apart(one, other):
    return np.abs(np.remainder(one - other + np.pi, 2 * np.pi) - np.pi).max(-1)


def test_ik_recovers_generating_configuration(case):
    robot, model, z = case
    slots = robot.ik(model.tip(z))
    own = apart(slots.q, z[:, None, model.actuated]) < SAME
    assert (own & slots.valid).any(-1).all()


def test_valid_slots_lead_to_pose_by_independent_continuation(case):
    robot, model, z = case
    T = model.tip(z[:1])
    slots = robot.ik(T)
    row, slot = np.nonzero(slots.valid)
    end, regular = followed(model, slots.q[row, slot])
    assert regular.any()
    np.testing.assert_allclose(model.tip(end)[regular], T[row][regular], atol=SAME)
    row, slot = np.nonzero(slots.other_mode)
    end, regular = followed(model, slots.q[row, slot])
    missed = np.abs(model.tip(end) - T[row]).max((-2, -1))
    assert (missed[regular] > 1e-3).all()
    assert not (slots.other_mode & slots.valid).any()


def test_one_pose_and_batch_have_the_same_modes(case):
    robot, model, z = case
    T = model.tip(z)
    slots = robot.ik(T, threads=2)
    for k, single in enumerate(map(robot.ik, T)):
        for name in ("q", "valid", "other_mode"):
            np.testing.assert_array_equal(getattr(single, name), getattr(slots, name)[k])


def test_agile_eye_reaches_every_pose_with_eight_closed_slots(tmp_path):
    mechanism = agile_eye()
    robot, model = compiled(mechanism, tmp_path, FUNCTIONS, ["c"]), Model(mechanism)
    z, _ = followed(model, np.array([[0.1, -0.2, 0.15]]))
    slots = robot.ik(model.tip(z)[0])
    assert slots.valid.sum() == 1
    assert slots.other_mode.sum() == 7
    # The first leg of the Agile Eye is the main chain.
    first = apart(slots.q[:, :1], z[0, model.actuated][:1]) < SAME
    assert first.sum() == 4
    assert all(closes_at(model, z[0, model.chain], q) for q in slots.q[first])


def test_leg_lengths_keep_their_sign(tmp_path):
    mechanism = driven_by_a_leg()
    robot, model = compiled(mechanism, tmp_path, FUNCTIONS, ["c"]), Model(mechanism)
    z, _ = followed(model, np.array([[0.52, 0.48, 0.5], [0.45, 0.5, 0.55]]))
    slots = robot.ik(model.tip(z))
    assert (slots.q[slots.valid] > 0).all()
    np.testing.assert_allclose(slots.q[slots.valid], z[:, model.actuated], atol=SAME)
    # In all assembly modes, the lengths of the legs that close loops are positive.
    assert (slots.q[..., 1:] > 0).all()


def test_pose_of_another_mode_is_out_of_reach():
    robot = chasles.load("stewart_gough")
    modes = robot.fk_all(robot.reference.q)
    T = modes.T[modes.valid]
    slots = robot.ik(T)
    own = np.abs(T - robot.fk(robot.reference.q)).max((-2, -1)) < SAME
    assert own.sum() == 1
    np.testing.assert_array_equal(slots.valid[:, 0], own)
    np.testing.assert_array_equal(slots.other_mode[:, 0], ~own)
    np.testing.assert_allclose(slots.q[:, 0], np.tile(robot.reference.q, (len(T), 1)), atol=1e-9)
    other = robot.ik(T[~own][0])
    with pytest.raises(chasles.OutOfReachError, match="does not follow the assembly mode"):
        other.nearest(robot.reference.q)
    assert not other.within_tolerance(np.inf).valid.any()
    assert np.isnan(other.least_squares().q).all()
