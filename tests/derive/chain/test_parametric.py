"""Parametric kinematics functions at nominal parameter values equal the nominal functions."""

from functools import cache

import numpy as np
import pytest

from chasles import InputValueError
from chasles.derive import Coupling, Joint, Parameter, SerialRobot, derive, read
from chasles.derive.chain.parametric import PARAMETRIC
from chasles.derive.model.placements import rotation, translation
from tests.support.derivations import ROBOTS
from tests.support.parametric import (
    IN_CONVENTION,
    IN_TOOL_FRAME,
    check,
    functions_of,
    nominal,
    of_convention,
)

SAMPLE = ("stanford", "bricklaying_planar")
"""Names of an arm with a spherical wrist after a prismatic joint, and of a planar arm with parallel
axes."""


@cache
def shipped(name):
    return functions_of(read(ROBOTS / f"{name}.toml"))


@pytest.mark.parametrize("name", SAMPLE)
def test_parametric_functions_match_nominal_and_casadi_derivatives(name):
    check(*shipped(name))


@pytest.mark.parametrize("name", IN_CONVENTION)
def test_parametric_derivatives_match_casadi_in_every_convention(name):
    check(*of_convention(name))


def test_parametric_derivatives_match_casadi_with_fixed_and_mimic_joints():
    h = Parameter("h", "0.4")
    joints = (
        Joint("a", "revolute", translation(0, 0, h.symbol)),
        Joint("plate", "fixed", rotation("x", "0.3") + translation("0.1", 0, h.symbol)),
        Joint("b", "revolute", rotation("y", "0.2"), translation(h.symbol, 0, 0)),
        Joint("c", "prismatic"),
    )
    couplings = (Coupling("c", (("b", "1/2"),), "0.1"),)
    base = translation(0, "0.2", 0)
    robot = SerialRobot("mixed", joints, base=base, parameters=(h,), couplings=couplings)
    check(*functions_of(robot, IN_TOOL_FRAME))


@pytest.mark.parametrize("name", SAMPLE)
def test_axis_and_tool_parameters_are_complete_and_minimal(name):
    derived, functions = shipped(name)
    robot = derived.robot
    p = nominal(derived)
    chosen = [k for k, g in enumerate(derived.geometry.parameters) if g.part in ("axis", "tool")]
    everything = [k for k, g in enumerate(derived.geometry.parameters) if g.part != "transmission"]
    q = np.random.default_rng(5).uniform(-3, 3, (60, len(robot.coordinates)))
    J = np.concatenate(
        [np.array(functions["identification_jacobian"](x, p)).reshape(6, -1) for x in q]
    )
    slides = sum(joint.kind == "prismatic" for joint in robot.moving)
    count = 4 * (len(robot.moving) - slides) + 2 * slides + 6
    assert len(chosen) == count
    rank = np.linalg.matrix_rank(J[:, everything], tol=1e-9)
    assert np.linalg.matrix_rank(J[:, chosen], tol=1e-9) == rank


def test_parametric_functions_are_derived_only_on_request():
    robot = read(ROBOTS / "bricklaying_planar.toml")
    plain = derive(robot)
    assert not {f.name for f in plain.functions} & set(PARAMETRIC)
    assert plain.geometry is None
    assert {f.name for f in derive(robot, parametric=True).functions} >= set(PARAMETRIC)
    with pytest.raises(InputValueError, match="fk_q"):
        derive(robot, functions=["fk_q"])
