"""Tests arguments of all shapes and types.

Each call either gives the same results as single calls or raises a clear error.
"""

import re
import threading
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import chasles
from chasles import derive
from tests.support.handwritten import tiny
from tests.support.leaks import assert_no_leaks

Q = np.array([0.3, -1.2])
finite = st.floats(-1e3, 1e3)
batches = hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=3)


def loop(function, core, *inputs):
    batch = np.broadcast_shapes(*(x.shape[: x.ndim - n] for x, n in zip(inputs, core, strict=True)))
    full = [
        np.broadcast_to(x, batch + x.shape[x.ndim - n :]) for x, n in zip(inputs, core, strict=True)
    ]
    results = [function(*(x[index] for x in full)) for index in np.ndindex(batch)]
    return batch, np.array(results)


@settings(max_examples=40)
@given(st.data())
def test_batch_equals_loop_over_single_poses(robot, data):
    q = data.draw(batches.flatmap(lambda b: hnp.arrays(np.float64, (*b, 2), elements=finite)))
    batch, expected = loop(tiny.fk, [1], q)
    result = robot.fk(q)
    assert result.shape == (*batch, 3, 4)
    assert result.dtype == np.float64
    # Terms may cancel in a sum, so that only their rounding errors remain.
    rounding = np.finfo(np.float64).eps * (1 + np.abs(q).max(initial=0))
    np.testing.assert_allclose(result, expected.reshape(result.shape), rtol=1e-13, atol=rounding)


@settings(max_examples=40)
@given(st.data())
def test_leading_dimensions_broadcast(robot, data):
    shapes = data.draw(hnp.mutually_broadcastable_shapes(num_shapes=2, max_dims=3, max_side=3))
    q_batch, a_batch = shapes.input_shapes
    q = data.draw(hnp.arrays(np.float64, (*q_batch, 2), elements=finite))
    a = data.draw(hnp.arrays(np.float64, (*a_batch, 2, 3), elements=finite))
    batch, expected = loop(tiny.blend, [1, 2], q, a)
    result = robot.blend(q, a)
    assert result.shape == (*batch, 2)
    np.testing.assert_allclose(result, expected.reshape(result.shape), rtol=1e-12, atol=1e-9)


LAYOUTS = {
    "C": lambda a: a,
    "fortran": np.asfortranarray,
    "negative strides": lambda a: np.ascontiguousarray(a[..., ::-1])[..., ::-1],
    "reversed batch": lambda a: np.ascontiguousarray(a[::-1])[::-1],
    "gaps": lambda a: np.repeat(a, 3, axis=-1)[..., ::3],
    "transposed": lambda a: np.ascontiguousarray(np.moveaxis(a, -1, 0)).transpose(1, 2, 3, 0),
    "byte order": lambda a: a.astype(a.dtype.newbyteorder()),
    "unaligned": lambda a: np.frombuffer(b"x" + a.tobytes(), a.dtype, offset=1).reshape(a.shape),
    "read-only": lambda a: np.frombuffer(a.tobytes(), a.dtype).reshape(a.shape),
    "subclass": np.rec.array,
    "list": lambda a: a.tolist(),
    "tuple": lambda a: tuple(a.tolist()),
}


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("single", [False, True])
def test_memory_layout_does_not_matter(robot, layout, single):
    rng = np.random.default_rng(1)
    a = rng.normal(size=(4, 5, 2, 3))
    arranged = LAYOUTS[layout](a)
    if layout not in ("list", "tuple"):
        np.testing.assert_array_equal(np.asarray(arranged), a)
    if single:
        a, arranged = a[2][1], arranged[2][1]
    np.testing.assert_array_equal(robot.blend(Q, arranged), robot.blend(Q, a))


@pytest.mark.parametrize(
    "dtype",
    [np.float32, np.float16, np.longdouble, int, np.int8, np.uint64],
    ids=lambda dtype: np.dtype(dtype).name,
)
def test_real_dtypes_are_converted(robot, dtype):
    q = np.arange(8).reshape(4, 2)
    np.testing.assert_array_equal(robot.fk(q.astype(dtype)), robot.fk(q.astype(float)))
    np.testing.assert_array_equal(robot.fk(q[0].astype(dtype)), robot.fk(q[0].astype(float)))


def test_large_strided_core_is_computed_correctly(robot):
    w = np.random.default_rng(2).normal(size=(3, 40, 40))
    strided = np.asfortranarray(w)
    out = np.empty((3, 40, 80))[..., ::2]
    assert robot.wide(strided, out=out) is out
    np.testing.assert_array_equal(out, 2 * w[:, ::-1, ::-1])


def test_scalar_functions_accept_and_return_scalars(robot):
    single = robot.distance(2, [3, 4])
    assert isinstance(single, np.float64)
    assert single == 10
    assert robot.distance(2.0, np.array([3.0, 4.0])) == 10
    assert isinstance(robot.distance(np.array(2.0), np.array([3.0, 4.0])), np.float64)
    np.testing.assert_array_equal(robot.distance([1, 2, 3], [3, 4]), [5, 10, 15])
    out = np.empty(())
    assert robot.distance(2, [3, 4], out=out) is out
    assert out == 10


def test_inputs_are_accepted_as_keywords(robot):
    a = np.ones((2, 3))
    expected = robot.blend(Q, a)
    np.testing.assert_array_equal(robot.blend(A=a, q=Q), expected)
    np.testing.assert_array_equal(robot.blend(Q, A=a, out=None), expected)


def test_several_outputs_are_returned_as_tuple(robot):
    for q in (Q, np.stack([Q, 2 * Q])):
        result = robot.fused(q)
        assert type(result) is tuple
        pose, jacobian = result
        np.testing.assert_array_equal(pose, robot.fk(q))
        np.testing.assert_array_equal(jacobian[..., 1, 0], q[..., 0] * q[..., 1])


# ------------------------------------------------------------------ out=


@pytest.mark.parametrize("batch", [(), (3,), (0,), (2, 3)], ids=str)
@pytest.mark.parametrize(
    "make",
    [
        np.empty,
        lambda shape: np.empty(shape, order="F"),
        lambda shape: np.empty((*shape[:-1], 2 * shape[-1]))[..., ::-2],
    ],
    ids=["C", "fortran", "strided"],
)
@pytest.mark.parametrize("as_tuple", [False, True])
def test_out_receives_and_returns_single_output(robot, batch, make, as_tuple):
    q = np.random.default_rng(3).normal(size=(*batch, 2))
    out = make((*batch, 3, 4))
    assert robot.fk(q, out=(out,) if as_tuple else out) is out
    np.testing.assert_array_equal(out, robot.fk(q))


@pytest.mark.parametrize("batch", [(), (3,)], ids=str)
def test_out_tuple_receives_several_outputs(robot, batch):
    q = np.random.default_rng(4).normal(size=(*batch, 2))
    pose, jacobian = np.empty((*batch, 3, 4)), np.empty((*batch, 2, 2))
    result = robot.fused(q, out=(pose, jacobian))
    assert result[0] is pose
    assert result[1] is jacobian
    result = robot.fused(q, out=(None, jacobian))
    assert result[0] is not pose
    assert result[1] is jacobian
    for got, expected in zip(result, robot.fused(q), strict=True):
        np.testing.assert_array_equal(got, expected)


def test_out_has_the_broadcast_shape(robot):
    rng = np.random.default_rng(11)
    q, a, out = rng.normal(size=(3, 2)), rng.normal(size=(4, 1, 2, 3)), np.empty((4, 3, 2))
    assert robot.blend(q, a, out=out) is out
    np.testing.assert_array_equal(out, robot.blend(q, a))
    assert robot.blend(q, a[:1], out=out[:1]).shape == (1, 3, 2)
    with pytest.raises(chasles.ShapeError, match=re.escape("must have shape (4, 3, 2)")):
        robot.blend(q, a, out=out[:1])


def test_outs_may_be_views_of_shared_buffer(robot):
    buffer = np.zeros((3, 16))
    pose, jacobian = buffer[:, :12].reshape(3, 3, 4), buffer[:, 12:].reshape(3, 2, 2)
    assert np.shares_memory(pose, buffer)
    q = np.random.default_rng(5).normal(size=(3, 2))
    robot.fused(q, out=(pose, jacobian))
    np.testing.assert_array_equal(pose, robot.fk(q))
    np.testing.assert_array_equal(jacobian[:, 0], q)


@pytest.mark.parametrize("shift", range(-2, 13))
@pytest.mark.parametrize("batch", [(), (1,), (3,)], ids=str)
def test_out_may_overlap_inputs(robot, shift, batch):
    n = int(np.prod(batch, dtype=int))
    buffer = np.random.default_rng(6).normal(size=60)
    q = buffer[4 : 4 + 2 * n].reshape(*batch, 2)
    out = buffer[4 + shift : 4 + shift + 12 * n].reshape(*batch, 3, 4)
    expected = robot.fk(q.copy())
    np.testing.assert_array_equal(robot.fk(q, out=out), expected)


def test_out_may_be_the_input_itself(robot):
    for batch in ((), (3,)):
        q = np.random.default_rng(7).normal(size=(*batch, 2))
        a = np.random.default_rng(8).normal(size=(*batch, 2, 3))
        expected = robot.blend(q.copy(), a)
        same = q.copy()
        np.testing.assert_array_equal(robot.blend.ufunc(same, a, out=same), expected)
        assert robot.blend(q, a, out=q) is q
        np.testing.assert_array_equal(q, expected)


def test_overlapping_outs_write_only_inside_their_buffers(robot):
    buffer = np.zeros(20)
    robot.fused(Q, out=(buffer[:12].reshape(3, 4), buffer[10:14].reshape(2, 2)))
    np.testing.assert_array_equal(buffer[:10], robot.fk(Q).ravel()[:10])
    assert not buffer[14:].any()


# --------------------------------------------------------- NaN, warnings


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("batch", [(), (5,)], ids=str)
def test_non_finite_inputs_propagate_without_warning(robot, bad, batch):
    q = np.zeros((*batch, 2))
    q[..., 0] = bad
    with warnings.catch_warnings(), np.errstate(all="raise"):
        warnings.simplefilter("error")
        assert np.isnan(robot.fk(q)).all()
        jacobian = robot.fused(q)[1]
        np.testing.assert_array_equal(jacobian[..., 1, 1], np.ones(batch))
        np.testing.assert_array_equal(jacobian[..., 0, 0], q[..., 0])
        robot.fk(q)
        assert np.add(1.0, 2.0) == 3


# ---------------------------------------------------------------- errors


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda r: r.fk(np.ones(5)),
            "tiny.fk: q must end in 2 values (shape (..., 2)), got shape (5,)",
        ),
        (lambda r: r.fk(1.0), "tiny.fk: q must end in 2 values (shape (..., 2)), got shape ()"),
        (lambda r: r.fk([]), "tiny.fk: q must end in 2 values (shape (..., 2)), got shape (0,)"),
        (
            lambda r: r.blend(Q, np.ones((7, 3, 2))),
            "tiny.blend: A must end in 2 x 3 values (shape (..., 2, 3)), got shape (7, 3, 2)",
        ),
        (
            lambda r: r.blend(np.ones((3, 2)), np.ones((4, 2, 3))),
            "tiny.blend: leading dimensions do not broadcast: A has (4,), "
            "the inputs before it have (3,)",
        ),
        (
            lambda r: r.fk(np.ones((5, 2)), out=np.empty((3, 4))),
            "tiny.fk: out for T must have shape (5, 3, 4), got shape (3, 4)",
        ),
        (
            lambda r: r.fk(Q, out=np.empty((1, 3, 4))),
            "tiny.fk: out for T must have shape (3, 4), got shape (1, 3, 4)",
        ),
    ],
    ids=[
        "vector",
        "scalar",
        "empty list",
        "transposed core",
        "no broadcast",
        "small out",
        "extra out dimension",
    ],
)
def test_wrong_shape_raises_shape_error(robot, call, message):
    with pytest.raises(chasles.ShapeError, match=f"^{re.escape(message)}$"):
        call(robot)
    assert issubclass(chasles.ShapeError, ValueError)


def _read_only():
    array = np.empty((3, 4))
    array.flags.writeable = False
    return array


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda r: r.fk("ab"), "tiny.fk: q must hold real numbers, got dtype <U2"),
        (lambda r: r.fk(["1", "2"]), "tiny.fk: q must hold real numbers, got dtype <U1"),
        (lambda r: r.fk(b"ab"), "tiny.fk: q must hold real numbers, got dtype |S2"),
        (lambda r: r.fk([1j, 2]), "tiny.fk: q must hold real numbers, got dtype complex128"),
        (lambda r: r.fk([True, False]), "tiny.fk: q must hold real numbers, got dtype bool"),
        (lambda r: r.fk(None), "tiny.fk: q must hold real numbers, got dtype object"),
        (lambda r: r.fk([1, object()]), "tiny.fk: q must hold real numbers, got dtype object"),
        (
            lambda r: r.fk(np.array([1, 2], "m8[s]")),
            "tiny.fk: q must hold real numbers, got dtype timedelta64[s]",
        ),
        (lambda r: r.fk(np.zeros(2, "i4,f8")), "tiny.fk: q must hold real numbers, got dtype "),
        (lambda r: r.fk([[1, 2], [3]]), "tiny.fk: q cannot be read as an array of numbers: "),
        (lambda r: r.fk(), "tiny.fk: takes 1 input (q), got 0"),
        (lambda r: r.fk(Q, Q), "tiny.fk: takes 1 input (q), got 2"),
        (lambda r: r.blend(Q), "tiny.blend: takes 2 inputs (q, A), got 1"),
        (lambda r: r.blend(Q, Q, np.empty(2)), "tiny.blend: takes 2 inputs (q, A), got 3"),
        (lambda r: r.fk(Q, q=Q), "tiny.fk: q is given twice"),
        (
            lambda r: r.fk(Q, where=True),
            "tiny.fk: unknown argument 'where'; it takes q, out, threads",
        ),
        (lambda r: r.fk(Q, out=[1.0]), "tiny.fk: out for T must be a NumPy array, got list"),
        (
            lambda r: r.fk(Q, out=np.empty((3, 4), np.float32)),
            "tiny.fk: out for T must have dtype float64, got float32",
        ),
        (
            lambda r: r.fk(Q, out=np.empty((3, 4), ">f8")),
            "tiny.fk: out for T must have dtype float64, got >f8",
        ),
        (lambda r: r.fk(Q, out=_read_only()), "tiny.fk: out for T is read-only"),
        (lambda r: r.fk(Q, out=(1, 2)), "tiny.fk: out must be an array, or a tuple of 1, one for "),
        (lambda r: r.fused(Q, out=np.empty(2)), "tiny.fused: out must be a tuple of 2, one for "),
        (lambda r: r.fused(Q, out=()), "tiny.fused: out must be a tuple of 2, one for each output"),
    ],
    ids=[
        "text",
        "numeric text",
        "bytes",
        "complex",
        "bool",
        "None",
        "object",
        "timedelta",
        "structured",
        "ragged list",
        "no input",
        "extra input",
        "missing second input",
        "extra third input",
        "input twice",
        "unknown keyword",
        "list as out",
        "float32 out",
        "big-endian out",
        "read-only out",
        "out of wrong length",
        "single out for two",
        "empty out",
    ],
)
def test_wrong_argument_raises_input_type_error(robot, call, message):
    with pytest.raises(chasles.InputTypeError, match=f"^{re.escape(message)}"):
        call(robot)
    assert issubclass(chasles.InputTypeError, TypeError)
    assert issubclass(chasles.InputTypeError, chasles.InputError)
    assert not issubclass(chasles.InputTypeError, ValueError)


def test_exceptions_raised_by_argument_propagate(robot):
    class Broken:
        def __array__(self, dtype=None, copy=None):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        robot.fk(Broken())
    with pytest.raises(chasles.InputError) as caught:
        robot.fk([[1, 2], [3]])
    assert isinstance(caught.value.__cause__, ValueError)


def test_any_object_is_rejected_or_computed(robot):
    weird = [object(), {}, {1, 2}, (), [[]], range(2), "", b"", lambda: 0, np, type, 10**400, ...]
    weird += [np.ma.array([1.0, 2.0]), memoryview(b"ab"), iter([1, 2]), np.array(None), np.nan]
    for value in weird:
        for call in (robot.fk, lambda v: robot.fk(Q, out=v), lambda v: robot.fused(Q, out=(v, v))):
            try:
                call(value)
            except (chasles.ChaslesError, OverflowError):
                continue
    assert robot.fk(range(2)).shape == (3, 4)


# ------------------------------------------------- ufunc, threads, memory


def test_function_exposes_ufunc_with_signature(robot):
    assert isinstance(robot.blend.ufunc, np.ufunc)
    assert robot.blend.ufunc.signature == "(2),(2,3)->(2)"
    assert robot.distance.ufunc.signature == "(),(2)->()"
    assert robot.fused.ufunc.signature == "(2)->(3,4),(2,2)"
    assert robot.fk.ufunc.__name__ == "fk"
    q = np.stack([Q, 2 * Q, 3 * Q])
    np.testing.assert_array_equal(robot.fk.ufunc(q.T, axes=[0, (1, 2)]), robot.fk(q))


def test_array_ufunc_override_is_dispatched(robot):
    class Lazy:
        def __array_ufunc__(self, ufunc, method, *inputs, **kwargs):
            return ufunc, method, inputs, kwargs

    lazy, out = Lazy(), np.empty(2)
    assert robot.blend(Q, lazy, out=out) == (
        robot.blend.ufunc,
        "__call__",
        (Q, lazy),
        {"out": (out,)},
    )
    assert robot.fk(Q, out=lazy)[3] == {"out": (lazy,)}


def test_apply_gufunc_on_dask_matches_numpy(robot):
    array = pytest.importorskip("dask.array")
    q = np.random.default_rng(9).normal(size=(10, 2))
    lazy = array.apply_gufunc(
        robot.fk,
        "(n)->(i,j)",
        array.from_array(q, chunks=(4, 2)),
        output_dtypes=float,
        output_sizes={"i": 3, "j": 4},
    )
    np.testing.assert_array_equal(lazy.compute(scheduler="threads"), robot.fk(q))


def test_concurrent_calls_give_single_thread_results(robot):
    q = np.random.default_rng(10).normal(size=(2000, 2))
    expected = robot.fk(q)
    failures = []

    def work(seed):
        order = np.random.default_rng(seed).permutation(len(q))
        for i in order[:300]:
            if not np.array_equal(robot.fk(q[i]), expected[i]):
                failures.append(i)
        for _ in range(5):
            if not np.array_equal(robot.fk(q[order]), expected[order]):
                failures.append(seed)

    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failures


def refused(function, *inputs, **keywords):
    with pytest.raises(chasles.ChaslesError):
        function(*inputs, **keywords)


def test_calls_leak_no_references_or_memory(robot, few_objects):
    q, out, strided = Q.copy(), np.empty((3, 4)), np.zeros(4)[::2]
    batch, bad = np.zeros((3, 2)), np.zeros(5)
    one, three = np.empty((3, 4)), np.empty((3, 3, 4))
    calls = [
        lambda: robot.fk(q),
        lambda: robot.fk(q, out=out),
        lambda: robot.fk(q=strided, out=(one,)),
        lambda: robot.fk(batch, out=three),
        lambda: robot.fk([1, 2]),
        lambda: robot.fused(q, out=(None, None)),
        lambda: robot.distance(1.0, batch),
        lambda: refused(robot.fk, bad),
        lambda: refused(robot.fk, "ab"),
        lambda: refused(robot.fk, [[1], [1, 2]]),
        lambda: refused(robot.fk, batch, out=out),
    ]
    watched = [q, out, strided, batch, bad, one, three, robot.fk, robot.fk.ufunc]
    assert_no_leaks(calls, watched)


def test_errors_form_one_tree_with_built_in_classes():
    kernel = (
        "CompilerNotFoundError",
        "CompileError",
        "CacheError",
        "ManifestError",
        "MismatchError",
    )
    assert all(issubclass(getattr(chasles, name), chasles.KernelError) for name in kernel)
    assert issubclass(chasles.KernelError, chasles.ChaslesError)
    assert issubclass(chasles.ShapeError, chasles.InputValueError)
    assert issubclass(chasles.NotInstalledError, ImportError)
    assert derive.ChaslesError is chasles.ChaslesError
