"""Functions accept dask arrays and return lazy results of the right shape, for all schedulers."""

import pickle
import re
import subprocess
import sys

import numpy as np
import pytest

import chasles
from tests.support.optional import OptionalPackage

array = OptionalPackage("dask.array")
dask = OptionalPackage("dask")

RNG = np.random.default_rng(21)
Q = RNG.normal(size=(10, 2))
A = RNG.normal(size=(3, 1, 2, 3))


def lazy(values, *chunks):
    return array.from_array(values, chunks=chunks)


def check(result, expected, chunks=None):
    """Check that a lazy result knows its dtype and shape, and that its values are right."""
    assert isinstance(result, array.Array)
    assert result.shape == expected.shape
    assert result.dtype == np.float64
    assert isinstance(result._meta, np.ndarray)
    if chunks is not None:
        assert result.chunks == chunks
    computed = result.compute(scheduler="threads")
    assert computed.shape == expected.shape
    np.testing.assert_array_equal(computed, expected)


def test_single_dask_input_matches_numpy(robot):
    check(robot.fk(lazy(Q, 4, 2)), robot.fk(Q), ((4, 4, 2), (3,), (4,)))


def test_dask_results_stay_lazy_until_compute(robot):
    def fail(block):
        raise AssertionError("computed")

    unread = lazy(Q, 4, 2).map_blocks(fail, meta=np.empty((0, 0)))
    result = robot.fk(unread)
    assert result.shape == (10, 3, 4)
    with pytest.raises(AssertionError, match="computed"):
        result.compute(scheduler="sync")


def test_single_pose_and_empty_batch_work_with_dask(robot):
    check(robot.fk(lazy(Q[0], 2)), robot.fk(Q[0]), ((3,), (4,)))
    check(robot.fk(lazy(Q[:0], 1, 2)), robot.fk(Q[:0]))


def test_chunked_core_dimensions_are_merged(robot):
    check(robot.fk(lazy(Q, 4, 1)), robot.fk(Q))
    expected = robot.wide(np.ones((2, 40, 40)))
    check(robot.wide(lazy(np.ones((2, 40, 40)), 1, 20, 7)), expected)


def test_several_dask_inputs_match_numpy(robot):
    a = RNG.normal(size=(10, 2, 3))
    expected = robot.blend(Q, a)
    check(robot.blend(lazy(Q, 4, 2), lazy(a, 4, 2, 3)), expected, ((4, 4, 2), (2,)))
    check(robot.blend(lazy(Q, 4, 2), lazy(a, 3, 2, 3)), expected)
    check(robot.blend(A=lazy(a, 5, 2, 3), q=lazy(Q, 10, 2)), expected)


@pytest.mark.parametrize("q", [Q, lazy(Q, 4, 2)], ids=["numpy", "dask"])
@pytest.mark.parametrize("a", [A, lazy(A, 2, 1, 2, 3)], ids=["numpy", "dask"])
def test_leading_dimensions_broadcast(robot, q, a):
    result = robot.blend(q, a)
    expected = robot.blend(Q, A)
    assert expected.shape == (3, 10, 2)
    if isinstance(result, np.ndarray):
        np.testing.assert_array_equal(result, expected)
    else:
        check(result, expected)


def test_lists_and_numbers_combine_with_dask_arrays(robot):
    check(robot.blend(lazy(Q, 4, 2), A[0, 0].tolist()), robot.blend(Q, A[0, 0]))
    check(robot.distance(2, lazy(Q, 4, 2)), robot.distance(2, Q), ((4, 4, 2),))
    check(robot.distance(lazy(Q[:, 0], 4), [3, 4]), robot.distance(Q[:, 0], [3, 4]))


def test_several_outputs_are_lazy_tuple(robot):
    result = robot.fused(lazy(Q, 4, 2))
    assert type(result) is tuple
    for got, expected in zip(result, robot.fused(Q), strict=True):
        check(got, expected)
    computed = dask.compute(*result, scheduler="sync")
    np.testing.assert_array_equal(computed[1], robot.fused(Q)[1])


@pytest.mark.parametrize(
    "dtype", [np.float32, np.int64, np.uint8], ids=lambda dtype: np.dtype(dtype).name
)
def test_real_dtypes_give_float64(robot, dtype):
    q = np.arange(8).reshape(4, 2).astype(dtype)
    check(robot.fk(lazy(q, 2, 2)), robot.fk(q))


def test_unknown_chunk_sizes_are_supported(robot):
    chosen = lazy(Q, 4, 2)[lazy(Q[:, 0], 4) > 0]
    result = robot.fk(chosen)
    assert np.isnan(result.shape[0])
    np.testing.assert_array_equal(result.compute(scheduler="sync"), robot.fk(Q[Q[:, 0] > 0]))
    both = robot.blend(chosen, A[0, 0])
    assert both.compute(scheduler="sync").shape == (np.sum(Q[:, 0] > 0), 2)


def test_lazy_result_composes_in_dask_graph(robot):
    positions = robot.fk(lazy(Q, 4, 2))[:, :, 3]
    highest = positions[:, 2].max()
    assert highest.compute(scheduler="threads") == robot.fk(Q)[:, 2, 3].max()


def test_explicit_apply_gufunc_matches_numpy(robot):
    result = array.apply_gufunc(
        robot.fk,
        "(n)->(i,j)",
        lazy(Q, 4, 2),
        output_dtypes=float,
        output_sizes={"i": 3, "j": 4},
    )
    check(result, robot.fk(Q))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda r: (r.fk, np.ones(5)), "q must end in 2 values (shape (..., 2)), got shape (5,)"),
        (lambda r: (r.blend, Q, A[..., :2]), "A must end in 2 x 3 values (shape (..., 2, 3)), got"),
        (lambda r: (r.blend, Q[:4], A[:, [0, 0]]), "leading dimensions do not broadcast: A has"),
        (lambda r: (r.fk, Q > 0), "q must hold real numbers, got dtype bool"),
        (lambda r: (r.fk, Q * 1j), "q must hold real numbers, got dtype complex128"),
    ],
    ids=["wrong size", "wrong core", "no broadcast", "bool", "complex"],
)
def test_dask_errors_match_numpy_errors_and_are_immediate(robot, call, message):
    function, *inputs = call(robot)
    with pytest.raises(chasles.ChaslesError, match=re.escape(message)) as plain:
        function(*inputs)
    with pytest.raises(type(plain.value), match=f"^{re.escape(str(plain.value))}$"):
        function(*(array.from_array(item, chunks=-1) for item in inputs))


def test_out_and_threads_are_rejected_for_dask(robot):
    q = lazy(Q, 4, 2)
    refused = r"tiny.fk: lazy dask arrays do not support out; omit this argument"
    with pytest.raises(chasles.InputError, match=refused):
        robot.fk(q, out=np.empty((10, 3, 4)))
    with pytest.raises(chasles.InputError, match=refused):
        robot.fk(Q, out=array.empty((10, 3, 4)))
    with pytest.raises(chasles.InputError, match=r"tiny.fk: threads splits NumPy arrays"):
        robot.fk(q, threads=2)
    check(robot.fk(q, threads=1), robot.fk(Q))
    with pytest.raises(chasles.InputError, match="A cannot be read as an array of numbers"):
        robot.blend(q, [[1], [1, 2]])


def test_mixed_array_protocols_dispatch_to_ufunc(robot):
    class Other:
        def __array_ufunc__(self, ufunc, method, *inputs, **kwargs):
            return ufunc, len(inputs)

    assert robot.blend(Other(), lazy(A, 1, 1, 2, 3)) == (robot.blend.ufunc, 2)


def test_dask_process_scheduler_gives_equal_results():
    """Only the function's name and hash are pickled.

    The worker process loads the robot from its installation.
    """
    arm = chasles.load("ur5e")
    q = np.random.default_rng(0).normal(size=(100, 6))
    results = arm.fk_jacobian_mixed(lazy(q, 40, 6))
    computed = dask.compute(*results, scheduler="processes", num_workers=1)
    for got, expected in zip(computed, arm.fk_jacobian_mixed(q), strict=True):
        np.testing.assert_array_equal(got, expected)


def test_repeated_unpickling_returns_same_function(robot):
    again = pickle.loads(pickle.dumps(robot.fk))
    assert pickle.loads(pickle.dumps(robot.fk)) is again


def test_the_package_does_not_import_dask():
    code = """
import sys
import numpy as np
import chasles

class Other:
    def __array_ufunc__(self, ufunc, method, *inputs, **kwargs):
        return inputs

arm = chasles.load("ur5e")
assert len(arm.fk(Other())) == 1
assert "dask" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", code], check=True)
