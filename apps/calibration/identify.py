"""Identification: the parameters of a robot from measurements of its tool.

Frames and unknowns have a closed form at the nominal robot (`measurements/frames.py`). Wrong
input is an error (`input_checks.py`). The least-squares fit starts from there (`fitting/`).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import Robot, ShapeError

from .fitting.noise import OUTLYING
from .fitting.problem import in_one_thread, problem_at, problem_nearby
from .input_checks import check_input, check_result
from .measurements.tool_measurements import Measurements, Start
from .parameters import GEOMETRY, nominal
from .result import Calibration

FloatArray = NDArray[np.float64]


@in_one_thread
def identify(
    robot: Robot,
    q: ArrayLike,
    measurements: Measurements,
    *,
    vary: str | Collection[str] = GEOMETRY,
    parameter_std: Mapping[str, float] | None = None,
    robust: bool = True,
    T_W_base: ArrayLike | None = None,
    weights: ArrayLike | None = None,
) -> Calibration:
    """Identify the parameters with which a robot explains measurements best.

    Args:
        robot: A robot with parametric functions, `chasles.load(name, parametric=True)`.
        q: (N, n) coordinates at which the tool was measured [rad or m].
        measurements: The measurements.
        vary: Parameters that may differ from nominal: names, or parts of the model ("joint",
            "offset", "axis", "transmission", "compliance", "loop", "base", "tool"), or one of
            these. "geometry" is every length, angle and offset that measurements may show, "axis"
            and in robots with loops "loop". With the tool's corrections, which are added where
            poses are measured, it is complete and minimal for every serial robot. Without "axis",
            with `parameter_std` and for robots with loops, the corrections of the base are added.
        parameter_std: Standard deviations of parameters about their nominal values [m, rad, 1] by
            name, part or unit, as in :func:`~chasles.calibration.first_order_errors`. Parameters
            that the measurements hardly show stay near nominal.
        T_W_base: (4, 4) the base frame in the device's, where it is known; it is found otherwise.
        robust: Whether rows that contradict the others are left out and named.
        weights: (N,) weight of each configuration; 4 halves its standard deviations.

    Raises:
        ShapeError: q does not fit the robot.
        InputValueError: There are fewer measurements than variables, an unknown name in vary, or a
            mistake in units, signs or columns with whose correction the measurements fit.
    """
    start = located(robot, q, measurements, T_W_base)
    at = np.asarray(q, dtype=np.float64)
    problem = problem_at(robot, at, start, vary, parameter_std)
    counts = np.ones(len(at)) if weights is None else np.asarray(weights, dtype=np.float64)
    before = problem.weighted(counts).errors(problem.x0)
    if robot.kind != "serial":
        problem = problem_nearby(problem, start, vary, parameter_std, robust=robust)
    solved = problem.weighted(counts).solved(problem.x0, robust=robust)
    found = replace(solved, nominal_errors=before)
    check_result(found, vary)
    return found


def located(
    robot: Robot, q: ArrayLike, measurements: Measurements, T_W_base: ArrayLike | None = None
) -> Start:
    """Frames and unknowns from the nominal robot, with units checked.

    Args:
        robot: A robot with parametric functions.
        q: (N, n) coordinates [rad or m].
        measurements: The measurements.
        T_W_base: (4, 4) the base frame in the device's, where it is known.

    Raises:
        ShapeError: q does not fit the robot.
        InputValueError: Units are wrong.
    """
    at = np.asarray(q, dtype=np.float64)
    if at.shape[1:] != (robot.n,):
        raise ShapeError(f"identify: q must have shape (N, {robot.n}), got {at.shape}")
    start = _without_outliers(measurements.start(T := robot.fk_p(at, nominal(robot))), T)
    check_input(robot, at, nominal(robot), measurements, start.misfit)
    if T_W_base is None:
        return start
    frame = np.asarray(T_W_base, dtype=np.float64)
    return start.measurements.from_frame(frame @ T, start._replace(T_W_base=frame))


def _without_outliers(start: Start, T: FloatArray) -> Start:
    """The start from configurations that agree: one wrong row moves the frame of all."""
    measured = start.measurements
    sizes = measured.lengths(measured.errors(start.T_W_base @ T, start.unknowns))
    wrong = measured.configurations[sizes > OUTLYING * np.median(sizes)]
    right = np.setdiff1d(np.arange(len(T)), wrong)
    if not len(wrong) or 2 * len(right) < len(T):
        return start
    found = measured.at(right).start(T[right])
    return found._replace(measurements=measured.placed_as(found.measurements))
