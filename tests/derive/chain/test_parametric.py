"""Parametric functions equal the nominal robot at nominal parameters; CasADi checks derivatives."""

from functools import cache

import casadi as ca
import numpy as np
import pytest
from numpy.testing import assert_allclose

from chasles import InputValueError
from chasles.derive import Joint, Mimic, Parameter, SerialRobot, derive, read
from chasles.derive.chain.parametric import PARAMETRIC
from chasles.derive.description.conventions import CONVENTIONS
from chasles.derive.model.placements import rotation, translation
from chasles.derive.terms.casadi_graph import lower
from tests.support.derivations import ROBOTS

RANDOM = np.random.default_rng(5)
SAMPLE = ("scara", "stanford", "bricklaying_planar")
"""Parallel axes, a spherical wrist after a prismatic joint, and a planar arm."""
IN_TOOL_FRAME = ("fk_p", "jacobian_p", "identification_jacobian")
"""Functions in a single frame; deriving all frames takes three times as long."""


def functions_of(robot, parametric=PARAMETRIC):
    derived = derive(robot, functions=["fk", "jacobian_mixed", *parametric])
    names = [function.name for function in derived.functions]
    return derived, dict(zip(names, lower(derived.functions, robot.name), strict=True))


@cache
def shipped(name):
    return functions_of(read(ROBOTS / f"{name}.toml"))


def nominal(derived):
    return np.array([float(derived.terms.value(p.value)) for p in derived.geometry.parameters])


def by_differentiation(fk_p, q, p, by):
    """Returns tool twists (v, omega) in base axes from automatic derivatives of the pose."""
    symbols = ca.SX.sym("q", len(q)), ca.SX.sym("p", len(p))
    pose = fk_p(*symbols)
    derivative = ca.Function("d", list(symbols), [ca.jacobian(pose, symbols[by])])
    T, D = np.array(fk_p(q, p)).reshape(4, 4), np.array(derivative(q, p))
    columns = []
    for column in D.T:
        turned = column.reshape(4, 4)[:3, :3] @ T[:3, :3].T
        v = column.reshape(4, 4)[:3, 3]
        columns.append([*v, turned[2, 1], turned[0, 2], turned[1, 0]])
    return T, np.array(columns).T


def check(robot, parametric=PARAMETRIC):
    check_functions(*functions_of(robot, parametric))


def check_functions(derived, functions):
    """Compares all available functions."""
    n, p = len(derived.robot.coordinates), nominal(derived)
    q = RANDOM.uniform(-2, 2, n)
    assert_allclose(np.array(functions["fk_p"](q, p)), np.array(functions["fk"](q)), atol=3e-15)
    own = np.array(functions["jacobian_mixed"](q))
    assert_allclose(np.array(functions["jacobian_p"](q, p)), own, atol=5e-15)
    p += RANDOM.normal(size=len(p)) * 0.1
    T, J_q = by_differentiation(functions["fk_p"], q, p, 0)
    assert_allclose(np.array(functions["jacobian_p"](q, p)).reshape(6, -1), J_q, atol=1e-12)
    _, J_p = by_differentiation(functions["fk_p"], q, p, 1)
    mixed = np.array(functions["identification_jacobian"](q, p)).reshape(6, -1)
    assert_allclose(mixed, J_p, atol=1e-12)
    if "identification_jacobian_space" not in functions:
        return
    R, origin = T[:3, :3], T[:3, 3]
    space = np.vstack([J_p[:3] - np.cross(J_p[3:].T, origin).T, J_p[3:]])
    found = np.array(functions["identification_jacobian_space"](q, p)).reshape(6, -1)
    assert_allclose(found, space, atol=1e-12)
    body = np.vstack([R.T @ J_p[:3], R.T @ J_p[3:]])
    found = np.array(functions["identification_jacobian_body"](q, p)).reshape(6, -1)
    assert_allclose(found, body, atol=1e-12)


@pytest.mark.parametrize("name", SAMPLE)
def test_parametric_functions_match_nominal_and_casadi_derivatives(name):
    check_functions(*shipped(name))


def drawn(convention, seed):
    """Returns three joints of a convention with random values; the second is prismatic."""
    random = np.random.default_rng(seed)
    joints = []
    for k, kind in enumerate(("revolute", "prismatic", "helical")):
        given = {}
        for field in convention.fields:
            value = [str(round(x, 3)) for x in random.uniform(-1, 1, 3)]
            given[field.name] = value if field.is_vector else value[0]
        before, after = convention(kind, **given)
        values = {f.name: f.value(given) for f in convention.fields}
        joints.append(
            Joint(
                f"j{k}",
                kind,
                before,
                after,
                pitch="0.1" if kind == "helical" else 0,
                direction=(1, -1, 1)[k],
                convention=convention,
                given=convention.scalars(values),
            )
        )
    return SerialRobot("drawn", tuple(joints), tool=translation("0.1", "0.2", "0.3"))


@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda convention: convention.name)
def test_parametric_derivatives_match_casadi_in_every_convention(convention):
    check(drawn(convention, 3), IN_TOOL_FRAME)


def test_parametric_derivatives_match_casadi_with_fixed_and_mimic_joints():
    h = Parameter("h", "0.4")
    joints = (
        Joint("a", "revolute", translation(0, 0, h.symbol)),
        Joint("plate", "fixed", rotation("x", "0.3") + translation("0.1", 0, h.symbol)),
        Joint("b", "revolute", rotation("y", "0.2"), translation(h.symbol, 0, 0)),
        Joint("c", "prismatic", mimic=Mimic("b", "1/2", "0.1")),
    )
    check(SerialRobot("mixed", joints, base=translation(0, "0.2", 0), parameters=(h,)))


@pytest.mark.parametrize("name", SAMPLE)
def test_axis_and_tool_parameters_are_complete_and_minimal(name):
    derived, functions = shipped(name)
    robot = derived.robot
    p = nominal(derived)
    chosen = [k for k, g in enumerate(derived.geometry.parameters) if g.part in ("axis", "tool")]
    everything = [k for k, g in enumerate(derived.geometry.parameters) if g.part != "transmission"]
    q = RANDOM.uniform(-3, 3, (60, len(robot.coordinates)))
    J = np.concatenate(
        [np.array(functions["identification_jacobian"](x, p)).reshape(6, -1) for x in q]
    )
    slides = sum(joint.kind == "prismatic" for joint in robot.moving)
    count = 4 * (len(robot.moving) - slides) + 2 * slides + 6
    assert len(chosen) == count
    rank = np.linalg.matrix_rank(J[:, everything], tol=1e-9)
    assert np.linalg.matrix_rank(J[:, chosen], tol=1e-9) == rank


def test_parametric_functions_are_derived_only_on_request():
    robot = read(ROBOTS / "scara.toml")
    plain = derive(robot)
    assert not {f.name for f in plain.functions} & set(PARAMETRIC)
    assert plain.geometry is None
    assert {f.name for f in derive(robot, parametric=True).functions} >= set(PARAMETRIC)
    with pytest.raises(InputValueError, match="fk_q"):
        derive(robot, functions=["fk_q"])
