"""Tests errors, Jacobian rows, and refinement near singularities of partial-pose tasks.

Errors and Jacobians are compared with ``bench/cases/tasks.py`` and finite differences. The tests
compute poses as products of exponentials of the joint screws.
"""

import numpy as np
import pytest

from chasles.closed_form.refinement import Refinement
from chasles.closed_form.task_components import PARTS, Task
from chasles.contract import TASK_COMPONENTS
from chasles.derive.terms.symbolic_function import SymbolicFunction
from tests.campaigns.losses import losses_of
from tests.support.derivations import derivation
from tests.support.generators.drawn_arms import PoseAndJacobian, cases_of, random_arm
from tests.support.generators.synthetic import Function
from tests.support.oracles.screws import screws
from tests.support.oracles.tasks import TASKS

OFFERED = [
    ("lynxmotion", "ik_position"),
    ("lynxmotion", "ik_position_pitch"),
    ("lynxmotion", "ik_position_direction"),
    ("bricklaying_planar", "ik_planar"),
]
"""Pairs of a robot and an inverse function whose task constrains only some components of a pose."""
SPOILT = 1e-7
"""Maximum difference (radian) between perturbed start coordinates and a solution."""
NEAR_RIGHT_ANGLES = 51898, "ik_position_direction"
"""Random seed of an arm, and name of its inverse kinematics function. Without refinement, this
arm's inverse kinematics function misses poses with joint angles near multiples of 90 degrees.

The command `make campaign ONLY=losses` tests many random arms of this kind.
"""


def test_task_parts_match_reference_table():
    assert PARTS.keys() == TASK_COMPONENTS.keys()


@pytest.mark.parametrize(("robot", "task"), OFFERED)
def test_task_jacobian_is_derivative_of_task_error(robot, task):
    chain, components = screws(robot), role_of(robot, task).components
    rng = np.random.default_rng(0)
    n = len(chain.axes)
    q, wanted = rng.uniform(-3, 3, (2, 300, n))
    target = TASKS[task].target(chain.fk(wanted))
    function = PoseAndJacobian(chain)
    measure = Task(components)
    _, _, size = measure(*function(q), target)
    np.testing.assert_allclose(size, distance(task, chain.fk(q), target), atol=1e-12)
    # At poses close to the target, the task error is linear in the joint displacement.
    near = q + 1e-6 * rng.uniform(-1, 1, q.shape)
    rows, error, _ = measure(*function(q), TASKS[task].target(chain.fk(near)))
    expected = np.einsum("Nij,Nj->Ni", rows, near - q)
    # The pitch has an extremum if the tool's z axis is vertical. Near such poses, the pitch error
    # is not linear in the joint displacement.
    steady = (np.abs(chain.fk(q)[:, 2, 2]) < 0.99) | ("pitch" not in components)
    assert steady.sum() > 200
    np.testing.assert_allclose(error[steady], expected[steady], atol=2e-10)


def distance(task, T, target):
    """Return task residuals as the generated code defines them.

    If the task includes angles, a residual is the larger of the position distance and the chord 2
    sin(angle / 2).
    """
    near = TASKS[task].error(T, target)
    if task == "ik_position":
        return near
    coordinates = 2 if task == "ik_planar" else 3
    apart = np.linalg.norm(T[:, :coordinates, 3] - target[:, :coordinates], axis=1)
    if task == "ik_position_direction":
        return np.maximum(apart, np.linalg.norm(T[:, :3, 2] - target[:, 3:], axis=1))
    angle = TASKS[task].target(T)[:, -1] - target[:, -1]
    return np.maximum(apart, 2 * np.abs(np.sin(angle / 2)))


def role_of(robot, task):
    function = derivation(robot).function(task)
    assert isinstance(function, SymbolicFunction)
    return function.role


def refinement_for(robot, task):
    role = role_of(robot, task)
    function = PoseAndJacobian(screws(robot))
    return Refinement(function, (*role.fixed, *role.free), task=Task(role.components))


@pytest.mark.parametrize(("robot", "task"), OFFERED)
def test_inaccurate_slots_are_refined_to_full_precision(robot, task):
    role, chain = role_of(robot, task), screws(robot)
    q = np.random.default_rng(1).uniform(0.1, 1.2, (200, len(chain.axes)))
    q[:, list(role.free)] = 0.0
    target = TASKS[task].target(chain.fk(q))
    found = Function(derivation(robot).function(task))(target)
    assert found.valid.any(axis=1).all()
    expected = found.q.copy()
    free = [k for k in range(q.shape[1]) if k not in role.free]
    rng = np.random.default_rng(2)
    moved = found.q.copy()
    moved[..., free] += rng.uniform(-SPOILT, SPOILT, moved[..., free].shape)
    residual = np.where(found.valid, SPOILT, 1.0)
    valid = np.zeros_like(found.valid)
    refinement_for(robot, task)((target,), moved, residual, valid)
    np.testing.assert_array_equal(valid, found.valid)
    errors = TASKS[task].error(chain.fk(moved), target[:, None])
    assert errors[valid].max() < 1e-12
    assert residual[valid].max() < 1e-12
    assert (moved[..., list(role.free)] == expected[..., list(role.free)]).all()


@pytest.mark.parametrize(("robot", "task"), OFFERED)
def test_unreachable_targets_remain_invalid_after_refinement(robot, task):
    role, chain = role_of(robot, task), screws(robot)
    q = np.random.default_rng(3).uniform(-3, 3, (60, len(chain.axes)))
    target = TASKS[task].target(chain.fk(q))
    reach = np.linalg.norm(target[:, :2], axis=1)
    length = np.linalg.norm(np.diff(chain.points, axis=0), axis=1).sum() + 10
    target[:, :2] *= (length / reach)[:, None]
    found = Function(derivation(robot).function(task))(target)
    before = found.q.copy()
    valid = found.valid
    assert not valid.any()
    for residual in (found.residual.copy(), np.full_like(found.residual, SPOILT)):
        q = found.q.copy()
        refinement_for(robot, task)((target,), q, residual, valid)
        assert not valid.any()
        np.testing.assert_array_equal(q, before)
    assert role.components


@pytest.mark.parametrize("unit", [1e-6, 1e3])
@pytest.mark.parametrize(("robot", "task"), OFFERED)
def test_task_target_scales_with_length_unit(robot, task, unit):
    components = role_of(robot, task).components
    T = screws(robot).fk(np.random.default_rng(4).uniform(-3, 3, (100, len(screws(robot).axes))))
    target = TASKS[task].target(T)
    scaled = T.copy()
    scaled[:, :3, 3] *= unit
    divided = Task(components).divided(TASKS[task].target(scaled), unit)
    np.testing.assert_allclose(divided, target, rtol=1e-12, atol=1e-12)


def test_poses_near_right_angles_are_refined():
    seed, name = NEAR_RIGHT_ANGLES
    case = next(case for case in cases_of(random_arm(seed)) if case.function == name)
    losses = [loss for loss in losses_of(case, seed) if loss.poses == "near right angles"]
    assert losses
    for loss in losses:
        assert loss.unrefined > 0
        assert not loss.is_real, str(loss)


def test_opposite_direction_gives_no_step_and_no_solution():
    """At an angle error of pi, the error has no unique rotation axis."""
    T = np.eye(4)[None]
    J = np.random.default_rng(5).normal(size=(1, 6, 5))
    _, error, left = Task(("direction",))(T, J, -T[:, :3, 2])
    assert (error == 0).all()
    assert left == 2
