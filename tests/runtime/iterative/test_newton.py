"""Loops solved by Newton's iteration: followed from the reference, called like the rest."""

import pickle

import numpy as np
import pytest

import chasles
from chasles.iterative import newton

from .. import struts


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    folder = tmp_path_factory.mktemp("struts")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CHASLES_CACHE", str(folder / "cache"))
        yield chasles.load(struts.write(folder / "struts"))


def poses(n, seed=0):
    """Poses of the reference's branch: no singularity is on the way to them."""
    return np.random.default_rng(seed).uniform([-0.15, -0.15, -0.2], [0.15, 0.15, 0.2], (n, 3))


UNREACHABLE = np.array([0.1, 0.1, 30.0])


def test_it_finds_the_pose_that_made_q(robot):
    expected = poses(10_000)
    found = robot.follow(struts.q_of(expected))
    assert found.valid.all()
    assert found.n_failed == 0
    assert found.residual.max() < 1e-12
    np.testing.assert_allclose(found.z[:, :3], expected, atol=1e-10)
    np.testing.assert_array_equal(found.z[:, 4::2], struts.q_of(expected) / 2)


def test_functions_of_q(robot):
    expected = poses(50).reshape(5, 10, 3)
    q = struts.q_of(expected)
    np.testing.assert_allclose(robot.chain(q), expected, atol=1e-10)
    np.testing.assert_allclose(robot.fk(q), robot.chain_fk(expected), atol=1e-10)
    assert robot.passive(q).shape == (5, 10, 3)
    z = robot.configuration(q)
    np.testing.assert_array_equal(robot.passive(q), z[..., 3::2])
    assert np.abs(robot.constraint(z)).max() < 1e-12


@pytest.mark.parametrize("name", ["configuration", "chain", "passive"])
def test_derivatives_by_q(robot, name):
    q, h = struts.q_of(poses(20)), 1e-5
    function = robot.functions[name]
    slope = robot.functions[f"{name}_D_q"](q)
    for k, step in enumerate(h * np.eye(3)):
        difference = (function(q + step) - function(q - step)) / (2 * h)
        np.testing.assert_allclose(slope[..., k], difference, atol=1e-7)


def test_jacobian_is_the_chains_times_the_derivative_of_its_joints(robot):
    q = struts.q_of(poses(20))
    J = robot.jacobian_mixed(q)
    expected = robot.chain_jacobian_mixed(robot.chain(q)) @ robot.chain_D_q(q)
    np.testing.assert_allclose(J, expected, atol=1e-12)
    assert robot.jacobian_mixed(q[0]).shape == (6, 3)


def test_what_is_not_reached(robot):
    q = np.stack([UNREACHABLE, struts.q_of(np.zeros(3)), [np.nan, 1.0, 1.0]])
    found = robot.follow(q)
    np.testing.assert_array_equal(found.valid, [False, True, False])
    assert found.n_failed == 2
    np.testing.assert_array_equal(np.isnan(found.z).all(-1), [True, False, True])
    np.testing.assert_array_equal(robot.valid(q), [False, True, False])
    np.testing.assert_array_equal(np.isnan(robot.fk(q)).any((-2, -1)), [True, False, True])
    with pytest.raises(
        chasles.OutOfReachError,
        match=r"struts.fk: .* to motor1 = 0.1 rad, .*, motor3 = 30 rad: the loops do not close",
    ):
        robot.fk(UNREACHABLE)
    out = np.zeros(3)
    with pytest.raises(chasles.OutOfReachError):
        robot.chain(UNREACHABLE, out=out)
    assert np.isnan(out).all()
    assert np.isnan(robot.chain([np.nan, 1.0, 1.0])).all()


def test_branches_are_not_mixed(robot):
    # For poses on both sides of a singularity, solutions stay on the side of the reference.
    spread = poses(5000) * 3
    found = robot.follow(struts.q_of(spread))
    assert 4000 < found.valid.sum() < 5000

    def side(z):
        return np.linalg.det(robot.constraint_D_z(z)[..., :6, [0, 1, 2, 3, 5, 7]]) > 0

    z = found.z[found.valid]
    assert (side(z) == side(robot.configuration(robot.reference.q))).all()
    assert (np.abs(z[:, :3] - spread[found.valid]).max(-1) > 1e-3).any()


def test_calls(robot):
    q = struts.q_of(poses(4)).reshape(2, 2, 3)
    out = np.empty((2, 2, 4, 4))
    assert robot.fk(q, out=out, threads="all") is out
    np.testing.assert_array_equal(out, robot.fk(q=q))
    np.testing.assert_allclose(robot.fk(q[0, 0].tolist()), out[0, 0], atol=1e-12)
    assert robot.fk(q[:0]).shape == (0, 2, 4, 4)
    with pytest.raises(chasles.ShapeError, match=r"struts.fk: q must end in 3 values .* \(2,\)"):
        robot.fk([1.0, 2.0])
    with pytest.raises(chasles.ShapeError, match=r"out for T must have shape \(2, 2, 4, 4\)"):
        robot.fk(q, out=np.empty((4, 4)))
    with pytest.raises(chasles.InputError, match="writable float64"):
        robot.fk(q, out=np.empty((2, 2, 4, 4), np.float32))
    with pytest.raises(chasles.InputError, match="real numbers, got dtype complex"):
        robot.fk(q * 1j)
    with pytest.raises(chasles.InputError, match="cannot be read"):
        robot.fk([[1.0], [2.0, 3.0]])


def test_help_and_pickle(robot):
    assert "by Newton's iteration on the generated constraints" in robot.fk.__doc__
    assert "chain_fk of it" in robot.fk.__doc__
    assert list(robot.fk.__signature__.parameters) == ["q", "out", "threads"]
    assert robot.functions["fk"] is robot.fk
    q = struts.q_of([0.1, 0.1, 0.1])
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(robot.fk))(q), robot.fk(q))
    assert pickle.loads(pickle.dumps(robot)) == robot


def test_singular_systems_in_a_batch_are_solved_in_least_squares():
    J = np.stack([np.eye(2), np.ones((2, 2))])
    x = newton._least_squares(J, np.ones((2, 2, 1)))
    np.testing.assert_allclose(x[..., 0], [[1, 1], [0.5, 0.5]])
