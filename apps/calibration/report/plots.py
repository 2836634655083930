"""Plots of calibrations, of planned measurements and of tool errors.

Color-blind readers can distinguish the colors (Okabe and Ito, Color universal design, 2008). In
black-and-white print, different marker shapes distinguish the curves.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from ..shown_numbers import SHOWN
from .contents import MM, lengths

if TYPE_CHECKING:
    from chasles.calibration import Calibration, Design, FirstOrderErrors, MonteCarloErrors

_WIDTH, _HEIGHT = 8 / 2.54, 5 / 2.54
"""Width and height of a new figure [inch]. The width is 8 cm, as in a printed column, and the
height is 5 cm."""
_ORANGE, _BLUE, _BLACK = "#E69F00", "#0072B2", "#000000"
_MAX_PARAMETERS = 12
_PLAIN = FuncFormatter(lambda value, _: f"{value:g}")


def plot_residuals(found: Calibration, ax: Any = None) -> Any:
    """Plot the errors [mm] before and after the calibration, on a logarithmic axis."""
    if ax is None:
        return _on_new_figure(plot_residuals, found)
    before, after = lengths(found)
    at, used = found.measurements.configurations + 1, found.used
    ax.semilogy(at, MM * before, "s", color=_ORANGE, label="before", fillstyle="none")
    ax.semilogy(at[used], MM * after[used], "o", color=_BLUE, label="after")
    if not used.all():
        ax.semilogy(at[~used], MM * after[~used], "x", color=_BLACK, ms=4, label="left out")
    ax.margins(x=0.03, y=0.1)
    ax.yaxis.set_major_formatter(_PLAIN)
    ax.yaxis.set_minor_formatter("")
    ax.set_xlabel("configuration")
    ax.set_ylabel("error [mm]")
    ax.legend(ncols=3, frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return ax


def plot_parameters(found: Calibration, ax: Any = None) -> Any:
    """Plot the most significant parameter changes with their 95 % intervals [mm, mrad, 1]."""
    if ax is None:
        return _on_new_figure(plot_parameters, found)
    units = {item.name: item.unit for item in found.robot.geometry if item.part != "base"}
    reach = (found.confidence_intervals[:, 1] - found.confidence_intervals[:, 0]) / 2
    own = np.flatnonzero([name in units for name in found.names])
    clear = own[np.argsort(-np.abs(found.deviations[own]) / reach[own])[:_MAX_PARAMETERS][::-1]]
    shown = [SHOWN[units[found.names[k]]] for k in clear]
    factors = np.array([factor for factor, _ in shown])
    changes, half = factors * found.deviations[clear], factors * reach[clear]
    rows = np.arange(len(clear))
    ax.errorbar(changes, rows, xerr=half, fmt="o", color=_BLUE, lw=1, capsize=2)
    ax.axvline(0, color=_BLACK, lw=0.5)
    names = [f"{found.names[k]} [{unit}]" for k, (_, unit) in zip(clear, shown, strict=True)]
    ax.set_yticks(rows, names)
    ax.margins(x=0.08)
    ax.set_xlabel("change, 95 % interval")
    return ax


def plot_effects(found: FirstOrderErrors, ax: Any = None) -> Any:
    """Plot the root mean square tool displacement [mm] that each parameter alone causes."""
    if ax is None:
        return _on_new_figure(plot_effects, found)
    shown = slice(min(_MAX_PARAMETERS, len(found.names)))
    names, effects = found.names[shown][::-1], found.effects[shown][::-1]
    ax.barh(names, MM * effects, color=_BLUE, height=0.6)
    ax.set_xlabel("displacement of the tool [mm]")
    return ax


def plot_distribution(found: MonteCarloErrors, ax: Any = None) -> Any:
    """Plot the cumulative distribution of the position error [mm] of random arms."""
    if ax is None:
        return _on_new_figure(plot_distribution, found)
    errors = np.sort(found.position)
    ax.step(MM * errors, np.arange(1, len(errors) + 1) / len(errors), color=_BLUE, lw=1)
    ax.set_ylim(0, 1.02)
    ax.set_xlim(left=0)
    ax.set_xlabel("position error [mm]")
    ax.set_ylabel("fraction of arms")
    return ax


def plot_deviations(found: Design, ax: Any = None) -> Any:
    """Plot the largest standard deviations of parameters [m, rad, 1] on a logarithmic axis."""
    if ax is None:
        return _on_new_figure(plot_deviations, found)
    shown = np.argsort(-found.std)[:_MAX_PARAMETERS][::-1]
    ax.semilogx(found.std[shown], [found.names[k] for k in shown], "o", color=_BLUE)
    ax.set_xlabel("standard deviation [m, rad]")
    ax.grid(axis="x", alpha=0.3)
    return ax


def _on_new_figure(plot: Any, found: Any) -> Any:
    """Draw a plot with a small font in a new figure, and return its axes."""
    with matplotlib.rc_context({"font.size": 7, "lines.markersize": 2.5}):
        figure = Figure(figsize=(_WIDTH, _HEIGHT), layout="constrained")
        axes = figure.add_subplot()
        axes.spines[["top", "right"]].set_visible(False)
        return plot(found, axes)
