"""Model selection by cross-validation: which parameters to identify.

More parameters fit the measurements better, but may predict other measurements less accurately.
Each model is identified several times. Each identification omits one group of the configurations.
The models are ranked by their errors at the omitted configurations.

Source:
    T. Hastie, R. Tibshirani, J. Friedman, The Elements of Statistical Learning, 2009, 7.10, for
    cross-validation.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import Robot
from chasles.contract import check_type

from ..study.arguments import finite
from .fitting.problem import Fit, Problem, in_one_thread, problem_at
from .identify import located
from .input_checks import check_result
from .measurements.tool_measurements import Measurements
from .parameters import GEOMETRY
from .result import Calibration

FloatArray = NDArray[np.float64]

FOLDS = 6
"""Default number of groups into which the configurations are divided."""
EQUAL = 1.05
"""Two models are equally good if the ratio of their median errors is at most this value. The median
error of a hundred targets has a sampling uncertainty of about 5 %."""


@dataclass(frozen=True)
class CalibrationModel:
    """A set of parameters to identify.

    Attributes:
        name: Name of the model, for reports.
        vary: Names or groups of parameters, as in ``identify``.
        parameter_std: Standard deviations of the parameters about the nominal values.
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
"""Models to compare, the simplest first. The standard deviations of the models [m, rad, 1] suit
industrial arms. They are about 1 degree for encoder zeros, 1 mm and 1 mrad for the dimensions and
assembly of links, and 0.3 mrad for drives."""


@dataclass(frozen=True, eq=False)
class ModelSelection:
    """The selected calibration model.

    Attributes:
        model: The selected model.
        calibration: The calibration of this model with all measurements.
        errors: Median validation error of each model [m], keyed by name. For poses, the error is
            the position error.
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

    The configurations are divided into six groups. Each group is compared with a fit to the other
    groups. Median errors within 5 % of the smallest one count as equal. Among models with equal
    errors, the simplest model is selected.

    Args:
        robot: A robot with parametric functions, as returned by `chasles.load(name,
            parametric=True)`.
        q: (N, n) actuated coordinates at which the tool was measured [rad or m].
        measurements: `Positions`, `StationPositions`, `Poses`, `CirclePoints`, `Distances`,
            `PlaneContacts` or `SphereContacts` at the N configurations. Positions are in the frame
            W of the measuring device [m].
        models: `CalibrationModel` objects to compare, the simplest first. Each contains a name, the
            parameters to vary, and their standard deviations.
        robust: Whether to exclude outliers from the fit.

    Returns:
        A `ModelSelection`. `model` is the selected `CalibrationModel`. `calibration` is the
        `Calibration` of this model with all measurements. `errors` is a dictionary of the median
        validation errors [m], keyed by the names of the models.

    Raises:
        MissingFunctionError: The robot has no parametric functions.
        InputTypeError: `robot` is not a `Robot`, or `q` contains values that are not real numbers.
        ShapeError: `q` is not (N, n).
        InputValueError: `q` contains a number that is not finite, or a name is not a parameter, a
            group or a unit. The measurements are fewer than the variables. The measurements fit
            much better with other units, joint signs or columns; the message states the probable
            mistake. A circle of `CirclePoints` has too few visible positions, or the tool rotates
            too little.
        ValueError: `models` is empty, or `q` and the measurements have different numbers of
            configurations. For `Positions`, this may be an IndexError instead.
    """
    check_type("select_model: robot", robot, Robot)
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
    """Return the cross-validation errors of a calibration.

    The configurations are divided into groups. The errors of each group are the errors of a fit to
    the other groups.

    Args:
        robot: A robot with parametric functions, as returned by `chasles.load(name,
            parametric=True)`.
        q: (N, n) actuated coordinates at which the tool was measured [rad or m].
        measurements: `Positions`, `StationPositions`, `Poses`, `CirclePoints`, `Distances`,
            `PlaneContacts` or `SphereContacts` at the N configurations. Positions are in the frame
            W of the measuring device [m].
        folds: Number of groups, an int of at least 2. With k groups, a group contains every k-th
            configuration.
        vary: Names of parameters or parameter groups; only these parameters may differ from their
            nominal values. The argument `vary` of `identify` lists the groups and explains the
            default "geometry".
        parameter_std: Standard deviations of parameters about their nominal values [m, rad, 1]. The
            keys are names, groups or units ("m", "rad", "1") of parameters. A name takes precedence
            over a group, and a group over a unit. A parameter without a key may differ from its
            nominal value freely. None means no standard deviations.
        robust: Whether to exclude outliers from the fit.

    Returns:
        (M,) errors of the measured values, in standard deviations. The order is the order of
        `Calibration.errors`, with x, y and z of each visible target for `Positions`.

    Raises:
        MissingFunctionError: The robot has no parametric functions.
        InputTypeError: `robot` is not a `Robot`, or `q` contains values that are not real numbers.
        TypeError: `folds` is not an int.
        ShapeError: `q` is not (N, n).
        InputValueError: `q` contains a number that is not finite, or a name is not a parameter, a
            group or a unit. The measurements are fewer than the variables. The measurements fit
            much better with other units, joint signs or columns; the message states the probable
            mistake. A circle of `CirclePoints` has too few visible positions, or the tool rotates
            too little. `folds` is 1.
        ValueError: `q` and the measurements have different numbers of configurations. For
            `Positions`, this may be an IndexError instead.
    """
    check_type("cross_validate: robot", robot, Robot)
    start = located(robot, q, measurements)
    problem = problem_at(robot, finite("cross_validate: q", q), start, vary, parameter_std)
    fitted = problem.solved(problem.x0, robust=robust)
    return _validation_errors(problem, fitted, folds, robust=robust)


def _validation_errors(
    problem: Problem, fitted: Calibration, folds: int, *, robust: bool
) -> FloatArray:
    """Return the cross-validation error of each measurement row.

    Each fit starts from the parameters of the fit with all rows.
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
