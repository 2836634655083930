"""Derives parametric functions of serial robots, and checks them by automatic differentiation."""

from functools import cache

import casadi as ca
import numpy as np
from numpy.testing import assert_allclose

from chasles.derive import Joint, SerialRobot, derive
from chasles.derive.chain.parametric import PARAMETRIC
from chasles.derive.description.conventions import CONVENTIONS
from chasles.derive.model.placements import translation
from chasles.derive.terms.casadi_graph import lower

IN_TOOL_FRAME = ("fk_p", "jacobian_p", "identification_jacobian")
"""Parametric functions that use the tool frame. A derivation for all frames takes three times as
long as for the tool frame."""
IN_CONVENTION = {convention.name: convention for convention in CONVENTIONS}


def functions_of(robot, parametric=PARAMETRIC):
    derived = derive(robot, functions=["fk", "jacobian_mixed", *parametric])
    names = [function.name for function in derived.functions]
    return derived, dict(zip(names, lower(derived.functions, robot.name), strict=True))


@cache
def of_convention(name):
    """Derive the parametric functions of a random chain in a kinematic convention."""
    return functions_of(drawn(IN_CONVENTION[name], 3), IN_TOOL_FRAME)


def nominal(derived):
    return np.array([float(derived.terms.value(p.value)) for p in derived.geometry.parameters])


def by_differentiation(fk_p, q, p, by):
    """Return (pose, tool twists) from automatic derivatives.

    The tool twists (v, omega) are in base axes, one for each differentiated variable.
    """
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


def check(derived, functions):
    """Compare the parametric functions with the functions of the nominal robot, and with automatic
    differentiation."""
    random = np.random.default_rng(5)
    n, p = len(derived.robot.coordinates), nominal(derived)
    q = random.uniform(-2, 2, n)
    assert_allclose(np.array(functions["fk_p"](q, p)), np.array(functions["fk"](q)), atol=3e-15)
    own = np.array(functions["jacobian_mixed"](q))
    assert_allclose(np.array(functions["jacobian_p"](q, p)), own, atol=5e-15)
    p += random.normal(size=len(p)) * 0.1
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


def drawn(convention, seed):
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
