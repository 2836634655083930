"""Results of the board installer paper also hold for other configurations and lengths."""

import board_installer as paper
import board_pictures
import numpy as np
import pytest

import chasles
from tests.support.compiling import deriving_only


def test_every_pose_of_the_required_box_is_reached_within_limits():
    T, robot = paper.box_poses(), paper.robot()
    assert np.ptp(T[:, :3, 3], axis=0) == pytest.approx([0.35, 1.43, 0.62], abs=1e-15)
    solutions = robot.ik(T).within_limits()
    q = np.array([solutions.at(k).valid_q()[0] for k in range(len(T))])
    assert ((q >= robot.lower) & (q <= robot.upper)).all()
    np.testing.assert_allclose(robot.fk(q), T, atol=1e-10)


def test_a_farther_box_is_not_reached():
    T = paper.box_poses()
    T[:, 0, 3] += 0.3
    assert (paper.robot().ik(T).within_limits().count == 0).any()


def test_equation_27_equals_the_tool_position():
    q = np.random.default_rng(3).uniform(paper.robot().lower, paper.robot().upper, (500, 6))
    np.testing.assert_allclose(paper.equation_27(q), paper.robot().fk(q)[:, :3, 3], atol=1e-14)


def test_the_arm_only_translates():
    q = np.random.default_rng(4).uniform(paper.robot().lower, paper.robot().upper, (500, 6))
    T = np.tile(np.eye(4), (500, 1, 1))
    T[:, :3, 3] = paper.arm_shift(q)
    np.testing.assert_allclose(paper.arm_exponentials(q), T, atol=1e-14)


def test_length_errors_match_first_order_derivatives(length_errors):
    """A length error of 0.1 mm is small, so first-order errors agree to 1 %."""
    with deriving_only():
        built = chasles.load("board_installer", parametric=True)
    p = np.array([number.value for number in built.geometry])
    names = [number.name for number in built.geometry]
    q = paper.grid(built)
    by_p = built.identification_jacobian(q, p)[:, :3]
    for own in length_errors:
        first = np.abs(by_p[:, :, names.index(own.name)]).max(0) * paper.LONGER
        np.testing.assert_allclose(own.largest, first, rtol=0.01)
        assert own.largest.max() <= own.distance <= np.linalg.norm(own.largest) + 1e-15
    assert max(own.distance for own in length_errors) == pytest.approx(0.83e-3, abs=0.005e-3)


def test_drawn_members_keep_their_lengths():
    """The distance between the drawn pins of rods and arms is constant at random configurations."""
    value = paper.parameters()
    a, b, gamma0 = value["a"], value["b"], value["gamma0"]
    push_rod = np.sqrt(a**2 + b**2 - 2 * a * b * np.cos(gamma0))
    lengths = {
        ("K", "H"): value["L2"] / value["k"],
        ("F", "H"): value["L1"] - value["L1"] / value["k"],
        ("O", "H"): value["r"],
        ("G'", "E'"): value["L1"],
        ('E"', 'W"'): value["L2"],
        ("C", "M"): a,
        ("C", "N"): b,
    }
    robot = paper.robot()
    for q in np.random.default_rng(5).uniform(robot.lower, robot.upper, (8, 6)):
        pins = board_pictures.skeleton(q).pins
        for (start, end), length in [*lengths.items(), (("M", "N"), push_rod + q[4])]:
            between = np.linalg.norm(pins[start] - pins[end])
            assert between == pytest.approx(length, abs=1e-13), (start, end)
