"""Raghavan-Roth equations of general six-joint arms, and their coefficient tables."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import sympy as sp

from chasles.derive import Joint, SerialRobot, read
from chasles.derive.description.conventions import dh
from chasles.derive.inverse.general.elimination_choice import choose, without
from chasles.derive.inverse.general.general_inverse import solver_function
from chasles.derive.inverse.general.line_quantities import SIZE, motion, quantities, slide, turn
from chasles.derive.inverse.general.raghavan_roth import (
    doubled,
    elimination_orders,
    equations,
    forward,
    moved,
    numbers,
    placements,
    suppressed,
    turned,
)
from chasles.derive.model.robot import DescriptionError
from tests.support.derivations import ROBOTS, description
from tests.support.generators.random_arms import random_arm

GENERAL = ("jaco2", "crx10")
NONE_IN_COMMON = SerialRobot(
    "skew",
    tuple(
        Joint(f"joint_{k}", "revolute", *dh("revolute", a=a, alpha=alpha, d=d, theta="0"))
        for k, (a, alpha, d) in enumerate(
            [
                ("0.1", "1.2", "0.3"),
                ("0.4", "-0.7", "0.1"),
                ("0.2", "1.9", "-0.2"),
                ("0.3", "0.6", "0.2"),
                ("0.1", "-1.4", "0.3"),
                ("0.2", "0.9", "0.1"),
            ],
            1,
        )
    ),
)


def rotation(axis, angle):
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) / np.linalg.norm(axis)
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def pose(random):
    T = np.eye(4)
    T[:3, :3] = rotation(random.normal(size=3), random.uniform(0, np.pi))
    T[:3, 3] = random.normal(size=3)
    return T


@cache
def of(name):
    return NONE_IN_COMMON if name == "skew" else read(description(name))


@cache
def choice_of(name):
    return choose(of(name))


def at(robot, q):
    return forward(numbers(robot), [j.direction * x for j, x in zip(robot.moving, q, strict=True)])


def products(first, second):
    return np.kron([1, np.cos(first), np.sin(first)], [1, np.cos(second), np.sin(second)])


def test_motion_matrix_maps_line_quantities_linearly():
    random = np.random.default_rng(1)
    for _ in range(50):
        T, p, line = pose(random), random.normal(size=3), pose(random)[:3, 2]
        R, d = T[:3, :3], T[:3, 3]
        assert motion(T) @ quantities(p, line) == pytest.approx(
            quantities(R @ p + d, R @ line), abs=1e-13
        )


def test_motion_matrices_compose_like_poses():
    random = np.random.default_rng(2)
    for _ in range(50):
        T, U = pose(random), pose(random)
        assert motion(T @ U) == pytest.approx(motion(T) @ motion(U), abs=1e-12)
    assert (motion(np.eye(4)) == np.eye(SIZE)).all()


@pytest.mark.parametrize("sign", [1, -1])
def test_rotation_about_z_expands_in_cosine_and_sine(sign):
    fixed, c, s = turn(sign)
    assert fixed + np.cos(0.7) * c + np.sin(0.7) * s == pytest.approx(
        motion(turned(sign * 0.7)), abs=1e-15
    )


@pytest.mark.parametrize("sign", [1, -1])
def test_translation_along_z_expands_in_powers(sign):
    fixed, once, square = slide(sign)
    assert fixed + 0.7 * once + 0.7**2 * square == pytest.approx(
        motion(moved(sign * 0.7, slides=True)), abs=1e-15
    )


def factors(value, slides):
    """Return [1, cosine, sine] of a joint angle, or the powers 0 to 2 of a displacement."""
    return [1, value, value**2] if slides else [1, np.cos(value), np.sin(value)]


@pytest.mark.parametrize(
    "slides", [{0}, {3}, {5}, {1, 2}, {0, 5}], ids=lambda slides: "-".join(map(str, sorted(slides)))
)
def test_equations_hold_with_prismatic_joints(slides):
    robot, random = random_arm(3, slides=slides), np.random.default_rng(4)
    arm, some = numbers(robot), elimination_orders(slides)
    assert len(some) >= 4
    for order in some:
        assert order.turning.isdisjoint(slides)
        q = random.uniform(-1, 1, 6)
        found = equations(arm, order, forward(arm, q, slides), slides)
        local = [factors(order.sense * q[k], k in slides) for k in order.joints]
        right = np.tensordot(local[2], found.right, 1)
        assert found.left @ np.kron(local[0], local[1]) == pytest.approx(
            right @ np.kron(local[3], local[4]), abs=1e-14
        )


def test_prismatic_joints_reduce_the_allowed_splits():
    assert len(elimination_orders()) == 24
    assert len(elimination_orders({2})) == 12
    assert not elimination_orders({0, 2, 4})


@pytest.mark.parametrize("name", ["crx10", "skew"])
@pytest.mark.parametrize(
    "order", elimination_orders(), ids=lambda s: f"{s.joints[2]}{s.sense:+d}{s.halved}"
)
def test_equations_hold_at_random_configurations(name, order):
    robot, random = of(name), np.random.default_rng(3)
    for _ in range(2):
        q = random.uniform(-np.pi, np.pi, 6)
        found = equations(numbers(robot), order, at(robot, q))
        local = [order.sense * robot.moving[k].direction * q[k] for k in order.joints]
        right = np.tensordot([1, np.cos(local[2]), np.sin(local[2])], found.right, 1)
        assert found.left @ products(local[0], local[1]) == pytest.approx(
            right @ products(local[3], local[4]), abs=1e-14
        )


@pytest.mark.parametrize("name", [*GENERAL, "skew"])
def test_suppressed_matrix_is_singular_at_solutions(name):
    robot, random = of(name), np.random.default_rng(5)
    order = choice_of(name).orders[0]
    turns = 2 * np.pi * np.arange(32) / 32
    for _ in range(3):
        q = random.uniform(-np.pi, np.pi, 6)
        M = suppressed(equations(numbers(robot), order, at(robot, q)), order.halved)
        degrees = np.abs(
            np.fft.rfft([np.linalg.det(M[0] + np.cos(t) * M[1] + np.sin(t) * M[2]) for t in turns])
        )
        assert degrees[9:].max() < 1e-10 * degrees.max()
        assert degrees[8] > 1e-10 * degrees.max()
        angle = order.sense * robot.moving[order.joints[2]].direction * q[order.joints[2]]
        sizes = np.linalg.svd(M[0] + np.cos(angle) * M[1] + np.sin(angle) * M[2])[1]
        assert sizes[-1] < 1e-13
        assert sizes[-2] > 1e-9


def test_half_angle_substitution_doubles_the_equations():
    random = np.random.default_rng(6)
    six, v, w = random.normal(size=(6, 9)), 2.1, -0.4
    f = v / 2
    u = np.kron([np.cos(3 * f), np.sin(3 * f), np.cos(f), np.sin(f)], [1, np.cos(w), np.sin(w)])
    left = six @ products(v, w)
    assert doubled(six) @ u == pytest.approx([*np.cos(f) * left, *np.sin(f) * left], abs=1e-14)


@pytest.mark.parametrize("name", [*GENERAL, "skew"])
def test_kept_splits_differ_in_joint_order_and_are_ranked(name):
    ratings = choice_of(name).ratings
    assert 2 <= len(ratings) <= 3
    assert len({rating.order.joints for rating in ratings}) == len(ratings)
    assert ratings[0].good == 1
    assert ratings[0].key == max(rating.key for rating in ratings)


def test_fixed_joint_choice_solves_all_rated_configurations():
    choice = choose(of("panda"))
    assert len(choice.given) == 1
    assert choice.good == 1


def test_concurrent_axes_have_no_split():
    meeting = SerialRobot(
        "meeting",
        tuple(
            Joint(f"joint_{k}", "revolute", *dh("revolute", a="0", alpha=alpha, d="0", theta="0"))
            for k, alpha in enumerate(["1.2", "-0.7", "1.9", "0.6", "-1.4", "0.9"], 1)
        ),
    )
    assert choose(meeting) is None


def test_fixed_joint_is_absorbed_into_a_placement():
    robot, random = read(ROBOTS / "iiwa14.toml"), np.random.default_rng(9)
    constants = numbers(robot)
    for given in range(7):
        q = random.uniform(-np.pi, np.pi, 7)
        six = without(constants, {given: turned(q[given])})
        assert forward(six, np.delete(q, given)) == pytest.approx(forward(constants, q), abs=1e-14)


def test_helical_joint_is_rejected_with_the_robot_name():
    robot = of("jaco2")
    screw = replace(robot.joints[2], kind="helical", pitch=sp.Rational(1, 10))
    with pytest.raises(DescriptionError, match="jaco2: expected revolute or prismatic joints"):
        placements(replace(robot, joints=(*robot.joints[:2], screw, *robot.joints[3:])))


@pytest.mark.parametrize("name", GENERAL)
def test_equal_robots_give_equal_generated_code(name):
    robot = of(name)
    one, other = (solver_function(r, choose(r), numbers(r)) for r in (robot, replace(robot)))
    assert one == other


def test_crx10_pose_matches_urdf_origins_and_axes():
    """Joint origins and axes are from fanuc_crx10ia_support/urdf/crx10ial_macro.xacro."""
    origins = [(0, 0, 0.245), (0, 0, 0), (0, 0, 0.71), (0, 0, 0), (0.54, -0.15, 0), (0.16, 0, 0)]
    axes = [(0, 0, 1), (0, 1, 0), (0, -1, 0), (-1, 0, 0), (0, -1, 0), (-1, 0, 0)]
    robot, random = of("crx10"), np.random.default_rng(8)
    tool = np.eye(4)
    tool[:3, :3] = rotation((0, 1, 0), -np.pi / 2) @ rotation((1, 0, 0), np.pi)
    for _ in range(5):
        q, T = random.uniform(-np.pi, np.pi, 6), np.eye(4)
        for origin, axis, angle in zip(origins, axes, q, strict=True):
            step = np.eye(4)
            step[:3, :3], step[:3, 3] = rotation(axis, angle), origin
            T = T @ step
        assert at(robot, q) == pytest.approx(T @ tool, abs=1e-14)
