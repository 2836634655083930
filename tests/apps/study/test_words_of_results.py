"""Results print a summary of one or two lines."""

import numpy as np
import pytest

import chasles
from chasles.drawing import skeleton
from chasles.study import (
    constant_orientation_workspace,
    dexterous_workspace,
    exact_workspace,
    orientation_grid,
    orientation_range_workspace,
    reach,
    reachable_positions,
    singularity_curves,
    workspace,
)
from chasles.study.grid import Grid, SizeEstimate
from chasles.study.motion import Motion, MotionSequence, line, spline, time_scaling
from chasles.study.planning import occupancy_map, prm, success_study

ROBOT = chasles.load("ur5e")
PLATFORM = chasles.load("planar_3rrr")
Q = np.array([0, -1, 1.2, -0.4, 0.5, 0])
LONGEST = 400


def moved():
    end = ROBOT.fk(Q)
    end[0, 3] += 0.1
    curve = line(ROBOT.fk(Q), end)
    return Motion(ROBOT, curve, time_scaling("quintic", curve.length, duration=1), Q)


def results():
    grid = occupancy_map(np.eye(30))
    made = prm(grid, 50)
    exact = exact_workspace(chasles.load("lynxmotion"))
    yield workspace(ROBOT, 2000, resolution=10, quality=["directions"])
    yield reach(ROBOT, Grid.from_bounds(np.full(3, -0.5), np.full(3, 0.5), 4))
    yield from (exact, exact.section, exact.meridian)
    yield from (constant_orientation_workspace(PLATFORM, 0.5), dexterous_workspace(PLATFORM))
    yield orientation_range_workspace(PLATFORM, 0, 0.1, tolerance=0.1)
    yield orientation_grid(PLATFORM, [0, 0.1], resolution=20)
    yield reachable_positions(chasles.load("stewart_gough"), resolution=32)
    yield singularity_curves(PLATFORM, 0.5, resolution=11)
    yield from (moved(), moved().sample(100), moved().curve, moved().time_scaling)
    yield MotionSequence(ROBOT, Q).pause(1).pause(1)
    yield spline([[0, 0, 0], [1, 0, 0], [1, 1, 0]])
    yield from (grid, made, made.plan([0.5, 20], [0.5, 25]), made.plan([0.5, 0.5], [1, 20]))
    yield success_study(grid, [0.5, 20], [0.5, 25], samples=[5], runs=2)
    yield skeleton(ROBOT)


def test_every_result_repr_is_short_and_single_line():
    count = 0
    for result in results():
        text = repr(result)
        assert len(text) < LONGEST, text
        assert "array" not in text
        assert "\n" not in text
        assert type(result).__name__ in text
        count += 1
    assert count >= 20


def test_repr_states_values_of_result():
    found = workspace(ROBOT, 2000, resolution=10)
    text = repr(found)
    (low, _, _), (high, _, _) = found.bounds
    assert "Workspace of ur5e: 2,000 configurations by sobol" in text
    assert f"x {low:.4g} to {high:.4g}" in text
    assert f"volume {found.size.value:.4g} ± {found.size.error:.2g} m^3" in text
    region = constant_orientation_workspace(PLATFORM, np.radians(30))
    assert f"area {region.area:.12g} m^2" in repr(region)
    refused = prm(occupancy_map(np.eye(30)), 5).plan([0.5, 0.5], [1, 20])
    assert repr(refused) == f"<Plan: no path: {refused.reason}>"


@pytest.mark.parametrize(
    ("unit", "words"),
    [("m", "length 2 ± 0.5 m"), ("m^2", "area 2 ± 0.5 m^2"), ("m^3", "volume 2 ± 0.5 m^3")],
    ids=["length", "area", "volume"],
)
def test_size_string_names_dimension_and_unit(unit, words):
    assert str(SizeEstimate(2.0, 0.5, unit)) == words
