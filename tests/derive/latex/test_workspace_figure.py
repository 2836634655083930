"""Workspace outlines have a known area, contain random reachable points, and are reproducible."""

import math
import re
from functools import cache

import numpy as np
import pytest
import sympy as sp

from chasles.derive import Joint, SerialRobot, derive, read
from chasles.derive.chain.body_shapes import skeleton
from chasles.derive.chain.rigid_bodies import RigidBodies
from chasles.derive.latex.drawing.contours import area
from chasles.derive.latex.drawing.reached import ToolPosition, reached
from chasles.derive.latex.drawing.region import reached_by_loops, workspace
from chasles.derive.model.placements import Rotation, Translation
from chasles.derive.terms.casadi_graph import lower
from chasles.derive.terms.terms import Terms
from tests.support.derivations import description
from tests.support.printed_robots import derived

AREA = 0.02
"""Maximum relative error of the workspace area."""
CELL = 0.011
"""Side length of a grid cell, relative to the longer side of the workspace region."""
ALMOST = 0.998
"""Minimum fraction of random tool positions inside the workspace outline, whose corners are
rounded."""
MAX_BYTES = 3000
SMALL_FIGURES = ("ur5e", "iiwa14", "bricklaying_planar", "awkward", "tilted", "random3")
"""Names of upright and horizontal arms, redundant arms, and arms with prismatic joints or unusual
angles."""


@cache
def derivation(name):
    return derive(read(description(name)), functions=["fk"])


def bodies_of(robot):
    reference = {joint.name: 0.0 for joint in robot.coordinates}
    return skeleton(RigidBodies(robot, Terms({}), reference), list(reference))


def arm(lengths, bounds, *, upright):
    """Return an arm with parallel axes.

    If ``upright`` is true, the arm has a vertical axis before the parallel axes.
    """
    x = [Translation((sp.Rational(str(length)), 0, 0)) for length in lengths]
    joints = []
    if upright:
        tilt = (Rotation("x", sp.pi / 2),)
        joints.append(Joint("q1", "revolute", after=tilt))
    for k, (link, bound) in enumerate(zip(x, bounds, strict=True), 2):
        joints.append(Joint(f"q{k}", "revolute", after=(link,), limits=bound))
    return SerialRobot("arm", tuple(joints))


def whole(found):
    return sum(area(loop) for loop in found.loops)


def test_two_link_arms_reach_rings_and_half_rings():
    a, b = 0.6, 0.45
    ring = math.pi * ((a + b) ** 2 - (a - b) ** 2)
    free = [(None, None)] * 2
    for upright in (False, True):
        found = reached(bodies_of(arm((a, b), free, upright=upright)))
        assert found.axes == (("r", "z") if upright else ("x", "y"))
        assert found.moving == ((1, 2) if upright else (0, 1))
        assert abs(whole(found) / (ring / 2 if upright else ring) - 1) < AREA


def test_joint_limits_reduce_the_area_to_a_ring_sector():
    # The elbow angle determines the distance of the arm tip from the shoulder, and the shoulder
    # moves the tip along an arc.
    rng = np.random.default_rng(2)
    for _ in range(3):
        low, bend, turn = (
            round(rng.uniform(*ends), 3) for ends in ((0.3, 0.9), (1.5, 2.5), (0.8, 3))
        )
        bounds = [(sp.Integer(0), sp.Rational(str(turn)))]
        bounds.append((sp.Rational(str(low)), sp.Rational(str(bend))))
        found = reached(bodies_of(arm((0.6, 0.5), bounds, upright=False)))
        sector = 0.6 * 0.5 * (math.cos(low) - math.cos(bend)) * turn
        assert abs(whole(found) / sector - 1) < 2 * AREA


def inside(loops, points):
    """Test which points are inside polygons, by counting the edges to the right of each point."""
    count = np.zeros(len(points), dtype=int)
    x, y = points.T
    for loop in loops:
        for (ax, ay), (bx, by) in zip(loop, loop[1:] + loop[:1], strict=True):
            crosses = (ay > y) != (by > y)
            with np.errstate(divide="ignore", invalid="ignore"):
                count += crosses & (x < ax + (y - ay) / (by - ay) * (bx - ax))
    return count % 2 == 1


@pytest.mark.parametrize("name", ["ur5e", "lynxmotion"])
def test_random_positions_lie_inside_the_outline(name):
    found = derivation(name)
    region = reached(found.skeleton)
    coordinates, rng = found.robot.coordinates, np.random.default_rng(3)
    value = found.terms.value
    bounds = [
        [float(value(v)) for v in j.limits] if j.limits[0] is not None else [-math.pi, math.pi]
        for j in coordinates
    ]
    q = rng.uniform(*np.array(bounds).T, size=(2000, len(bounds)))
    p = poses_at(name, q)[:, :3, 3]
    seen = np.column_stack([np.hypot(p[:, 0], p[:, 1]), p[:, 2]])
    step = CELL * np.ptp(seen, 0).max()
    near = [seen + step * np.array(way) for way in ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))]
    assert np.any([inside(region.loops, some) for some in near], axis=0).mean() > ALMOST
    low, high = np.min(seen, 0), np.max(seen, 0)
    corners = np.array([point for loop in region.loops for point in loop])
    assert (corners.min(0) > low - 0.15 * np.ptp(seen, 0)).all()
    assert (corners.max(0) < high + 0.15 * np.ptp(seen, 0)).all()


@pytest.mark.parametrize("name", SMALL_FIGURES)
def test_workspace_figure_is_small_and_reproducible(name):
    found = derived(name)
    text = workspace(found.robot, found.skeleton)
    assert text == workspace(found.robot, found.skeleton)
    assert len(text) <= MAX_BYTES
    assert not re.search(r"\d[eE][-+]|nan|inf", text)


def test_unlimited_prismatic_joint_has_no_workspace_outline():
    found = derivation("photo_robot")
    assert reached(found.skeleton) is None
    assert workspace(found.robot, found.skeleton) == ""


def of_loops(name):
    found = derivation(name)
    return reached_by_loops(found.robot, found.terms, found.skeleton, found.functions)


def poses_at(name, q):
    (kernel,) = lower([derivation(name).function("fk")], name)
    return np.array(kernel(q.T)).T.reshape(-1, 4, 4)


def bounds_of(name):
    found = derivation(name)
    return np.array(
        [[float(found.terms.value(x)) for x in c.limits] for c in found.robot.coordinates]
    )


@pytest.mark.parametrize("name", ["well_manipulator", "five_bar"])
def test_random_positions_of_mechanisms_lie_inside_the_outline(name):
    region = of_loops(name)
    bounds = bounds_of(name)
    q = np.random.default_rng(4).uniform(*bounds.T, size=(4000, len(bounds)))
    p = poses_at(name, q)[:, :3, 3]
    assert region.upright == (-1 if name == "five_bar" else 0)
    seen = (
        np.column_stack([np.hypot(p[:, 0], p[:, 1]), p[:, 2]]) if region.upright == 0 else p[:, :2]
    )
    step = CELL * np.ptp(seen, 0).max()
    near = [seen + step * np.array(way) for way in ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))]
    assert np.any([inside(region.loops, some) for some in near], axis=0).mean() > ALMOST


def test_five_bar_area_equals_integral_of_determinant():
    low, high = bounds_of("five_bar").T
    cells, step = 100, 1e-5
    grid = np.stack(np.meshgrid(*(np.arange(cells) + 0.5,) * 2), -1).reshape(-1, 2) / cells
    q = low + (high - low) * grid
    columns = [
        (poses_at("five_bar", q + step * e) - poses_at("five_bar", q - step * e))[:, :2, 3]
        for e in np.eye(2)
    ]
    (a, b), (c, d) = (column.T for column in columns)
    determinant = (a * d - b * c) / (2 * step) ** 2
    assert (determinant > 0).all() or (determinant < 0).all()
    exact = abs(determinant).mean() * np.prod(high - low)
    assert abs(whole(of_loops("five_bar")) / exact - 1) < AREA


def test_configurations_without_position_are_excluded():
    def at(q):
        angle = np.cumsum(q, axis=1)
        x, y = (0.6 * f(angle[:, 0]) + 0.4 * f(angle[:, 1]) for f in (np.cos, np.sin))
        y = np.where(y < 0, np.nan, y)
        return np.column_stack([x, y, np.zeros(len(q))])

    turn = np.array([math.pi, math.pi])
    found = ToolPosition(at, -turn, turn, 1.0, None).region()
    assert abs(whole(found) / (math.pi * (1 - 0.2**2) / 2) - 1) < AREA


def test_mechanisms_without_planar_region_have_no_outline():
    assert of_loops("four_bar") is None
    assert of_loops("planar_3rrr") is None
    assert of_loops("delta") is None
