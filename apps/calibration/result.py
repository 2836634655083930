"""Result of a calibration, with its text report, plots and files."""

from __future__ import annotations

import csv
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Self, cast

import numpy as np
import scipy.special
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, Robot, load, se3
from chasles.contract import output_file, requires
from chasles.summaries import summary_repr

from ..study.results import StudyResult, by_suffix
from .calibrated_file import robot_file
from .fitting.identifiable import Unidentifiable
from .measurements.circles import CirclePoints
from .measurements.contacts import Distances, PlaneContacts, SphereContacts
from .measurements.stations import StationPositions
from .measurements.tool_measurements import Measurements, Poses, Positions
from .shown_numbers import SHOWN, shown_numbers

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Calibration(StudyResult):
    """Identified parameters of a robot, with their uncertainty.

    Attributes:
        names: (k,) names of the identified parameters, followed by the unknowns of the
            measurements.
        values: (k,) identified values, in the order of `names` [m, rad, 1].
        deviations: (k,) differences from the nominal values of the parameters. For unknowns, the
            deviations are the identified values.
        covariance: (k, k) covariance of `values`.
        parameter_std: (k,) standard deviation of each value about its nominal value, from the
            argument `parameter_std` of `identify`, or 0 without one.
        p: All geometry parameters of the calibrated robot, in the order of `robot.geometry`.
        unidentifiable: Parameters that the measurements do not determine.
        T_W_base: (4, 4) pose of the base frame in the frame W of the measuring device.
        nominal_errors: (M,) error of each measured value with the nominal robot, divided by its
            standard deviation.
        errors: (M,) error of each measured value with the calibrated robot, divided by its standard
            deviation.
        used: (rows,) mask of the measurement rows that the fit used. The mask is false for
            outliers.
        noise: Ratio of the estimated to the stated standard deviations of the measurements.
        residual_dof: Number of measured values minus number of fitted variables.
        unknowns: Values of all unknowns of the measurements, such as target positions in the tool
            frame [m].
        measurements: The measurements, with their estimated frames.
        q: (N, n) actuated coordinates at which the tool was measured [rad or m].
        robot: The nominal robot.
        warnings: Sentences about suspicious data, such as swapped targets.
        model_errors: Name and median cross-validation error [m] of each model that `select_model`
            compared. After `identify`, `model_errors` is empty.
    """

    names: tuple[str, ...]
    values: FloatArray
    deviations: FloatArray
    covariance: FloatArray
    parameter_std: FloatArray
    p: FloatArray
    unidentifiable: tuple[Unidentifiable, ...]
    T_W_base: FloatArray
    nominal_errors: FloatArray
    errors: FloatArray
    used: BoolArray
    noise: float
    residual_dof: int
    unknowns: FloatArray
    measurements: Measurements
    q: FloatArray
    robot: Robot
    warnings: tuple[str, ...] = ()
    model_errors: tuple[tuple[str, float], ...] = ()

    _parts: ClassVar[tuple[type, ...]] = (
        CirclePoints,
        Distances,
        PlaneContacts,
        Poses,
        Positions,
        SphereContacts,
        StationPositions,
        Unidentifiable,
    )

    def __repr__(self) -> str:
        """Return a short summary of the calibration with its main values."""
        return summary_repr(
            self,
            self.robot.name,
            f"{len(self.names)} variables from {len(self.measurements.rows)} measured values",
            f"error {self.rms_before:.4g} before, {self.rms_after:.4g} after [standard deviations]",
            f"{len(self.outliers)} outliers" if self.outliers else "",
            f"{len(self.unidentifiable)} parameters are unidentifiable"
            if self.unidentifiable
            else "",
            f"{len(self.warnings)} warnings" if self.warnings else "",
            methods="print() it for the report; poses(q), plot(), save(path)",
        )

    @property
    def rms_before(self) -> float:
        """Root mean square error of the nominal robot, in standard deviations."""
        return _rms(self.nominal_errors[self.used[self.measurements.rows]])

    @property
    def rms_after(self) -> float:
        """Root mean square error of the calibrated robot, in standard deviations."""
        return _rms(self.errors[self.used[self.measurements.rows]])

    @property
    def outliers(self) -> tuple[str, ...]:
        """Labels of the excluded measurement rows."""
        return tuple(np.array(self.measurements.labels)[~self.used].tolist())

    def poses(self, q: ArrayLike) -> FloatArray:
        """Return tool poses (..., 4, 4) of the calibrated robot in the device frame W."""
        return np.asarray(self.T_W_base @ self.robot.fk_p(q, self.p))

    def validation_errors(self, q: ArrayLike, measurements: Measurements) -> FloatArray:
        """Return the errors of additional measurements, divided by their standard deviations.

        Args:
            q: (N, n) actuated coordinates of these measurements [rad or m].
            measurements: Measurements at the configurations `q`. The device and the targets must
                have the same poses as during the calibration.
        """
        frames = measurements._placed_as(self.measurements)
        return frames._errors(self.poses(q), self.unknowns)

    @property
    def std(self) -> FloatArray:
        """(k,) standard deviation of each value in `values`."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def confidence_intervals(self) -> FloatArray:
        """(k, 2) bounds of the 95 % confidence interval of each value (Student's t)."""
        reach = float(scipy.special.stdtrit(self.residual_dof, 0.975)) * self.std
        return np.stack([self.values - reach, self.values + reach], -1)

    @property
    def frames(self) -> tuple[tuple[str, FloatArray], ...]:
        """Names and poses (4, 4) of the identified base and tool frames."""
        found = [("base frame in the frame of the measurements", self.T_W_base)]
        own = self.p.copy()
        own[[item.part == "tool" for item in self.robot.geometry]] = 0.0
        T_tool = se3.inverse(self.robot.fk_p(self.q[0], own)) @ self.robot.fk_p(self.q[0], self.p)
        if isinstance(self.measurements, Poses):
            probe = T_tool @ self.measurements.T_tool_probe
            found.append(("probe frame in the nominal tool frame", probe))
        elif not np.array_equal(own, self.p):
            found.append(("tool frame in the nominal tool frame", T_tool))
        return tuple(found)

    def __str__(self) -> str:
        """Return the report as text."""
        return _report(self)

    def plot(self, ax: Any = None) -> Any:
        """Plot the errors of all configurations before and after the calibration [mm].

        Args:
            ax: matplotlib axes, or None for a new figure 8 cm wide.

        Returns:
            The axes.
        """
        with requires("chasles[calibration]"):
            from .report.plots import plot_residuals  # noqa: PLC0415

        return plot_residuals(self, ax)

    def plot_parameters(self, ax: Any = None) -> Any:
        """Plot the most significant parameter changes with 95 % confidence intervals [mm, mrad].

        Args:
            ax: matplotlib axes, or None for a new figure 8 cm wide.

        Returns:
            The axes.
        """
        with requires("chasles[calibration]"):
            from .report.plots import plot_parameters  # noqa: PLC0415

        return plot_parameters(self, ax)

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        name: str | None = None,
        source: str = "",
        nominal: str | None = None,
    ) -> None:
        """Write the calibration to a file in the format that the suffix of its name selects.

        A .toml file is the robot file of the calibrated robot. An .html or .tex file is a one-page
        report. A .csv file is a table of the parameters. An .npz file contains all data, and
        `Calibration.load` reads it.

        Args:
            path: The file. Plots of a .tex report are PDF files next to the report.
            name: Name of the calibrated robot in a .toml file, or None for the stem of the path.
            source: Text for the field `source` of a .toml file. If `source` is empty, the .toml
                file repeats the source of the nominal robot.
            nominal: Name or file of the nominal robot in a .toml file. For a robot with loops, the
                inverse kinematics solves this nominal robot and then refines each solution. If
                `nominal` is None, the compiler infers a nominal robot by rounding lengths.

        Raises:
            InputValueError: The suffix of the path is not supported, or a .toml file is requested
                for a robot in which a coordinate moves several joints.
        """

        def write_toml(path: Path) -> None:
            origin = source or self.robot.source
            text = robot_file(self.robot, self.p, name or path.stem, origin, nominal or "")
            with output_file(path) as target:
                target.write_text(text, encoding="utf-8")

        def write_report(path: Path) -> None:
            with requires("chasles[calibration]"):
                from .report import page, tex_page  # noqa: PLC0415

            if path.suffix == ".tex":
                tex_page.write_tex(self, path)
            else:
                text = page.html_page(self)
                with output_file(path) as target:
                    target.write_text(text, encoding="utf-8")

        writers = {
            ".toml": write_toml,
            ".html": write_report,
            ".tex": write_report,
            ".csv": self.to_csv,
            ".npz": self.to_npz,
        }
        by_suffix(path, writers)(Path(path))

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write nominal value, change, value and confidence interval of each parameter as CSV."""
        head = ("nominal", "change", "value", "lower", "upper")
        nominal = self.values - self.deviations
        rows = np.column_stack([nominal, self.deviations, self.values, self.confidence_intervals])
        units = {item.name: item.unit for item in self.robot.geometry}
        with output_file(path) as target, target.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(["parameter", "unit", *head])
            for own, row in zip(self.names, rows.tolist(), strict=True):
                writer.writerow([own, units.get(own, "m"), *map(repr, row)])

    def to_npz(self, path: str | os.PathLike[str]) -> None:
        """Write all data of the calibration to a compressed .npz file."""
        # The file contains the name of the robot instead of the robot itself.
        StudyResult.to_npz(replace(self, robot=cast(Any, self.robot.name)), path)

    @classmethod
    def load(cls, path: str | os.PathLike[str], robot: Robot | None = None) -> Self:
        """Return the calibration that `to_npz` wrote.

        Args:
            path: The .npz file.
            robot: The nominal robot with parametric functions, or None to load the robot by name.

        Raises:
            InputValueError: The suffix is not .npz, or the file contains no calibration of this
                robot.
            UnknownRobotError: The robot named in the file is unknown. Pass `robot`.
        """
        found = super().load(path)
        name = str(found.robot)
        if robot is not None and robot.name != name:
            raise InputValueError(f"{path}: expected robot {name}, got robot {robot.name}")
        if robot is None and not name.isidentifier():
            # A robot name that is a path could load code from any folder.
            raise InputValueError(f"{path}: expected the name of a robot, got {name!r}; pass robot")
        return replace(found, robot=robot or load(name, parametric=True))

    @property
    def correlations(self) -> FloatArray:
        """(k, k) correlation matrix of the identified values."""
        return np.asarray(self.covariance / np.outer(self.std, self.std))


def _rms(errors: FloatArray) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def _report(found: Calibration) -> str:
    """Return the report as text."""
    lengths, used = found.measurements._lengths, found.used
    before, after = (lengths(e)[used].mean() for e in (found.nominal_errors, found.errors))
    units = {item.name: item.unit for item in found.robot.geometry}
    lines = [
        f"{found.robot.name}: {len(found.names)} variables from {len(found.measurements.rows)} "
        "measured values",
        f"mean distance before {1e3 * before:.4g} mm, after {1e3 * after:.4g} mm",
        f"error before {found.rms_before:.4g}, after {found.rms_after:.4g} standard deviations",
        f"noise {found.noise:.3g} times the stated noise, sigma = {found.measurements._stated}",
        "",
        f"{'frame':<46}{'x':>12}{'y':>12}{'z mm':>12}{'roll':>12}{'pitch':>12}{'yaw deg':>12}",
        *(f"{name:<46}{''.join(f'{x:>12}' for x in shown_numbers(T))}" for name, T in found.frames),
        "",
        f"{'parameter':<28}{'nominal':>12}{'change':>12}{'+-95 %':>10}",
    ]
    reach = (found.confidence_intervals[:, 1] - found.confidence_intervals[:, 0]) / 2
    rows = zip(found.names, found.values, found.deviations, reach, strict=True)
    for name, value, deviation, half in rows:
        factor, unit = SHOWN[units.get(name, "m")]
        nominal, change, half_width = (factor * x for x in (value - deviation, deviation, half))
        lines.append(f"{name:<28}{nominal:12.4f}{change:+12.4f}{half_width:10.4f} {unit}")
    lines += ["", *(f"fixed at nominal: {item}" for item in found.unidentifiable)]
    lines += [f"left out: {label}" for label in found.outliers]
    lines += [f"warning: {sentence}" for sentence in found.warnings]
    return "\n".join(lines).rstrip()
