"""The command line: `chasles build`, `calibrate`, `info`, `list` and `view`."""

from .command_line import main

__all__ = ["main"]
