"""Two coupled rotations: all angles of a dense grid, and accuracy near alignment."""

import casadi as ca
import numpy as np
import pytest
import sympy as sp

from chasles.derive.inverse.subproblems.coupled_turns import CoupledPair, coupled_turns
from chasles.derive.terms.casadi_graph import lower
from chasles.derive.terms.symbolic_function import Argument, Result, SymbolicFunction
from chasles.derive.terms.terms import Terms

SIGNS = sp.symbols("sign1:3", real=True)
ANGLES = np.linspace(-np.pi, np.pi, 40001)
PLANES = (
    (0, 35, -35, 0),
    (0, 35, 105, 140),
    (0, 60, 120, 180),
    (0, 90, 180, 270),
    (10, 40, -50, -15),
)


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("plane", PLANES)
def test_angles_are_all_sign_changes_of_the_equation(plane, sense):
    pair, component = coupled_pair(plane, sense)
    values = component(ANGLES)
    rng = np.random.default_rng(0)
    d = rng.uniform(values.min() + 1e-3, values.max() - 1e-3, 300)
    found = solutions(pair, directions(pair, d, rng))
    counts = []
    for wanted, angles, margins in zip(d, *found, strict=True):
        own = angles[margins.min(axis=-1) > 0]
        np.testing.assert_allclose(component(own), wanted, atol=1e-12)
        counts.append(len(own))
    above = values > d[:, None]
    np.testing.assert_array_equal(counts, (above[:, 1:] != above[:, :-1]).sum(axis=1))
    assert max(counts) > 0


@pytest.mark.parametrize("shift", [0, 1e-12, 1e-9, 1e-6, 1e-3])
def test_small_bend_has_no_cancellation(shift):
    pair, _ = coupled_pair((0, 35, -35, 0), -1)
    k1, k2, p = (np.array(v, dtype=float) for v in (pair.k1, pair.k2, pair.p))
    v = turned(k1, np.array([shift]), turned(k2, np.array([-shift]), p)[0])
    angles, _ = solutions(pair, v)
    assert np.abs(np.abs(angles) - shift).min() < 1e-15


def coupled_pair(plane, sense):
    """Return two coupled rotations, and the component of p along h.

    ``plane`` contains the angles (degrees) of the vectors h, k1, k2 and p in their common plane.
    """
    exact = [
        (sp.sin(a), sp.Integer(0), sp.cos(a)) for a in (sp.pi * sp.Integer(x) / 180 for x in plane)
    ]
    h, k1, k2, p = (np.array(v, dtype=float) for v in exact)

    def component(angles):
        back, there = (turned(k, s * angles, v) for k, s, v in ((k1, -1, h), (k2, sense, p)))
        return np.sum(back * there, axis=1)

    return CoupledPair(*exact, sense), component


def turned(k, angles, v):
    """Rotate row i of v about the axis k by angles[i]."""
    c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
    along = k * (k @ v)
    return along + c * (v - along) + s * np.cross(k, v)


def directions(pair, d, rng):
    """Return random unit vectors (N, 3) whose components along h are d (N,)."""
    h = np.array(pair.h, dtype=float)
    across = np.cross(h, rng.normal(size=(len(d), 3)))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    return d[:, None] * h + np.sqrt(1 - d**2)[:, None] * across


def solutions(pair, v):
    """Return four angles (N, 4) and their margins (N, 4, 2) for directions v (N, 3)."""
    terms, symbols = Terms({}), sp.symbols("v1:4", real=True)
    root, found = coupled_turns(terms, pair, symbols, SIGNS)
    outputs = (found.turn.c, found.turn.s, root.margin, found.margin)
    arguments = (Argument("v", symbols, (3,), "", ""), Argument("signs", SIGNS, (2,), "", ""))
    result = Result("y", outputs, (len(outputs),), "", "")
    f = lower([SymbolicFunction("f", "F.", "", arguments, (result,), terms)], "test")[0]
    signs = [(a, b) for a in (1, -1) for b in (1, -1)]
    slots = np.stack(
        [np.array(f(ca.DM(v.T), ca.DM(np.repeat([s], len(v), 0).T))).T for s in signs], axis=1
    )
    np.testing.assert_allclose(np.hypot(slots[..., 0], slots[..., 1]), 1, atol=1e-14)
    return np.arctan2(slots[..., 1], slots[..., 0]), slots[..., 2:]
