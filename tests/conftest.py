"""Settings of all tests, and reports of missing programs."""

import gc
from contextlib import nullcontext

import hypothesis
import pytest

# This import sets the size of SymPy's cache before a test imports SymPy.
import chasles.derive  # noqa: F401
from tests.support.compiling import (
    compiled_with_vectors,
    own_robots_compiled_quickly,
    printing_here,
    reading_here,
)

# The deadline and the check `too_slow` measure wall-clock time, which depends on the load of the
# machine.
hypothesis.settings.register_profile(
    "untimed", deadline=None, suppress_health_check=[hypothesis.HealthCheck.too_slow]
)
hypothesis.settings.load_profile("untimed")

NEW_OBJECTS = 50_000
"""Number of allocations between two collections of young objects; the default of Python is 700.

SymPy allocates many small, long-lived objects. A garbage collection scans these objects, but frees
nothing.
"""
ABOUT_COMPILATION = {"call", "library", "test_portable.py"}
"""Folders and modules whose tests compile robots with the flags of users."""
ABOUT_VECTORS = {"runtime", "derive", "generated", "crosscheck", "campaigns"}
"""Folders of tests that compile robots with SIMD code."""
ABOUT_READING = {
    *("test_crafted_corpus.py", "test_crafted_files.py", "test_known_files.py"),
    *("test_checking.py", "test_isolation.py", "test_readers.py"),
}
"""Modules whose tests read files in a separate process with limits, as users do."""
ABOUT_PRINTING = {"test_cli.py", "test_language.py"}
"""Modules whose tests print LaTeX articles in a separate process, as users do."""
MISSING = ("missing program", "missing package")
"""Prefixes of skip reasons that name a missing program or package."""


@pytest.fixture(scope="module", autouse=True)
def vectors(request):
    """Compile robots with vector code for the modules that test vector code."""
    with compiled_with_vectors() if ABOUT_VECTORS & {*request.path.parts} else nullcontext():
        yield


@pytest.fixture(scope="module", autouse=True)
def own_robots(request, vectors):
    """Shorten the compilation of robots that chasles does not ship, except in compilation tests."""
    is_about_compilation = ABOUT_COMPILATION & {*request.path.parts}
    with nullcontext() if is_about_compilation else own_robots_compiled_quickly():
        yield


@pytest.fixture(scope="module", autouse=True)
def files_read_here(request):
    """Read robot files in the test process instead of a forked process."""
    with nullcontext() if request.path.name in ABOUT_READING else reading_here():
        yield


@pytest.fixture(scope="module", autouse=True)
def articles_printed_here(request):
    with nullcontext() if request.path.name in ABOUT_PRINTING else printing_here():
        yield


def pytest_addoption(parser):
    parser.addoption(
        "--all-tools",
        action="store_true",
        help="fail if a test is skipped because a program or a package is missing",
    )


def pytest_collectstart():
    """Disable garbage collection while test files are imported."""
    gc.disable()


def pytest_collection_finish():
    """Exclude all imported modules from garbage collection.

    A test for memory leaks runs dozens of garbage collections. The collections are faster if they
    skip these modules.
    """
    # At its first draw, Hypothesis searches all Python objects for references.
    hypothesis.find(hypothesis.strategies.none(), lambda value: value is None)
    gc.collect()
    gc.freeze()
    gc.set_threshold(NEW_OBJECTS)
    gc.enable()


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session):
    # After freezing, the remaining garbage collections skip all existing objects.
    gc.freeze()
    if session.config.getoption("all_tools") and missing(session.config):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter, config):
    for line in missing(config):
        terminalreporter.write_line(line)


def missing(config):
    """List the missing programs and packages, one per line."""
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    skipped = reporter.stats.get("skipped", ()) if reporter else ()
    reasons = [report.longrepr[2].removeprefix("Skipped: ") for report in skipped]
    found = sorted({reason for reason in reasons if reason.startswith(MISSING)})
    return [f"{reasons.count(reason)} tests skipped: {reason}" for reason in found]
