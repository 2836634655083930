"""The command line: `chasles SUBCOMMAND ROBOT`; needs `pip install 'chasles[cli]'`."""

import sys

from chasles import NotInstalledError
from chasles.contract import requires

__all__ = ["main"]
_VERBS_OF_COMPILER = {"derive", "explain", "export", "new"}


def main() -> None:
    """Run the command line, or print how to install typer and rich."""
    try:
        needs_compiler = not _VERBS_OF_COMPILER.isdisjoint(sys.argv[1:2])
        with requires("chasles[derive]" if needs_compiler else "chasles[cli]"):
            from .app import run  # noqa: PLC0415
    except NotInstalledError as error:
        sys.exit(f"chasles: {error}")
    sys.exit(run())
