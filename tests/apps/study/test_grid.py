"""Grid cells measure volumes of known shapes within the reported error."""

import numpy as np
import pytest

from chasles.study.grid import Grid, indices, size_of

POINTS = 1_000_000


def shell(u, inner, outer):
    r, turn, rise = inner + (outer - inner) * u[0], 2 * np.pi * u[1], np.pi * (u[2] - 0.5)
    points = np.array([np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)])
    return r * points, 4 / 3 * np.pi * (outer**3 - inner**3)


def torus(u, large, small):
    r, turn, around = small * u[0], 2 * np.pi * u[1], 2 * np.pi * u[2]
    reach = large + r * np.cos(around)
    points = np.array([reach * np.cos(turn), reach * np.sin(turn), r * np.sin(around)])
    return points, 2 * np.pi**2 * large * small**2


def sector(u, inner, outer, height, angle):
    r, turn = inner + (outer - inner) * u[0], angle * u[1]
    points = np.array([r * np.cos(turn), r * np.sin(turn), height * u[2]])
    return points, (outer**2 - inner**2) * angle / 2 * height


def box(u, *sides):
    return np.array(sides)[:, None] * u, np.prod(sides)


def shapes(rng, count):
    for k in range(count):
        a, b = rng.uniform(0, 0.75), rng.uniform(0.2, 0.95)
        yield [
            (shell, a, 1.0),
            (torus, 1.0, b),
            (sector, a, 1.0, b, rng.uniform(0.5, 6.2)),
            (box, 1.0, b, rng.uniform(0.2, 1)),
        ][k % 4]


def turned(rng):
    Q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return Q


@pytest.mark.parametrize("turn", [False, True])
def test_volume_estimate_stays_within_stated_error(turn):
    rng = np.random.default_rng(1)
    stated = []
    for kind, *sizes in shapes(rng, 8):
        points, volume = kind(rng.random((3, POINTS)), *sizes)
        points = (turned(rng) @ points if turn else points).T
        cells = Grid.from_bounds(points.min(0), points.max(0), 40)
        hits = np.bincount(indices(cells, points), minlength=cells.count + 1)[:-1]
        found = size_of(cells, hits.reshape(cells.shape).astype(np.uint32))
        assert abs(found.value - volume) <= found.error, (kind.__name__, sizes)
        stated.append(found.error / volume)
    assert len(stated) == 8
    assert np.median(stated) < 0.1


@pytest.mark.parametrize("count", [1000, 30_000])
def test_few_points_give_honest_error_and_nonnegative_volume(count):
    missed = total = 0
    for key in range(2):
        rng = np.random.default_rng([5, key])
        for kind, *sizes in shapes(rng, 8):
            points, volume = kind(rng.random((3, count)), *sizes)
            points = (turned(rng) @ points).T
            cells = Grid.from_bounds(points.min(0), points.max(0), 40)
            hits = np.bincount(indices(cells, points), minlength=cells.count + 1)[:-1]
            found = size_of(cells, hits.reshape(cells.shape).astype(np.uint32))
            assert found.value >= 0
            missed += abs(found.value - volume) > found.error
            total += 1
    assert total == 16
    assert missed == 0


def test_cells_extend_half_a_cell_beyond_points():
    cells = Grid.from_bounds(np.array([0.0, 1.0, 5.0]), np.array([3.9, 2.0, 5.0]), 40)
    assert cells.side == pytest.approx(0.1)
    assert cells.shape == (40, 11, 1)
    np.testing.assert_allclose(cells.lower, [-0.05, 0.95, 4.95])
    np.testing.assert_allclose(cells.upper, [3.95, 2.05, 5.05])


def test_sparse_points_state_error_that_covers_any_volume():
    cells = Grid.from_bounds(np.zeros(3), np.ones(3), 40)
    hits = np.bincount(
        indices(cells, np.random.default_rng(6).random((9, 3))), minlength=cells.count + 1
    )[:-1]
    found = size_of(cells, hits.reshape(cells.shape).astype(np.uint32))
    assert found.value - found.error <= 0
    assert found.value + found.error >= 1


def test_disk_area_lies_within_stated_error():
    rng = np.random.default_rng(2)
    r, turn = np.sqrt(rng.random(POINTS)), 2 * np.pi * rng.random(POINTS)
    points = np.column_stack([r * np.cos(turn), r * np.sin(turn), np.full(POINTS, 0.3)])
    cells = Grid.from_bounds(points.min(0), points.max(0), 200)
    hits = np.bincount(indices(cells, points), minlength=cells.count + 1)[:-1]
    found = size_of(cells, hits.reshape(cells.shape).astype(np.uint32))
    assert found.unit == "m^2"
    assert abs(found.value - np.pi) <= found.error < 0.05


def test_outside_points_are_clipped_and_nan_points_counted_apart():
    cells = Grid.from_bounds(np.zeros(3), np.ones(3), 10)
    index = indices(cells, np.array([[-5.0, 0, 0], [9.0, 9, 9], [np.nan, 0, 0]]))
    assert index[1] == cells.count - 1
    assert index[2] == cells.count
