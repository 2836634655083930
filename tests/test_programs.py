"""Typical programs that use the public names run without errors."""

import numpy as np
import pytest

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
PLANNER = """
import chasles
from chasles import se3
arm = chasles.load("ur5e")
from chasles.study import motion, planning, workspace
found = workspace(arm, SAMPLES, resolution=50, rng=1)
print(found.size, found.bounds); found.plot(); found.save("workspace.npz")
obstacles = [planning.box(se3.pose([0, 0, -0.2]), [2, 2, 0.1]),
             planning.sphere([0.4, 0.3, 0.5], 0.1)]
space = planning.configuration_space(arm, obstacles, radius=0.05)
plan = planning.prm(space, 200, rng=1).plan(q_start, q_goal)
if not plan.found: raise SystemExit(plan.reason)
sequence = motion.MotionSequence(arm, q_start).follow(planning.shortcut(space, plan), "quintic",
                                                      duration=3)
trajectory = sequence.sample(500); trajectory.save("move.csv")
print(motion.limit_violations(arm, trajectory, rate_limits=3.0))
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


def test_planned_motion_avoids_obstacles_within_limits(tmp_path, monkeypatch, capsys):
    """The test uses 100,000 samples instead of the 1,000,000 samples of the example program."""
    pytest.importorskip("coal", reason="coal comes with pin")
    pytest.importorskip("matplotlib").use("Agg")
    from chasles.study import Workspace
    from chasles.study.motion import Trajectory

    monkeypatch.chdir(tmp_path)
    q_start = np.array([0, -1, 1.2, -0.4, 0.5, 0])
    q_goal = q_start + 1.2 * np.eye(6)[0]
    seen = run(PLANNER, SAMPLES=100_000, q_start=q_start, q_goal=q_goal)
    assert capsys.readouterr().out.startswith("volume 3.")
    assert Workspace.load("workspace.npz").size == seen["found"].size
    moved = Trajectory.load("move.csv", robot=seen["arm"])
    np.testing.assert_allclose(moved.q[[0, -1]], [q_start, q_goal], atol=1e-12)
    assert moved.t[-1] == 3
    assert seen["space"].is_free(moved.q[::50]).all()
