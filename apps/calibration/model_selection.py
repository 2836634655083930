"""Which parameters to seek: the model with the least error on measurements that took no part.

More parameters fit the measurements better and may predict others worse. Each model is identified
without a part of the configurations, in turns, and judged by its errors on that part.

Source:
    T. Hastie, R. Tibshirani, J. Friedman, The Elements of Statistical Learning, 2009, 7.10, for
    cross-validation, and for the simplest among models that are equal within its uncertainty.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import Robot

from .fitting.problem import Fit, Problem, in_one_thread, problem_at
from .identify import located
from .input_checks import check_result
from .measurements.tool_measurements import Measurements
from .parameters import GEOMETRY
from .result import Calibration

FloatArray = NDArray[np.float64]

FOLDS = 6
"""Parts of the configurations, of which each is held back once."""
EQUAL = 1.05
"""Ratio of two models' median errors that their sampling explains: the median distance of a hundred
targets is known to about 5 %."""


@dataclass(frozen=True)
class CalibrationModel:
    """Parameters that are sought together.

    Attributes:
        name: A word for people.
        vary: Names or parts, as in :func:`~chasles.calibration.identify`.
        parameter_std: Standard deviations about nominal.
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
"""Models from the simplest on. Their standard deviations [m, rad, 1] suit industrial arms: encoders
are zeroed to a degree, parts are made and mounted to 1 mm and 1 mrad, drives run true to 0.3
mrad."""


@dataclass(frozen=True, eq=False)
class ModelSelection:
    """The model that predicts best.

    Attributes:
        model: The model.
        calibration: Its calibration from all measurements.
        errors: Median error of each model, by name, on configurations that took no part [m]; of
            poses, that of their positions.
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
    """The simplest model among those with the least error on held-back configurations.

    Args:
        robot: A robot with parametric functions.
        q: (N, n) coordinates [rad or m].
        measurements: The measurements.
        models: Models to choose from, the simplest first.
        robust: As in :func:`~chasles.calibration.identify`.

    Raises:
        InputValueError: As :func:`~chasles.calibration.identify`.
    """
    at, start = np.asarray(q, dtype=np.float64), located(robot, q, measurements)
    found, errors = {}, {}
    for model in models:
        problem = problem_at(robot, at, start, model.vary, model.parameter_std)
        found[model.name] = problem.solved(problem.x0, robust=robust)
        held = _held_back(problem, found[model.name], FOLDS, robust=robust)
        errors[model.name] = float(np.median(problem.measurements.lengths(held)))
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
    """Errors of each configuration when the robot is identified from the others.

    Args:
        robot: As in :func:`~chasles.calibration.identify`, as all others.
        q: (N, n) coordinates [rad or m].
        measurements: The measurements.
        folds: Number of parts, each of which is held back once; every folds-th configuration.
        vary: Parameters that may differ from nominal.
        parameter_std: Their standard deviations about nominal.
        robust: Whether rows that contradict the others are left out.

    Returns:
        (M,) the errors in the order of the measurements, in standard deviations.
    """
    start = located(robot, q, measurements)
    problem = problem_at(robot, np.asarray(q, dtype=np.float64), start, vary, parameter_std)
    whole = problem.solved(problem.x0, robust=robust)
    return _held_back(problem, whole, folds, robust=robust)


def _held_back(problem: Problem, whole: Calibration, folds: int, *, robust: bool) -> FloatArray:
    """Errors of each row by the fit from which its configuration was held back.

    The iteration of each part starts where that of all ended: the least sum is the same.
    """
    every, measured = np.arange(len(problem.q)), problem.measurements
    part, errors = measured.configurations[measured.rows] % folds, np.empty(len(measured.rows))
    used = measured.configurations % folds
    for fold in range(folds):
        others, held = every[every % folds != fold], every[every % folds == fold]
        start = Fit(whole.values, whole.used[used != fold], whole.noise)
        x = problem.at(others).settled(start, robust=robust).x
        T = problem.poses(problem.q[held], x)
        errors[part == fold] = measured.at(held).errors(T, problem.unknowns(x))
    return errors
