r"""The table of the geometry as a vector p: the numbers of each joint, loop and frame."""

from collections.abc import Callable, Sequence
from itertools import groupby

from ...model.geometry import GeometryParameter
from ..setting import names
from ..setting.printer import Printer, number
from . import tables

_FEW = 2
"""Most symbols of a run that are all written."""


def parameter_table(found: Sequence[GeometryParameter], printer: Printer) -> str:
    """A row for each part of the base, a joint, a loop and the tool, with values other than 0."""
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
    """Sorts parameters by parts of the robot from base to tool, then by their numbers in p."""
    joints = {item.joint: k for k, item in reversed(list(enumerate(found)))}
    parts = {_place(item): k for k, item in reversed(list(enumerate(found)))}
    return lambda item: (joints[item.joint], parts[_place(item)])


def _range(row: Sequence[GeometryParameter], printer: Printer) -> str:
    """The symbols of a row, the first and the last of a run."""
    tex = [printer.tex(item.symbol) for item in row]
    indices = [int(item.symbol.name[1:]) for item in row]
    if len(row) > _FEW and indices == list(range(indices[0], indices[-1] + 1)):
        return rf"${tex[0]}, \dots, {tex[-1]}$"
    return ", ".join(f"${symbol}$" for symbol in tex)


def _number(item: GeometryParameter) -> str:
    """The name of a number within its part, with its value unless that is zero."""
    name = names.parameter(item.name.removeprefix(f"{item.joint}_"))
    return f"${name}$" if item.value == 0 else f"${name} = {number(item.value)}$"
