"""Every result of a study can be plotted, saved and loaded in the same way."""

from dataclasses import fields, is_dataclass

import numpy as np
import pytest

import chasles
from chasles import study
from chasles.errors import InputValueError
from chasles.study import motion, planning

ARM, PLATFORM = chasles.load("scara"), chasles.load("planar_3rrr")
START, END = np.zeros(4), np.array([0.3, -0.4, 0.05, 1.0])
GRID = study.Grid.from_bounds(np.full(3, -0.5), np.full(3, 0.5), 4)


def moved():
    curve = motion.joint_line(START, END)
    timed = motion.time_scaling("cubic", curve.length, duration=1)
    return motion.Motion(ARM, curve, timed, START).sample(10)


def planned():
    return planning.prm(planning.occupancy_map(np.zeros((9, 9))), 5).plan([1, 1], [8, 5])


def studied():
    free = planning.occupancy_map(np.zeros((9, 9)))
    return planning.success_study(free, [1, 1], [8, 5], samples=[3, 4], runs=2)


RESULTS = {
    study.Workspace: lambda: study.workspace(ARM, 500, resolution=6, quality=["directions"]),
    study.ExactWorkspace: lambda: study.exact_workspace(ARM),
    study.Reach: lambda: study.reach(ARM, GRID, study.uniform_orientations(2)),
    study.ReachablePositions: lambda: study.reachable_positions(
        chasles.load("delta"), resolution=32
    ),
    study.PlanarRegion: lambda: study.constant_orientation_workspace(PLATFORM, 0.5),
    study.OrientationGrid: lambda: study.orientation_grid(PLATFORM, [0, 0.1], resolution=20),
    study.OrientationRangeWorkspace: lambda: study.orientation_range_workspace(
        PLATFORM, 0, 0.1, tolerance=0.1
    ),
    motion.Trajectory: moved,
    planning.Plan: planned,
    planning.SuccessStudy: studied,
}


def flat(value):
    """List the arrays, numbers and strings in a result and its nested objects."""
    if is_dataclass(value):
        return [leaf for item in fields(value) for leaf in flat(getattr(value, item.name))]
    if isinstance(value, tuple):
        return [leaf for item in value for leaf in flat(item)]
    return [value.item() if isinstance(value, np.generic) else value]


@pytest.fixture(autouse=True)
def axes():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    from matplotlib import pyplot

    yield
    pyplot.close("all")


@pytest.mark.parametrize("kind", RESULTS, ids=lambda kind: kind.__name__)
def test_result_survives_file_and_is_drawn(kind, tmp_path):
    made = RESULTS[kind]()
    made.save(tmp_path / "result.npz")
    found = kind.load(tmp_path / "result.npz")
    assert type(found) is kind
    own, other = flat(made), flat(found)
    assert [type(leaf) for leaf in own] == [type(leaf) for leaf in other]
    for a, b in zip(own, other, strict=True):
        np.testing.assert_array_equal(a, b)
    assert repr(found) == repr(made)
    assert all(hasattr(ax, "plot") for ax in np.ravel(made.plot()))
    if hasattr(made, "to_csv"):
        made.save(tmp_path / "result.csv")
        assert len((tmp_path / "result.csv").read_text().splitlines()) > 2
    else:
        with pytest.raises(InputValueError, match=r"expected a file \.npz, got \.csv"):
            made.save(tmp_path / "result.csv")


def test_file_of_another_result_is_rejected(tmp_path):
    planned().save(tmp_path / "plan.npz")
    with pytest.raises(InputValueError, match="expected a Workspace written by to_npz"):
        study.Workspace.load(tmp_path / "plan.npz")


@pytest.mark.parametrize("rng", [np.random.default_rng(3), None], ids=["generator", "None"])
def test_workspace_rng_repeats_its_configurations(rng):
    found = study.workspace(ARM, 500, resolution=6, rng=rng, sampling="uniform")
    again = study.workspace(ARM, 500, resolution=6, rng=found.rng, sampling="uniform")
    np.testing.assert_array_equal(again.hits, found.hits)
    other = study.workspace(ARM, 500, resolution=6, rng=rng, sampling="uniform")
    assert other.rng != found.rng


@pytest.mark.parametrize(
    ("rng", "error", "message"),
    [
        (-1, InputValueError, "workspace: rng: expected an int of at least 0, got -1"),
        (1.5, chasles.InputTypeError, "rng: expected an int, a Generator or None, got 1.5"),
        (True, chasles.InputTypeError, "got True"),
    ],
    ids=["negative", "float", "bool"],
)
def test_invalid_rng_is_rejected(rng, error, message):
    with pytest.raises(error, match=message):
        study.workspace(ARM, 10, rng=rng)
