"""In the inverse of a calibrated arm, C code refines the solutions of a nominal arm."""

import ctypes
import subprocess

import numpy as np
import pytest

import chasles
from chasles.derive import read
from chasles.derive.inverse.chain_solution import pose_task
from chasles.derive.inverse.classify import classify
from chasles.derive.inverse.nominal import nominal_of
from chasles.derive.inverse.nominal_convergence import Sampled
from chasles.derive.inverse.serial_inverse import inverses
from chasles.derive.inverse.structure.lines import Lines, axes_of
from chasles.derive.model.tolerances import MIN_CONVERGED
from chasles.derive.terms.terms import Terms
from tests.support.derivations import ROBOTS
from tests.support.fixed import fixed_at
from tests.support.generators.drawn_arms import random_arm
from tests.support.generators.geometric_errors import displaced
from tests.support.oracles.pinocchio_fk import pinocchio_fk

TRUE = 1e-8
"""Maximum pose error (meter, or rotation matrix entry) of a correct solution."""


@pytest.fixture(scope="module")
def case(displaced_robot, displaced_arm):
    """Return a calibrated arm and its forward kinematics from Pinocchio.

    The test campaign `displaced` covers all arms and error sizes. The file test_displaced tests
    fixed joints.
    """
    return displaced_arm, pinocchio_fk(displaced_robot)


def inputs_of(arm, q):
    """Return the poses and the redundancy parameters of configurations."""
    return arm.fk(q), fixed_at(arm, q)


def found(arm, solutions, q):
    """Test whether each configuration is among the solutions."""
    return (np.abs(solutions.distances_from(q)).max(-1) < 1e-6).any(-1)


def right_angles(n, count, seed=1):
    """Return configurations, half of them near and half exactly at multiples of 90 degrees."""
    rng = np.random.default_rng(seed)
    q = rng.integers(-2, 3, (count, n)) * np.pi / 2
    size = 10 ** rng.uniform(-9, -3, (count // 2, 1))
    q[: count // 2] += rng.uniform(-1, 1, (count // 2, n)) * size
    return q


def test_valid_solutions_reach_pose_and_configurations_are_found(case):
    arm, fk = case
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (150, arm.n))
    solutions = arm.ik(arm.fk(q), fixed=fixed_at(arm, q))
    assert (solutions.count > 0).all()
    assert found(arm, solutions, q).mean() > 0.99
    wanted = np.broadcast_to(arm.fk(q)[:, None], (*solutions.valid.shape, 4, 4))
    for row, T in zip(solutions.q[solutions.valid], wanted[solutions.valid], strict=True):
        assert np.abs(fk(row) - T).max() < TRUE


def test_right_angle_poses_are_solved(case):
    arm, fk = case
    q = right_angles(arm.n, 100)
    T, fixed = inputs_of(arm, q)
    solutions = arm.ik(T, fixed=fixed)
    assert (solutions.count > 0).all()
    for k in range(0, 100, 10):
        for row in solutions.valid_q() if solutions.valid.ndim == 1 else solutions.at(k).valid_q():
            assert np.abs(fk(row) - T[k]).max() < TRUE


def test_residual_is_pose_error_of_calibrated_arm(case):
    arm, fk = case
    q = np.random.default_rng(2).uniform(-1, 1, (20, arm.n))
    T, fixed = inputs_of(arm, q)
    T[:, :3, 3] *= 1.2
    solutions = arm.ik(T, fixed=fixed)
    checked = 0
    for k, residuals in enumerate(solutions.residual):
        for slot, residual in enumerate(residuals):
            if np.isnan(residual):
                continue
            apart = fk(solutions.q[k, slot]) - T[k]
            angle = np.linalg.norm(apart[:3, :3]) / 2**0.5
            assert residual == pytest.approx(max(np.linalg.norm(apart[:3, 3]), angle), abs=1e-12)
            checked += 1
    assert checked >= 20 * 4


def test_invalid_poses_have_no_solution(case):
    arm, _ = case
    q = np.random.default_rng(3).uniform(-1, 1, (10, arm.n))
    T, fixed = inputs_of(arm, q)
    assert arm.ik(T.astype(np.float32), fixed=fixed).valid.any(-1).all()
    off = T.copy()
    off[:, 0, 0] += 1e-3
    with pytest.raises(chasles.InputValueError, match="deviation"):
        arm.ik(off, fixed=fixed)
    T[0], T[1, 0, 3] = np.nan, 100.0
    solutions = arm.ik(T, fixed=fixed)
    assert np.isnan(solutions.residual[0]).all()
    assert not solutions.valid[:2].any()
    assert np.isfinite(solutions.q[1, 0]).all()
    assert solutions.valid[2:].any(-1).all()


def test_batch_equals_single_pose_calls(case):
    arm, _ = case
    q = np.random.default_rng(4).uniform(-np.pi, np.pi, (40, arm.n))
    T, fixed = inputs_of(arm, q)
    batch = arm.ik(T, fixed=fixed, threads=2)
    for k in range(40):
        one = arm.ik(T[k], fixed={name: value[k] for name, value in fixed.items()})
        np.testing.assert_array_equal(one.q, batch.q[k])
        np.testing.assert_array_equal(one.valid, batch.valid[k])


def test_standalone_c_agrees_with_python(case, tmp_path):
    arm, fk = case
    library = tmp_path / "alone.so"
    source = arm.folder / f"{arm.name}.c"
    command = ["cc", "-std=c99", "-O0", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared"]
    subprocess.run([*command, source, "-o", library, "-lm"], check=True)
    ik = getattr(ctypes.CDLL(str(library)), f"{arm.name}_ik")
    slots = len(arm.labels["ik"])
    q, residual, margin = np.empty((slots, arm.n)), np.empty(slots), np.empty(slots)
    same = 0
    for wanted in np.random.default_rng(5).uniform(-np.pi, np.pi, (50, arm.n)):
        T = np.ascontiguousarray(arm.fk(wanted))
        address = [array.ctypes.data_as(ctypes.c_void_p) for array in (T, q, residual, margin)]
        ik(*address)
        python = arm.ik(T)
        same += (residual <= 1e-9).sum() == python.count
        for row in q[residual <= 1e-9]:
            assert np.abs(fk(row) - T).max() < TRUE
    # Near a singularity, scalar code and vector code may converge to different solutions.
    assert same >= 48


def test_calibrated_arm_offers_nominal_inverse_and_deviation_note(case):
    arm, _ = case
    (note,) = [note for note in arm.notes if "nominal" in note]
    assert "off by" in note
    assert arm.labels["ik"][-1].startswith("further")
    assert "ik_nominal" in arm.functions
    casadi = (arm.folder / f"{arm.name}.casadi").read_text()
    assert "residual" not in casadi


def test_nominal_convergence_rate_falls_with_deviation():
    shares = []
    for size in (1e-4, 8e-2):
        robot = displaced(read(ROBOTS / "puma560.toml"), size)
        classification = classify(robot, Terms({}))
        lines, near = classification.lines, classification.near[0]
        nominal = nominal_of(robot, lines, near)
        task = pose_task(nominal, Lines(lines.terms, axes_of(nominal, lines.terms)), near)
        shares.append(Sampled.of(robot, lines, task.function).share_converged)
    assert shares[0] > 0.97
    assert shares[1] < MIN_CONVERGED


def test_nominal_inverse_with_other_configurations_is_discarded():
    """Newton's method from solutions of the nominal arm recovers all sampled configurations."""
    robot = displaced(random_arm(164), 1.4e-4, 164)
    assert classify(robot, Terms({})).near
    assert inverses(robot, Terms({})).polished is None
