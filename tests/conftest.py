"""Settings of the garbage collector for all tests."""

import gc

# It sets the size of SymPy's cache, before a test imports SymPy.
import chasles.derive  # noqa: F401

NEW_OBJECTS = 50_000
"""Allocations between two collections of young objects; Python's default is 700.

SymPy allocates many small objects that live long, and a collection that walks over them finds
nothing to free.
"""


def pytest_collection_finish():
    """Takes all modules that the tests import out of the collector's sight.

    A collection of all generations then takes milliseconds. With SymPy, CasADi and Pinocchio
    loaded it takes 0.4 s otherwise, and tests for leaks ask for dozens of them.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(NEW_OBJECTS)
