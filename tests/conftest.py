"""Settings of all tests: the garbage collector, and tests skipped for want of a program."""

import gc

import pytest

# It sets the size of SymPy's cache, before a test imports SymPy.
import chasles.derive  # noqa: F401

NEW_OBJECTS = 50_000
"""Allocations between two collections of young objects; Python's default is 700.

SymPy allocates many small objects that live long, and a collection that walks over them finds
nothing to free.
"""
MISSING = ("missing program", "missing package")
"""Beginnings of the reasons of tests that are skipped because this machine lacks something."""


def pytest_addoption(parser):
    parser.addoption(
        "--all-tools",
        action="store_true",
        help="fail if a test is skipped because a program or a package is missing",
    )


def pytest_collection_finish():
    """Hides all modules that the tests import from the garbage collector.

    A collection of all generations then takes milliseconds. With SymPy, CasADi and Pinocchio
    loaded it takes 0.4 s otherwise, and tests for leaks need dozens of collections.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(NEW_OBJECTS)


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session):
    if session.config.getoption("all_tools") and missing(session.config):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter, config):
    for line in missing(config):
        terminalreporter.write_line(line)


def missing(config):
    """One line for each reason for which tests were skipped and that an installation mends."""
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    skipped = reporter.stats.get("skipped", ()) if reporter else ()
    reasons = [report.longrepr[2].removeprefix("Skipped: ") for report in skipped]
    found = sorted({reason for reason in reasons if reason.startswith(MISSING)})
    return [f"{reasons.count(reason)} tests skipped: {reason}" for reason in found]
