"""Tolerances and weights of parameters, and selection of models."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chasles.calibration import Positions, identify, select_model
from chasles.calibration.parameters import chosen, nominal
from chasles.errors import InputValueError, ShapeError
from tests.support.measured_arms import drawn

NOISE = 2e-5
TOLERANCES = {"offset": 5e-3, "axis": 1e-3}


def measured(robot, truth, q, seed=0):
    points = truth.positions(robot, q)
    noise = np.random.default_rng(seed).normal(size=points.shape)
    return Positions(points + NOISE * noise, NOISE)


def with_offsets(robot, seed):
    """Return a simulated robot with random errors of axes and joint offsets (see `TOLERANCES`)."""
    truth, random = drawn(robot, seed, count=30), np.random.default_rng(seed)
    p = nominal(robot)
    for part, sigma in TOLERANCES.items():
        own = chosen(robot, [part])
        p[own] += sigma * random.normal(size=len(own))
    return truth._replace(p=p)


def test_confidence_intervals_with_tolerances_cover_truth(arm):
    """Joint zero offsets and axis errors differ only in their assumed standard deviations."""
    inside = []
    for seed in range(10):
        truth = with_offsets(arm, seed)
        found = identify(
            arm,
            truth.q,
            measured(arm, truth, truth.q, seed),
            vary=("offset", "axis"),
            parameter_std=TOLERANCES,
            T_W_base=truth.T_W_base,
        )
        assert not found.unidentifiable
        own = [k for k, name in enumerate(found.names) if "base_" not in name][:-9]
        true = truth.p[chosen(arm, [found.names[k] for k in own])]
        low, high = found.confidence_intervals[own].T
        inside.append((low <= true) & (true <= high))
    assert 0.92 < np.mean(inside) < 0.98


def test_tolerances_keep_parameters_near_nominal_with_few_data(arm):
    truth = with_offsets(arm, 2)
    few = measured(arm, truth, truth.q[:4])
    free = identify(arm, truth.q[:4], few, robust=False)
    near = identify(
        arm, truth.q[:4], few, vary=("offset", "axis"), parameter_std=TOLERANCES, robust=False
    )
    q = np.random.default_rng(0).uniform(-2.5, 2.5, (500, 6))
    validation = measured(arm, truth, q)
    errors = [
        np.sqrt(np.mean(found.validation_errors(q, validation) ** 2)) for found in (free, near)
    ]
    assert 3 * errors[1] < errors[0]
    assert np.abs(near.deviations[:-9]).max() < 0.05


def test_base_corrections_are_absorbed_by_base_frame(arm):
    truth = with_offsets(arm, 2)
    found = identify(
        arm, truth.q, measured(arm, truth, truth.q), vary=("offset",), parameter_std=TOLERANCES
    )
    assert_allclose(found.p[chosen(arm, ["base"])], 0)
    assert_allclose(
        found.errors,
        found.validation_errors(truth.q, found.measurements),
        atol=1e-6 * found.rms_after,
    )


def test_best_model_selects_simplest_model_with_best_prediction(loaded):
    robot = loaded("stanford")
    truth = drawn(robot, 3, zero=0.02, count=36)
    found = select_model(robot, truth.q, measured(robot, truth, truth.q))
    assert found.model.name == "offsets and axes"
    assert found.errors["joint offsets"] > 5 * found.errors["offsets and axes"]
    assert 0.85 < found.calibration.noise < 1.15
    p = nominal(robot)
    zeros = chosen(robot, ["offset"])
    p[zeros] += np.random.default_rng(0).uniform(-0.02, 0.02, len(zeros))
    q = truth.q
    found = select_model(robot, q, measured(robot, truth._replace(p=p), q))
    assert found.model.name == "joint offsets"


def test_weight_two_equals_repeated_measurement(arm, truth):
    once = measured(arm, truth, truth.q)
    q = np.concatenate([truth.q, truth.q[:10]])
    twice = Positions(np.concatenate([once.points, once.points[:10]]), NOISE)
    weights = np.where(np.arange(60) < 10, 2.0, 1.0)
    a = identify(arm, q, twice, robust=False, T_W_base=truth.T_W_base)
    b = identify(arm, truth.q, once, robust=False, T_W_base=truth.T_W_base, weights=weights)
    assert_allclose(a.values, b.values, atol=1e-9)
    with pytest.raises(ShapeError, match=r"weights must have shape \(60,\), got \(3,\)"):
        identify(arm, truth.q, once, weights=[1, 2, 3])


def test_unknown_tolerance_name_is_rejected(arm, truth):
    with pytest.raises(InputValueError, match="unknown parameter, group or unit elbows"):
        identify(arm, truth.q, measured(arm, truth, truth.q), parameter_std={"elbows": 1.0})


def test_empty_list_of_models_is_rejected(arm, truth):
    with pytest.raises(InputValueError, match="expected at least one calibration model"):
        select_model(arm, truth.q, measured(arm, truth, truth.q), models=())
