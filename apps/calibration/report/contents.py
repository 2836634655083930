"""Contents of a report as plain data, shared by the HTML and LaTeX reports."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..shown_numbers import SHOWN, shown_numbers

if TYPE_CHECKING:
    from chasles.calibration import Calibration

FloatArray = NDArray[np.float64]

MM = 1e3
STRONG = 0.9
"""The report lists pairs of parameters whose absolute correlation exceeds this value. Parameters
with a stronger correlation are hard to distinguish."""
_LISTED = 8
_SHOWN_OUTLIERS = 12


@dataclass(frozen=True)
class Table:
    """A table of a calibration report.

    Attributes:
        title: Title of the table.
        heading: Column names of the table, with units.
        rows: Cells of each row in the table.
    """

    title: str
    heading: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Contents:
    """All sentences and tables of a calibration report.

    Attributes:
        title: Title of the report page.
        summary: Sentences of the report's summary.
        parameters: Table of the parameter values and their 95 % confidence intervals.
        tables: Tables with the errors of each target, the frames, the validation errors of the
            models, and the strong correlations.
        notes: Warnings, and sentences about excluded measurement rows and unidentifiable
            parameters.
    """

    title: str
    summary: tuple[str, ...]
    parameters: Table
    tables: tuple[Table, ...]
    notes: tuple[str, ...]


def contents(found: Calibration) -> Contents:
    """Return the title, sentences and tables of a calibration report."""
    before, after = lengths(found)
    used = found.used
    summary = (
        f"{len(found.names)} variables are identified from {len(found.measurements.rows)} "
        f"measured values at {len(found.q)} configurations.",
        f"Mean error {MM * before[used].mean():.3f} mm before, {MM * after[used].mean():.3f} mm "
        f"after; largest {MM * before[used].max():.3f} mm before, {MM * after[used].max():.3f} mm "
        "after.",
        f"The noise is {found.noise:.3g} times the stated noise, sigma = "
        f"{found.measurements._stated}.",
    )
    tables = [_of_targets(found, before, after), _of_frames(found)]
    if found.model_errors:
        rows = tuple((name, f"{MM * error:.3f}") for name, error in found.model_errors)
        tables.append(Table("Models, validation error", ("model", "median [mm]"), rows))
    if strong := _correlated(found):
        tables.append(Table("Strong correlations", ("parameters", "", "r"), strong))
    return Contents(
        f"{found.robot.title}: calibration",
        summary,
        _of_parameters(found),
        tuple(tables),
        (
            *found.warnings,
            *_left_out(found),
            *(f"Fixed at nominal: {item}." for item in found.unidentifiable),
        ),
    )


def lengths(found: Calibration) -> tuple[FloatArray, FloatArray]:
    """Return the distance errors of all measurement rows before and after the calibration [m]."""
    measured = found.measurements
    return measured._lengths(found.nominal_errors), measured._lengths(found.errors)


def _of_targets(found: Calibration, before: FloatArray, after: FloatArray) -> Table:
    names = np.array(found.measurements.targets)
    rows = []
    for name in dict.fromkeys(names.tolist()):
        own = (names == name) & found.used
        cells = (before[own].mean(), after[own].mean(), after[own].max()) if own.any() else ()
        rows.append((name, str(int(own.sum())), *(f"{MM * x:.3f}" for x in cells)))
    heading = ("measured", "number", "before [mm]", "after [mm]", "largest after [mm]")
    return Table("Errors by target", heading, tuple(rows))


def _of_frames(found: Calibration) -> Table:
    heading = ("frame", "x [mm]", "y [mm]", "z [mm]", "roll [deg]", "pitch [deg]", "yaw [deg]")
    return Table("Frames", heading, tuple((name, *shown_numbers(T)) for name, T in found.frames))


def _of_parameters(found: Calibration) -> Table:
    units = {item.name: item.unit for item in found.robot.geometry}
    # The parameter table omits base corrections, because the base frame in the device frame already
    # includes them.
    parts = {item.name: item.part for item in found.robot.geometry}
    reach = (found.confidence_intervals[:, 1] - found.confidence_intervals[:, 0]) / 2
    rows = []
    for name, value, change, half in zip(
        found.names, found.values, found.deviations, reach, strict=True
    ):
        if parts.get(name) == "base":
            continue
        factor, unit = SHOWN[units.get(name, "m")]
        numbers = (factor * (value - change), factor * change, factor * half)
        shown = ("{:.3f}", "{:+.3f}", "{:.3f}")
        cells = (form.format(x) for form, x in zip(shown, numbers, strict=True))
        rows.append((name, *cells, unit))
    heading = ("parameter", "nominal", "change", "± 95 %", "unit")
    return Table("Parameters", heading, tuple(rows))


def _correlated(found: Calibration) -> tuple[tuple[str, ...], ...]:
    base = {item.name for item in found.robot.geometry if item.part == "base"}
    own = np.array([name not in base for name in found.names])
    r = np.triu(found.correlations * np.outer(own, own), 1)
    order = np.argsort(-np.abs(r), axis=None)[:_LISTED]
    pairs = [np.unravel_index(k, r.shape) for k in order]
    return tuple(
        (found.names[i], found.names[j], f"{r[i, j]:+.3f}")
        for i, j in pairs
        if abs(r[i, j]) > STRONG
    )


def _left_out(found: Calibration) -> tuple[str, ...]:
    labels = found.outliers
    if not labels:
        return ("No measurement was left out.",)
    more = f" and {len(labels) - _SHOWN_OUTLIERS} more" if len(labels) > _SHOWN_OUTLIERS else ""
    return (f"Left out as contradicting the others: {'; '.join(labels[:_SHOWN_OUTLIERS])}{more}.",)
