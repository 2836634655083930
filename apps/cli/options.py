"""Arguments and options that several subcommands share."""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from chasles import robots, shelf_robots


def names() -> list[str]:
    """Return the names of all installed robots, for shell completion."""
    return sorted([*robots(), *shelf_robots()])


Robot = Annotated[
    str,
    typer.Argument(
        help="Robot by name, robot:NAME of robot_descriptions, folder, or file: .toml, .urdf, "
        ".xacro, MuJoCo .xml.",
        autocompletion=names,
    ),
]
Robots = Annotated[
    list[str],
    typer.Argument(
        help="Robots by name, robot:NAME of robot_descriptions, or files: .toml, .urdf, .xacro "
        "with its arguments as name:=value, MuJoCo .xml.",
        autocompletion=names,
    ),
]
Base = Annotated[
    str | None,
    typer.Option(metavar="LINK", help="Base link in a tree of links. Default: its root."),
]
DEFAULT_TIP = (
    "the link on the last joint with a tool name, such as tool0, tcp or flange; without such a "
    "link, the only end of the chain."
)
Tip = Annotated[
    str | None,
    typer.Option(
        metavar="LINK",
        help="Tip link in a tree of links. Default: " + DEFAULT_TIP,
    ),
]
Exact = Annotated[
    bool, typer.Option("--exact", help="Take all numbers as written; do not snap rounded ones.")
]
Json = Annotated[bool, typer.Option("--json", help="Print a machine-readable result.")]
Fixed = Annotated[
    list[str] | None,
    typer.Option(
        metavar="JOINT=VALUE", help="Fixed joint or redundancy parameter, such as joint7=0.5."
    ),
]
Picture = Annotated[
    Path | None, typer.Option("--to", help="Picture to write: .svg, .pdf, .png. Default: NAME.svg.")
]


class Command(TyperCommand):
    """A subcommand. Its help shows no value type next to flags such as --json."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the options of the subcommand. The help shows no value type next to flags."""
        return _with_plain_flags(super().get_params(ctx))


class Group(TyperGroup):
    """A Typer command group with subcommands. The help shows no value type next to flags."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the options of the command. The help shows no value type next to flags."""
        return _with_plain_flags(super().get_params(ctx))


def _with_plain_flags(parameters: list[Any]) -> list[Any]:
    for parameter in parameters:
        if getattr(parameter, "is_flag", False) and parameter.metavar is None:
            parameter.metavar = ""
    return parameters


def add(app: typer.Typer, subcommand: Callable[..., None], example: str, name: str = "") -> None:
    """Add a subcommand. The help of the subcommand ends with an example."""
    parameters = signature(subcommand).parameters.values()
    needs_arguments = any(parameter.default is parameter.empty for parameter in parameters)
    example = f"Example: [bold]{example}[/]"
    app.command(name or None, cls=Command, no_args_is_help=needs_arguments, epilog=example)(
        subcommand
    )


def listed(words: str) -> tuple[str, ...]:
    """Return the words of a comma-separated list."""
    return tuple(word.strip() for word in words.split(",") if word.strip())
