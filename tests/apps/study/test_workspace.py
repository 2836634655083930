"""Workspaces: bounds, volumes of known shapes, and thread counts."""

import numpy as np
import pytest

import chasles
from chasles.errors import InputValueError
from chasles.study import Workspace, workspace
from chasles.study.grid import indices
from chasles.study.samples import PIECE, Samples

SAMPLES = 100_000


@pytest.fixture(scope="module")
def lynxmotion():
    return chasles.load("lynxmotion")


def same(a, b):
    arrays = ("hits", "manipulability", "limit_margin", "directions")
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in arrays)


QUALITY = ("manipulability", "limit_margin", "directions")


def test_teaching_arm_bounds_are_exact(lynxmotion):
    found = workspace(lynxmotion, 1000)
    r = 0.1 * (2 + np.sqrt(3) / 2)
    np.testing.assert_allclose(found.bounds, [[-r, -r, -0.05], [r, r, 0.4]], atol=1e-9)


def test_every_sample_is_counted_in_a_cell(lynxmotion):
    for sampling in ("sobol", "uniform", "grid"):
        found = workspace(lynxmotion, SAMPLES, sampling=sampling, resolution=30)
        assert found.hits.sum() == found.samples
        assert found.n_open == 0
    assert found.samples == 10**5


@pytest.mark.parametrize("sampling", ["sobol", "uniform", "grid"])
def test_workspace_is_bitwise_equal_for_any_thread_count(lynxmotion, sampling):
    # Only one sampling method computes the slow quality measures.
    quality = QUALITY if sampling == "sobol" else ("directions",)
    one, *others = (
        workspace(
            lynxmotion,
            PIECE + 77,
            sampling=sampling,
            resolution=30,
            quality=quality,
            threads=threads,
        )
        for threads in (1, 5)
    )
    assert all(same(one, other) for other in others)


def test_same_rng_gives_same_workspace(lynxmotion):
    one, again, other = (workspace(lynxmotion, SAMPLES, rng=rng) for rng in (3, 3, 4))
    assert same(one, again)
    assert not same(one, other)


def test_cell_quality_matches_sampled_configurations(lynxmotion):
    found = workspace(lynxmotion, 5000, resolution=12, quality=QUALITY, sampling="uniform")
    from chasles.study.samples import samples_of

    points = samples_of(lynxmotion, 5000, "uniform", 0)
    q = np.concatenate([block.copy() for block in points.blocks(0)])
    T = lynxmotion.fk(q)
    cell = indices(found.grid, T[:, :3, 3])
    smallest = lynxmotion.manipulability(q).min_singular_value
    lower, upper = points.lower, points.upper
    moving = upper > lower
    margin = np.minimum(q - lower, upper - q) / (upper - lower + ~moving)
    checked = 0
    for k in np.unique(cell):
        here = cell == k
        assert found.hits.ravel()[k] == here.sum()
        assert found.manipulability.ravel()[k] == np.float32(smallest[here].max())
        assert found.limit_margin.ravel()[k] == np.float32(margin[here].min(-1).max())
        assert 1 <= found.directions.ravel()[k] <= here.sum()
        checked += 1
    assert checked > 100


def test_volume_from_few_samples_lies_within_error(lynxmotion):
    true = workspace(lynxmotion, 500_000, resolution=40).size
    for rng in range(3):
        found = workspace(lynxmotion, 5000, sampling="uniform", resolution=40, rng=rng).size
        assert found.value > 0
        assert abs(found.value - true.value) <= found.error + true.error


def test_samples_with_open_loops_are_counted():
    found = workspace(chasles.load("planar_3rrr"), 2000)
    assert 0 < found.n_open < 2000
    assert found.hits.sum() + found.n_open == 2000
    assert found.size.unit == "m^2"


def test_workspace_survives_npz_round_trip(lynxmotion, tmp_path):
    found = workspace(lynxmotion, SAMPLES, resolution=20, quality=("directions",))
    found.save(tmp_path / "arm.npz")
    again = Workspace.load(tmp_path / "arm.npz")
    assert same(found, again)
    assert again.size == found.size
    assert again.robot == "lynxmotion"


def test_npz_without_workspace_is_rejected(tmp_path):
    np.savez(tmp_path / "other.npz", a=np.ones(3))
    with pytest.raises(InputValueError, match=r"other\.npz: expected a Workspace"):
        Workspace.load(tmp_path / "other.npz")


def test_sections_sum_to_projection(lynxmotion):
    found = workspace(lynxmotion, SAMPLES, resolution=20)
    z = found.grid.centers()[2]
    layers = [found.section("z", at) for at in z]
    assert np.array_equal(np.sum(layers, 0), found.projection("z"))
    with pytest.raises(InputValueError, match=r"z = 9 m: the layer is outside the workspace"):
        found.section("z", 9)
    for ask in (lambda: found.section("w", 0), lambda: found.projection("xy")):
        with pytest.raises(InputValueError, match="expected axis x, y or z, got"):
            ask()


def test_only_sobol_samples_stratify_every_coordinate():
    """Each of 1024 equal intervals of a coordinate contains the same number of points."""
    for sampling in ("sobol", "uniform"):
        points = Samples(np.zeros(3), np.array([1.0, 2.0, 4.0]), 2 * PIECE, sampling, 5)
        for piece in range(2):
            q = np.concatenate([block.copy() for block in points.blocks(piece)])
            assert q.shape == (PIECE, 3)
            assert len(np.unique(q[:, 0])) == PIECE
            parts = (q / [1, 2, 4] * 1024).astype(int)
            hits = np.array([np.bincount(column, minlength=1024) for column in parts.T])
            assert (hits == PIECE // 1024).all() == (sampling == "sobol")


def test_workspace_plot_labels_axes(lynxmotion):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    found = workspace(lynxmotion, 20_000, resolution=20)
    top, side = found.plot()
    assert (top.get_xlabel(), top.get_ylabel()) == ("x [m]", "y [m]")
    assert (side.get_xlabel(), side.get_ylabel()) == ("x [m]", "z [m]")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"samples": 0}, "samples = 0: expected an integer of at least 1"),
        ({"samples": 10, "sampling": "grid"}, "a grid; expected at least 32 for 5 coordinates"),
        ({"sampling": "halton"}, "sampling = 'halton': expected one of sobol, uniform, grid"),
        ({"threads": 0}, "threads = 0: expected a positive number or 'all'"),
        ({"quality": ("speed",)}, "quality from manipulability, limit_margin"),
    ],
    ids=["zero samples", "small grid", "unknown sampling", "zero threads", "unknown quality"],
)
def test_invalid_workspace_arguments_are_rejected(lynxmotion, arguments, message):
    with pytest.raises(InputValueError, match=message):
        workspace(lynxmotion, **{"samples": 100, **arguments})


def test_workspace_of_one_coordinate_has_the_length_of_its_path(tmp_path):
    linkage = chasles.load("four_bar")
    found = workspace(linkage, 1000, resolution=20, progress=False)
    q = np.linspace(-np.pi, np.pi, 100_001)[:, None]
    chords = np.linalg.norm(np.diff(linkage.fk(q)[:, :3, 3], axis=0), axis=-1)
    assert found.size.unit == "m"
    assert abs(found.size.value - chords.sum()) <= 4 * found.size.error
    assert found.size.error < 1e-6
    found.save(tmp_path / "path.npz")
    assert Workspace.load(tmp_path / "path.npz").size == found.size
    assert workspace(chasles.load("scara"), 1000, resolution=10, progress=False).path_length is None
