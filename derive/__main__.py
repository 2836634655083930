"""``python -m chasles.derive`` is ``chasles-derive``."""

import sys

from . import NOT_INSTALLED


def main() -> None:
    """The console script; if the compiler is not installed, it prints how to install it."""
    try:
        from .cli import main as run  # noqa: PLC0415
    except ModuleNotFoundError as error:
        sys.exit(f"{NOT_INSTALLED} ({error})")
    run()


if __name__ == "__main__":
    main()
