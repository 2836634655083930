"""`reach` agrees with the solutions of `ik` within the limits, for random robots."""

import numpy as np
import pytest

import chasles
from chasles import se3
from chasles.errors import InputValueError, ShapeError
from chasles.study import base_placement, reach, uniform_orientations
from chasles.study.grid import Grid
from chasles.study.reach import FREE, OUT_OF_REACH

ROBOTS = ("ur5e", "puma560", "irb6640", "scara", "stanford", "board_installer")
POSES = 400


def poses(robot, rng):
    """Return tool poses at random configurations. Some configurations violate the joint limits."""
    lower = np.where(np.isfinite(robot.lower), robot.lower, -np.pi)
    upper = np.where(np.isfinite(robot.upper), robot.upper, np.pi)
    beyond = 0.5 * (upper - lower)
    T = robot.fk(rng.uniform(lower - beyond, upper + beyond, (POSES, robot.n)))
    return T[np.isfinite(T).all((-1, -2))]


@pytest.mark.parametrize("name", ["puma560", "irb6640", "scara"])
def test_configurations_at_limits_are_reached(name):
    """Rounding errors may move a solution slightly beyond a limit."""
    robot, rng = chasles.load(name), np.random.default_rng(12)
    q = rng.uniform(robot.lower, robot.upper, (200, robot.n))
    at = rng.integers(0, 3, q.shape)
    q = np.select([at == 0, at == 1], [robot.lower, robot.upper], q)
    # Some joints are at their limits. The inverse kinematics function recovers regular
    # configurations.
    clear = robot.ik(robot.fk(q)).margin.min(-1) > 1e-6
    assert clear.sum() > 100
    assert reach(robot, robot.fk(q[clear])).reached.all()


@pytest.mark.parametrize("name", ROBOTS)
def test_reach_matches_inverse_with_limit_filter(name):
    robot = chasles.load(name)
    T = poses(robot, np.random.default_rng(3))
    found = reach(robot, T)
    kept = robot.ik(T).within_limits(windings=False)
    assert np.array_equal(found.n_solutions[:, 0], kept.valid.sum(-1))
    assert np.array_equal(found.limiting_coordinate[:, 0] == FREE, kept.valid.any(-1))
    open_reach = robot.ik(T).valid.any(-1)
    assert np.array_equal(found.limiting_coordinate[:, 0] == OUT_OF_REACH, ~open_reach)
    assert found.reached.any()


def test_reported_limit_prevents_solution():
    robot = chasles.load("puma560")
    T = poses(robot, np.random.default_rng(4))
    found = reach(robot, T)
    lower, upper = robot.lower, robot.upper
    checked = 0
    for k in np.flatnonzero(found.limiting_coordinate[:, 0] >= 0):
        j = found.limiting_coordinate[k, 0]
        q = robot.ik(T[k])
        wide = q.within_limits(
            np.column_stack(
                [
                    np.where(np.arange(robot.n) == j, -np.pi, lower - 2 * np.pi),
                    np.where(np.arange(robot.n) == j, np.pi, upper + 2 * np.pi),
                ]
            ),
            windings=False,
        )
        assert wide.valid.any()
        checked += 1
    assert checked > 50
    assert sum(found.limit_counts().values()) == checked


def test_reach_over_cells_counts_limited_solutions():
    robot = chasles.load("ur5e")
    cells = Grid.from_bounds(np.array([-0.9, -0.9, 0.0]), np.array([0.9, 0.9, 0.9]), 9)
    found = reach(robot, cells, uniform_orientations(6))
    assert found.fraction_grid().shape == cells.shape
    x, y, z = cells.centers()
    T = np.eye(4)
    checked = 0
    for i, j, k, turn in np.ndindex(3, 3, 3, 6):
        T[:3, 3] = x[3 * i], y[3 * j], z[k]
        T[:3, :3] = uniform_orientations(6)[turn]
        place = np.ravel_multi_index((3 * i, 3 * j, k), cells.shape)
        expected = robot.ik(T).within_limits(windings=False).count
        assert found.n_solutions[place, turn] == expected
        checked += 1
    assert checked == 162


def test_reach_sums_solutions_over_fixed_joint_values():
    robot = chasles.load("panda")
    lower, upper = robot.lower[6], robot.upper[6]
    T = robot.fk(np.random.default_rng(5).uniform(robot.lower, robot.upper, (20, 7)))
    found = reach(robot, T, redundancy_samples=5)
    values = np.linspace(lower, upper, 5)
    counts = [
        robot.ik(T, fixed={"joint7": value}).within_limits(windings=False).valid.sum(-1)
        for value in values
    ]
    assert np.array_equal(found.n_solutions[:, 0], np.sum(counts, 0))


def test_reach_is_equal_for_any_thread_count():
    robot = chasles.load("ur5e")
    places = np.random.default_rng(6).uniform(-1, 1, (5000, 3))
    one, two = (reach(robot, places, threads=threads) for threads in (1, 2))
    assert np.array_equal(one.n_solutions, two.n_solutions)
    assert np.array_equal(one.limiting_coordinate, two.limiting_coordinate)


def test_base_placement_scores_share_of_reachable_poses():
    robot = chasles.load("ur5e")
    rng = np.random.default_rng(7)
    T_w_0 = np.tile(np.eye(4), (30, 1, 1))
    T_w_0[:, :2, 3] = rng.uniform(-2, 2, (30, 2))
    T_w_ee = T_w_0[11] @ robot.fk(rng.uniform(-2, 2, (15, 6)))
    share = base_placement(robot, T_w_ee, T_w_0)
    assert share[11] == 1
    assert share.min() < 0.5
    expected = [robot.ik(se3.inverse(T) @ T_w_ee).within_limits(windings=False) for T in T_w_0]
    np.testing.assert_allclose(share, [found.valid.any(-1).mean() for found in expected])


def test_uniform_orientations_are_well_spread():
    R = uniform_orientations(50)
    np.testing.assert_allclose(R @ np.moveaxis(R, 1, 2), np.tile(np.eye(3), (50, 1, 1)), atol=1e-15)
    between = R[:, :, 2] @ R[:, :, 2].T - 2 * np.eye(50)
    assert between.max() < np.cos(np.radians(20))


def test_invalid_reach_arguments_are_rejected():
    robot = chasles.load("ur5e")
    with pytest.raises(ShapeError, match=r"targets: expected a Grid, \(m, 3\) or \(m, 4, 4\)"):
        reach(robot, np.zeros((2, 2)))
    with pytest.raises(InputValueError, match="orientations= requires positions"):
        reach(robot, np.eye(4)[None], uniform_orientations(2))
    with pytest.raises(ShapeError, match=r"T_w_0: expected shape \(m, 4, 4\), got \(4, 4\)"):
        base_placement(robot, np.eye(4)[None], np.eye(4))


def test_reach_plot_shows_share_and_limit_counts():
    pytest.importorskip("matplotlib").use("Agg")
    robot = chasles.load("stanford")
    found = reach(
        robot, Grid.from_bounds(np.full(3, -0.6), np.full(3, 0.6), 8), uniform_orientations(3)
    )
    above, side, limits = found.plot()
    assert (above.get_ylabel(), side.get_ylabel()) == ("y [m]", "z [m]")
    assert [int(bar.get_width()) for bar in limits.patches] == list(found.limit_counts().values())
    drawn = above.images[0].get_array().T
    share = np.where(found.fraction_grid() > 0, found.fraction_grid(), np.nan)
    expected = 100 * np.nanmean(np.where(np.isnan(share).all(2)[..., None], 0, share), axis=2)
    np.testing.assert_allclose(np.ma.filled(drawn, 0), expected)
    with pytest.raises(InputValueError, match="the targets are not a Grid"):
        reach(robot, np.zeros((1, 3)), uniform_orientations(1)).plot()


def test_labels_of_reach_plot_lie_inside_its_figure():
    pytest.importorskip("matplotlib").use("Agg")
    grid = Grid.from_bounds(np.array([-1, -1, -0.5]), np.ones(3), 8)
    axes = reach(chasles.load("irb6640"), grid, uniform_orientations(3)).plot()
    figure = axes[0].figure
    figure.canvas.draw()
    for ax in axes:
        box = ax.get_tightbbox()
        assert figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1


def test_limit_reason_precedes_out_of_reach_for_fixed_joint_values():
    robot, count = chasles.load("panda"), 8
    rng = np.random.default_rng(9)
    places = rng.uniform([-0.9, -0.9, -0.2], [0.9, 0.9, 1.1], (300, 3))
    found = reach(robot, places, uniform_orientations(2), redundancy_samples=count)
    T = np.tile(np.eye(4), (300, 2, 1, 1))
    T[..., :3, :3], T[..., :3, 3] = uniform_orientations(2), places[:, None]
    j = robot.redundancy[0].index
    values = np.linspace(robot.lower[j], robot.upper[j], count)
    some = np.any([robot.ik(T, fixed={"joint7": value}).valid.any(-1) for value in values], axis=0)
    stopped = found.limiting_coordinate
    assert (stopped[some] != OUT_OF_REACH).all()
    assert (stopped[~some] == OUT_OF_REACH).all()
    every = np.all([robot.ik(T, fixed={"joint7": value}).valid.any(-1) for value in values], axis=0)
    assert ((stopped >= 0) & ~every).sum() > 10
