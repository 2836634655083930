"""Packages that only some tests need, imported when a test first uses them."""

from importlib.util import find_spec

import pytest


class OptionalPackage:
    """Stands for a package; its first use imports it, or skips the test where it is missing.

    Each process that runs tests imports all test files. A package that takes seconds to import is
    then paid for by the tests that use it alone.
    """

    def __init__(self, name: str) -> None:
        """Remembers the name of the package, which pip may know by another name."""
        self._name = name

    def __getattr__(self, attribute: str):
        """An attribute of the package."""
        return getattr(pytest.importorskip(self._name, reason=reason(self._name)), attribute)


def reason(name: str) -> str:
    """The reason of a test that is skipped because a package is missing."""
    return f"missing package: {name} (make test installs it)"


def requires(name: str) -> pytest.MarkDecorator:
    """Mark of a test, or of all tests of a file, that needs a package."""
    return pytest.mark.skipif(find_spec(name) is None, reason=reason(name))
