"""Large results reuse freed memory, but never memory in use."""

import itertools
import os
import pickle
import sys
import threading

import numpy as np
import pytest

import chasles

N = 270_000
BLOCK = N * 16 * 8
"""Size in bytes of N pose matrices (35 MB), for which malloc requests memory from the operating
system."""
MAX = 256 << 20

handler_of = np._core.multiarray.get_handler_name


@pytest.fixture(scope="module")
def arm():
    return chasles.load("ur5e")


@pytest.fixture(scope="module")
def q():
    return np.random.default_rng(5).uniform(-3, 3, (N, 6))


@pytest.fixture(scope="module")
def expected(arm, q):
    return arm.fk.ufunc(q)


@pytest.fixture(autouse=True)
def _nothing_kept(few_objects):
    chasles.release_memory()


def address(array):
    return array.__array_interface__["data"][0]


def test_freed_result_buffer_is_reused(arm, q, expected):
    first = arm.fk(q)
    place = address(first)
    del first
    again = arm.fk(q)
    assert address(again) == place
    np.testing.assert_array_equal(again, expected)
    del again
    # A result that is 2 % smaller than the freed memory block reuses this block. A result of twice
    # the size gets new memory.
    fewer = arm.fk(q[: N * 98 // 100])
    assert address(fewer) == place
    del fewer
    other = arm.fk(np.tile(q, (2, 1)))
    assert address(other) != place
    assert chasles.release_memory() == pytest.approx(BLOCK, rel=0.1)
    assert chasles.release_memory() == 0


def test_small_results_use_numpy_allocator(arm, q):
    assert handler_of(arm.fk(q)) == "chasles_results"
    assert handler_of(arm.fk(q[:100])) == "default_allocator"
    assert handler_of(arm.fk(q[0])) == "default_allocator"
    assert handler_of(np.empty((N, 16))) == "default_allocator"


def test_every_result_of_large_call_uses_buffer_pool(arm, q):
    # Each of the two result arrays alone is too small for the buffer pool.
    both = arm.fk_jacobian_mixed(q[: N * 4 // 10])
    assert [handler_of(array) for array in both] == ["chasles_results"] * 2
    assert max(array.nbytes for array in both) < BLOCK


def test_every_large_batch_call_path_uses_buffer_pool(arm, q, expected):
    for found in (arm.fk(q[::-1])[::-1], arm.fk(q.astype(np.longdouble)), arm.fk(q, threads=2)):
        assert handler_of(found if found.base is None else found.base) == "chasles_results"
        np.testing.assert_array_equal(found, expected)
    half = q[: N // 2]
    T = np.empty((N // 2, 4, 4))
    given, J = arm.fk_jacobian_mixed(half, out=(T, None))
    assert given is T
    assert handler_of(J) == "chasles_results"
    np.testing.assert_array_equal(T, expected[: N // 2])
    np.testing.assert_array_equal(J, arm.jacobian_mixed.ufunc(half))


def test_live_results_never_share_memory(arm, q, expected):
    arrays = [arm.fk(q) for _ in range(4)]
    del arrays[1]
    arrays.append(arm.fk(q)[N // 2 :, :3].transpose(0, 2, 1))
    kept_alive = memoryview(arm.fk(q))
    arrays += [np.asarray(kept_alive), arm.fk(q)]
    arm.fk(-q)
    arm.fk_jacobian_mixed(-q[: N * 4 // 10])
    count = 0
    for a, b in itertools.combinations(arrays, 2):
        assert not np.may_share_memory(a, b)
        count += 1
    assert count == 15
    part = expected[N // 2 :, :3].transpose(0, 2, 1)
    for array, own in zip(arrays, [*[expected] * 3, part, expected, expected], strict=True):
        np.testing.assert_array_equal(array, own)


def test_pooled_results_behave_like_ordinary_arrays(arm, q, expected):
    found = arm.fk(q)
    assert found.flags.owndata
    assert found.flags.c_contiguous
    assert address(found) % 64 == 0
    restored = pickle.loads(pickle.dumps(found))
    arm.fk(-q)
    np.testing.assert_array_equal(restored, expected)
    assert handler_of(found.copy()) == "default_allocator"
    found.resize((N // 100, 4, 4), refcheck=False)
    np.testing.assert_array_equal(found, expected[: N // 100])
    found.resize((2 * N, 4, 4), refcheck=False)
    np.testing.assert_array_equal(found[: N // 100], expected[: N // 100])
    assert not found[N // 100 :].any()


def test_buffer_pool_size_is_bounded(arm, q):
    results = [arm.fk(q) for _ in range(9)]
    assert sum(array.nbytes for array in results) > MAX
    del results
    assert 6 * BLOCK < chasles.release_memory() <= MAX
    assert arm.fk(np.tile(q, (8, 1))).nbytes > MAX
    assert chasles.release_memory() == 0


def test_buffer_pool_is_thread_safe(arm, q, expected):
    failures = []

    def work(sign):
        reference = expected if sign > 0 else arm.fk.ufunc(-q)
        arrays = []
        for _ in range(4):
            arrays.append(arm.fk(sign * q))
            if not all(np.array_equal(array, reference) for array in arrays[-2:]):
                failures.append(sign)
            arrays = arrays[-2:]

    threads = [threading.Thread(target=work, args=(sign,)) for sign in (1, -1, 1, -1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures == []


@pytest.mark.skipif(sys.platform != "linux", reason="forks")
def test_forked_child_does_not_share_pooled_memory(arm, q, expected):
    arrays, dropped = arm.fk(q), arm.fk(q)
    del dropped
    child = os.fork()
    if child == 0:
        same = np.array_equal(arrays, expected)
        arrays *= 0.0
        # The child process reuses its own copy of the memory block that the parent process freed.
        right = np.array_equal(arm.fk(q), expected)
        chasles.release_memory()
        os._exit(0 if same and right else 1)
    again = arm.fk(q)
    _, status = os.waitpid(child, 0)
    assert os.waitstatus_to_exitcode(status) == 0
    np.testing.assert_array_equal(arrays, expected)
    np.testing.assert_array_equal(again, expected)
