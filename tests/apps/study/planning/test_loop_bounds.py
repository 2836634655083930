"""Compares motion bounds of loop joints with sampled motion."""

import warnings
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest

import chasles
from chasles.derive import read, write
from chasles.errors import InputValueError
from chasles.study.planning import configuration_space, sphere
from chasles.study.planning.hulls import hulls_of
from chasles.study.planning.loop_bounds import closed_configurations, loop_bounds
from tests.support.compiling import compiled_quickly
from tests.support.robot_stand_in import RobotStandIn

ROBOTS = (
    "excavator",
    "well_manipulator",
    "board_installer",
    "bricklaying_gantry",
    "five_bar",
    "four_bar",
    "slider_crank",
    "planar_3rrr",
    "stewart_gough",
    "delta",
)
KINDS = ("excavator", "slider_crank", "planar_3rrr", "stewart_gough", "delta")
"""The robots have cylinders, a slider, a planar platform, legs with six degrees of freedom, and
parallelograms."""
PLACES = 17
GEARED = Path(__file__).parents[3] / "derive" / "loops" / "geared_five_bar.toml"


@cache
def made(name):
    robot = chasles.load(name)
    lower = np.where(np.isfinite(robot.lower), robot.lower, -np.pi)
    upper = np.where(np.isfinite(robot.upper), robot.upper, np.pi)
    return robot, loop_bounds(robot, lower, upper), lower, upper


def around(values, turns):
    """Return the largest distance of each coordinate from its value at the middle sample.

    Full turns are ignored.
    """
    away = values - values[PLACES // 2]
    return np.abs(np.where(turns, (away + np.pi) % (2 * np.pi) - np.pi, away)).max(0)


@pytest.mark.parametrize("name", KINDS)
def test_loop_motion_stays_within_bounds(name):
    robot, bounds, lower, upper = made(name)
    hulls = hulls_of(robot)
    rng, certain, tight = np.random.default_rng(1), 0, []
    q, _ = closed_configurations(robot, lower, upper)
    for k in range(45):
        a = q[rng.integers(len(q))]
        size = (0.0005, 0.002, 0.01)[k % 3] * (upper - lower)
        b = np.clip(a + rng.normal(size=robot.n) * size, lower, upper)
        q = a + np.linspace(0, 1, PLACES)[:, None] * (b - a)
        z = robot.configuration(q)
        joints = bounds.joints(a, b)
        if joints is None:
            continue
        assert np.isfinite(z).all()
        moved = around(z, bounds.turns)
        assert (moved <= joints + 1e-9).all()
        points = [np.concatenate(hulls.corners(place)) for place in z]
        far = np.linalg.norm(points - points[PLACES // 2], axis=-1).max(0)
        most = hulls.moves(z[PLACES // 2], joints)[0]
        ends = np.cumsum([len(hull.corners) for hull in hulls.hulls])[:-1]
        far = np.array([own.max() for own in np.split(far, ends)])
        assert (far <= most + 1e-9).all()
        tight.append(most.max() / max(far.max(), 1e-9))
        certain += 1
    assert certain >= 25
    assert np.median(tight) < 6


def test_bounds_of_geared_linkage_contain_its_motion(tmp_path):
    functions = ("chain_D_q", "configuration", "constraint", "constraint_D_z")
    write(read(GEARED), tmp_path, functions=functions, languages=("c",))
    with compiled_quickly():
        robot = chasles.load(tmp_path)
        bounds = loop_bounds(robot, robot.q_reference - 0.5, robot.q_reference + 0.5)
        rng, certain = np.random.default_rng(1), 0
        for a in robot.q_reference + rng.uniform(-0.4, 0.4, (20, 1)):
            b = a + rng.uniform(-0.02, 0.02, 1)
            joints = bounds.joints(a, b)
            if joints is None:
                continue
            z = robot.configuration(a + np.linspace(0, 1, PLACES)[:, None] * (b - a))
            assert (around(z, bounds.turns) <= joints + 1e-9).all()
            certain += 1
    assert certain >= 15
    # The last closure equation belongs to the gear pair. A gear equation is linear, without
    # curvature.
    assert not bounds.curvature[-1].any()


@pytest.mark.parametrize("name", ROBOTS)
def test_curvature_bounds_exceed_second_derivatives(name):
    robot, bounds, _, _ = made(name)
    rng, n = np.random.default_rng(2), len(bounds.turns)
    z = rng.uniform(-1, 1, (300, n)) * np.where(bounds.turns, np.pi, bounds.widest)
    most = np.zeros_like(bounds.curvature)
    c, D = robot.constraint(z), robot.constraint_D_z(z)
    length = bounds.lengths[:, 0] + z @ bounds.lengths[:, 1:].T
    rows = bounds.lengths.any(1)
    for k, along in enumerate(np.eye(n)):
        second = robot.constraint_D_z_dot(z, np.broadcast_to(along, z.shape))
        # `squared` is the second derivative of d^2 - l^2 = c^2 + 2 l c, where d = l + c.
        l_k = bounds.lengths[:, 1 + k]
        squared = 2 * (
            D[..., k, None] * D
            + (c + length)[..., None] * second
            + l_k[:, None] * D
            + bounds.lengths[:, 1:] * D[..., k, None]
        )
        most[:, :, k] = np.abs(np.where(rows[:, None], squared, second)).max(0)
    assert (most <= bounds.curvature * (1 + 1e-9) + 1e-9).all()
    there = bounds.curvature > 1e-9
    assert (most[there] > 0.15 * bounds.curvature[there]).all()


def test_no_bound_exists_for_segment_with_open_loops():
    """The cylinder lengths exceed their limits, so some loops cannot close."""
    robot, bounds, lower, upper = made("excavator")
    rng, dead, span = np.random.default_rng(3), 0, upper - lower
    for _ in range(800):
        a = rng.uniform(lower - span, upper + span)
        b = a + rng.normal(size=robot.n) * 0.03 * span
        z = robot.configuration(a + np.linspace(0, 1, 60)[:, None] * (b - a))
        closed = np.isfinite(z).all(-1)
        if closed.all() or not closed.any():
            continue
        assert bounds.joints(a, b) is None
        dead += 1
    assert dead > 5


class Changed(RobotStandIn):
    """A robot with some functions replaced."""

    def __init__(self, robot, **changed):
        self.real = robot
        vars(self).update({name: partial(made, robot) for name, made in changed.items()})

    def __getattr__(self, name):
        return getattr(self.real, name)


def on_another_branch(robot, q):
    """Return joint values of a wrong branch at the end of the segment."""
    z = robot.configuration(q)
    z[-1, 1] += 0.5
    return z


def of_third_degree(robot, z):
    """Replace the first equation by an equation of an unsupported type."""
    found = robot.constraint(z)
    found[..., 0] = np.sin(z[..., 0]) ** 3
    return found


def test_no_bound_exists_beyond_stroke_or_on_other_branch():
    robot, bounds, _, _ = made("excavator")
    q = np.array(robot.reference.q)
    way = (q, q + 1e-3)
    assert bounds.joints(*way) is not None
    assert replace(bounds, widest=0.2 * bounds.widest).joints(*way) is None
    assert (
        replace(bounds, robot=Changed(robot, configuration=on_another_branch)).joints(*way) is None
    )


def test_loops_without_computable_bounds_are_rejected():
    robot, _, lower, upper = made("excavator")
    with pytest.raises(
        InputValueError, match=r"a polynomial of degree 2 in the joints, got loop equation 0"
    ):
        loop_bounds(Changed(robot, constraint=of_third_degree), lower, upper)
    with pytest.raises(
        InputValueError,
        match=r"the loops close at too few random configurations to bound their motion: 1 of 6000",
    ):
        loop_bounds(robot, lower + 100, upper + 100)


def test_no_bound_exists_at_singular_configuration():
    """If no loop equation contains a joint, the motion of the joint has no bounds."""
    robot, bounds, _, _ = made("excavator")

    def without_a_joint(robot, z):
        D = robot.constraint_D_z(z).copy()
        D[:, np.setdiff1d(np.arange(len(z)), bounds.given)[0]] = 0
        return D

    q = np.array(robot.reference.q)
    changed = Changed(robot, constraint_D_z=without_a_joint)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert replace(bounds, robot=changed).joints(q, q + 1e-3) is None


def test_bounded_boxes_contain_no_singular_configuration():
    checked = 0
    for name in ("planar_3rrr", "stewart_gough", "delta", "excavator"):
        robot, bounds, lower, upper = made(name)
        q, z = closed_configurations(robot, lower, upper)
        rest = np.setdiff1d(np.arange(z.shape[1]), bounds.given)
        rng = np.random.default_rng(7)
        for k in range(30):
            a = q[k]
            # The longest segment with a bound is used.
            for size in (0.1, 0.03, 0.01, 0.003):
                b = a + rng.normal(size=robot.n) * size * (upper - lower) / 3
                w = bounds.joints(a, b)
                if w is not None:
                    break
            else:
                continue
            middle = robot.configuration((a + b) / 2)
            corners = middle + rng.choice([-1, 1], (200, len(w))) * w
            dets = np.linalg.det(robot.constraint_D_z(corners)[..., rest])
            assert (np.sign(dets) == np.sign(dets[0])).all()
            checked += 1
    assert checked > 100


def in_other_mode(robot, z):
    """Return the joints in another assembly mode."""
    actuated = [item.index for item in robot.manifest.loops.actuated_in_z]
    poses = robot.functions["modes"](z[actuated])[0]
    poses = poses[np.isfinite(poses).all(1)]
    pose = poses[np.linalg.norm(poses - z[:3], axis=1).argmax()]
    for start in np.random.default_rng(5).uniform(-np.pi, np.pi, (50, len(z))):
        other = np.where(np.arange(len(z)) < len(pose), np.r_[pose, start[3:]], start)
        other[actuated] = z[actuated]
        passive = np.setdiff1d(np.arange(3, len(z)), actuated)
        for _ in range(30):
            D = robot.constraint_D_z(other)[:, passive]
            other[passive] -= np.linalg.lstsq(D, robot.constraint(other), rcond=None)[0]
        if np.abs(robot.constraint(other)).max() < 1e-12:
            return other
    raise AssertionError("found no joint values of a different assembly mode")


def test_no_free_segment_connects_different_assembly_modes():
    pytest.importorskip("coal", reason="coal comes with pin")
    robot = chasles.load("planar_3rrr")
    here = robot.configuration(np.array(robot.reference.q))
    there = in_other_mode(robot, here)
    assert np.abs(there[2] - here[2]) > 1

    def switching(robot, q):
        z = robot.configuration(q)
        beyond = q[..., 0] > robot.reference.q[0]
        z[beyond] = robot.configuration_near(q[beyond], np.broadcast_to(there, z[beyond].shape))
        return z

    plain = configuration_space(robot, [sphere([0, 0, 1], 0.1)], radius=0.002)
    changed = Changed(robot, configuration=switching)
    space = configuration_space(changed, [sphere([0, 0, 1], 0.1)], radius=0.002)
    rng, q = np.random.default_rng(6), np.array(robot.reference.q)
    for _ in range(20):
        a, b = q + rng.normal(size=(2, 3)) * 0.02
        across = (a[0] > q[0]) != (b[0] > q[0])
        assert plain.is_free_segment(a, b)
        assert space.is_free(np.array([a, b])).all()
        assert space.is_free_segment(a, b) is not across
