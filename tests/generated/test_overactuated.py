"""Platforms with redundant actuators: legs, rates, forces and least-squares poses."""

import numpy as np
import pytest

from chasles import MissingFunctionError
from chasles.derive.loops.iterated.closure_equations import on_balls
from tests.support.compiling import compiled
from tests.support.generators.overactuated_platforms import PLATFORMS, drawn_overactuated
from tests.support.loops.closures import Model

POSES, STEP = 50, 1e-6
EXACT = ("actuators", "actuator_rates", "chain_fk", "chain_jacobian_mixed", "chain_twist_mixed")
EXACT += ("velocity_relation", "ik")
LEAST = ("fk", "chain", "margin", "actuators", "chain_fk", "chain_jacobian_mixed")
LEAST += ("velocity_relation", "jacobian_mixed")


@pytest.fixture(scope="module", params=PLATFORMS)
def exact(request, tmp_path_factory):
    """Return a platform with redundant actuators, and its numeric model."""
    return platform(tmp_path_factory, drawn_overactuated(request.param, 2), EXACT)


@pytest.fixture(scope="module", params=PLATFORMS)
def least(request, tmp_path_factory):
    """Return a platform with least-squares closure, and its numeric model."""
    mechanism = drawn_overactuated(request.param, 3, closure="least squares")
    return platform(tmp_path_factory, mechanism, LEAST)


def platform(tmp_path_factory, mechanism, functions):
    """Return a compiled platform and its numeric model.

    The numeric model of the platform has no swing angles.
    """
    robot = compiled(mechanism, tmp_path_factory.mktemp("platform") / "spare", functions, ["c"])
    return robot, Model(on_balls(mechanism))


def poses_near(robot, seed=0, reach=0.1):
    """Return main-chain joint values (N, n_theta) near the reference values, which are 0."""
    return np.random.default_rng(seed).uniform(-reach, reach, (POSES, len(robot.chain_joints)))


def free_directions(robot, theta):
    """Return the indices of the twist components that the main chain can change."""
    return np.flatnonzero(np.abs(robot.chain_jacobian_mixed(theta)).max((0, -1)) > 0)


def test_actuators_close_the_loops(exact):
    robot, model = exact
    theta = poses_near(robot)
    q = robot.actuators(theta)
    assert robot.n > robot.dof
    z = np.zeros((POSES, len(model.names)))
    z[:, model.chain], z[:, model.actuated] = theta, q
    assert model.gap(z).max() < 1e-12


def test_inverse_returns_the_actuators_of_a_pose(exact):
    robot, _ = exact
    theta = poses_near(robot)
    found = robot.ik(robot.chain_fk(theta))
    own = np.abs(found.q - robot.actuators(theta)[:, None]).max(-1) < 1e-9
    assert (own & found.valid).any(-1).all()


def test_rates_are_the_difference_quotient(exact):
    robot, _ = exact
    theta = poses_near(robot)
    thetad = np.random.default_rng(1).uniform(-1, 1, theta.shape)
    ahead, behind = (robot.actuators(theta + h * thetad) for h in (STEP, -STEP))
    rates = robot.actuator_rates(theta, thetad)
    np.testing.assert_allclose(rates, (ahead - behind) / (2 * STEP), atol=1e-8)


def test_forces_of_the_legs_do_the_work_of_their_wrench(exact):
    """With J_x x' = J_q q', the matrix J_x^T J_q^-T maps actuator forces to the tool wrench."""
    robot, _ = exact
    theta = poses_near(robot)
    thetad = np.random.default_rng(2).uniform(-1, 1, theta.shape)
    q, forces = robot.actuators(theta), np.random.default_rng(3).uniform(0, 100, (POSES, robot.n))
    J_x, J_q = robot.functions["velocity_relation"](theta, q)
    tensions = np.linalg.solve(J_q.mT, forces[..., None])
    wrench = (J_x.mT @ tensions)[..., 0]
    twist = robot.chain_twist_mixed(theta, thetad)[:, free_directions(robot, theta)]
    power = (forces * robot.actuator_rates(theta, thetad)).sum(-1)
    np.testing.assert_allclose((wrench * twist).sum(-1), power, atol=1e-10)


def test_missing_forward_kinematics_names_least_squares(exact):
    robot, _ = exact
    with pytest.raises(MissingFunctionError, match=r"outnumber its freedoms; closure = .least squ"):
        _ = robot.fk


def test_consistent_actuators_return_their_pose(least):
    robot, _ = least
    theta = poses_near(robot)
    T = robot.chain_fk(theta)
    np.testing.assert_allclose(robot.fk(robot.actuators(theta)), T, atol=1e-9)


def test_inconsistent_actuators_return_the_pose_of_least_gaps(least):
    """At the returned pose, the squared closure gaps of a NumPy model have gradient 0."""
    robot, model = least
    rng = np.random.default_rng(4)
    q = robot.actuators(poses_near(robot)) + rng.uniform(-1e-3, 1e-3, (POSES, robot.n))
    z = np.zeros((POSES, len(model.names)))
    z[:, model.chain], z[:, model.actuated] = robot.chain(q), q
    gaps, J = model.gaps(z), model.D_z(z)[..., model.chain]
    assert np.abs(gaps).max() > 1e-4
    gradient = (J.mT @ gaps[..., None])[..., 0]
    assert np.abs(gradient).max() < 1e-5


def test_least_squares_forces_have_the_smallest_rod_forces_that_hold_a_wrench(least):
    robot, _ = least
    theta = poses_near(robot)
    q = robot.actuators(theta)
    wrench = np.random.default_rng(5).uniform(-10, 10, (POSES, 6))
    J_x, J_q = robot.functions["velocity_relation"](theta, q)
    held = wrench[:, free_directions(robot, theta)]
    rods = np.linalg.pinv(J_x.mT) @ held[..., None]
    forces = (J_q.mT @ rods)[..., 0]
    np.testing.assert_allclose(robot.actuator_forces(q, wrench), forces, atol=1e-6)
