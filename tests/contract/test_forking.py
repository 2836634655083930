"""A function runs in a forked process, in parallel with this process."""

import os
import signal
import sys
import threading

import pytest

from chasles.contract.forking import run_in_fork
from chasles.derive import DescriptionError

is_forked = pytest.mark.skipif(sys.platform != "linux", reason="processes are forked only on Linux")


@pytest.fixture
def alone(monkeypatch):
    monkeypatch.setattr(threading, "active_count", lambda: 1)


@is_forked
def test_result_comes_from_a_forked_process(alone):
    with run_in_fork(lambda: (os.getpid(), "text")) as found:
        pid, text = found()
    assert text == "text"
    assert pid != os.getpid()


@is_forked
@pytest.mark.parametrize("kind", [DescriptionError, ValueError])
def test_error_in_fork_is_raised_again_with_its_type(alone, kind):
    def refuse():
        raise kind("no such wrench")

    with pytest.raises(kind, match="no such wrench"), run_in_fork(refuse) as found:
        found()


@is_forked
def test_unpicklable_error_in_fork_is_reported(alone):
    class Local(Exception):
        pass

    def refuse():
        raise Local("a class inside a function")

    with (
        pytest.raises(RuntimeError, match="Local: a class inside a function"),
        run_in_fork(refuse) as found,
    ):
        found()


@is_forked
def test_killed_fork_is_reported(alone):
    def die():
        os.kill(os.getpid(), signal.SIGKILL)

    with pytest.raises(RuntimeError, match="the operating system ended"), run_in_fork(die) as found:
        found()


@is_forked
def test_error_in_parent_ends_the_fork(alone):
    read, write = os.pipe()

    def wait():
        signal.pause()

    def fail_in_fork():
        with run_in_fork(wait):
            os.close(write)
            raise ArithmeticError

    with pytest.raises(ArithmeticError):
        fail_in_fork()
    # The other process has closed its end of the pipe, so a read returns the end of the file.
    assert os.read(read, 1) == b""
    os.close(read)


def test_work_runs_in_this_process_if_another_thread_exists():
    done = threading.Event()
    other = threading.Thread(target=done.wait)
    other.start()
    try:
        with run_in_fork(os.getpid) as found:
            assert found() == os.getpid()
    finally:
        done.set()
        other.join()
