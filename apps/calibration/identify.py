"""Identification of a robot's parameters from measurements of its tool.

The modules in `measurements/` first estimate the frames and unknowns with the nominal robot. The
module `input_checks.py` raises an error if the input is wrong. The least-squares fit in `fitting/`
starts from the estimated frames and unknowns.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, Robot, ShapeError
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
    """Identify the geometry parameters of a robot that best explain measurements of its tool.

    Args:
        robot: A robot with parametric functions, as returned by `chasles.load(name,
            parametric=True)`.
        q: (N, n) actuated coordinates at which the tool was measured [rad or m].
        measurements: The field `measurements` of a table from `read_measurements`, or a
            `Positions`, `StationPositions`, `Poses`, `CirclePoints`, `Distances`, `PlaneContacts`
            or `SphereContacts` object. Entry k of the measurement arrays belongs to row k of `q`.
            Positions [m] and poses are in the frame W of the measuring device; `StationPositions`
            are in the frames of the stations.
        vary: One or several names of parameters or parameter groups. All other parameters keep
            their nominal values. `robot.geometry` lists the name (`name`) and the group (`part`) of
            each parameter. The group "axis" contains the positions and tilts of the joint axes.
            "offset" contains the zeros of the joint coordinates. "parameter" contains the named
            parameters of the robot file, such as the radius of a delta robot. The other groups are
            "joint", "transmission", "coupling", "compliance", "loop", "base" and "tool". The
            reference page "Calibration tables" describes all groups. The default "geometry" means
            "axis", and also "loop" for robots with loops. For serial robots, "axis" and "tool" are
            a complete and minimal set of parameters. Two groups are added to every choice: "tool"
            if poses are measured, and "base" if `parameter_std` is set, if "axis" is not varied, or
            if the robot has loops.
        parameter_std: Standard deviations of parameters about their nominal values, in the units of
            the parameters (such as m or rad). A key is a name, a group (`part`) or a unit from
            `robot.geometry`. If several keys match a parameter, a name takes precedence over a
            group, and a group over a unit. A parameter that matches no key is identified from the
            measurements alone. None means no standard deviations. A parameter with a standard
            deviation in `parameter_std` stays near its nominal value if the measurements hardly
            depend on the parameter.
        robust: Whether to exclude outliers from the fit. `Calibration.outliers` lists the excluded
            measurements.
        T_W_base: (4, 4) known pose of the robot's base frame in the device frame W, positions in
            [m]. None means that the pose is identified.
        weights: (N,) weights of the configurations, above 0. With weight 4, the standard deviations
            of the measurements at a configuration are halved. None means 1 for all configurations.

    Returns:
        A `Calibration`. `names` and `values` (k,) [m, rad, 1] contain the identified parameters,
        followed by the unknowns of the measurements, such as target positions on the tool.
        `covariance` (k, k) is the covariance of `values`. `p` contains all geometry parameters of
        the calibrated robot. `poses(q)` returns the tool poses of the calibrated robot in W.
        `errors` (M,) contains the remaining error of each measured value, divided by its standard
        deviation. `unidentifiable` lists the parameters that the measurements do not determine.
        Python's `print` shows a report.

    Raises:
        MissingFunctionError: The robot has no parametric functions.
        InputTypeError: `robot` is not a `Robot`, or `q`, `T_W_base` or `weights` contains values
            that are not real numbers.
        ShapeError: `q` is not (N, n), `T_W_base` is not (4, 4), or `weights` is not (N,). `q` and
            `measurements` have different numbers of configurations.
        InputValueError: `q`, `T_W_base` or `weights` contains a number that is not finite, or a
            weight is not above 0. `vary` names an unknown parameter or group. `parameter_std` has
            an unknown key or a negative value. The number of measured values does not exceed the
            number of values to identify, or too few measurements are consistent with one geometry.
            Units are wrong, joint signs are inverted, or table columns are swapped; the message
            names the mistake. In `CirclePoints`, a circle has no target that is visible in four
            configurations. Along a circle, the rotation of the tool is less than 0.2 rad, or is not
            about a single axis.
    """
    check_type("identify: robot", robot, Robot)
    start = located(robot, q, measurements, T_W_base)
    at = finite("identify: q", q)
    problem = problem_at(robot, at, start, vary, parameter_std)
    counts = np.ones(len(at)) if weights is None else finite("identify: weights", weights)
    if (counts <= 0).any():
        raise InputValueError(f"identify: weights: expected numbers above 0, got {counts.min():g}")
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
        robot: A robot that was loaded with `parametric=True`.
        q: (N, n) coordinates [rad or m].
        measurements: The measurements.
        T_W_base: (4, 4) the base frame in the device frame W, or None to estimate this frame.

    Raises:
        ShapeError: The shape of q does not match the robot, or q and `measurements` have different
            numbers of configurations.
        InputValueError: The units, joint signs or columns of the input are wrong.
    """
    at = finite("identify: q", q)
    if at.shape[1:] != (robot.n,):
        raise ShapeError(f"identify: q must have shape (N, {robot.n}), got {at.shape}")
    if len(at) != len(measurements):
        raise ShapeError(
            f"identify: q has {len(at)} configurations, but the measurements have "
            f"{len(measurements)}; expected one row of q for each configuration"
        )
    start = _without_outliers(measurements._start(T := robot.fk_p(at, nominal(robot))), T)
    check_input(robot, at, nominal(robot), measurements, start.misfit)
    if T_W_base is None:
        return start
    frame = finite("identify: T_W_base", T_W_base, (4, 4))
    return start.measurements._from_frame(frame @ T, start._replace(T_W_base=frame))


def _without_outliers(start: Start, T: FloatArray) -> Start:
    """Estimate the start values again from the measurements that are not outliers.

    Outliers would shift the estimated frame for all measurements.
    """
    measured = start.measurements
    sizes = measured._lengths(measured._errors(start.T_W_base @ T, start.unknowns))
    wrong = measured.configurations[sizes > OUTLYING * np.median(sizes)]
    right = np.setdiff1d(np.arange(len(T)), wrong)
    if not len(wrong) or 2 * len(right) < len(T):
        return start
    found = measured.at(right)._start(T[right])
    return found._replace(measurements=measured._placed_as(found.measurements))
