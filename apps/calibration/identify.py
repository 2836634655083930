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
        robot: A robot with parametric functions, `chasles.load(name, parametric=True)`.
        q: (N, n) coordinates at which the tool was measured [rad or m].
        measurements: The measurements.
        vary: One or several names of parameters or parameter groups. These parameters may differ
            from their nominal values. The groups are "parameter", "joint", "offset", "axis",
            "transmission", "coupling", "compliance", "loop", "base" and "tool". The group
            "parameter" means the named parameters of the description, such as the radius of a delta
            robot. A named parameter changes every value that depends on it. The name "geometry"
            stands for the group "axis", which contains all lengths, angles and offsets. For robots
            with loops, "geometry" also includes "loop". If poses are measured, corrections of the
            tool frame are added. For serial robots, "geometry" and the tool corrections are a
            complete and minimal set of parameters. Corrections of the base frame are added if
            `parameter_std` is set, if "axis" is not varied, or if the robot has loops.
        parameter_std: Standard deviations of parameters about their nominal values [m, rad, 1],
            keyed by name, group or unit, as in ``first_order_errors``.
            Parameters with little effect on the measurements stay near nominal.
        T_W_base: (4, 4) the base frame in the device frame W, or None to identify this frame.
        robust: Whether outliers are excluded. The result lists the excluded rows.
        weights: (N,) weight of each configuration. A weight of 4 halves the standard
            deviations of the measurements at this configuration.

    Raises:
        ShapeError: The shape of q does not match the robot.
        InputValueError: There are fewer measurements than variables, vary contains an unknown name,
            or units, signs or columns are wrong.
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
