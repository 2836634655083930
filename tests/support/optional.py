"""Optional packages, imported when a test first uses them."""

from importlib.util import find_spec

import pytest


class OptionalPackage:
    """Imports a package at its first use, or skips the test if the package is missing."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str):
        """Return a public attribute of the package.

        During collection, pytest reads private attributes of all objects in a test file. Reading a
        private attribute must not import the package.
        """
        if attribute.startswith("_"):
            raise AttributeError(f"{self._name}: only public attributes can be used")
        return getattr(pytest.importorskip(self._name, reason=reason(self._name)), attribute)


def reason(name: str) -> str:
    """Return the skip reason for a missing package."""
    return f"missing package: {name} (make test installs it)"


def requires(name: str) -> pytest.MarkDecorator:
    """Return the pytest mark of tests that need a package."""
    return pytest.mark.skipif(find_spec(name) is None, reason=reason(name))
