"""Creates figures of 8 cm width in colors that color-blind readers can distinguish."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, product
from typing import Any

import numpy as np

COLOURS = ("#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7", "#000000")
"""Colors of Okabe and Ito (2008), which also differ in lightness."""
STYLES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1)), (0, (1, 1)))
WIDTH = 3.15
"""Width of a text column [inch], which is 8 cm."""
FONT = {
    "font.size": 7.5,
    "axes.titlesize": 8,
    "legend.fontsize": 7,
    "axes.linewidth": 0.6,
    "lines.linewidth": 1.1,
}
GREY = "#808080"
PALE = "#e8e8e8"


def panels(height: float, rows: int = 1, columns: int = 1, **given: Any) -> tuple[Any, Any]:
    """Return a figure as wide as a text column, and its axes, with the settings in `FONT`.

    Args:
        height: Height of the figure [inch].
        rows: Number of rows of subplots.
        columns: Number of columns of subplots.
        given: Further arguments of `matplotlib.pyplot.subplots`.
    """
    import matplotlib.pyplot as plt  # noqa: PLC0415

    with plt.rc_context(FONT):
        return plt.subplots(rows, columns, figsize=(WIDTH, height), layout="constrained", **given)


def solid(height: float) -> tuple[Any, Any]:
    """Return a figure as wide as a text column, and its 3D axes."""
    figure, axes = panels(height, subplot_kw={"projection": "3d"})
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_tick_params(pad=-2)
        axis.labelpad = -5
    return figure, axes


def curves(axes: Any, t: Any, values: Any, names: Sequence[str], label: str) -> None:
    """Plot columns of values over time, each with its own color and style.

    Args:
        axes: Axes of the plot.
        t: (m,) times [s].
        values: (m, n) values to plot.
        names: Names of the n columns.
        label: Label of the vertical axis, with the unit.
    """
    for k, (column, name) in enumerate(zip(np.asarray(values).T, names, strict=True)):
        axes.plot(t, column, color=COLOURS[k % 6], linestyle=STYLES[k % 6], label=name)
    axes.set_ylabel(label)
    axes.set_xlabel("time [s]")
    axes.grid(alpha=0.3)
    axes.margins(x=0.01)


def legend_below(figure: Any, axes: Any, columns: int) -> None:
    """Place the legend of the axes under the figure."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside lower center", ncols=columns, fontsize=7, frameon=False
    )


def plane(axes: Any, across: str = "x [m]", up: str = "y [m]") -> None:
    """Set equal scales, a grid and axis labels for a planar plot."""
    axes.set_aspect("equal")
    axes.set_xlabel(across)
    axes.set_ylabel(up)
    axes.grid(alpha=0.3)
    axes.set_axisbelow(True)


def edges(axes: Any, lower: Any, upper: Any, **style: Any) -> None:
    """Draw the twelve edges of an axis-aligned box as lines."""
    corners = np.array(list(product(*zip(lower, upper, strict=True))))
    for a, b in combinations(corners, 2):
        if np.count_nonzero(a != b) == 1:
            axes.plot(*np.array([a, b]).T, **style)
