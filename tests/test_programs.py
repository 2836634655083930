"""Programs that use the public names as a reader would, run as they stand."""

import numpy as np

import chasles

CONTROLLER = """
import chasles, numpy as np
from chasles import se3
arm = chasles.load("ur5e"); q = arm.q_reference
for T in se3.interpolate(arm.fk(q), T_goal, np.linspace(0, 1, 500)):
    found = arm.ik_nearest(T, q)
    if not found.valid or np.abs(found.q - q).max() > 0.05: break
    q = found.q
"""
BATCH = """
import chasles
from chasles import se3
arm = chasles.load("ur5e")
qs = arm.random_q(100_000, rng=7)
T, J = arm.fk_jacobian_mixed(qs, threads="all")
xyz, quat = se3.to_xyz(T), se3.to_quat(T, order="xyzw")
"""
EXCAVATOR = """
import chasles
boom = chasles.load("excavator"); q = boom.q_reference
rates = boom.joint_rates(q, [0.2, 0, 0.1], components="linear", fixed="swing",
                         rate_limits=[0.5, 0.1, 0.1, 0.1], dt=0.01)
q = q + 0.01 * rates.qd
theta, ok = boom.chain(q), boom.loops_close(q)
"""


def run(program, **names):
    exec(compile(program, "program", "exec"), names)
    return names


def test_controller_step_reaches_the_goal():
    arm = chasles.load("ur5e")
    q_goal = arm.q_reference + 0.1
    seen = run(CONTROLLER, T_goal=arm.fk(q_goal))
    np.testing.assert_allclose(seen["q"], q_goal, atol=1e-8)
    assert seen["found"].reason == ""


def test_batch_of_random_configurations_gives_poses_and_orientations():
    seen = run(BATCH)
    arm, qs = seen["arm"], seen["qs"]
    assert (seen["T"].shape, seen["J"].shape) == ((100_000, 4, 4), (100_000, 6, 6))
    assert arm.is_within_limits(qs).all()
    again = chasles.se3.pose(seen["xyz"][:50], quat=seen["quat"][:50], order="xyzw")
    np.testing.assert_allclose(again, arm.fk(qs[:50]), atol=1e-12)
    np.testing.assert_array_equal(qs, arm.random_q(100_000, rng=7))


def test_excavator_moves_its_bucket_with_a_fixed_swing():
    seen = run(EXCAVATOR)
    boom, rates = seen["boom"], seen["rates"]
    assert boom.coordinate_names[0] == "swing"
    assert boom.joint_names == ("swing", "boom", "stick", "bucket")
    assert rates.qd[0] == 0
    assert (np.abs(rates.qd) <= [0.5, 0.1, 0.1, 0.1]).all()
    V = boom.jacobian_mixed(boom.q_reference) @ rates.qd
    np.testing.assert_allclose(V[:3], rates.scale * np.array([0.2, 0, 0.1]), atol=1e-6)
    assert seen["ok"]
    assert seen["theta"].shape == (4,)
