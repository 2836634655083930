r"""Prints the table of the geometry parameters p."""

from collections.abc import Callable, Sequence
from itertools import groupby

from ...model.geometry import GeometryParameter
from ..setting import names
from ..setting.printer import Printer, number
from . import tables

_FEW = 2
"""Maximum number of consecutive symbols that are printed in full. If a sequence of symbols is
longer, only its first and last symbol are printed."""


def parameter_table(found: Sequence[GeometryParameter], printer: Printer) -> str:
    """Print the table of the geometry parameters from base to tool, with one row per group."""
    items = sorted(found, key=_order(found))
    rows = [list(run) for _, run in groupby(items, key=_place)]
    columns: list[tables.Column] = [
        ("$p$", [_range(row, printer) for row in rows]),
        ("joint", [names.escape(row[0].joint) for row in rows]),
        ("part", [row[0].part for row in rows]),
        ("numbers", [", ".join(_number(item) for item in row) for row in rows]),
    ]
    return tables.tabular(columns, repeated=2)


def _place(item: GeometryParameter) -> tuple[str, str]:
    return item.joint, item.part


def _order(
    found: Sequence[GeometryParameter],
) -> Callable[[GeometryParameter], tuple[int, int]]:
    joints = {item.joint: k for k, item in reversed(list(enumerate(found)))}
    parts = {_place(item): k for k, item in reversed(list(enumerate(found)))}
    return lambda item: (joints[item.joint], parts[_place(item)])


def _range(row: Sequence[GeometryParameter], printer: Printer) -> str:
    tex = [printer.tex(item.symbol) for item in row]
    indices = [int(item.symbol.name[1:]) for item in row]
    if len(row) > _FEW and indices == list(range(indices[0], indices[-1] + 1)):
        return rf"${tex[0]}, \dots, {tex[-1]}$"
    return ", ".join(f"${symbol}$" for symbol in tex)


def _number(item: GeometryParameter) -> str:
    name = names.parameter(item.name.removeprefix(f"{item.joint}_"))
    return f"${name}$" if item.value == 0 else f"${name} = {number(item.value)}$"
