"""Runs ``chasles-derive`` as ``python -m chasles.derive``."""

import sys

from . import LIBRARIES, NOT_INSTALLED


def main() -> None:
    """Runs the console script, or prints how to install a missing compiler."""
    try:
        from .cli import main as run  # noqa: PLC0415

        run()
    except ModuleNotFoundError as error:
        if error.name not in LIBRARIES:
            raise
        sys.exit(f"{NOT_INSTALLED} ({error})")


if __name__ == "__main__":
    main()
