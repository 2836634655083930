"""The result of an identification, and its report."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.special
from numpy.typing import ArrayLike, NDArray

from chasles import Robot
from chasles.screws import inverse
from chasles.summaries import summary_repr

from .fitting.identifiable import Unidentifiable
from .frame_numbers import shown_numbers
from .measurements.tool_measurements import Measurements, Poses

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

SHOWN = {"m": (1e3, "mm"), "rad": (1e3, "mrad"), "1": (1e3, "‰"), "m/rad": (1e3, "mm/rad")}
"""Factor and unit in which a number of a unit is shown to people."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """Identified parameters, and how well they are known.

    Attributes:
        names: The identified parameters, those of the robot first, then unknowns.
        values: Their values [m, rad, 1].
        deviations: What they differ by from the nominal robot; of unknowns, the values.
        covariance: (k, k) of the values.
        parameter_std: Stated standard deviation of each value about nominal; 0 if it is free.
        p: The whole vector of the robot's geometry.
        unidentifiable: Parameters that the measurements do not distinguish; they keep their values.
        T_W_base: (4, 4) the base frame in the measuring device's.
        nominal_errors: (M,) errors of the nominal robot, in standard deviations.
        errors: (M,) errors of the calibrated robot.
        used: (rows,) whether a row took part; the others contradict it.
        noise: Factor by which the errors exceed the standard deviations that were stated.
        residual_dof: Measured numbers beyond those that determine the variables.
        unknowns: The values of all unknowns of the measurements, such as targets on the tool [m].
        measurements: The measurements, with the frames that were found for them.
        q: (N, n) coordinates at which the tool was measured [rad or m].
        robot: The nominal robot.
        warnings: Suspicious facts, one sentence each: exchanged targets, joints that do not move.
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

    def __repr__(self) -> str:
        """In words, with the figures that matter."""
        return summary_repr(
            self,
            self.robot.name,
            f"{len(self.names)} variables from {len(self.measurements.rows)} measured numbers",
            f"error {self.rms_before:.4g} before, {self.rms_after:.4g} after [standard deviations]",
            f"{len(self.outliers)} rows left out" if self.outliers else "",
            f"{len(self.unidentifiable)} parameters are unidentifiable"
            if self.unidentifiable
            else "",
            f"{len(self.warnings)} warnings" if self.warnings else "",
            methods="print() it for the report; values, confidence_intervals, poses(q)",
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
        """Labels of the rows that were left out."""
        return tuple(np.array(self.measurements.labels)[~self.used].tolist())

    def poses(self, q: ArrayLike) -> FloatArray:
        """Poses (..., 4, 4) of the calibrated robot's tool in the measuring device's frame."""
        return np.asarray(self.T_W_base @ self.robot.fk_p(q, self.p))

    def validation_errors(self, q: ArrayLike, measurements: Measurements) -> FloatArray:
        """Return the errors on measurements that took no part, in their standard deviations.

        Args:
            q: (N, n) coordinates [rad or m].
            measurements: What was measured there, `at` other configurations of the same set-up.
        """
        frames = measurements.placed_as(self.measurements)
        return frames.errors(self.poses(q), self.unknowns)

    @property
    def std(self) -> FloatArray:
        """Standard deviation of each value."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def confidence_intervals(self) -> FloatArray:
        """(k, 2) bounds between which each value lies in 95 of 100 calibrations (Student's t)."""
        reach = float(scipy.special.stdtrit(self.residual_dof, 0.975)) * self.std
        return np.stack([self.values - reach, self.values + reach], -1)

    @property
    def frames(self) -> tuple[tuple[str, FloatArray], ...]:
        """Names and poses (4, 4) of the identified base and tool frames.

        The robot without corrections of its tool defines the nominal tool frame.
        """
        found = [("base frame in the frame of the measurements", self.T_W_base)]
        own = self.p.copy()
        own[[item.part == "tool" for item in self.robot.geometry]] = 0.0
        T_tool = inverse(self.robot.fk_p(self.q[0], own)) @ self.robot.fk_p(self.q[0], self.p)
        if isinstance(self.measurements, Poses):
            probe = T_tool @ self.measurements.T_tool_probe
            found.append(("probe frame in the nominal tool frame", probe))
        elif not np.array_equal(own, self.p):
            found.append(("tool frame in the nominal tool frame", T_tool))
        return tuple(found)

    def __str__(self) -> str:
        """A report for people."""
        return _report(self)

    @property
    def correlations(self) -> FloatArray:
        """(k, k) correlation of the values."""
        return np.asarray(self.covariance / np.outer(self.std, self.std))


def _rms(errors: FloatArray) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def _report(found: Calibration) -> str:
    """Errors before and after, parameters with their 95 % intervals, and what was left out.

    Args:
        found: A calibration.
    """
    lengths, used = found.measurements.lengths, found.used
    before, after = (lengths(e)[used].mean() for e in (found.nominal_errors, found.errors))
    units = {item.name: item.unit for item in found.robot.geometry}
    lines = [
        f"{found.robot.name}: {len(found.names)} variables from {len(found.measurements.rows)} "
        "measured numbers",
        f"mean distance before {1e3 * before:.4g} mm, after {1e3 * after:.4g} mm",
        f"error before {found.rms_before:.4g}, after {found.rms_after:.4g} standard deviations",
        f"noise {found.noise:.3g} times the stated one, sigma = {found.measurements.stated}",
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
    lines += ["", *(f"held at nominal: {item}" for item in found.unidentifiable)]
    lines += [f"left out: {label}" for label in found.outliers]
    lines += [f"warning: {sentence}" for sentence in found.warnings]
    return "\n".join(lines).rstrip()
