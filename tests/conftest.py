"""Settings of all tests: the garbage collector, and tests skipped because a program is missing."""

import gc

import hypothesis
import pytest

# Sets the size of SymPy's cache before a test imports SymPy.
import chasles.derive  # noqa: F401

# Both limits measure wall-clock time, which on a busy machine says nothing about a test.
hypothesis.settings.register_profile(
    "untimed", deadline=None, suppress_health_check=[hypothesis.HealthCheck.too_slow]
)
hypothesis.settings.load_profile("untimed")

NEW_OBJECTS = 50_000
"""Number of allocations between two collections of young objects; the default of Python is 700.

SymPy allocates many small, long-lived objects, and a collection that scans them frees nothing.
"""
MISSING = ("missing program", "missing package")
"""Prefixes of skip reasons that name a missing program or package."""


def pytest_addoption(parser):
    parser.addoption(
        "--all-tools",
        action="store_true",
        help="fail if a test is skipped because a program or a package is missing",
    )


def pytest_collection_finish():
    """Excludes all modules that the tests import from garbage collection.

    A full garbage collection then takes milliseconds. Without this exclusion, each garbage
    collection takes 0.4 s, because SymPy, CasADi and Pinocchio are loaded, and tests for leaks need
    dozens of collections.
    """
    # At its first draw, Hypothesis searches all objects for references; at this point, few objects
    # exist.
    hypothesis.find(hypothesis.strategies.none(), lambda value: value is None)
    gc.collect()
    gc.freeze()
    gc.set_threshold(NEW_OBJECTS)


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session):
    # At the end, pytest would collect garbage ten times, although the process frees its memory
    # anyway.
    gc.freeze()
    if session.config.getoption("all_tools") and missing(session.config):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter, config):
    for line in missing(config):
        terminalreporter.write_line(line)


def missing(config):
    """Lists the missing programs and packages for which tests were skipped, one reason per line."""
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    skipped = reporter.stats.get("skipped", ()) if reporter else ()
    reasons = [report.longrepr[2].removeprefix("Skipped: ") for report in skipped]
    found = sorted({reason for reason in reasons if reason.startswith(MISSING)})
    return [f"{reasons.count(reason)} tests skipped: {reason}" for reason in found]
