"""Tests assembly modes of the shipped platforms, and their leg lengths at a pose."""

from functools import cache

import numpy as np
import pytest

import chasles
from tests.support.rate_inputs import sampling_limits

NAMES = ["planar_3rrr", "stewart_gough", "delta"]
MAX = {"planar_3rrr": 6, "stewart_gough": 28, "delta": 40}
CLOSED = 1e-12


@cache
def robot(name):
    return chasles.load(name)


def within(name, n, seed):
    r = robot(name)
    return np.random.default_rng(seed).uniform(*sampling_limits(r), (n, r.n))


def apart(T, other):
    return np.abs(T - other).max((-2, -1))


@pytest.mark.parametrize("name", NAMES)
def test_assembly_modes_close_and_contain_reference(name):
    r = robot(name)
    q = within(name, 60, 0)
    found = r.fk_all(q)
    assert found.T.shape == (60, MAX[name], 4, 4)
    assert found.complete.all()
    rods = r.functions["rods"](found.theta[found.valid], np.repeat(q, found.valid.sum(-1), 0))
    assert np.abs(rods).max() < CLOSED
    assert np.isnan(found.T[~found.valid]).all()
    assert np.isnan(found.margin[~found.valid]).all()
    # Real assembly modes occur in pairs and fill the first solution slots.
    assert (found.valid.sum(-1) % 2 == 0).all()
    assert (found.valid[:, :-1] >= found.valid[:, 1:]).all()
    assert np.nanmin(apart(found.T, r.fk(q)[:, None]), axis=-1).max() < 1e-9
    for k in range(0, 60, 10):
        T = found.T[k][found.valid[k]]
        distances = apart(T[:, None], T[None]) + 9 * np.eye(len(T))
        assert distances.min() > 1e-6


def test_hexapod_modes_are_sorted_from_highest():
    r = robot("stewart_gough")
    found = r.fk_all(within("stewart_gough", 40, 1))
    heights = np.where(found.valid, found.theta[..., 2], -np.inf)
    assert (heights[:, :-1] >= heights[:, 1:]).all()
    np.testing.assert_allclose(found.T[found.valid], r.chain_fk(found.theta[found.valid]))


def test_hexapod_with_equal_legs_has_16_modes():
    """With legs of equal length, the reference mode is symmetric, and modes could coincide."""
    r = robot("stewart_gough")
    found = r.fk_all(np.full(6, 0.08))
    assert found.complete
    theta = found.theta[found.valid]
    assert len(theta) == 16
    np.testing.assert_allclose(theta[0], r.chain(np.full(6, 0.08)), atol=1e-12)
    np.testing.assert_allclose(theta[-1], theta[0] * [1, 1, -1, 1, 1, 1], atol=1e-12)


def test_delta_modes_include_rotated_platforms():
    r = robot("delta")
    q = within("delta", 30, 2)
    found, both = r.fk_all(q), r.chain_branches(q).theta
    for k in range(2):
        assert np.nanmin(np.abs(found.theta - both[:, None, k]).max(-1), axis=-1).max() < 1e-9
    turned = found.valid & (np.abs(found.T[..., :3, :3] - np.eye(3)).max((-2, -1)) > 0.1)
    np.testing.assert_array_equal(turned.sum(-1), found.valid.sum(-1) - 2)
    assert (turned.sum(-1) > 4).all()


def test_hexapod_ik_returns_leg_lengths():
    r = robot("stewart_gough")
    generator = np.random.default_rng(3)
    theta = generator.uniform([-0.3, -0.3, 0.3, -3, -1.5, -3], [0.3, 0.3, 1, 3, 1.5, 3], (500, 6))
    T = r.chain_fk(theta)
    found = r.ik(T)
    assert (found.valid ^ found.other_mode).all()
    assert 50 < found.count.sum() < 450
    np.testing.assert_array_equal(found.valid, apart(r.fk(found.q), T[:, None]) < 1e-9)
    np.testing.assert_allclose(found.q[:, 0], r.actuators(theta), atol=1e-15)
    right = np.eye(4)
    right[:3, :3], right[2, 3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], 0.6
    sampling_limits = r.ik(right)
    assert sampling_limits.valid.all()
    modes = r.fk_all(sampling_limits.q[0])
    assert np.nanmin(apart(modes.T, right)) < 1e-9
    with pytest.raises(chasles.InputValueError, match="T"):
        r.ik(2 * np.eye(4))
    assert not r.ik(np.full((4, 4), np.nan)).valid.any()


@pytest.mark.parametrize("name", NAMES)
def test_modes_agree_for_every_call_form(name):
    r = robot(name)
    q = within(name, 6, 4).reshape(2, 3, -1)
    theta, margin, unsure = r.functions["modes"](q)
    assert theta.shape == (2, 3, MAX[name], theta.shape[-1])
    assert unsure.shape == (2, 3, 1)
    single = r.functions["modes"](q[1, 2])
    np.testing.assert_array_equal(single[0], theta[1, 2])
    into = (np.empty_like(theta), np.empty_like(margin), np.empty_like(unsure))
    assert r.functions["modes"](q, out=into, threads=2)[0] is into[0]
    for one, other in zip(into, (theta, margin, unsure), strict=True):
        np.testing.assert_array_equal(one, other)
    array = pytest.importorskip("dask.array")
    lazy = r.functions["modes"](array.from_array(q, chunks=(1, 3, r.n)))
    np.testing.assert_array_equal(lazy[0].compute(), theta)
    for bad in (np.nan, np.inf):
        odd = q[0, 0].copy()
        odd[0] = bad
        assert all(np.isnan(part).all() for part in r.functions["modes"](odd))
        assert not r.fk_all(odd).complete


@pytest.mark.parametrize("name", NAMES)
def test_assembly_modes_far_outside_limits_are_closed(name):
    r = robot(name)
    lower, upper = sampling_limits(r)
    beyond = 1.5 * (upper - lower)
    q = np.random.default_rng(5).uniform(lower - beyond, upper + beyond, (60, r.n))
    found = r.fk_all(q)
    rods = r.functions["rods"](found.theta[found.valid], np.repeat(q, found.valid.sum(-1), 0))
    assert np.abs(rods).max() < CLOSED
    counts = found.valid.sum(-1)
    assert (counts == 0).any()
    assert (counts > 0).any()
    assert found.complete.mean() > 0.99
