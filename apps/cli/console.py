"""Output: Two consoles: `out` prints results, and `err` prints warnings and errors."""

from __future__ import annotations

import json
from typing import Any, NoReturn

import typer
from rich.console import Console

out = Console(highlight=False, soft_wrap=True)
err = Console(highlight=False, soft_wrap=True, stderr=True)


def say(text: str = "") -> None:
    """Print a line of results."""
    out.print(text, markup=False)


def print_json(result: Any) -> None:
    """Print a machine-readable result."""
    print(json.dumps(result, indent=2))


def warn(message: str) -> None:
    """Print a warning."""
    err.print(message, style="yellow", markup=False)


def stop(message: str) -> NoReturn:
    """Print an error message and exit with status 1."""
    err.print(message, style="red", markup=False)
    raise typer.Exit(1)
