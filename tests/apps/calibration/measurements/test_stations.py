"""Positions measured by several tracker stations with unknown frames."""

import csv

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chasles import se3
from chasles.calibration import StationPositions, identify, read_measurements
from chasles.errors import InputValueError

SIGMA = 2e-5
MIN = 20.0
"""Minimum factor by which calibration reduces the error of validation positions."""


def seen_from(arm, truth, random, stations):
    station = np.arange(len(truth.q)) % stations
    T_W_station = se3.exp(random.normal(size=(stations, 6)) * [3, 3, 1, 1, 1, 2])
    T_W_station[0] = np.eye(4)
    points = truth.positions(arm, truth.q)
    points += SIGMA * random.normal(size=points.shape)
    R, origin = T_W_station[station][:, :3, :3], T_W_station[station][:, None, :3, 3]
    own = np.einsum("nji,nmj->nmi", R, points - origin)
    return StationPositions(own, station, SIGMA), T_W_station


@pytest.mark.parametrize("stations", [2, 3])
@pytest.mark.parametrize("truth", [0, 1], indirect=True)
def test_station_frames_and_robot_are_identified_together(arm, truth, stations):
    random = np.random.default_rng(stations)
    measured, frames = seen_from(arm, truth, random, stations)
    measured.points[4, 1] = np.nan
    measured.points[7, 0] += 5e-3
    found = identify(arm, truth.q, measured)
    assert found.outliers == (f"station {7 % stations + 1}, measurement 8, target 1",)
    assert 0.85 < found.noise < 1.15
    validation = np.random.default_rng(9).uniform(-2.5, 2.5, (500, 6))
    true = truth.positions(arm, validation)
    T, targets = found.poses(validation), found.unknowns[:9].reshape(-1, 3)
    placed = T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], targets)
    after = np.linalg.norm(placed - true, axis=-1).mean()
    nominal = found.T_W_base @ arm.fk(validation)
    before = nominal[:, None, :3, 3] + np.einsum("nij,mj->nmi", nominal[:, :3, :3], targets)
    assert np.linalg.norm(before - true, axis=-1).mean() > MIN * after
    found_frames = found.measurements.frames(found.unknowns)
    errors = se3.log(se3.inverse(found_frames) @ frames)
    names = [n for n in found.names if n.startswith("station")]
    std = dict(zip(found.names, found.std, strict=True))
    reach = np.array([std[name] for name in names]).reshape(-1, 6)
    assert len(names) == 6 * (stations - 1)
    assert np.abs(errors[1:, 3:]).max() < 6 * reach[:, 3:].max()


def test_station_derivatives_match_central_differences(arm, truth):
    random = np.random.default_rng(5)
    measured, _ = seen_from(arm, truth, random, 3)
    start = measured._start(arm.fk(truth.q))
    T, x = start.T_W_base @ arm.fk(truth.q), start.unknowns
    J = np.zeros((len(T), 6, 1))
    _, by_x = start.measurements._derivatives(T, J, x)
    step = 1e-6
    differences = [
        (start.measurements._errors(T, x + e) - start.measurements._errors(T, x - e)) / (2 * step)
        for e in step * np.eye(len(x))
    ]
    assert_allclose(by_x, np.transpose(differences), atol=1e-3, rtol=1e-7)


def test_validation_measurements_use_identified_station_frames(arm, truth):
    random = np.random.default_rng(6)
    measured, _ = seen_from(arm, truth, random, 2)
    first, last = np.arange(45), np.arange(45, 60)
    found = identify(arm, truth.q[first], measured.at(first))
    errors = found.validation_errors(truth.q[last], measured.at(last))
    assert 0.8 < np.sqrt(np.mean(errors**2)) < 1.6


def test_station_with_too_few_targets_is_rejected(arm, truth):
    measured, _ = seen_from(arm, truth, np.random.default_rng(7), 3)
    measured.points[measured.station == 2] = np.nan
    measured.points[2, 0] = 1.0
    with pytest.raises(
        InputValueError,
        match=r"three or more measured targets that are not collinear; got 1 targets",
    ):
        identify(arm, truth.q, measured)


def test_station_column_is_read_from_table(arm, truth, tmp_path):
    measured, _ = seen_from(arm, truth, np.random.default_rng(8), 2)
    path = tmp_path / "two.csv"
    with path.open("w", newline="", encoding="utf-8") as stream:
        lines = csv.writer(stream)
        heads = [f"q{k + 1} [rad]" for k in range(6)]
        lines.writerow(["Station", *heads, "target", "x [mm]", "y [mm]", "z [mm]"])
        for q, s, points in zip(truth.q, measured.station, measured.points, strict=True):
            lines.writerows(["AB"[s], *q, j, *(1e3 * y)] for j, y in enumerate(points))
    table = read_measurements(path, arm)
    q, read = table.q, table.measurements
    assert_allclose(q, truth.q)
    assert isinstance(read, StationPositions)
    assert (read.station == measured.station).all()
    assert_allclose(read.points, measured.points, atol=1e-12)
