"""Identification of random arms from exact, noisy and wrong measurements."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chasles import se3, so3
from chasles.calibration import Poses, Positions, cross_validate, identify
from chasles.calibration.measurements.frames import register_points
from chasles.errors import InputValueError, ShapeError

NOISE = 2e-5, 5e-5
"""Measurement noise in meter and radian."""


def measured_poses(arm, truth, random):
    T = truth.poses(arm, truth.q) @ se3.exp([0.1, 0.02, -0.05, 1.0, -2.0, 0.5])
    T[:, :3, 3] += random.normal(size=(len(T), 3)) * NOISE[0]
    T[:, :3, :3] = so3.exp(random.normal(size=(len(T), 3)) * NOISE[1]) @ T[:, :3, :3]
    return Poses(T, NOISE)


def measured_positions(arm, truth, random):
    points = truth.positions(arm, truth.q)
    return Positions(points + random.normal(size=points.shape) * NOISE[0], NOISE[0])


def errors_elsewhere(arm, truth, found, random):
    """Return calibrated and nominal position errors at new configurations [m]."""
    q = random.uniform(-2.5, 2.5, (2000, arm.n))
    true = truth.positions(arm, q)
    T = found.poses(q)
    placed = T[:, None, :3, 3] + np.einsum(
        "nij,mj->nmi", T[:, :3, :3], found.unknowns.reshape(-1, 3)
    )
    nominal = register_points(arm.fk(q), true)
    T = nominal.T_W_base @ arm.fk(q)
    of_nominal = T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], nominal.points)
    return (np.linalg.norm(x - true, axis=-1).mean() for x in (placed, of_nominal))


def test_identify_from_unknown_targets_reduces_validation_error(arm, truth):
    random = np.random.default_rng(1)
    found = identify(arm, truth.q, measured_positions(arm, truth, random))
    assert len(found.names) == 4 * 6 + 9
    assert not found.unidentifiable
    assert found.residual_dof == 3 * 3 * 60 - len(found.names)
    after, before = errors_elsewhere(arm, truth, found, random)
    assert 20 * after < before
    assert 0.9 < found.noise < 1.1


def test_gross_errors_are_named_and_excluded(arm, truth):
    random = np.random.default_rng(2)
    measurements = measured_positions(arm, truth, random)
    wrong = np.argwhere(random.random((60, 3)) < 0.05)
    for i, j in wrong:
        measurements.points[i, j] += random.normal(size=3) * 5e-3
    found = identify(arm, truth.q, measurements)
    named = {f"measurement {i + 1}, target {j + 1}" for i, j in wrong}
    assert set(found.outliers) <= named
    assert len(found.outliers) > 0.9 * len(named)
    after, before = errors_elsewhere(arm, truth, found, random)
    assert 20 * after < before


def test_identify_from_unknown_probe_poses_reduces_error(arm, truth):
    random = np.random.default_rng(3)
    measurements = measured_poses(arm, truth, random)
    found = identify(arm, truth.q, measurements)
    assert len(found.names) == 4 * 6 + 6
    q = random.uniform(-2.5, 2.5, (2000, arm.n))
    placed = found.poses(q) @ found.measurements.T_tool_probe
    true = truth.poses(arm, q) @ se3.exp([0.1, 0.02, -0.05, 1.0, -2.0, 0.5])
    apart = np.linalg.norm((placed - true)[:, :3, 3], axis=-1).mean()
    T_W_base, T_tool_probe = found.T_W_base, found.measurements.T_tool_probe
    nominal = np.linalg.norm((T_W_base @ arm.fk(q) @ T_tool_probe - true)[:, :3, 3], axis=-1).mean()
    assert 20 * apart < nominal


def test_confidence_intervals_cover_truth_in_95_percent(arm):
    """Only the identified parameters have errors, so the true values are unique."""
    inside = []
    for seed in range(20):
        random = np.random.default_rng(seed)
        p = np.array([g.value for g in arm.geometry])
        off = np.array([g.part == "axis" for g in arm.geometry])
        p[off] += random.uniform(-1e-3, 1e-3, off.sum())
        q = random.uniform(-2.5, 2.5, (40, arm.n))
        targets = random.uniform(-0.15, 0.15, (3, 3))
        T = arm.fk_p(q, p)
        points = T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], targets)
        measurements = Positions(points + random.normal(size=points.shape) * NOISE[0], NOISE[0])
        found = identify(arm, q, measurements, robust=False, T_W_base=np.eye(4))
        true = np.concatenate([p[off], targets.ravel()])
        low, high = found.confidence_intervals.T
        inside.append((low <= true) & (true <= high))
    assert 0.92 < np.mean(inside) < 0.98


def test_pose_spread_of_repeated_identifications_stays_near_noise(arm, truth):
    found = [
        identify(arm, truth.q, measured_positions(arm, truth, np.random.default_rng(seed)))
        for seed in range(5)
    ]
    spread = np.std([c.poses(truth.q[:1])[0, :3, 3] for c in found], axis=0)
    assert (spread < 5 * NOISE[0]).all()
    assert_allclose(np.diag(found[0].correlations), 1)


def test_dh_model_cannot_explain_tilted_parallel_axes(arm, truth):
    measurements = measured_positions(arm, truth, np.random.default_rng(0))
    complete = identify(arm, truth.q, measurements, robust=False)
    dh = identify(arm, truth.q, measurements, vary=("joint", "offset"), robust=False)
    assert complete.rms_after < 1.1
    assert dh.rms_after > 3
    names = {item.name for item in dh.unidentifiable}
    assert "elbow_d" in names or "shoulder_lift_d" in names


def test_vary_geometry_equals_axis_parameters_for_serial_arm(arm, truth):
    measurements = measured_positions(arm, truth, np.random.default_rng(0))
    whole, named, axes, offsets = (
        identify(arm, truth.q, measurements, robust=False, **words)
        for words in ({}, {"vary": "geometry"}, {"vary": ("axis",)}, {"vary": "offset"})
    )
    assert whole.names == named.names == axes.names
    assert len(whole.names) == 4 * 6 + 9
    assert {g.part for g in arm.geometry if g.name in offsets.names} == {"offset", "base"}


def test_cross_validated_errors_match_noise_level(arm, truth):
    measurements = measured_positions(arm, truth, np.random.default_rng(0))
    errors = cross_validate(arm, truth.q, measurements, folds=3)
    assert errors.shape == (540,)
    assert 0.8 < np.sqrt(np.mean(errors**2)) < 1.6


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda q, y: (np.degrees(q), y), "joint angles are in degrees"),
        (lambda q, y: (np.radians(q), y), "joint angles are in radians, not in degrees"),
        (lambda q, y: (q, 1e3 * y), "positions are in millimeters"),
        (lambda q, y: (q, 1e-3 * y), "positions are in meters, not in millimeters"),
    ],
    ids=["degrees", "radians", "millimeters", "meters"],
)
def test_wrong_units_are_rejected(arm, truth, change, words):
    q = truth.q[:12]
    q, points = change(q, truth.positions(arm, q))
    with pytest.raises(InputValueError, match=words):
        identify(arm, q, Positions(points))


def test_invalid_identify_arguments_are_rejected(arm, truth):
    points = truth.positions(arm, truth.q)
    with pytest.raises(InputValueError, match="fewer parameters; got 18 measured values for"):
        identify(arm, truth.q[:6], Positions(points[:6, :1]))
    with pytest.raises(ShapeError, match=r"q must have shape \(N, 6\), got \(60, 5\)"):
        identify(arm, truth.q[:, :5], Positions(points))
    with pytest.raises(InputValueError, match="no parameter elbows"):
        identify(arm, truth.q, Positions(points), vary=("elbows",))
    with pytest.raises(ShapeError, match="q has 59 configurations, but the measurements have 60"):
        identify(arm, truth.q[1:], Positions(points))
    with pytest.raises(InputValueError, match="weights: expected numbers above 0, got 0"):
        identify(arm, truth.q, Positions(points), weights=np.arange(60))
    with pytest.raises(
        InputValueError,
        match=r"parameter_std: axis: expected a finite value of at least 0, got -0\.001",
    ):
        identify(arm, truth.q, Positions(points), parameter_std={"axis": -1e-3})
    with pytest.raises(InputValueError, match="folds = 1: expected an integer of at least 2"):
        cross_validate(arm, truth.q, Positions(points), folds=1)


def test_calibration_summary_lists_counts_and_parameters(arm, truth):
    found = identify(arm, truth.q, measured_positions(arm, truth, np.random.default_rng(0)))
    text = str(found)
    assert "33 variables from 540 measured values" in text
    assert "shoulder_pan_shift_x" in text
    assert "target3_z" in text


def test_noise_free_data_with_tolerances_keep_positive_covariance(arm, truth):
    """The weight of parameter_std is proportional to the noise, so the noise must not be zero."""
    parameter_std = {"offset": 0.02, "axis": 1e-3}
    exact = Positions(truth.positions(arm, truth.q), NOISE[0])
    found = identify(arm, truth.q, exact, vary=("offset", "axis"), parameter_std=parameter_std)
    assert np.isfinite(found.covariance).all()
    assert (found.std > 0).all()
    assert found.rms_after < 1e-2


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("turned", [1.0, 0.3])
def test_register_points_recovers_random_frames_and_targets(count, turned):
    for seed in range(10):
        random = np.random.default_rng(seed)
        T = se3.exp(random.normal(size=(20, 6)) * [1, 1, 1, turned, turned, turned])
        T_W_base = se3.exp(random.normal(size=6) * 2)
        targets = random.uniform(-0.2, 0.2, (count, 3))
        placed = T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], targets)
        points = placed @ T_W_base[:3, :3].T + T_W_base[:3, 3]
        points[0, 0] = np.nan
        found = register_points(T, points)
        assert_allclose(found.T_W_base, T_W_base, atol=1e-9)
        assert_allclose(found.points, targets, atol=1e-9)
        assert found.error < 1e-9
