"""`threads=` and calls from many threads change neither results nor errors."""

import gc
import itertools
import re
import subprocess
import sys
import threading

import numpy as np
import pytest

import chasles
import chasles.call.threads
from tests.support.leaks import assert_no_leaks
from tests.support.waiting import SECONDS

COUNTS = [None, 1, 2, 3, 5, np.int64(2), "all", 10**6, 10**30]


@pytest.fixture
def eager(monkeypatch):
    """Make even small batches run on four threads, on any machine."""
    monkeypatch.setattr(chasles.call.threads, "_MIN", 1)
    monkeypatch.setattr(chasles.call.threads, "count_cores", lambda: 4)


def check(function, *inputs, **keywords):
    expected = function(*inputs, **keywords)
    several = isinstance(expected, tuple)
    for threads in COUNTS:
        result = function(*inputs, **keywords, threads=threads)
        assert type(result) is type(expected)
        for a, b in zip(*((x if several else [x]) for x in (result, expected)), strict=True):
            assert a.shape == b.shape
            assert a.dtype == np.float64
            np.testing.assert_array_equal(a, b)
        out = tuple(np.full(x.shape, np.nan) for x in (expected if several else [expected]))
        result = function(*inputs, **keywords, threads=threads, out=out)
        for a, b, c in zip(
            result if several else [result], out, expected if several else [expected], strict=True
        ):
            assert a is b
            np.testing.assert_array_equal(a, c)


SHAPES = [(100,), (37,), (16,), (17,), (3, 40), (2, 3, 50), (64, 3), (1, 99), (99, 1), (4, 4, 4)]


@pytest.mark.parametrize("shape", [*SHAPES, (0,), (5, 0), (1,), (2,), ()], ids=str)
def test_threaded_results_match_for_every_batch_shape(robot, eager, shape):
    rng = np.random.default_rng(31)
    check(robot.fused, rng.normal(size=(*shape, 2)))
    check(chasles.load("ur5e").fk_jacobian_mixed, rng.normal(size=(*shape, 6)))


@pytest.mark.parametrize(
    ("q_shape", "qd_shape"),
    [
        ((100,), ()),
        ((), (100,)),
        ((100, 1), (1, 30)),
        ((1, 30), (100, 1)),
        ((3, 1), (50,)),
        ((50,), (3, 1)),
        ((64, 1, 3), (5, 1)),
        ((1,), (70,)),
    ],
    ids=str,
)
def test_threaded_results_match_for_broadcast_inputs(eager, q_shape, qd_shape):
    rng = np.random.default_rng(32)
    q, qd = rng.normal(size=(*q_shape, 6)), rng.normal(size=(*qd_shape, 6))
    check(chasles.load("ur5e").twist_mixed, q, qd)


def test_threaded_results_match_for_default_partition(robot):
    rng = np.random.default_rng(33)
    arm = chasles.load("ur5e")
    for n in (1000, 12_345, 30_001):
        check(arm.fk, rng.normal(size=(n, 6)))
    check(arm.twist_mixed, rng.normal(size=(7, 3000, 6)), rng.normal(size=(3000, 6)))
    check(robot.fk, rng.normal(size=(4, 20_000, 2)))


def test_threaded_results_match_for_every_memory_layout(eager):
    rng = np.random.default_rng(34)
    arm = chasles.load("ur5e")
    q = rng.normal(size=(60, 5, 6))
    check(arm.fk, np.asfortranarray(q))
    check(arm.fk, q[::-1])
    check(arm.fk, q[:, ::-2])
    check(arm.fk, q[..., ::-1])
    check(arm.fk, q.transpose(1, 0, 2))
    check(arm.fk, q.astype(np.float32))
    check(arm.fk, q.tolist())
    check(arm.fk, np.broadcast_to(q[0, 0], (200, 6)))
    check(arm.fk, q=q[0])
    buffer = np.zeros((70, 5, 7, 4))
    out = buffer[5:65, :, 1:5]
    assert arm.fk(q, out=out, threads=2) is out
    np.testing.assert_array_equal(out, arm.fk(q))
    assert np.count_nonzero(buffer) == np.count_nonzero(out)
    out, other = (np.empty((60, 5, 4, 4), order="F") for _ in range(2))
    assert arm.fk(q, out=out, threads=2) is out
    np.testing.assert_array_equal(out, arm.fk(q, out=other))


def test_partial_out_tuple_works_with_threads(eager, robot):
    q = np.random.default_rng(35).normal(size=(100, 2))
    jacobian = np.empty((100, 2, 2))
    result = robot.fused(q, out=(None, jacobian), threads=2)
    assert result[1] is jacobian
    for a, b in zip(result, robot.fused(q), strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("shift", [-600, -64, -7, 0, 1, 64, 599, 600])
def test_threaded_out_may_overlap_inputs(eager, shift):
    function = chasles.load("ur5e").twist_mixed
    buffer = np.random.default_rng(36).normal(size=2400)
    q = buffer[900:1500].reshape(100, 6)
    out = buffer[900 + shift : 1500 + shift].reshape(100, 6)
    qd = np.ones(6)
    expected = function(q.copy(), qd)
    assert function(q, qd, out=out, threads=3) is out
    np.testing.assert_allclose(out, expected, rtol=1e-13, atol=1e-15)


def test_threaded_outs_may_share_one_table(eager, robot):
    table = np.zeros((100, 18))
    outs = table[:, :12].reshape(100, 3, 4), table[:, 12:16].reshape(100, 2, 2)
    table[:, 16:] = np.random.default_rng(37).normal(size=(100, 2))
    expected = robot.fused(table[:, 16:].copy())
    robot.fused(table[:, 16:], out=outs, threads=2)
    for a, b in zip(outs, expected, strict=True):
        np.testing.assert_array_equal(a, b)


def test_outs_that_overlap_each_other_are_written_by_one_thread(eager, robot, monkeypatch):
    share, batches = chasles.call.threads._share, []
    monkeypatch.setattr(
        chasles.call.threads, "_share", lambda *args: batches.append(args) or share(*args)
    )
    q, buffer = np.random.default_rng(38).normal(size=(100, 2)), np.zeros(1600)
    for begin, shared in ((1200, 1), (1199, 1)):
        outs = buffer[:1200].reshape(100, 3, 4), buffer[begin : begin + 400].reshape(100, 2, 2)
        robot.fused(q, out=outs, threads=3)
        assert len(batches) == shared


def test_threads_argument_starts_worker_threads(eager):
    arm = chasles.load("ur5e")
    q = np.zeros((200_000, 6))
    arm.fk(q, threads=2)
    assert any(thread.name.startswith("chasles") for thread in threading.enumerate())


def test_partition_covers_every_row_once_in_aligned_parts():
    checked = 0
    for rows, threads in itertools.product([*range(1, 70), 1000, 4096, 100_003], range(1, 9)):
        for batch in [(rows,), (2, rows), (rows, 1000), (3, rows, 5)]:
            axis, cuts = chasles.call.threads._cut(batch, threads)
            if not cuts:
                continue
            covered = np.concatenate([np.arange(cut.start, cut.stop) for cut in cuts])
            np.testing.assert_array_equal(covered, np.arange(batch[axis]))
            if len(cuts) > 1:
                assert min(cut.stop - cut.start for cut in cuts) >= 8
                assert all(cut.start % 8 == 0 for cut in cuts)
                checked += 1
    assert checked > 100


# ---------------------------------------------------------------- errors


@pytest.mark.parametrize(
    "threads", [0, -1, -(10**30), True, False, 2.0, "2", "", [2], np.array([2, 3])], ids=repr
)
@pytest.mark.parametrize("batch", [(), (3,), (5000,)], ids=str)
def test_invalid_thread_count_is_rejected(robot, threads, batch):
    message = f"tiny.fk: threads must be a positive integer or 'all', got {threads!r}"
    with pytest.raises(chasles.InputError, match=f"^{re.escape(message)}$"):
        robot.fk(np.zeros((*batch, 2)), threads=threads)


@pytest.mark.parametrize(
    "call",
    [
        lambda r, **k: r.fk(np.zeros((5000, 3)), **k),
        lambda r, **k: r.fk(np.zeros((5000, 2), complex), **k),
        lambda r, **k: r.fk([[1, 2], [3]], **k),
        lambda r, **k: r.blend(np.zeros((5000, 2)), np.zeros((4000, 2, 3)), **k),
        lambda r, **k: r.fk(np.zeros((5000, 2)), out=np.zeros((4999, 3, 4)), **k),
        lambda r, **k: r.fk(np.zeros((5000, 2)), out=np.zeros((5000, 3, 4), np.float32), **k),
        lambda r, **k: r.fused(np.zeros((5000, 2)), out=np.zeros((5000, 3, 4)), **k),
        lambda r, **k: r.blend(np.zeros((5000, 2)), **k),
        lambda r, **k: r.fk(np.zeros((5000, 2)), where=True, **k),
    ],
    ids=[
        "wrong size",
        "complex",
        "ragged list",
        "no broadcast",
        "short out",
        "float32 out",
        "single out for two",
        "missing input",
        "unknown keyword",
    ],
)
def test_threaded_errors_match_single_threaded_errors(robot, call):
    with pytest.raises(chasles.ChaslesError) as plain:
        call(robot)
    with pytest.raises(type(plain.value), match=f"^{re.escape(str(plain.value))}$"):
        call(robot, threads=2)


def test_worker_error_is_raised_after_all_parts_end(monkeypatch):
    """A worker fails if the memory for strided operands cannot be allocated."""
    running, ended = threading.Barrier(2, timeout=SECONDS), []

    def ufunc(part, out):
        if part < 2:
            running.wait()
        if part == 0:
            raise MemoryError
        ended.append(part)

    with pytest.raises(MemoryError):
        chasles.call.threads._share(ufunc, iter([(k, None) for k in range(6)]), 1, 2)
    assert sorted(ended) == [1, 2, 3, 4, 5]


def test_threads_accept_strided_wide_core(eager, robot):
    w = np.random.default_rng(38).normal(size=(30, 40, 80))[..., ::2]
    np.testing.assert_array_equal(robot.wide(w, threads=3), 2 * w[:, ::-1, ::-1])


def test_no_thread_starts_in_main_thread():
    """Ctrl-C during the start of a thread would leave a thread that never ends."""
    starts = []

    class Watched(threading.Thread):
        def start(self):
            starts.append((self.name, threading.current_thread()))
            super().start()

    chasles.call.threads._forget_pool()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(threading, "Thread", Watched)
        chasles.load("ur5e").fk(np.zeros((100_000, 6)), threads=2)
    of_pool = [by for name, by in starts if name.startswith("chasles")]
    assert len(of_pool) == chasles.call.threads.count_cores()
    assert threading.main_thread() not in of_pool


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_threaded_non_finite_inputs_propagate_without_warning(bad):
    arm = chasles.load("ur5e")
    q = np.zeros((50_000, 6))
    q[::7] = bad
    with np.errstate(all="raise"):
        result = arm.fk(q, threads=2)
    np.testing.assert_array_equal(result, arm.fk(q))


def refused(function, *inputs, **keywords):
    with pytest.raises(chasles.InputError):
        function(*inputs, **keywords)


def test_threaded_calls_leak_no_references_or_memory(eager, robot, few_objects):
    q, out = np.zeros((100, 2)), np.empty((100, 3, 4))
    calls = [
        lambda: robot.fk(q, threads=2),
        lambda: robot.fk(q, out=out, threads=2),
        lambda: robot.fused(q, threads=2),
        lambda: refused(robot.fk, q, threads=0),
    ]

    def settle():
        """Wait until the helper threads notice that no work remains."""
        for _ in range(10):
            chasles.call.threads._get_pool().submit(int).result()
        gc.collect()

    watched = [q, out, robot.fk, robot.fk.ufunc]
    assert_no_leaks(calls, watched, settle)


# ---------------------------------------------- processes and their exit


def run_python(code):
    subprocess.run([sys.executable, "-c", code], check=True, timeout=SECONDS)


def test_forked_child_starts_its_own_threads():
    run_python("""
import os, sys
import numpy as np
import chasles

arm = chasles.load("ur5e")
q = np.random.default_rng(0).normal(size=(50_000, 6))
expected = arm.fk(q, threads=2)
for _ in range(5):
    child = os.fork()
    if child == 0:
        os._exit(0 if np.array_equal(arm.fk(q, threads=2), expected) else 1)
    assert os.waitpid(child, 0)[1] == 0
assert np.array_equal(arm.fk(q, threads=2), expected)
""")


def test_threaded_calls_work_during_interpreter_shutdown():
    run_python("""
import atexit, threading
import numpy as np
import chasles

arm = chasles.load("ur5e")
q = np.random.default_rng(0).normal(size=(50_000, 6))
expected = arm.fk(q)

def last():
    assert np.array_equal(arm.fk(q, threads=2), expected)
    print("done")

atexit.register(last)
threading.Thread(target=lambda: arm.fk(q, threads=2)).start()
""")


def test_call_succeeds_if_no_thread_can_start(monkeypatch):
    class Full:
        def submit(self, _):
            raise RuntimeError("can't start new thread")

    monkeypatch.setattr(chasles.call.threads, "_pool", Full())
    arm = chasles.load("ur5e")
    q = np.random.default_rng(39).normal(size=(50_000, 6))
    np.testing.assert_array_equal(arm.fk(q, threads=4), arm.fk(q))


# ------------------------------------------------ calls from many threads


def at_once(n, work):
    """Run work(0), ..., work(n - 1) in parallel and raise the first error."""
    failures, start = [], threading.Barrier(n)

    def run(k):
        try:
            start.wait()
            work(k)
        except BaseException as error:
            failures.append(error)

    threads = [threading.Thread(target=run, args=(k,)) for k in range(n)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if failures:
        raise failures[0]


def test_concurrent_mixed_calls_give_correct_results():
    arm = chasles.load("ur5e")
    rng = np.random.default_rng(40)
    q, qd = rng.normal(size=(2, 15_000, 6))
    pose, jacobian = arm.fk_jacobian_mixed(q)
    twist = arm.twist_mixed(q, qd)
    single = [arm.fk(row) for row in q[:50]]
    shared = np.empty((8, *pose.shape))

    def work(k):
        for turn in range(3):
            for row, expected in zip(q[:50], single, strict=True):
                assert np.array_equal(arm.fk(row), expected)
            part = slice(k * 100 + turn, k * 100 + turn + 300)
            assert np.array_equal(arm.fk(q[part]), pose[part])
            got = arm.fk_jacobian_mixed(q, threads=1 + (k + turn) % 4)
            assert np.array_equal(got[0], pose)
            assert np.array_equal(got[1], jacobian)
            assert np.array_equal(arm.twist_mixed(qd=qd, q=q, threads="all"), twist)
            arm.fk(q, out=shared[k], threads=2)
            assert np.array_equal(chasles.load("ur5e").fk(q[:20]), pose[:20])

    at_once(8, work)
    assert all(np.array_equal(one, pose) for one in shared)


def test_concurrent_first_loads_compile_once(folder, cache):
    """Several threads make the first call of a function before the robot is compiled."""
    q = np.random.default_rng(41).normal(size=(3000, 2))
    results = {}

    def work(k):
        robot = chasles.load(folder.path)
        results[k] = robot.fk(q, threads=1 + k % 3), robot.fk(q[0])

    at_once(6, work)
    assert len(results) == 6
    assert len(list(cache.iterdir())) == 1
    for batch, single in results.values():
        np.testing.assert_array_equal(batch, results[0][0])
        np.testing.assert_array_equal(single, results[0][1])


def test_concurrent_first_use_of_generated_package_is_consistent(folder, cache):
    (folder.path / "__init__.py").write_text(
        '"""A tiny robot."""\n\nfrom chasles.lazy_package import lazy_package\n\n'
        "__getattr__, __dir__ = lazy_package(globals())\n"
    )
    code = """
import threading
import numpy as np
import tiny

results = []
threads = [threading.Thread(target=lambda: results.append(tiny.fk([0.5, 1.0]))) for _ in range(5)]
[thread.start() for thread in threads]
[thread.join() for thread in threads]
assert len(results) == 5 and all(np.array_equal(x, results[0]) for x in results)
"""
    subprocess.run([sys.executable, "-c", code], cwd=folder.path.parent, check=True)
