"""Select by cross-validation which parameters of a robot to identify.

A model with more parameters fits the measurements better, but may predict other measurements less
accurately. The parameters of each model are identified several times, each time without one group
of the configurations. The models are ranked by their errors at the omitted configurations.

Source:
    T. Hastie, R. Tibshirani, J. Friedman, The Elements of Statistical Learning, 2009, 7.10, for
    cross-validation.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, Robot
from chasles.contract import check_type

from ..study.arguments import finite, integer_at_least
from .fitting.problem import Fit, Problem, in_one_thread, problem_at
from .identify import located
from .input_checks import check_result
from .measurements.tool_measurements import Measurements
from .parameters import GEOMETRY
from .result import Calibration

FloatArray = NDArray[np.float64]

FOLDS = 6
"""Default number of groups into which the measured configurations are divided for cross-validation.
"""
EQUAL = 1.05
"""Two calibration models are equally good if the ratio of their median errors is at most this
value. The median error of a hundred targets has a sampling uncertainty of about 5 %."""


@dataclass(frozen=True)
class CalibrationModel:
    """Parameters to identify, and their standard deviations.

    Attributes:
        name: Name of the model, for reports.
        vary: Names of parameters or parameter groups, as in `identify`.
        parameter_std: Standard deviations of parameters about their nominal values, as in
            `identify`.
    """

    name: str
    vary: tuple[str, ...]
    parameter_std: Mapping[str, float] = field(default_factory=dict)


CALIBRATION_MODELS = (
    CalibrationModel("joint offsets", ("offset",)),
    CalibrationModel("offsets and axes", ("offset", GEOMETRY), {"offset": 2e-2, "axis": 1e-3}),
    CalibrationModel(
        "offsets, axes and drives",
        ("offset", GEOMETRY, "transmission"),
        {"offset": 2e-2, "axis": 1e-3, "transmission": 3e-4},
    ),
)
"""Default calibration models to compare, the simplest first. The standard deviations of the
parameters in these models [m, rad, 1] suit industrial arms. The standard deviations are about 1
degree for encoder zeros, 1 mm and 1 mrad for the dimensions and assembly of links, and 0.3 mrad for
drives."""


@dataclass(frozen=True, eq=False)
class ModelSelection:
    """The calibration model that `select_model` selected.

    Attributes:
        model: The selected model.
        calibration: The calibration with this model and all measurements.
        errors: Median cross-validation error of each model [m], keyed by the name of the model. For
            pose measurements, the error of a model is the position error.
    """

    model: CalibrationModel
    calibration: Calibration
    errors: Mapping[str, float]


@in_one_thread
def select_model(
    robot: Robot,
    q: ArrayLike,
    measurements: Measurements,
    *,
    models: tuple[CalibrationModel, ...] = CALIBRATION_MODELS,
    robust: bool = True,
) -> ModelSelection:
    """Select the calibration model with the smallest cross-validation error.

    The configurations are divided into six groups. For each model and each group of configurations,
    the parameters are identified from the other five groups and tested with the omitted group.
    Median errors that exceed the smallest median error by at most 5 % count as equal. Among models
    with equal errors, the simplest model is selected.

    Args:
        robot: A robot with parametric functions, as returned by `chasles.load(name,
            parametric=True)`.
        q: (N, n) actuated coordinates at which the tool was measured [rad or m].
        measurements: The field `measurements` of a table from `read_measurements`, or a
            `Positions`, `StationPositions`, `Poses`, `CirclePoints`, `Distances`, `PlaneContacts`
            or `SphereContacts` object. Entry k of its arrays belongs to row k of `q`. Positions [m]
            and poses are in the frame W of the measuring device; `StationPositions` are in the
            frames of the stations.
        models: `CalibrationModel` objects to compare, the simplest first. Each model contains a
            name, and the arguments `vary` and `parameter_std` of `identify`. The default is
            `CALIBRATION_MODELS`.
        robust: Whether to exclude outliers from the fit.

    Returns:
        A `ModelSelection`. `model` is the selected `CalibrationModel`. `calibration` is the
        `Calibration` of this model from all measurements. `errors` is a dictionary of the median
        cross-validation errors [m], keyed by the name of the model.

    Raises:
        MissingFunctionError: The robot has no parametric functions.
        InputTypeError: `robot` is not a `Robot`, or `q` contains values that are not real numbers.
        ShapeError: `q` is not (N, n), or `q` and `measurements` have different numbers of
            configurations.
        InputValueError: `models` is empty. `q` contains a number that is not finite. A model names
            an unknown parameter or group, or its `parameter_std` has an unknown key or a negative
            value. The number of measured values does not exceed the number of values to identify.
            Units are wrong, joint signs are inverted, or table columns are swapped; the message
            names the mistake. In `CirclePoints`, a circle has no target that is visible in four
            configurations. Along a circle, the rotation of the tool is less than 0.2 rad, or is not
            about a single axis.
    """
    check_type("select_model: robot", robot, Robot)
    if not models:
        raise InputValueError("select_model: models: expected at least one calibration model")
    at, start = finite("select_model: q", q), located(robot, q, measurements)
    found, errors = {}, {}
    for model in models:
        problem = problem_at(robot, at, start, model.vary, model.parameter_std)
        found[model.name] = problem.solved(problem.x0, robust=robust)
        tested = _validation_errors(problem, found[model.name], FOLDS, robust=robust)
        errors[model.name] = float(np.median(problem.measurements._lengths(tested)))
    good = EQUAL * min(errors.values())
    model = next(model for model in models if errors[model.name] <= good)
    check_result(found[model.name], model.vary)
    calibration = replace(found[model.name], model_errors=tuple(errors.items()))
    return ModelSelection(model, calibration, errors)


@in_one_thread
def cross_validate(
    robot: Robot,
    q: ArrayLike,
    measurements: Measurements,
    *,
    folds: int = FOLDS,
    vary: str | Collection[str] = GEOMETRY,
    parameter_std: Mapping[str, float] | None = None,
    robust: bool = True,
) -> FloatArray:
    """Cross-validate a calibration: test each measurement with a fit that does not use it.

    The configurations are divided into groups. For each group, the parameters are identified from
    the other groups. The errors of the omitted group are then computed with the identified
    parameters.

    Args:
        robot: A robot with parametric functions, as returned by `chasles.load(name,
            parametric=True)`.
        q: (N, n) actuated coordinates at which the tool was measured [rad or m].
        measurements: The field `measurements` of a table from `read_measurements`, or a
            `Positions`, `StationPositions`, `Poses`, `CirclePoints`, `Distances`, `PlaneContacts`
            or `SphereContacts` object. Entry k of its arrays belongs to row k of `q`. Positions [m]
            and poses are in the frame W of the measuring device; `StationPositions` are in the
            frames of the stations.
        folds: Number of groups, an int of at least 2. Each group contains every `folds`-th
            configuration.
        vary: One or several names of parameters or parameter groups, as in `identify`. All other
            parameters keep their nominal values.
        parameter_std: Standard deviations of parameters about their nominal values, in the units of
            the parameters (such as m or rad). A key is a name, a group (`part`) or a unit from
            `robot.geometry`. If several keys match a parameter, a name takes precedence over a
            group, and a group over a unit. A parameter that matches no key is identified from the
            measurements alone. If `parameter_std` is None, no parameter has a standard deviation.
        robust: Whether to exclude outliers from the fit.

    Returns:
        (M,) error of each measured value, divided by its standard deviation. The errors are in the
        order of `Calibration.errors`. For `Positions`, each visible target has three errors x, y
        and z.

    Raises:
        MissingFunctionError: The robot has no parametric functions.
        InputTypeError: `robot` is not a `Robot`, or `q` contains values that are not real numbers.
        ShapeError: `q` is not (N, n), or `q` and `measurements` have different numbers of
            configurations.
        InputValueError: `q` contains a number that is not finite. `vary` names an unknown parameter
            or group, or `parameter_std` has an unknown key or a negative value. The number of
            measured values does not exceed the number of values to identify. Units are wrong, joint
            signs are inverted, or table columns are swapped; the message names the mistake. In
            `CirclePoints`, a circle has no target that is visible in four configurations. Along a
            circle, the rotation of the tool is less than 0.2 rad, or is not about a single axis.
            `folds` is not an integer of at least 2.
    """
    check_type("cross_validate: robot", robot, Robot)
    folds = integer_at_least("cross_validate: folds", folds, 2)
    start = located(robot, q, measurements)
    problem = problem_at(robot, finite("cross_validate: q", q), start, vary, parameter_std)
    fitted = problem.solved(problem.x0, robust=robust)
    return _validation_errors(problem, fitted, folds, robust=robust)


def _validation_errors(
    problem: Problem, fitted: Calibration, folds: int, *, robust: bool
) -> FloatArray:
    """Return the cross-validation error of each measured value, in standard deviations.

    Each fit without one group starts from the parameters of the fit to all measurements.
    """
    every, measured = np.arange(len(problem.q)), problem.measurements
    part, errors = measured.configurations[measured.rows] % folds, np.empty(len(measured.rows))
    used = measured.configurations % folds
    for fold in range(folds):
        others, tested = every[every % folds != fold], every[every % folds == fold]
        start = Fit(fitted.values, fitted.used[used != fold], fitted.noise)
        x = problem.at(others).settled(start, robust=robust).x
        T = problem.poses(problem.q[tested], x)
        errors[part == fold] = measured.at(tested)._errors(T, problem.unknowns(x))
    return errors
