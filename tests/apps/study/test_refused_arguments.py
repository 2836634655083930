"""Meaningless arguments raise an error that names the argument."""

import numpy as np
import pytest

import chasles
from chasles.errors import InputValueError, ShapeError
from chasles.study import (
    base_placement,
    constant_orientation_workspace,
    orientation_grid,
    orientation_range_workspace,
    reach,
    reachable_positions,
    uniform_orientations,
    workspace,
)
from chasles.study.grid import Grid
from chasles.study.motion import (
    Motion,
    MotionSequence,
    arc,
    blend,
    conic,
    joint_line,
    limit_violations,
    line,
    parabola,
    spline,
    task_curve,
    task_line,
    time_optimal,
    time_scaling,
)
from chasles.study.planning import occupancy_map, prm, rrt_connect

NAN = np.nan
ROBOT = chasles.load("ur5e")
Q = np.array([0, -1, 1.2, -0.4, 0.5, 0])
T_0 = ROBOT.fk(Q)
T_1 = T_0.copy()
T_1[0, 3] += 0.1
EMPTY = occupancy_map(np.zeros((5, 5)))


def moving(curve=None):
    own = curve or line(T_0, T_1)
    return Motion(ROBOT, own, time_scaling("quintic", own.length, duration=1), Q)


def among(first, second=None, third=None):
    """Return three points. By default, the first and the second point are equal."""
    return [first, first if second is None else second, [1, 1, 1] if third is None else third]


REFUSED = {
    "line: start and end are equal": lambda: line(T_0, T_0),
    "line: T_start: expected finite numbers, got nan": lambda: line(T_0 * NAN, T_0),
    "line: T_end is no pose": lambda: line(T_0, 2 * T_0),
    "arc: via: expected finite": lambda: arc(T_0, [NAN] * 3, T_1),
    "arc: start and end are equal": lambda: arc(T_0, T_1[:3, 3], T_0),
    "arc: via is at the start or the end": lambda: arc(T_0, T_0[:3, 3], T_1),
    "arc: start, via and end are collinear": lambda: arc(T_0, (T_0 + T_1)[:3, 3] / 2, T_1),
    "spline: two poses have the same position: 0 and 1": lambda: spline(among([0, 0, 0])),
    "spline: poses: expected finite numbers": lambda: spline(among([0, 0, 0], [NAN] * 3)),
    "parabola: poses: expected finite numbers": lambda: parabola(among([0, 0, 0], [NAN] * 3)),
    "conic: two poses have the same position: 0 and 1": lambda: conic(np.zeros((5, 3))),
    "conic: poses: expected finite numbers": lambda: conic(np.full((5, 3), NAN)),
    "blend: expected a radius above 0": lambda: blend(among([0, 0, 0], [1, 0, 0]), NAN),
    "task_line: start and end are equal": lambda: task_line("position", [0, 0, 1], [0, 0, 1]),
    "task_line: end: expected finite": lambda: task_line("position", [0, 0, 1], [0, 0, NAN]),
    "task_curve: start and end: expected": lambda: task_curve("planar", line(T_0, T_1), NAN),
    "joint_line: q_end: expected finite": lambda: joint_line(Q, Q * NAN),
    "time_scaling: a length of 0 takes no time": lambda: time_scaling(
        "cubic", 0, speed=1, acceleration=1
    ),
    "finite duration > 0 and limits > 0, got length 1, duration inf": lambda: time_scaling(
        "cubic", 1, duration=np.inf
    ),
    "limits > 0, got length 1, duration None, speed 0": lambda: time_scaling("cubic", 1, speed=0),
    "length nan, duration 1": lambda: time_scaling("cubic", NAN, duration=1),
    "pause: duration: expected a finite value above 0, got 0": lambda: MotionSequence(
        ROBOT, Q
    ).pause(0),
    "pause: duration: expected a finite value above 0, got nan": lambda: MotionSequence(
        ROBOT, Q
    ).pause(NAN),
    "MotionSequence of ur5e: q_start: expected finite": lambda: MotionSequence(ROBOT, Q * NAN),
    "MotionSequence.sample: there is no stage yet": lambda: MotionSequence(ROBOT, Q).sample(),
    "sample: frequency: expected a finite value above 0, got inf": lambda: moving().sample(np.inf),
    "sample: frequency: expected a finite value above 0, got 0": lambda: moving().sample(0),
    "Motion.at: expected one or more times in ascending order": lambda: moving().at([1, 0.5]),
    "expected one or more times in ascending order": lambda: moving().at([]),
    "Motion.at: t: expected finite": lambda: moving().at([0, NAN]),
    "Motion of ur5e: q_seed: expected finite": lambda: Motion(
        ROBOT, line(T_0, T_1), time_scaling("cubic", 0.1, duration=1), Q * NAN
    ),
    "rate_limits: expected values above 0, got 0": lambda: time_optimal(
        moving(), rate_limits=0, acceleration_limits=1
    ),
    "rate_limits: expected values above 0, got -1": lambda: limit_violations(
        ROBOT, moving().sample(10), rate_limits=-1
    ),
    "acceleration_limits: expected values above 0, got nan": lambda: limit_violations(
        ROBOT, moving().sample(10), acceleration_limits=NAN
    ),
    "time_optimal: acceleration_limits: expected finite": lambda: time_optimal(
        moving(), rate_limits=1, acceleration_limits=np.inf
    ),
    "time_optimal: nodes = 1: expected an integer of at least 10": lambda: time_optimal(
        moving(), rate_limits=1, acceleration_limits=1, nodes=1
    ),
    "time_optimal: nothing moves on the curve": lambda: time_optimal(
        moving(joint_line(Q, Q)), rate_limits=1, acceleration_limits=1
    ),
    "time_optimal: tool_speed: expected a finite value above 0": lambda: time_optimal(
        moving(), rate_limits=1, acceleration_limits=1, tool_speed=0
    ),
    "samples = 0: expected an integer": lambda: workspace(ROBOT, 0),
    "samples = 10.5: expected an integer": lambda: workspace(ROBOT, 10.5),
    "section: at: expected finite": lambda: workspace(ROBOT, 100, resolution=5).section("z", NAN),
    "targets: expected finite numbers, got nan at .1, 0.": lambda: reach(
        ROBOT, [[0, 0, 1], [NAN, 0, 0]]
    ),
    "T_w_0: expected finite": lambda: base_placement(ROBOT, T_0[None], T_0[None] * NAN),
    "uniform_orientations: count = 0: expected an integer of at least 1": lambda: (
        uniform_orientations(0)
    ),
    "Grid.from_bounds: expected lower < upper": lambda: Grid.from_bounds(
        np.ones(3), np.zeros(3), 5
    ),
    "Grid.from_bounds: upper: expected finite": lambda: Grid.from_bounds(
        np.ones(3), np.full(3, np.inf), 5
    ),
    "Grid.from_bounds: resolution = 1: expected": lambda: Grid.from_bounds(
        np.zeros(3), np.ones(3), 1
    ),
    "resolution = 10000000: the grid is too fine; expected at most 1,000,000,000 cells, "
    "got 10000000 x .*; choose a smaller": lambda: workspace(ROBOT, 10, resolution=10_000_000),
    "at most 1,000,000,000 cells, got 1001 x 1001 x 1001; choose": lambda: Grid.from_bounds(
        np.zeros(3), np.ones(3), 1001
    ),
    "constant_orientation_workspace: phi: expected finite": lambda: constant_orientation_workspace(
        chasles.load("planar_3rrr"), NAN
    ),
    "orientation_range_workspace: expected phi_min < phi_max": lambda: orientation_range_workspace(
        chasles.load("planar_3rrr"), 1, 0
    ),
    "phi_min < phi_max and tolerance > 0, got 0, inf": lambda: orientation_range_workspace(
        chasles.load("planar_3rrr"), 0, np.inf
    ),
    "orientation_grid: expected at least one angle": lambda: orientation_grid(
        chasles.load("planar_3rrr"), []
    ),
    "orientation_grid: phi: expected finite": lambda: orientation_grid(
        chasles.load("planar_3rrr"), [0, NAN]
    ),
    "reachable_positions: R_0_ee: expected finite": lambda: reachable_positions(
        chasles.load("stewart_gough"), np.full((3, 3), NAN)
    ),
    "prm: expected max_step > 0": lambda: prm(EMPTY, 5, dispersion=NAN),
    "q_goal: expected finite numbers, got nan at .1,.": lambda: prm(EMPTY, 5).plan(
        [1, 1], [1, NAN]
    ),
    "rrt_connect: time_limit: expected a finite value above 0": lambda: (
        pytest.importorskip("ompl") and rrt_connect(EMPTY, [1, 1], [2, 2], time_limit=0)
    ),
    "occupancy_map: cell_size: expected a finite value above 0": lambda: occupancy_map([[0]], NAN),
}


@pytest.mark.parametrize("message", REFUSED, ids=lambda message: message.replace("\\", "")[:40])
def test_meaningless_study_arguments_are_rejected(message):
    with pytest.raises(InputValueError, match=message):
        REFUSED[message]()


@pytest.mark.parametrize(
    ("message", "called"),
    [
        (
            r"Motion of ur5e: q_seed: expected shape \(6,\), got \(2,\)",
            lambda: replaced_seed([1, 2]),
        ),
        (
            r"MotionSequence of ur5e: q_start: expected shape \(6,\)",
            lambda: MotionSequence(ROBOT, [1, 2]),
        ),
        (r"arc: via: expected shape \(3,\), got \(2,\)", lambda: arc(T_0, [1, 2], T_1)),
        (
            r"Grid.from_bounds: lower: expected shape \(3,\)",
            lambda: Grid.from_bounds(np.zeros(2), np.ones(2), 5),
        ),
    ],
    ids=["motion seed", "sequence start", "arc via", "cells lower"],
)
def test_wrong_shapes_of_study_arguments_are_rejected(message, called):
    with pytest.raises(ShapeError, match=message):
        called()


def replaced_seed(seed):
    return Motion(ROBOT, line(T_0, T_1), time_scaling("cubic", 0.1, duration=1), np.array(seed))


def test_pure_rotation_line_has_angle_as_length():
    """A line with equal end positions is a pure rotation, even if the positions have rounding
    errors."""
    turn = np.eye(4)
    turn[:2, :2] = [[0, -1], [1, 0]]
    for off in (0, 1e-17, 1e-14):
        end = T_0 @ turn
        end[:3, 3] = T_0[:3, 3] + off
        turned = line(T_0, end)
        assert turned.length == pytest.approx(np.pi / 2)
        assert np.abs(turned.at(np.array([0, 0.5])).V).max() < 1.1
    start, pitched = [0.2, 0.1, 0.3, 0.0], [0.2 + 1e-17, 0.1, 0.3, 0.5]
    assert task_line("position_pitch", start, pitched).length == pytest.approx(0.5)


def test_float_sample_count_is_accepted():
    one, other = (workspace(ROBOT, count, resolution=10) for count in (1e3, 1000))
    assert one.samples == 1000
    assert np.array_equal(one.hits, other.hits)
