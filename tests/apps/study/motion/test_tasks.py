"""Joint rates of arms with few axes agree with finite differences."""

from itertools import pairwise

import numpy as np
import pytest

import chasles
from chasles.errors import InputValueError, ShapeError
from chasles.study.motion import Motion, task_line, time_scaling

POINTS = ((0.2, 0.1, 0.1), (0.2, 0.0, 0.1), (0.15, -0.1, 0.15))


def checked(motion):
    t, h = np.linspace(0, motion.duration, 2001, retstep=True)
    found = motion.at(t)
    for values, rates in ((found.q, found.qd), (found.qd, found.qdd)):
        differences = (values[2:] - values[:-2]) / (2 * h)
        most = max(np.abs(rates).max(), 1e-9)
        np.testing.assert_allclose(differences, rates[1:-1], atol=1e-3 * most)
    return found


def test_position_pitch_line_is_straight_at_constant_pitch():
    arm = chasles.load("lynxmotion")
    for a, b in pairwise(POINTS):
        line = task_line("position_pitch", [*a, 0], [*b, 0])
        seed = np.radians([np.degrees(np.arctan2(a[1], a[0])), 52, -104, -38, 0])
        found = checked(Motion(arm, line, time_scaling("quintic", line.length, duration=1), seed))
        np.testing.assert_allclose(found.T[-1, :3, 3], b, atol=1e-9)
        assert np.abs(found.T[:, 2, 2]).max() < 1e-9
        way = found.T[:, :3, 3] - a
        across = np.cross(way, (np.array(b) - a) / line.length)
        assert np.abs(across).max() < 1e-9
    pitched = task_line("position_pitch", [*POINTS[1], 0], [0.15, 0.15, 0.15, -0.5])
    found = checked(
        Motion(arm, pitched, time_scaling("quintic", pitched.length, duration=1), found.q[0])
    )
    assert np.arcsin(found.T[-1, 2, 2]) == pytest.approx(-0.5, abs=1e-9)


def test_planar_task_line_has_exact_derivatives():
    arm = chasles.load("bricklaying_planar")
    rng = np.random.default_rng(1)
    done = 0
    for q in rng.uniform(-1.5, 1.5, (40, arm.n)):
        T = arm.fk([q, q + rng.uniform(-0.05, 0.05, arm.n)])
        x = np.column_stack([T[:, :2, 3], np.arctan2(T[:, 1, 0], T[:, 0, 0])])
        line = task_line("planar", *x)
        try:
            checked(Motion(arm, line, time_scaling("quintic", line.length, duration=1), q))
        except chasles.OutOfReachError:
            continue
        done += 1
    assert done >= 5


def test_underconstrained_position_task_is_rejected():
    arm = chasles.load("lynxmotion")
    q = np.radians([[10, 80, -60, 0, 0], [12, 82, -63, 0, 0]])
    line = task_line("position", *arm.fk(q)[:, :3, 3])
    motion = Motion(arm, line, time_scaling("cubic", line.length, duration=1), q[0])
    with pytest.raises(
        InputValueError,
        match=r"task position: the task does not determine the joint rates; got 3 coordinates",
    ):
        motion.sample()


def test_invalid_task_line_arguments_are_rejected():
    with pytest.raises(InputValueError, match="expected one of position, position_pitch, planar"):
        task_line("pose", [0] * 6, [1] * 6)
    with pytest.raises(ShapeError, match=r"position_pitch has 4 values, got \(3,\) and \(4,\)"):
        task_line("position_pitch", [0] * 3, [1] * 4)
