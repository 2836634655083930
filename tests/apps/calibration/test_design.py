"""Optimal designs and predicted errors agree with linear algebra and Monte Carlo analysis."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chasles.calibration import Positions, first_order_errors, identify, monte_carlo, optimal_design
from chasles.errors import InputValueError, ShapeError

TARGETS = [[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]


@pytest.fixture
def candidates(arm):
    return np.random.default_rng(0).uniform(-2.5, 2.5, (300, arm.n))


@pytest.mark.parametrize("targets", [TARGETS, None], ids=["positions", "poses"])
def test_designed_configurations_beat_random_selections(arm, candidates, targets):
    sigma = 2e-5 if targets else (2e-5, 5e-5)
    chosen = optimal_design(arm, candidates, 20, targets=targets, sigma=sigma)
    assert len(set(chosen.indices.tolist())) == 20
    assert_allclose(chosen.q, candidates[chosen.indices])
    random = np.random.default_rng(1)
    chance = [
        optimal_design(
            arm, candidates[random.choice(300, 20, replace=False)], 20, targets=targets, sigma=sigma
        )
        for _ in range(20)
    ]
    assert chosen.observability > max(other.observability for other in chance)
    assert chosen.tool_error_with_more < chosen.tool_error


def test_predicted_standard_deviations_match_identification(arm, candidates):
    chosen = optimal_design(arm, candidates, 20, targets=TARGETS, sigma=2e-5)
    p = np.array([g.value for g in arm.geometry])
    T = arm.fk_p(chosen.q, p)
    points = T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], np.array(TARGETS))
    points += np.random.default_rng(2).normal(size=points.shape) * 2e-5
    found = identify(arm, chosen.q, Positions(points, 2e-5), robust=False, T_W_base=np.eye(4))
    assert chosen.names == found.names
    assert_allclose(chosen.std, found.std / found.noise, rtol=2e-3)


def test_design_respects_limits_and_allowed_predicate(arm, candidates):
    chosen = optimal_design(arm, 2 * candidates, 10, is_allowed=lambda q: q[:, 0] > 0)
    assert (chosen.q[:, 0] > 0).all()
    assert (np.abs(chosen.q) <= arm.upper).all()
    with pytest.raises(InputValueError, match="allowed candidates within limits, got 0 of 300"):
        optimal_design(arm, candidates, 10, is_allowed=lambda q: q[:, 0] > 9)
    with pytest.raises(InputValueError, match="4 configurations have 24 measured values for 30"):
        optimal_design(arm, candidates, 4)


def test_first_order_tool_errors_match_monte_carlo(arm):
    q = np.array([0.3, -1.0, 1.2, 0.4, 0.9, -0.5])
    parameter_std = {"axis": 1e-4, "elbow_tilt_x": 3e-4}
    first = first_order_errors(arm, q, parameter_std)
    drawn = monte_carlo(arm, q, parameter_std, samples=40_000, rng=3)
    assert_allclose(np.sqrt((drawn.position**2).mean()), first.position, rtol=0.02)
    assert_allclose(np.sqrt((drawn.orientation**2).mean()), first.orientation, rtol=0.02)
    covariance = np.cov(drawn.displacement.T)
    assert_allclose(covariance, first.covariance[:3, :3], atol=0.03 * covariance.max())
    assert drawn.quantiles()[-1, 0] == drawn.position.max()
    assert len(first.names) == 24
    alone = first_order_errors(arm, q, {first.names[0]: parameter_std.get(first.names[0], 1e-4)})
    assert_allclose(alone.position, first.effects[0])
    again = monte_carlo(arm, q, parameter_std, samples=40_000, rng=3)
    assert (again.displacement == drawn.displacement).all()


def test_unknown_tolerance_or_incomplete_sigma_is_rejected(arm):
    with pytest.raises(InputValueError, match="unknown parameter, group or unit mm"):
        first_order_errors(arm, np.zeros(6), {"mm": 1.0})
    with pytest.raises(InputValueError, match="two standard deviations"):
        optimal_design(arm, np.zeros((50, 6)), 20, sigma=1e-5)
    for sigma in (-1e-5, (1e-5, 0.0)):
        targets = None if isinstance(sigma, tuple) else [[0, 0, 0.1]]
        with pytest.raises(InputValueError, match="sigma: expected a finite value above 0"):
            optimal_design(arm, np.zeros((50, 6)), 20, targets=targets, sigma=sigma)
    with pytest.raises(ShapeError, match=r"is_allowed: expected 50 booleans, got \(1,\)"):
        optimal_design(arm, np.zeros((50, 6)), 20, is_allowed=lambda _: [True])
    with pytest.raises(InputValueError, match=r"count = 2\.5: expected an integer"):
        optimal_design(arm, np.zeros((50, 6)), 2.5)
