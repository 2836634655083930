"""Displayed configurations, ghost robots and limits agree with the robot's functions."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import chasles
from chasles.view.display import Display, Nearness, quaternions
from chasles.view.slider_units import slider_units

WITH_BRANCHES = (
    *("ur5e", "panda", "iiwa14", "jaco2", "irb6640", "puma560", "stanford", "lynxmotion"),
    *("photo_robot", "scara", "bricklaying_planar", "board_installer", "delta", "excavator"),
    *("stewart_gough", "planar_3rrr", "well_manipulator"),
)
SAME_POSE = 1e-7
"""Maximum tool error of a displayed branch, less than a pixel (meter for positions, no unit for
directions)."""


def drawn(display: Display, rng, steps: int = 4):
    units = slider_units(display.robot, display.start.q)
    lower, upper = (np.array([getattr(u, end) for u in units]) for end in ("lower", "upper"))
    found, last = [], display.start
    for _ in range(60):
        q = last.q + 0.1 * (upper - lower) * (rng.random(len(units)) - 0.5)
        last = display.at(np.clip(q, lower, upper), last)
        found += [last] if last.closes else []
    assert len(found) >= steps
    return found[:steps]


def tools(display: Display, ghosts) -> np.ndarray:
    """Return the tool poses (g, 4, 4) of the displayed ghost robots."""
    shown = ghosts.scales > 0
    bodies = np.tile(np.eye(4), (*ghosts.positions[shown].shape[:2], 1, 1))
    wxyz = ghosts.wxyzs[shown]
    rotations = Rotation.from_quat(wxyz[..., [1, 2, 3, 0]].reshape(-1, 4)).as_matrix()
    bodies[..., :3, :3] = rotations.reshape(*wxyz.shape[:2], 3, 3)
    bodies[..., :3, 3] = ghosts.positions[shown]
    return display.skeleton.tip_poses(bodies)


@pytest.mark.parametrize("name", chasles.robots())
def test_displayed_tool_matches_fk(name):
    robot = chasles.load(name)
    display = Display(robot)
    assert np.isfinite(display.start.bodies).all()
    np.testing.assert_allclose(display.start.tool, robot.fk(display.start.q), atol=1e-9)
    for displayed in drawn(display, np.random.default_rng(5)):
        assert displayed.reached
        if robot.loop_solution != "newton":
            np.testing.assert_allclose(displayed.tool, robot.fk(displayed.q), atol=1e-12)
        if robot.loops:
            assert np.abs(robot.constraint(displayed.z)).max() < 1e-9


@pytest.mark.parametrize("name", WITH_BRANCHES)
def test_ghosts_have_same_tool_pose(name):
    display = Display(chasles.load(name))
    shown = 0
    for displayed in drawn(display, np.random.default_rng(7)):
        ghosts = display.ghosts(displayed)
        found = tools(display, ghosts)
        np.testing.assert_allclose(
            found, np.broadcast_to(displayed.tool, found.shape), atol=SAME_POSE
        )
        shown += len(found)
        assert len(ghosts.scales) == display.most_ghosts
    few = name in ("delta", "excavator", "stewart_gough", "well_manipulator")
    assert few or shown > 0


def test_ghosts_show_all_branches_except_current():
    robot = chasles.load("ur5e")
    display = Display(robot)
    displayed = display.at(np.array([0.3, -1.1, 1.2, 0.4, 0.9, -0.5]), display.start)
    assert robot.ik(displayed.tool).count == 8
    ghosts = display.ghosts(displayed)
    assert int(ghosts.scales.sum()) == 7
    elbow = [body.name for body in display.skeleton.bodies].index("link3")
    apart = np.linalg.norm(ghosts.positions[:7, elbow] - displayed.bodies[elbow, :3, 3], axis=1)
    assert apart.max() > 0.1


@pytest.mark.parametrize("name", WITH_BRANCHES)
def test_dragged_tool_stays_on_its_branch(name):
    """A small displacement of the tool moves all coordinates by small values."""
    robot = chasles.load(name)
    display = Display(robot)
    units = slider_units(robot, display.start.q)
    middle = np.array([(unit.lower + unit.upper) / 2 for unit in units])
    followed = 0
    for displayed in drawn(display, np.random.default_rng(11)):
        way = 1e-3 * np.where(displayed.q < middle, 1.0, -1.0)
        way[[item.index for item in robot.redundancy if item.index is not None]] = 0
        there = display.at(displayed.q + way, displayed)
        if not there.closes:
            continue
        found = display.reaching(there.tool, displayed)
        if found.reached:
            np.testing.assert_allclose(found.tool, there.tool, atol=SAME_POSE)
            assert np.abs(found.q - displayed.q).max() < 0.2
            followed += 1
    assert followed > 0


def test_unreachable_drag_target_moves_tool_closer():
    display = Display(chasles.load("ur5e"))
    T = display.start.tool.copy()
    T[:3, 3] = [5.0, 0.0, 0.0]
    found = display.reaching(T, display.start)
    assert not found.reached
    assert np.isfinite(found.bodies).all()
    before = np.linalg.norm(display.start.tool[:3, 3] - T[:3, 3])
    assert np.linalg.norm(found.tool[:3, 3] - T[:3, 3]) < before


def test_joints_near_or_beyond_limits_are_marked():
    robot = chasles.load("irb6640")
    display = Display(robot)
    middle = (robot.lower + robot.upper) / 2
    names = [c.name for c in robot.coordinates]
    near, beyond = middle.copy(), middle.copy()
    near[1] = robot.upper[1] - 0.01 * (robot.upper[1] - robot.lower[1])
    beyond[2] = robot.lower[2] - 0.1
    for q, k, expected in ((near, 1, Nearness.NEAR), (beyond, 2, Nearness.BEYOND)):
        found = display.limits(display.at(q, display.start))
        assert found[names[k]] is expected
        assert all(found[name] is Nearness.FREE for name in names if name != names[k])


def test_open_loop_stops_robot_at_last_closed_configuration():
    display = Display(chasles.load("planar_3rrr"))
    start, goal = display.start.q, np.array([3.1, 0.1, -3.1])
    found = display.at(goal, display.start)
    assert not found.closes
    part = (found.q - start) / (goal - start)
    np.testing.assert_allclose(part, part[0], atol=1e-12)
    assert 0 < part[0] < 1
    assert np.abs(display.robot.constraint(found.z)).max() < 1e-9


def test_open_closed_form_loop_keeps_configuration():
    display = Display(chasles.load("excavator"))
    found = display.at(display.start.q + np.array([0, 9.0, 0, 0]), display.start)
    assert not found.closes
    assert found.q is display.start.q


def test_workspace_points_are_reachable_tool_positions():
    robot = chasles.load("scara")
    display = Display(robot)
    points = display.workspace(slider_units(robot, display.start.q), 500)
    assert points.shape == (500, 3)
    reach = np.hypot(*points[:, :2].T)
    q = np.zeros(robot.n)
    assert reach.max() <= np.hypot(*robot.fk(q)[:2, 3]) + 1e-12
    assert np.ptp(reach) > 0.3


def test_quaternions_match_scipy():
    rng = np.random.default_rng(2)
    turns = [Rotation.random(200, random_state=3).as_matrix()]
    axes = np.vstack([np.eye(3), rng.normal(size=(20, 3))])
    unit = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    turns += [Rotation.from_rotvec(np.pi * unit).as_matrix(), np.eye(3)[None]]
    T = np.tile(np.eye(4), (224, 1, 1))
    T[:, :3, :3] = np.vstack(turns)
    found = quaternions(T)
    again = Rotation.from_quat(found[:, [1, 2, 3, 0]]).as_matrix()
    np.testing.assert_allclose(again, T[:, :3, :3], atol=1e-14)


@pytest.mark.parametrize("name", ["planar_3rrr", "delta", "stewart_gough"])
def test_ghosts_show_all_other_assembly_modes(name):
    robot = chasles.load(name)
    display = Display(robot)
    shown = 0
    for displayed in drawn(display, np.random.default_rng(3)):
        ghosts = display.modes(displayed)
        assert len(ghosts.scales) == display.most_modes > 0
        found = tools(display, ghosts)
        count = robot.functions["modes"](displayed.q)[1]
        assert len(found) == np.isfinite(count).sum() - 1
        apart = np.abs(found - displayed.tool).max((-1, -2))
        assert (apart > 1e-6).all()
        shown += len(found)
    assert shown > 0


def test_robot_without_assembly_modes_reserves_no_mode_ghosts():
    assert Display(chasles.load("ur5e")).most_modes == 0
