"""Assembly modes of planar platforms with all types of legs agree with Newton's method."""

import sys

import numpy as np
import pytest

from chasles.derive import derive, read_text
from tests.support.compiling import compiled
from tests.support.generators import planar_platforms
from tests.support.generators.planar_platforms import HEAD, drawn_platform

CYLINDER = """
[[cylinders]]
name = "q_{k}"
retracted = 0
a = {{ body = "0", xyz = [{a[0]}, {a[1]}, 0] }}
b = {{ body = "platform", xyz = [{b[0]}, {b[1]}, 0] }}
swing = "psi_{k}"
"""
SLIDE = """
[[joints]]
name = "q_{k}"
type = "prismatic"
parent = "0"
link = "slide_{k}"
xyz = [{a[0]}, {a[1]}, 0]
axis = [{c}, {s}, 0]
"""
ROD = """
[[rods]]
name = "rod_{k}"
length = {length}
a = {{ body = "slide_{k}", xyz = [0, 0, 0] }}
b = {{ body = "platform", xyz = [{b[0]}, {b[1]}, 0] }}
swing = "psi_{k}"
"""
FUNCTIONS = ["modes", "chain_fk", "actuators", "actuators_all", "velocity_relation"]
FUNCTIONS += ["actuator_margin", "constraint", "constraint_D_z", "rods"]
# A planar platform on three cylinders with six real assembly modes, from Innocenti and
# Parenti-Castelli 1992.
BASE = np.array([[0, 0], [15.91, 0], [0, 10]])
PINS = np.array([[0, 0], [17.04, 0], [13.237, 16.095]])
LENGTHS = np.array([14.98, 15.38, 12.0])


def placed(pose, pins):
    c, s = np.cos(pose[..., 2, None]), np.sin(pose[..., 2, None])
    x = pose[..., 0, None] + c * pins[:, 0] - s * pins[:, 1]
    return np.stack([x, pose[..., 1, None] + s * pins[:, 0] + c * pins[:, 1]], -1)


def reference(pose, ends, pins, q):
    d = placed(np.asarray(pose), pins) - ends
    lines = [f"q_{k} = {v!r}" for k, v in enumerate(map(float, q), 1)]
    psi = np.arctan2(d[:, 1], d[:, 0])
    lines += [f"psi_{k} = {v!r}" for k, v in enumerate(map(float, psi), 1)]
    lines += [
        f"{name} = {v!r}" for name, v in zip(("x", "y", "phi"), map(float, pose), strict=True)
    ]
    return "\n[reference]\n" + "\n".join(lines)


def newton(ends, pins, lengths, generator, count=150):
    """Find planar poses with three pins on three circles, by Newton's method from random starts."""
    size = np.abs(pins).max() + np.max(lengths)
    x = generator.uniform([-size, -size, -np.pi], [size, size, np.pi], (count, 3))
    for _ in range(60):
        b = placed(x, pins)
        d = b - ends
        distance = np.hypot(d[..., 0], d[..., 1])
        n = d / distance[..., None]
        r = b - x[:, None, :2]
        J = np.concatenate([n, (r[..., :1] * n[..., 1:] - r[..., 1:] * n[..., :1])], -1)
        step = np.linalg.solve(J + 1e-12 * np.eye(3), (lengths - distance)[..., None])[..., 0]
        x = x + step * np.minimum(1, 0.5 / np.maximum(np.abs(step[:, 2:]), 0.5))
    x = x[np.abs(lengths - distance).max(-1) < 1e-11 * size]
    x[:, 2] = np.angle(np.exp(1j * x[:, 2]))
    kept = []
    for pose in x:
        if all(np.abs(pose - other).max() > 1e-6 for other in kept):
            kept.append(pose)
    return np.array(sorted(kept, key=lambda pose: pose[2])).reshape(-1, 3)


@pytest.fixture(scope="module")
def cylinders(tmp_path_factory):
    text = HEAD.format(name="planar_3rpr")
    text += "".join(
        CYLINDER.format(k=k, a=a, b=b) for k, (a, b) in enumerate(zip(BASE, PINS, strict=True), 1)
    )
    text += reference([-8.7253, 12.1766, -0.9871], BASE, PINS, LENGTHS)
    # A planar leg with a cylinder has only one branch.
    functions = [name for name in FUNCTIONS if name not in ("actuators_all", "actuator_margin")]
    folder = tmp_path_factory.mktemp("rpr") / "planar_3rpr"
    return compiled(read_text(text), folder, functions, ["c"])


def test_published_planar_platform_has_six_assembly_modes(cylinders):
    found = cylinders.fk_all(LENGTHS)
    assert found.complete
    assert found.valid.all()
    expected = newton(BASE, PINS, LENGTHS, np.random.default_rng(0))
    np.testing.assert_allclose(found.theta, expected, atol=1e-9)
    np.testing.assert_allclose(found.T[:, :2, 3], expected[:, :2], atol=1e-9)
    assert found.margin.min() > 0.05


def test_assembly_modes_at_random_lengths_match_newton(cylinders):
    generator = np.random.default_rng(1)
    counts = np.zeros(7, int)
    for q in generator.uniform(4, 25, (25, 3)):
        found = cylinders.fk_planar_all(q)
        expected = newton(BASE, PINS, q, generator)
        np.testing.assert_allclose(found.x[found.valid], expected, atol=1e-6)
        counts[len(expected)] += 1
    assert counts[1::2].sum() == 0
    assert (counts[[0, 2, 4]] > 2).all()
    assert np.isnan(cylinders.fk_all([-1.0, 15.0, 12.0]).theta).all()


def test_planar_ik_returns_lengths_of_cylinder_legs(cylinders):
    generator = np.random.default_rng(2)
    pose = generator.uniform([-10, -10, -3], [10, 10, 3], (50, 3))
    q, _, margin, valid = cylinders.ik_planar(pose)
    assert q.shape == (50, 1, 3)
    assert valid.all()
    np.testing.assert_array_equal(margin, 1)
    d = placed(pose, PINS) - BASE
    np.testing.assert_allclose(q[:, 0], np.hypot(d[..., 0], d[..., 1]), atol=1e-12)
    found = cylinders.fk_planar_all(q[:, 0])
    assert np.nanmin(np.abs(found.x - pose[:, None]).max(-1), axis=1).max() < 1e-6


def test_assembly_modes_of_3prr_platform_match_newton(tmp_path):
    angles = np.radians([20, 130, 265])
    base = 0.5 * np.stack([np.cos(angles), np.sin(angles)], -1)
    way = np.stack([-np.sin(angles), np.cos(angles)], -1)
    pins, lengths = 0.3 * base, np.array([0.4, 0.45, 0.38])
    q0 = np.sqrt(lengths**2 - 0.35**2)
    text = HEAD.format(name="planar_3prr")
    for k in range(3):
        text += SLIDE.format(k=k + 1, a=base[k], c=way[k, 0], s=way[k, 1])
        text += ROD.format(k=k + 1, length=lengths[k], b=pins[k])
    text += reference([0, 0, 0], base + q0[:, None] * way, pins, q0)
    robot = compiled(read_text(text), tmp_path / "planar_3prr", FUNCTIONS, ["c"])
    generator = np.random.default_rng(3)
    modes = 0
    for q in generator.uniform(0.1, 0.3, (10, 3)):
        found = robot.fk_planar_all(q)
        ends = base + q[:, None] * way
        expected = newton(ends, pins, lengths, generator)
        np.testing.assert_allclose(found.x[found.valid], expected, atol=1e-6)
        modes += len(expected)
    assert modes > 15
    assert robot.ik_planar([0.0, 0.0, 0.0]).q.shape == (8, 3)


MAX_QUERIES = 5_000
"""Upper bound on the number of sign queries in SymPy. A platform needs 300 to 1,000 queries."""


@pytest.fixture
def queries(monkeypatch):
    assumptions = sys.modules["sympy.core.assumptions"]
    search, counted = assumptions._ask, []

    def counting(fact, expression):
        counted.append(fact)
        return search(fact, expression)

    monkeypatch.setattr(assumptions, "_ask", counting)
    return counted


def test_legs_with_prismatic_joints_are_derived_quickly_with_long_decimals(monkeypatch, queries):
    monkeypatch.setattr(planar_platforms, "_rounded", lambda place: tuple(map(float, place)))
    platform = drawn_platform(np.random.default_rng(0), (("PRP", 2), ("RPP", 1), ("PRP", 2)))
    hybrid = derive(read_text(platform.text("platform")), functions=["legs", "actuators"]).hybrid
    assert not hybrid.backward.open
    assert 0 < len(queries) < MAX_QUERIES
