"""Optional packages, imported when a test first uses them."""

from importlib.util import find_spec

import pytest


class OptionalPackage:
    """Proxy of a package: the first use imports it, or skips the test if it is missing.

    Every test worker imports all test files. With this proxy, a slow package is imported only by
    the tests that use it.
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str):
        """Returns a public attribute of the package.

        Pytest looks for private attributes in all objects of a test file when it collects the
        tests. The lookup of these attributes must not import the package.
        """
        if attribute.startswith("_"):
            raise AttributeError(f"{self._name}: only public attributes can be used")
        return getattr(pytest.importorskip(self._name, reason=reason(self._name)), attribute)


def reason(name: str) -> str:
    """Returns the skip reason for a missing package."""
    return f"missing package: {name} (make test installs it)"


def requires(name: str) -> pytest.MarkDecorator:
    """Returns the pytest mark of tests that need a package."""
    return pytest.mark.skipif(find_spec(name) is None, reason=reason(name))
