"""Identification of a robot's parameters from measurements of its tool.

For the nominal robot, frames and unknowns are computed in closed form (`measurements/frames.py`).
Wrong input raises an error (`input_checks.py`). The least-squares fit starts from the closed-form
values (`fitting/`).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import Robot, ShapeError
from chasles.contract import check_type

from ..study.arguments import finite
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
    """Identify the parameters of a robot that fit the measurements best.

    Args:
        robot: A robot with parametric functions, as returned by `chasles.load(name,
            parametric=True)`.
        q: (N, n) actuated coordinates at which the tool was measured [rad or m].
        measurements: `Positions`, `StationPositions`, `Poses`, `CirclePoints`, `Distances`,
            `PlaneContacts` or `SphereContacts` at the N configurations. Positions are in the frame
            W of the measuring device [m].
        vary: One or several names of parameters or parameter groups. Only these parameters may
            differ from their nominal values. The groups are "parameter", "joint", "offset", "axis",
            "transmission", "coupling", "compliance", "loop", "base" and "tool". The reference page
            "Calibration tables" describes the groups. "parameter" means the named parameters of the
            description, such as the radius of a delta robot. A named parameter changes every value
            that depends on it. The default "geometry" stands for "axis", which contains all
            lengths, angles and offsets. For robots with loops, "geometry" also includes "loop". If
            poses are measured, corrections of the tool frame are added. For serial robots,
            "geometry" and the tool corrections are a complete and minimal set of parameters.
            Corrections of the base frame are added if `parameter_std` is set, if "axis" is not
            varied, or if the robot has loops.
        parameter_std: Standard deviations of parameters about their nominal values [m, rad, 1]. The
            keys are names, groups or units ("m", "rad", "1") of parameters. A name takes precedence
            over a group, and a group over a unit. A parameter without a key may differ from its
            nominal value freely. None means no standard deviations. Parameters with a standard
            deviation stay near nominal if they have little effect on the measurements.
        robust: Whether to exclude outliers from the fit. The result lists the excluded rows.
        T_W_base: (4, 4) pose of the base frame in the device frame W, with its position in [m].
            None means that the pose is identified.
        weights: (N,) weights of the configurations, above 0. A weight of 4 halves the standard
            deviations of the measurements at its configuration. None means equal weights of 1.

    Returns:
        A `Calibration`. `names` and `values` (k,) contain the identified parameters and the
        unknowns of the measurements [m, rad, 1]. `covariance` (k, k) is the covariance of the
        values. `p` contains all parameters of the calibrated robot. `poses(q)` returns the tool
        poses of the calibrated robot in W. `errors` (M,) contains the remaining errors in standard
        deviations. `unidentifiable` lists the parameters that the measurements do not determine.
        `print` shows a report.

    Raises:
        MissingFunctionError: The robot has no parametric functions.
        InputTypeError: `robot` is not a `Robot`, or `q`, `T_W_base` or `weights` contains values
            that are not real numbers.
        ShapeError: `q` is not (N, n), `T_W_base` is not (4, 4), or `weights` is not (N,).
        InputValueError: `q` contains a number that is not finite, or a name is not a parameter, a
            group or a unit. The measurements are fewer than the variables. The measurements fit
            much better with other units, joint signs or columns; the message states the probable
            mistake. A circle of `CirclePoints` has too few visible positions, or the tool rotates
            too little. Too few measurements agree with one another. A number in `T_W_base` or
            `weights` is not finite.
        ValueError: `q` and the measurements have different numbers of configurations. For
            `Positions`, this may be an IndexError instead.
    """
    check_type("identify: robot", robot, Robot)
    start = located(robot, q, measurements, T_W_base)
    at = finite("identify: q", q)
    problem = problem_at(robot, at, start, vary, parameter_std)
    counts = np.ones(len(at)) if weights is None else finite("identify: weights", weights)
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
    """Estimate the frames and unknowns with the nominal robot, and check the input data.

    Args:
        robot: A robot with parametric functions.
        q: (N, n) coordinates [rad or m].
        measurements: The measurements.
        T_W_base: (4, 4) the base frame in the device frame W, or None to estimate this frame.

    Raises:
        ShapeError: The shape of q does not match the robot.
        InputValueError: Units, signs or columns are wrong.
    """
    at = finite("identify: q", q)
    if at.shape[1:] != (robot.n,):
        raise ShapeError(f"identify: q must have shape (N, {robot.n}), got {at.shape}")
    start = _without_outliers(measurements._start(T := robot.fk_p(at, nominal(robot))), T)
    check_input(robot, at, nominal(robot), measurements, start.misfit)
    if T_W_base is None:
        return start
    frame = finite("identify: T_W_base", T_W_base, (4, 4))
    return start.measurements._from_frame(frame @ T, start._replace(T_W_base=frame))


def _without_outliers(start: Start, T: FloatArray) -> Start:
    """Estimate the start values again from the measurements that are not outliers.

    Outliers would shift the frame of all rows.
    """
    measured = start.measurements
    sizes = measured._lengths(measured._errors(start.T_W_base @ T, start.unknowns))
    wrong = measured.configurations[sizes > OUTLYING * np.median(sizes)]
    right = np.setdiff1d(np.arange(len(T)), wrong)
    if not len(wrong) or 2 * len(right) < len(T):
        return start
    found = measured.at(right)._start(T[right])
    return found._replace(measurements=measured._placed_as(found.measurements))
