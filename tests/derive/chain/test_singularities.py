"""The determinant of the Jacobian as a product, beside determinants in numbers."""

from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import chasles.derive
from chasles.derive.chain.singular.determinant import Determinant, determinant
from chasles.derive.chain.singular.postures import words
from chasles.derive.terms.casadi_graph import lower

ROBOTS = Path(chasles.derive.__file__).parent / "robots"
SQUARE = ("ur5e", "irb6640", "puma560", "stanford", "scara")
ON_SHELF = ("cr5", "gp7", "irb120", "kr6_r900", "m0609", "mycobot280")
TEN_DIGITS = 1e-10


def loaded(name):
    path = ROBOTS / f"{name}.toml"
    return chasles.derive.load(path if path.exists() else ROBOTS / "shelf" / f"{name}.toml")


def coordinates(robot):
    return sp.symbols(f"q1:{len(robot.moving) + 1}", real=True)


def in_numbers(robot, expression, at):
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    return float(expression.xreplace(values).xreplace(at).evalf())


def product(found: Determinant):
    return sp.Mul(found.constant, *(factor**power for factor, power in found.factors))


def jacobian(robot):
    (kernel,) = lower([chasles.derive.derive(robot, ["jacobian_mixed"]).functions[0]], "arm")
    return lambda q: np.array(kernel(q)).reshape(6, -1)


def volume(J):
    """The absolute determinant of a Jacobian, or of its part that is not 0."""
    return np.sqrt(abs(np.linalg.det(J.T @ J)))


@pytest.mark.parametrize("name", [*SQUARE, *ON_SHELF])
def test_the_product_is_the_determinant(name):
    robot = loaded(name)
    q, J = coordinates(robot), jacobian(robot)
    found = product(determinant(robot, q))
    rng = np.random.default_rng(5)
    for posture in rng.uniform(-3, 3, (20, len(q))):
        at = dict(zip(q, map(sp.Float, posture), strict=True))
        expected = volume(J(posture))
        assert abs(abs(in_numbers(robot, found, at)) - expected) <= TEN_DIGITS * max(1.0, expected)


def test_the_textbook_factors_of_a_ur():
    q = coordinates(robot := loaded("ur5e"))
    a2, a3, d5 = (sp.Symbol(name, real=True) for name in ("a2", "a3", "d5"))
    shoulder = a2 * sp.cos(q[1]) + a3 * sp.cos(q[1] + q[2]) + d5 * sp.sin(q[1] + q[2] + q[3])
    factors = {str(factor) for factor, power in determinant(robot, q).factors if power == 1}
    assert factors == {str(shoulder), str(sp.sin(q[2])), str(sp.sin(q[4]))}


@pytest.mark.parametrize(
    ("name", "meanings"),
    [
        (
            "irb6640",
            {
                "the wrist's centre is on axis 1",
                "the wrist's centre is in the plane of axes 2 and 3; the arm is stretched or"
                " folded",
                "axes 4 and 6 coincide",
            },
        ),
        (
            "ur5e",
            {
                "the point where axes 5 and 6 meet is in the plane of axis 1 and the direction of"
                " axis 2",
                "axes 2, 3 and 4 lie in a plane; the arm is stretched or folded",
                "axes 4 and 6 are parallel",
            },
        ),
    ],
)
def test_words_say_how_the_axes_stand(name, meanings):
    robot = loaded(name)
    q = coordinates(robot)
    assert {words(robot, q, factor) for factor, _ in determinant(robot, q).factors} == meanings


def test_a_factor_at_zero_is_a_singular_posture():
    robot = loaded("irb6640")
    q, J = coordinates(robot), jacobian(robot)
    wrist = next(f for f, _ in determinant(robot, q).factors if f == sp.sin(q[4]))
    assert wrist == sp.sin(q[4])
    posture = np.array([0.3, -0.4, 0.5, 0.6, 0.0, 0.7])
    assert np.linalg.svd(J(posture))[1][-1] <= TEN_DIGITS
    posture[4] = 0.2
    assert np.linalg.svd(J(posture))[1][-1] > 1e-3


@pytest.mark.parametrize("name", ["panda", "lynxmotion", "jaco2", "photo_robot"])
def test_no_determinant_where_it_is_not_square_or_does_not_factor(name):
    robot = loaded(name)
    assert determinant(robot, coordinates(robot)) is None
