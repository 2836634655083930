"""Optional packages, imported when a test first uses them."""

from importlib.util import find_spec

import pytest


class OptionalPackage:
    """Imports a package at its first use, or skips the test if the package is missing."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str):
        """Return a public attribute of the package.

        During collection, pytest reads private attributes of all objects in a test file. These
        reads must not import the package.
        """
        if attribute.startswith("_"):
            raise AttributeError(f"{self._name}: only public attributes can be used")
        return getattr(pytest.importorskip(self._name, reason=reason(self._name)), attribute)


def reason(name: str) -> str:
    """Return the message that a test is skipped because a package is missing."""
    return f"missing package: {name} (make test installs it)"


def requires(name: str) -> pytest.MarkDecorator:
    """Return the pytest mark that skips a test if a package is missing."""
    return pytest.mark.skipif(find_spec(name) is None, reason=reason(name))
