"""Micrometer- and kilometer-sized robots have the solutions of a meter-sized robot.

Scaling all lengths scales positions and prismatic joints. Scaling all lengths does not change
revolute joint values or valid solution slots.
"""

from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import chasles
import chasles.derive
from chasles.contract import Coordinate
from chasles.size import unit_length
from chasles.tolerances import MIN_SIZE
from tests.support.compiling import compiled
from tests.support.scaled import scaled

ROBOTS = Path(chasles.derive.__file__).parent / "robots"
FUNCTIONS = ("fk", "fk_jacobian_mixed", "hessian_mixed", "ik")
SIZES = {"scara": sp.Rational(1, 10**6), "stanford": sp.Integer(1000)}
"""Scale factors for the lengths of two arms with prismatic joints: one with four joints, and one
with six.

The scaled scara is about one micrometer long. The scaled stanford arm is about one kilometer long.
"""
POSES = 300
BORDER = 0.1
"""If a residual differs from the tolerance by less than this fraction, rounding decides on
validity."""
REACHED = 1e-12
"""Largest pose error of a solution, in radians and relative to the unit of length."""


@pytest.fixture(scope="module", params=SIZES)
def family(request, tmp_path_factory):
    """Return a shipped robot about one meter in size, and the same robot scaled to another size."""
    name, factor = request.param, SIZES[request.param]
    robot = scaled(chasles.derive.read(ROBOTS / f"{name}.toml"), factor, name)
    folder = tmp_path_factory.mktemp("sizes") / name
    return {1: chasles.load(name), float(factor): compiled(robot, folder, FUNCTIONS, ["c"])}


def poses(arm):
    """Return reachable poses, far poses, and poses slightly out of reach."""
    rng = np.random.default_rng(1)
    q = rng.uniform(-2, 2, (POSES, arm.n))
    T = arm.fk(q)
    T[: POSES // 3, :3, 3] *= rng.uniform(1, 1.5, (POSES // 3, 1))
    near = T[POSES // 3 : POSES // 2]
    near[:, :3, 3] *= 1 + 10 ** rng.uniform(-12, -3, (len(near), 1))
    return T


def resized(T, factor):
    T = T.copy()
    T[..., :3, 3] *= factor
    return T


def slides(arm, factor):
    """Return the scale factor of each coordinate."""
    return np.array([factor if c.unit == "m" else 1.0 for c in arm.coordinates])


def test_unit_length_scales_with_robot(family):
    for factor, arm in family.items():
        assert arm.unit_length == pytest.approx(family[1].unit_length * factor)
        assert arm.ik.solutions.unit_length == arm.unit_length
        np.testing.assert_allclose(arm.ik.solutions.tolerance, 1e-9 * arm.unit_length)


def test_ik_solutions_are_scale_invariant(family):
    T = poses(family[1])
    wanted = family[1].ik(T)
    assert 0.1 < wanted.valid.mean() < 1
    for factor, arm in family.items():
        found = arm.ik(resized(T, factor))
        border = np.abs(wanted.residual / wanted.tolerance - 1) < BORDER
        np.testing.assert_array_equal(found.valid | border, wanted.valid | border)
        np.testing.assert_allclose(
            found.residual[~wanted.valid] / factor, wanted.residual[~wanted.valid], rtol=1e-3
        )
        off = resized(arm.fk(found.q) - resized(T, factor)[:, None], 1 / arm.unit_length)
        assert np.abs(off[wanted.residual < REACHED]).max() < REACHED
        single = arm.ik(resized(T, factor)[5])
        np.testing.assert_array_equal(single.valid, found.valid[5])
        np.testing.assert_allclose(single.residual, found.residual[5], atol=1e-12 * factor)
        batch = arm.ik(resized(T, factor)[::-1], threads=2)
        np.testing.assert_array_equal(batch.valid[::-1], found.valid)


def test_solution_filters_are_scale_invariant(family):
    q = np.random.default_rng(2).uniform(-1.5, 1.5, (100, family[1].n))
    T, seed = family[1].fk(q), q + 0.1
    wanted = family[1].ik(T)
    for factor, arm in family.items():
        by = slides(arm, factor)
        found = arm.ik(resized(T, factor))
        nearest = found.nearest(seed * by) / by
        np.testing.assert_allclose(nearest, wanted.nearest(seed), atol=1e-9)
        np.testing.assert_array_equal(found.distinct().valid, wanted.distinct().valid)
        np.testing.assert_array_equal(
            found.within_limits(windings=False).valid, wanted.within_limits(windings=False).valid
        )


def test_ik_path_is_scale_invariant(family):
    q = np.linspace(0.2, 0.9, 60)[:, None] * np.linspace(1, 0.6, family[1].n)
    T = family[1].fk(q)
    wanted = family[1].ik_path(T, q[0])
    for factor, arm in family.items():
        by = slides(arm, factor)
        found = arm.ik_path(resized(T, factor), q[0] * by)
        assert (found.reason, found.ended_at) == (wanted.reason, wanted.ended_at)
        np.testing.assert_allclose(found.q / by, wanted.q, atol=1e-9)


def test_ik_numeric_converges_at_every_scale(family):
    q = np.random.default_rng(3).uniform(-1, 1, (60, family[1].n))
    T = family[1].fk(np.clip(q, family[1].lower, family[1].upper))
    for factor, arm in family.items():
        found = arm.ik_numeric(resized(T, factor))
        assert found.valid.all()
        off = resized(arm.fk(found.q) - resized(T, factor), 1 / arm.unit_length)
        assert np.abs(off).max() < 2e-9


def test_out_of_reach_error_suspects_millimeters(family):
    for factor, arm in family.items():
        T = arm.fk(np.full(arm.n, 0.3) * slides(arm, factor))
        if arm.ik(resized(T, 1000)).valid.any():
            # `ik` ignores limits, so a prismatic joint has no bounds.
            assert arm.name == "stanford"
            continue
        with pytest.raises(chasles.OutOfReachError, match="in millimeters"):
            arm.ik(resized(T, 1000)).nearest(np.zeros(arm.n))
        with pytest.raises(chasles.OutOfReachError, match="out of reach, by"):
            arm.ik(resized(T, 10)).nearest(np.zeros(arm.n))


def coordinate(kind, lower=None, upper=None):
    return Coordinate("q", kind, "rad" if kind == "revolute" else "m", lower, upper)


def on_a_line(scale, away=0.0):
    """Return the forward kinematics of a prismatic joint."""

    def fk(q):
        T = np.tile(np.eye(4), (len(q), 1, 1))
        T[:, 0, 3] = scale * q[:, 0] + away
        return T

    return fk


@pytest.mark.parametrize("exponent", range(-6, 4, 3))
def test_unit_length_follows_prismatic_joint_range(exponent):
    span = 10.0**exponent
    slide = (coordinate("prismatic", -2 * span, 2 * span),)
    assert unit_length(on_a_line(1), slide, None) == pytest.approx(span)
    assert unit_length(on_a_line(1, 100 * span), slide, None) == pytest.approx(span)
    assert unit_length(on_a_line(1, 1e8 * span), slide, None) == pytest.approx(1000 * span)


@pytest.mark.parametrize(
    ("radius", "unit"), [(0.02, 0.001), (0.05, 1), (20, 1), (50, 1000)], ids=str
)
def test_unit_length_is_the_nearest_power_of_1000(radius, unit):
    """A line segment of length L has the RMS distance L / (2 sqrt(3)) from its midpoint."""
    half = radius * 3**0.5
    slide = (coordinate("prismatic", -half, half),)
    assert unit_length(on_a_line(1), slide, None) == unit
    still = (coordinate("prismatic", -1e-12, 1e-12),)
    assert unit_length(on_a_line(1, radius / MIN_SIZE), still, None) == unit


def test_unit_length_defaults_to_meter():
    assert unit_length(on_a_line(0), (coordinate("revolute"),), None) == 1
    lost = unit_length(lambda q: np.full((len(q), 4, 4), np.nan), (coordinate("revolute"),), None)
    assert lost == 1
