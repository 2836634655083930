"""Plots of a calibration, 8 cm wide: residuals before and after, and parameters with intervals.

The colours are told apart by people who see red and green alike, and the markers in black and white
(Okabe and Ito, Color universal design, 2008).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ..result import SHOWN, Calibration
from .contents import MM, lengths

_WIDTH, _HEIGHT = 8 / 2.54, 5 / 2.54
_ORANGE, _BLUE, _BLACK = "#E69F00", "#0072B2", "#000000"
_FONT = 7
_LARGEST = 12


def residual_plot(found: Calibration) -> Figure:
    """Errors of all rows before and after [mm], by configuration; a logarithmic axis.

    Args:
        found: A calibration.
    """
    figure, axes = _empty()
    before, after = lengths(found)
    at, used = found.measurements.configurations + 1, found.used
    axes.semilogy(at, MM * before, "s", color=_ORANGE, ms=2.5, label="before", fillstyle="none")
    axes.semilogy(at[used], MM * after[used], "o", color=_BLUE, ms=2, label="after")
    if not used.all():
        axes.semilogy(at[~used], MM * after[~used], "x", color=_BLACK, ms=4, label="left out")
    axes.set_xlabel("configuration", fontsize=_FONT)
    axes.set_ylabel("error [mm]", fontsize=_FONT)
    axes.legend(
        fontsize=_FONT, ncols=3, frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0)
    )
    return figure


def parameter_plot(found: Calibration) -> Figure:
    """The clearest changes of parameters with their 95 % intervals [mm, mrad, 1].

    Args:
        found: A calibration.
    """
    figure, axes = _empty()
    units = {item.name: item.unit for item in found.robot.geometry if item.part != "base"}
    reach = (found.confidence_intervals[:, 1] - found.confidence_intervals[:, 0]) / 2
    own = np.flatnonzero([name in units for name in found.names])
    clear = own[np.argsort(-np.abs(found.deviations[own]) / reach[own])[:_LARGEST][::-1]]
    shown = [SHOWN[units[found.names[k]]] for k in clear]
    factors = np.array([factor for factor, _ in shown])
    axes.errorbar(
        factors * found.deviations[clear],
        np.arange(len(clear)),
        xerr=factors * reach[clear],
        fmt="o",
        color=_BLUE,
        ms=2.5,
        lw=1,
        capsize=2,
    )
    axes.axvline(0, color=_BLACK, lw=0.5)
    names = [f"{found.names[k]} [{unit}]" for k, (_, unit) in zip(clear, shown, strict=True)]
    axes.set_yticks(np.arange(len(clear)), names)
    axes.set_xscale("symlog", linthresh=1.0)
    axes.set_xlabel("change from nominal, with 95 % interval", fontsize=_FONT)
    return figure


def _empty() -> tuple[Figure, Any]:
    figure = Figure(figsize=(_WIDTH, _HEIGHT), layout="constrained")
    axes = figure.add_subplot()
    axes.tick_params(labelsize=_FONT)
    axes.spines[["top", "right"]].set_visible(False)
    return figure, axes
