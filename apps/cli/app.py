"""The command `chasles`: its subcommands and its error handling."""

from __future__ import annotations

import io
import os
import sys
import traceback
from collections.abc import Sequence
from typing import Annotated

import typer

from chasles import ChaslesError, __version__

from . import calibrating, compiling, environment, listing, loops, pictures, solving
from .console import err
from .options import Group

_DEFECT = "This is a defect of chasles. Please report it with the lines above and the input."
INTERRUPTED = 130
"""Exit status after Ctrl-C, as shells report it for SIGINT."""

app = typer.Typer(
    cls=Group,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Values take units (90deg, 250mm); without a unit they are in rad and m. "
    "Each subcommand has a help with an example: [bold]chasles ik --help[/]",
)
for _room in (solving, listing, loops, pictures, compiling, calibrating, environment):
    _room.add_to(app)


def _show_version(is_asked: bool) -> None:
    if is_asked:
        print(f"chasles {__version__}")
        raise typer.Exit


@app.callback()
def _chasles(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    """Closed-form kinematics of robots: derived with SymPy, run as C, printed in LaTeX."""


def run(arguments: Sequence[str] | None = None) -> int:
    """Run a chasles command from its command-line arguments.

    Args:
        arguments: The arguments after the program name. If None, the command-line arguments of the
            current process are used.

    Returns:
        The exit status: 0 for success, 1 after an error, 2 for wrong arguments, 130 after Ctrl-C.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        # With line buffering, a program that reads the output from a pipe receives each line
        # immediately.
        sys.stdout.reconfigure(line_buffering=True)
    try:
        app(arguments, prog_name="chasles")
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 1
    except ChaslesError as error:
        return _failed(str(error))
    except BrokenPipeError:
        # If `head` or `less` closed the pipe, Python would print an error message at exit.
        # Redirecting stdout to the null device prevents the error message.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as error:
        return _failed(f"{error.filename}: {error.strerror}" if error.filename else str(error))
    except MemoryError as error:
        return _failed(str(error) or "out of memory")
    except KeyboardInterrupt:
        return INTERRUPTED
    except Exception:
        traceback.print_exc()
        return _failed(_DEFECT)
    return 0


def _failed(message: str) -> int:
    err.print(f"chasles: {message}", style="red", markup=False)
    return 1
