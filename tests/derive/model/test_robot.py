"""Models built in Python convert inputs to exact values, or reject them."""

from dataclasses import replace
from decimal import Decimal
from fractions import Fraction

import pytest
import sympy as sp

from chasles.derive import Coupling, DescriptionError, Joint, Parameter, SerialRobot, derive
from chasles.derive.description.conventions import dh, poe, urdf


def turning(name="j", **given):
    row = {"a": 0, "alpha": 0, "d": 0, "theta": 0} | given
    return Joint(name, "revolute", *dh("revolute", **row))


def linked(*links):
    return tuple(replace(turning(f"j{k}"), link=link) for k, link in enumerate(links))


A = (Parameter("a", 1), Parameter("a", 2))


def test_exact_number_types_are_accepted():
    for value in (Fraction(1, 4), Decimal("0.25"), "0.25", "1/4", sp.Rational(1, 4)):
        joint = turning(a=value)
        assert joint.after[0].vector == (sp.Rational(1, 4), 0, 0)
        assert Parameter("a", value).value == sp.Rational(1, 4)
    assert turning(alpha="pi/2").after[0].angle == sp.pi / 2
    screw = poe("revolute", axis=(0, 0, 1), point=("0.1", 0, 0))
    assert screw[0][0].vector == (sp.Rational(1, 10), 0, 0)
    joint = Joint("j", "revolute", *screw, limits=("-pi", 3), pitch=0)
    assert joint.limits == (-sp.pi, 3)
    assert Coupling("k", (("j", "1/2"),)).ratios == (("j", sp.Rational(1, 2)),)
    assert len(derive(SerialRobot("r", (joint,)), functions=("fk",)).functions) == 1


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: turning(a=0.25), "got the float 0.25; write a fraction or '0.25'"),
        (lambda: Parameter("a", 0.3), "got the float 0.3"),
        (lambda: turning(a=None), "expected an exact number, got None"),
        (lambda: turning(a="a1"), "a1"),
        (
            lambda: Joint("j", "rotary"),
            "joint 'j': expected one of revolute, prismatic, helical, fixed, got 'rotary'",
        ),
        (lambda: Joint("j", "revolute", direction=2), "expected one of 1, -1, got 2"),
        (lambda: Joint("j", "revolute", limits=(-1.5, 1.5)), "got the float -1.5"),
        (lambda: Joint("my joint", "revolute"), "a name of letters, digits and _"),
        (
            lambda: Parameter("a", 1, "width"),
            "expected one of length, angle, ratio, mass, got 'width'",
        ),
        (lambda: SerialRobot("my robot", (turning(),)), "robot 'my robot': expected a name"),
        (
            lambda: SerialRobot("r", (turning(a=sp.Symbol("a")),)),
            "'r': expected symbols of its parameters (Parameter(name, value).symbol), got a",
        ),
        (lambda: SerialRobot("r", (turning(), turning())), "two joints are called 'j'"),
        (lambda: SerialRobot("r", linked("arm", "arm")), "two links are called 'arm'"),
        (lambda: SerialRobot("r", (turning(),), parameters=A), "two parameters are called 'a'"),
        (
            lambda: SerialRobot("r", (Joint("j", "fixed"),)),
            "expected a joint with its own coordinate",
        ),
        (lambda: urdf("revolute", xyz=(0, 0), rpy=(0, 0, 0), axis=(0, 0, 1)), "three numbers"),
        (lambda: poe("revolute", axis=(0, 0, 0), point=(0, 0, 0)), "zero vector"),
    ],
)
def test_invalid_robot_parts_raise_specific_errors(make, words):
    with pytest.raises(DescriptionError) as caught:
        make()
    assert words in str(caught.value)


def test_coupling_with_unknown_coordinate_is_rejected():
    follower = Joint("k", "revolute", *dh("revolute", a=1, alpha=0, d=0, theta=0))
    with pytest.raises(DescriptionError, match="unknown coordinate 'x'; expected a motor or joint"):
        SerialRobot("r", (turning(), follower), couplings=(Coupling("k", (("x", 1),)),))
