"""Derived equations are exactly equal to printed textbook equations."""

import pytest
import sympy as sp

from chasles import InputValueError
from chasles.derive import (
    Joint,
    Parameter,
    SerialRobot,
    derive,
    product_of_exponentials,
)
from chasles.derive.chain.kinematics import FUNCTIONS
from chasles.derive.description.conventions import dh, poe
from tests.laws.lie import adjoint, exp_screw, inverse_se3
from tests.support.derivations import derivation

q1, q2, q3 = sp.symbols("q1:4", real=True)
a1, a2 = sp.symbols("a1 a2", real=True)


def planar_arm():
    zero = sp.Integer(0)
    joints = []
    for k, length in enumerate((a1, a2), 1):
        before, after = dh("revolute", a=length, alpha=zero, d=zero, theta=zero)
        joints.append(Joint(f"j{k}", "revolute", before, after))
    parameters = tuple(Parameter(str(a), sp.Rational(1, 2)) for a in (a1, a2))
    return SerialRobot("planar", tuple(joints), parameters=parameters)


def matrix(derived, name):
    function = derived.function(name)
    (entries,) = function.expanded()
    return sp.Matrix(*function.outputs[0].shape, entries)


def vanishes(expression):
    """Test whether a polynomial in cosines c and sines s vanishes due to c^2 + s^2 = 1."""
    rest = sp.expand(sp.expand(expression), trig=True)
    for q in (q1, q2, q3):
        c, s = sp.symbols("c s")
        rest = rest.xreplace({sp.cos(q): c, sp.sin(q): s})
        rest = sp.expand(sp.rem(rest, c**2 + s**2 - 1, c).xreplace({c: sp.cos(q), s: sp.sin(q)}))
    return rest == 0


def test_planar_arm_fk_and_jacobians_match_spong():
    """The expected equations are from the planar arm in Spong, Hutchinson and Vidyasagar."""
    derived = derive(planar_arm())
    c1, s1, c12, s12 = sp.cos(q1), sp.sin(q1), sp.cos(q1 + q2), sp.sin(q1 + q2)
    T = sp.Matrix(
        [
            [c12, -s12, 0, a1 * c1 + a2 * c12],
            [s12, c12, 0, a1 * s1 + a2 * s12],
            [0, 0, 1, 0],
            [0, 0, 0, 1],
        ]
    )
    J = sp.Matrix(
        [
            [-a1 * s1 - a2 * s12, -a2 * s12],
            [a1 * c1 + a2 * c12, a2 * c12],
            [0, 0],
            [0, 0],
            [0, 0],
            [1, 1],
        ]
    )
    J_space = sp.Matrix([[0, a1 * s1], [0, -a1 * c1], [0, 0], [0, 0], [0, 0], [1, 1]])
    assert (matrix(derived, "fk") - T).expand() == sp.zeros(4, 4)
    assert (matrix(derived, "jacobian_mixed") - J).expand() == sp.zeros(6, 2)
    assert (matrix(derived, "jacobian_space") - J_space).expand() == sp.zeros(6, 2)


def test_planar_arm_derivatives_match_symbolic_differentiation():
    derived = derive(planar_arm())
    qd, qdd = sp.symbols("qd1:3", real=True), sp.symbols("qdd1:3", real=True)
    J = matrix(derived, "jacobian_mixed")
    J_dot = sum((J.diff(q) * rate for q, rate in zip((q1, q2), qd, strict=True)), sp.zeros(6, 2))
    assert (matrix(derived, "jacobian_mixed_dot") - J_dot).expand() == sp.zeros(6, 2)
    V = J * sp.Matrix(qd)
    (twist,) = derived.function("twist_mixed").expanded()
    assert (sp.Matrix(twist) - V).expand() == sp.zeros(6, 1)
    A = J * sp.Matrix(qdd) + J_dot * sp.Matrix(qd)
    (acceleration,) = derived.function("acceleration_mixed").expanded()
    assert (sp.Matrix(acceleration) - A).expand() == sp.zeros(6, 1)
    (hessian,) = derived.function("hessian_mixed").expanded()
    expected = [J[i, j].diff(q) for i in range(6) for j in range(2) for q in (q1, q2)]
    assert [sp.expand(h - e) for h, e in zip(hessian, expected, strict=True)] == [0] * 24


def test_a_screw_arm_is_the_product_of_its_exponentials():
    """The pose is T = exp(S1 q1) exp(S2 q2) exp(S3 q3) M, as in equation (4.14) of Lynch and Park.

    Column k of the spatial Jacobian is the screw of joint k, transformed by the adjoint of the
    preceding exponentials.
    """
    zero, one, h = sp.Integer(0), sp.Integer(1), sp.Rational(1, 7)
    joints = (
        Joint("turn", "revolute", *poe("revolute", axis=(zero, zero, one), point=(a1, zero, zero))),
        Joint(
            "screw",
            "helical",
            *poe("helical", axis=(one, zero, zero), point=(zero, a2, one)),
            pitch=h,
        ),
        Joint(
            "slide", "prismatic", *poe("prismatic", axis=(zero, one, zero), point=(one, one, one))
        ),
    )
    parameters = tuple(Parameter(str(a), sp.Rational(1, 2)) for a in (a1, a2))
    derived = derive(SerialRobot("screws", joints, parameters=parameters))
    S, M = product_of_exponentials(derived.robot)
    assert sp.Matrix(M) == sp.eye(4)
    assert S[:, 0] == sp.ImmutableMatrix([0, -a1, 0, 0, 0, 1])
    assert S[:, 1] == sp.ImmutableMatrix([h, 1, -a2, 1, 0, 0])
    assert S[:, 2] == sp.ImmutableMatrix([0, 1, 0, 0, 0, 0])
    exponentials = [exp_screw(S[:, k], q) for k, q in enumerate((q1, q2, q3))]
    T = exponentials[0] * exponentials[1] * exponentials[2]
    assert (matrix(derived, "fk") - T).applyfunc(sp.expand) == sp.zeros(4, 4)
    J_space = matrix(derived, "jacobian_space")
    carried = sp.eye(4)
    for k in range(3):
        column = adjoint(sp.ImmutableMatrix(carried)) * S[:, k]
        assert all(map(vanishes, J_space[:, k] - column))
        carried = carried * exponentials[k]
    J_body = adjoint(inverse_se3(sp.ImmutableMatrix(T))) * J_space
    assert all(map(vanishes, matrix(derived, "jacobian_body") - J_body))


def test_ur5e_position_matches_hawkins_closed_form():
    """The expected formula is from Hawkins, Analytic inverse kinematics for the UR, 2013."""
    derived = derivation("ur5e")
    d1, la2, la3, d4, d5, d6 = (p.symbol for p in derived.robot.parameters)
    q = sp.symbols("q1:7", real=True)
    q234 = q[1] + q[2] + q[3]
    c1, s1, c5, s5 = sp.cos(q[0]), sp.sin(q[0]), sp.cos(q[4]), sp.sin(q[4])
    reach = la2 * sp.cos(q[1]) + la3 * sp.cos(q[1] + q[2]) + d5 * sp.sin(q234)
    reach -= d6 * sp.cos(q234) * s5
    height = la2 * sp.sin(q[1]) + la3 * sp.sin(q[1] + q[2]) - d5 * sp.cos(q234)
    height -= d6 * sp.sin(q234) * s5
    side = d4 + d6 * c5
    T = matrix(derived, "fk")
    expected = sp.Matrix([c1 * reach + s1 * side, s1 * reach - c1 * side, d1 + height])
    assert (T[:3, 3] - expected).applyfunc(sp.expand) == sp.zeros(3, 1)


@pytest.mark.parametrize("name", ["ur5e", "stanford", "jaco2"])
def test_shipped_robots_derive_all_functions_in_order(name):
    names = tuple(function.name for function in derivation(name).functions)
    assert names[: len(FUNCTIONS)] == FUNCTIONS
    assert all(n.startswith("ik") or n == "swivel" for n in names[len(FUNCTIONS) :])


def test_an_unknown_function_is_an_error():
    with pytest.raises(
        InputValueError, match="planar has no function fkk; nearest functions: fk, "
    ):
        derive(planar_arm(), functions=("fkk",))
    with pytest.raises(KeyError, match="planar has no function 'fkk'"):
        derive(planar_arm(), functions=("fk",)).function("fkk")
