"""``python -m chasles.derive`` is ``chasles-derive``."""

import sys

from . import LIBRARIES, NOT_INSTALLED


def main() -> None:
    """The console script; if the compiler is not installed, it prints how to install it."""
    try:
        from .cli import main as run  # noqa: PLC0415

        run()
    except ModuleNotFoundError as error:
        if error.name not in LIBRARIES:
            raise
        sys.exit(f"{NOT_INSTALLED} ({error})")


if __name__ == "__main__":
    main()
