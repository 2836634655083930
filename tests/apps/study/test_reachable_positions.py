"""Tests the workspace of platform positions at one orientation."""

import numpy as np
import pytest

import chasles
from chasles import so3
from chasles.errors import InputValueError, OutOfReachError, ShapeError
from chasles.study import reachable_positions
from chasles.study.grid import indices


def lengths(robot, places, R):
    """Compute the leg lengths (m, 6) from the ends of the rods."""
    T = np.tile(np.eye(4), (len(places), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = R, places
    return robot.ik(T).q[:, 0]


@pytest.fixture(scope="module")
def hexapod():
    return chasles.load("stewart_gough")


@pytest.fixture(scope="module")
def whole(hexapod):
    return reachable_positions(hexapod, resolution=64)


def test_hexapod_workspace_matches_intersection_of_leg_shells(hexapod):
    """The workspace is the intersection of six spherical shells, one per leg."""
    rng, checked = np.random.default_rng(1), 0
    q_0 = np.array(hexapod.reference.q)
    T_0 = hexapod.fk(q_0)
    for turn in rng.uniform(-0.2, 0.2, (2, 3)):
        R = so3.exp(turn) @ T_0[:3, :3]
        found = reachable_positions(hexapod, R, resolution=64)
        # Sampled positions p determine the center c of each sphere from the leg length q = |p - c|
        # - l.
        places = T_0[:3, 3] + rng.uniform(-0.05, 0.05, (40, 3))
        shells = [shell(places, column) for column in lengths(hexapod, places, R).T]
        box = found.grid.upper - found.grid.lower
        points = found.grid.lower + box * sobol(2**16, 2)
        inside = in_shells(points, shells)
        volume = inside.mean() * box.prod()
        assert abs(found.size.value - volume) < found.size.error
        assert abs(found.size.value - volume) < 0.03 * volume
        centers = np.stack(np.meshgrid(*found.grid.centers(), indexing="ij"), -1).reshape(-1, 3)
        assert (in_shells(centers, shells) != found.inside.ravel()).mean() < 1e-3
        own = found.inside.ravel()[indices(found.grid, points)]
        assert (own != inside).mean() < 0.05
        assert (points[inside].min(0) >= found.bounds[0] - found.grid.side).all()
        assert (points[inside].max(0) <= found.bounds[1] + found.grid.side).all()
        checked += inside.sum()
    assert checked > 2000


def sobol(count, seed):
    """Return scrambled Sobol points (count, 3) in the unit cube."""
    from scipy.stats import qmc

    return qmc.Sobol(3, rng=np.random.default_rng(seed)).random(count)


def in_shells(points, shells):
    inside = np.ones(len(points), dtype=bool)
    for center, least in shells:
        d = np.linalg.norm(points - center, axis=1)
        inside &= (d >= least) & (d <= least + 0.16)
    return inside


def shell(places, q):
    """Fit the center c, the length l and the smallest radius of a spherical shell.

    The leg length is q = |p - c| - l at position p. The equation (q + l)^2 = |p|^2 - 2 p c + |c|^2
    is linear in l, c and |c|^2 - l^2.
    """
    terms = np.column_stack([2 * places, 2 * q, np.ones(len(q))])
    x, y, z, least, _ = np.linalg.lstsq(terms, (places**2).sum(1) - q**2, rcond=None)[0]
    return np.array([x, y, z]), least


def test_delta_workspace_volume_matches_jacobian_integral():
    delta = chasles.load("delta")
    found = reachable_positions(delta, resolution=128)
    unit = sobol(2**14, 3)
    q = delta.lower + unit * (delta.upper - delta.lower)
    T, J = delta.fk_jacobian_mixed(q)
    closed = np.isfinite(T[:, 0, 3])
    volumes = np.where(closed, np.abs(np.linalg.det(np.nan_to_num(J[:, :3]))), 0)
    volume = volumes.mean() * np.prod(delta.upper - delta.lower)
    assert abs(found.size.value - volume) < found.size.error
    assert found.size.value == pytest.approx(volume, rel=0.03)
    beyond = indices(found.grid, T[closed, :3, 3])
    assert found.inside.ravel()[beyond].mean() > 0.95


def test_finer_cells_reduce_error_consistently(hexapod, whole):
    rough, fine = reachable_positions(hexapod, resolution=32).size, whole.size
    assert abs(rough.value - fine.value) < rough.error
    assert fine.error < 0.6 * rough.error


def test_position_workspace_plot_labels_axes(hexapod):
    pytest.importorskip("matplotlib").use("Agg")
    found = reachable_positions(hexapod, resolution=32)
    assert found.plot()[1].get_ylabel() == "z [m]"


def test_invalid_position_workspace_arguments_are_rejected(hexapod):
    with pytest.raises(
        InputValueError, match="resolution must be a power of two times 32, got 100"
    ):
        reachable_positions(hexapod, resolution=100)
    with pytest.raises(ShapeError, match=r"R_0_ee: expected shape \(3, 3\)"):
        reachable_positions(hexapod, np.eye(4))
    # The test uses the delta, because its inverse kinematics function runs ten times faster than
    # the function of the hexapod.
    with pytest.raises(OutOfReachError, match="delta: found no box around the reached"):
        reachable_positions(chasles.load("delta"), so3.exp([3.0, 0, 0]))


def test_box_that_cuts_region_grows_to_cover_it(hexapod, whole):
    T_0, size = hexapod.fk(hexapod.reference.q), hexapod.unit_length
    # The box must not contain the mirror image of the region below the base.
    up = np.array([0, 0, 0.5])
    for away in ([1, 0, 0], [0, -1, 0]):
        T = T_0.copy()
        T[:3, 3] += size * (0.9 * np.array(away) + up)
        q_seed = hexapod.ik(T).q[0]
        found = reachable_positions(hexapod, T_0[:3, :3], resolution=64, q_seed=q_seed)
        apart = abs(found.size.value - whole.size.value)
        assert apart < found.size.error + whole.size.error
        side = found.grid.side + whole.grid.side
        np.testing.assert_allclose(found.bounds, whole.bounds, atol=side)
