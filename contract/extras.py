"""Optional packages, and errors that name the command to install a package."""

import shlex
from collections.abc import Iterator
from contextlib import contextmanager

from .errors import NotInstalledError


@contextmanager
def requires(distribution: str) -> Iterator[None]:
    """Raise NotInstalledError if an import in this block does not find its package.

    Args:
        distribution: The argument of pip that installs the package, such as "chasles[study]".

    Raises:
        NotInstalledError: The package is not installed. A missing module of chasles itself is a
            defect and raises ModuleNotFoundError.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        package = (error.name or str(error)).partition(".")[0]
        if package == "chasles":
            raise
        command = f"pip install {shlex.quote(distribution)}"
        raise NotInstalledError(f"{package} is not installed: {command}", name=package) from error
