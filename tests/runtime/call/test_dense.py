"""Batches of dense arrays bypass the NumPy ufunc.

Results, shapes and errors of dense batches are the same as with the ufunc.
"""

import numpy as np
import pytest

import chasles


@pytest.fixture(params=["lanes", "plain"])
def function(request, robot):
    """Return a robot function with vector code or with scalar code, depending on the parameter."""
    return chasles.load("ur5e").fk if request.param == "lanes" else robot.fk


def rows(function, *batch):
    (width,) = function.inputs[0].shape
    return np.random.default_rng(3).uniform(-3, 3, (*batch, width))


@pytest.mark.parametrize(
    "batch", [(0,), (1,), (2,), (9,), (40,), (3, 5), (2, 1, 4), (0, 7), (7, 0)], ids=str
)
def test_dense_batches_equal_ufunc_results(function, batch):
    q = rows(function, *batch)
    found = function(q)
    assert found.shape == (*batch, *function.outputs[0].shape)
    np.testing.assert_array_equal(found, function.ufunc(q))


def test_dense_calls_with_several_inputs_and_outputs_equal_ufunc():
    robot = chasles.load("ur5e")
    q, qd = rows(robot.fk, 21), rows(robot.fk, 21)
    np.testing.assert_array_equal(robot.twist_mixed(q, qd), robot.twist_mixed.ufunc(q, qd))
    for found, expected in zip(
        robot.fk_jacobian_mixed(q), robot.fk_jacobian_mixed.ufunc(q), strict=True
    ):
        np.testing.assert_array_equal(found, expected)
    # The ufunc broadcasts different leading shapes.
    assert robot.twist_mixed(q, qd[0]).shape == (21, 6)
    assert robot.twist_mixed(q.reshape(3, 7, 6), qd[:7]).shape == (3, 7, 6)


def test_wrong_core_dimensions_are_rejected_in_dense_path(function):
    q = rows(function, 4)
    with pytest.raises(chasles.ShapeError, match="must end in"):
        function(q[:, :-1].copy())
    with pytest.raises(chasles.ShapeError, match="must end in"):
        function(np.zeros((4, q.shape[1] + 1)))


def test_read_only_and_subclassed_inputs_are_accepted(function):
    q = rows(function, 5)
    expected = function(q)
    q.flags.writeable = False
    np.testing.assert_array_equal(function(q), expected)

    class Mine(np.ndarray):
        """Imitates an array type of another package."""

    np.testing.assert_array_equal(np.asarray(function(q.view(Mine))), expected)
