"""Conics through five points, and task curves."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

import chasles
from chasles.errors import InputValueError, ShapeError
from chasles.study.motion import Motion, concatenate, conic, parabola, task_curve, time_scaling

ELLIPSE = (np.cos, np.sin, lambda u: -np.sin(u), np.cos)
PARABOLA = (lambda u: u, lambda u: u**2, lambda u: 1 + 0 * u, lambda u: 2 * u)
HYPERBOLA = (np.cosh, np.sinh, np.sinh, np.cosh)


def drawn(count):
    rng = np.random.default_rng(1)
    for k in range(count):
        x, y, x_u, y_u = (ELLIPSE, PARABOLA, HYPERBOLA)[k % 3]
        a, b = rng.uniform(0.2, 2, 2)
        start, width = rng.uniform(-2, 2), rng.uniform(0.5, 5 if k % 3 == 0 else 2)
        u = start + width * np.r_[0, np.sort(rng.uniform(0.1, 0.9, 3)), 1]
        if np.diff(u).min() < 0.05:
            u = start + width * np.linspace(0, 1, 5)
        R, middle = Rotation.random(random_state=rng).as_matrix(), rng.uniform(-1, 1, 3)
        T = np.tile(np.eye(4), (5, 1, 1))
        T[:, :3, :3] = Rotation.from_rotvec(rng.uniform(-0.5, 0.5, (5, 3))).as_matrix()
        T[:, :3, 3] = middle + np.column_stack([a * x(u), b * y(u), 0 * u]) @ R.T

        def speed(v, a=a, b=b, x_u=x_u, y_u=y_u):
            return np.hypot(a * x_u(v), b * y_u(v))

        yield T, u, speed, (R, middle, a, b, k % 3)


def off(points, form):
    """Return distances of points from the implicit conic and from its plane."""
    R, middle, a, b, kind = form
    x, y, z = ((points - middle) @ R).T
    x, y = x / a, y / b
    return np.abs((x * x + y * y - 1, y - x * x, x * x - y * y - 1)[kind]), np.abs(z)


def test_conic_through_five_points_recovers_curve():
    checked = 0
    for T, u, speed, form in drawn(30):
        curve = conic(T)
        ways = np.r_[0, np.cumsum([quad(speed, *ends)[0] for ends in pairwise(u)])]
        np.testing.assert_allclose(curve.length, ways[-1], rtol=1e-8)
        np.testing.assert_allclose(curve.at(ways).T, T, atol=1e-7)
        points = curve.at(np.linspace(0, curve.length, 40)).T[:, :3, 3]
        size = np.abs(points - form[1]).max() ** 2 / min(form[2:4]) ** 2
        implicit, plane = off(points, form)
        assert implicit.max() < 1e-8 * max(size, 1)
        assert plane.max() < 1e-10
        assert (curve.weight < 1, abs(curve.weight - 1) < 1e-6, curve.weight > 1)[form[4]]
        checked += 1
    assert checked == 30


def test_conic_is_parametrized_by_arc_length():
    h = 1e-5
    for T, *_ in drawn(12):
        curve = conic(T)
        s = np.linspace(2 * h, curve.length - 2 * h, 25)
        _, V, A = curve.at(s)
        before, after = curve.at(s - h), curve.at(s + h)
        np.testing.assert_allclose(np.linalg.norm(V[:, :3], axis=1), 1, atol=1e-12)
        moved = (after.T[:, :3, 3] - before.T[:, :3, 3]) / (2 * h)
        np.testing.assert_allclose(moved, V[:, :3], atol=1e-6 * max(np.abs(A).max(), 1) ** 2)
        bent = (after.V - before.V) / (2 * h)
        np.testing.assert_allclose(bent, A, atol=1e-5 * max(np.abs(A).max(), 1) ** 3)


def test_points_without_conic_arc_are_rejected():
    on_circle = np.column_stack([np.cos(a := np.arange(5.0)), np.sin(a), 0 * a])
    swapped = on_circle[[0, 2, 1, 3, 4]]
    branches = np.column_stack([[1, 1, 1, -1, -1] * np.cosh(a - 2), np.sinh(a - 2), 0 * a])
    for points in (swapped, branches):
        with pytest.raises(InputValueError, match="conic: the points do not follow each other"):
            conic(points)
    with pytest.raises(InputValueError, match="conic: points 0, 2 and 4 are collinear"):
        conic([[0, 0, 0], [1, 1, 0], [2, 0, 0], [3, 1, 0], [4, 0, 0]])
    with pytest.raises(InputValueError, match="expected coplanar points"):
        conic(on_circle + np.outer(a == 0, [0, 0, 1]))
    with pytest.raises(ShapeError, match="conic: expected five poses, got 4"):
        conic(on_circle[:4])


def test_teaching_arm_follows_two_parabolas_of_paper():
    """With the paper's base height of 0.1 m, three points violate the limits."""
    arm = chasles.load("lynxmotion")
    y = np.array([0.2, 0.15, 0.1, 0.05, 0.0])
    points = np.column_stack([np.full(5, 0.2), y, [0.15, 0.1, 0.15, 0.1, 0.15]])
    seed, parts = np.radians([45, 40, -50, -80, 0]), []
    for three in (points[:3], points[2:]):
        curve = task_curve("position_pitch", parabola(three))
        motion = Motion(arm, curve, time_scaling("constant", curve.length, duration=0.5), seed)
        parts.append(motion.sample(100))
        seed = parts[-1].q[-1]
    found = concatenate(parts)
    assert len(found.t) == 101
    assert found.t[-1] == pytest.approx(1)
    np.testing.assert_allclose(found.T[[0, 25, 50, 75, 100], :3, 3], points, atol=1e-12)
    depth = 0.1 + 0.05 * (np.abs(found.T[:, 1, 3] - 0.1) / 0.05 - 1) ** 2
    np.testing.assert_allclose(found.T[:, 2, 3], depth, atol=1e-12)
    assert np.abs(found.T[:, 2, 2]).max() < 1e-12
    for part in parts:
        rates = (part.q[2:] - part.q[:-2]) * 50
        np.testing.assert_allclose(rates, part.qd[1:-1], atol=1e-2 * np.abs(part.qd).max())
    np.testing.assert_allclose(parts[0].q[-1], parts[1].q[0], atol=1e-9)


def test_unknown_curve_task_is_rejected():
    curve = parabola([[0, 0, 0], [1, 1, 0], [2, 0, 0]])
    with pytest.raises(InputValueError, match="task_curve: expected one of position, position_pi"):
        task_curve("pose", curve)
