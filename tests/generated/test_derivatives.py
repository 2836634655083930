"""Closed-form derivatives agree with CasADi's automatic differentiation."""

import casadi as ca
import numpy as np
import pytest

from chasles.derive import casadi_function
from tests.support.derivations import FULL, GENERATED, NAMES, shaped
from tests.support.tolerances import DERIVATIVES

POSES = 5
ROBOTS = [name for name in FULL if name in NAMES]
"""Serial robots of every kind, with revolute and prismatic joints."""


def mixed_jacobian(name):
    """Return q, the tool pose, and the mixed Jacobian (the derivative of fk) in CasADi symbols."""
    fk = casadi_function(GENERATED / name, "fk")
    q = ca.SX.sym("q", fk.numel_in(0))
    T = fk(q)
    columns = []
    for k in range(q.numel()):
        T_D_qk = ca.reshape(ca.jacobian(ca.vec(T), q[k]), 4, 4)
        omega = ca.inv_skew(T_D_qk[:3, :3] @ T[:3, :3].T)
        columns.append(ca.vertcat(T_D_qk[:3, 3], omega))
    return q, T, ca.horzcat(*columns)


def change_of_frame(representation, T):
    """Return the matrix that converts a mixed Jacobian to another representation."""
    R, p, none = T[:3, :3], T[:3, 3], ca.SX(3, 3)
    if representation == "space":
        return ca.blockcat([[ca.SX.eye(3), ca.skew(p)], [none, ca.SX.eye(3)]])
    if representation == "body":
        return ca.blockcat([[R.T, none], [none, R.T]])
    return ca.SX.eye(6)


@pytest.mark.parametrize("representation", ["space", "body", "mixed"])
@pytest.mark.parametrize("name", ROBOTS)
def test_jacobian_and_rate_match_automatic_differentiation(name, representation):
    q, T, J_mixed = mixed_jacobian(name)
    J = change_of_frame(representation, T) @ J_mixed
    qd = ca.SX.sym("qd", q.numel())
    J_dot = ca.reshape(ca.jtimes(ca.vec(J), q, qd), 6, q.numel())
    oracle = ca.Function("oracle", [q, qd], [J, J_dot])
    rng = np.random.default_rng(11)
    for _ in range(POSES):
        x, xd = rng.uniform(-np.pi, np.pi, q.numel()), rng.uniform(-1, 1, q.numel())
        expected, rate = (np.array(value) for value in oracle(x, xd))
        found = shaped(name, f"jacobian_{representation}", x)
        found_rate = shaped(name, f"jacobian_{representation}_dot", x, xd)
        assert np.abs(found - expected).max() <= DERIVATIVES
        assert np.abs(found_rate - rate).max() <= DERIVATIVES


@pytest.mark.parametrize("name", ROBOTS)
def test_hessian_matches_automatic_differentiation(name):
    q, _, J = mixed_jacobian(name)
    n = q.numel()
    oracle = ca.Function("oracle", [q], [ca.jacobian(ca.vec(J), q)])
    rng = np.random.default_rng(13)
    for _ in range(POSES):
        x = rng.uniform(-np.pi, np.pi, n)
        # CasADi's ``vec`` stacks columns, so row j * 6 + i contains entry (i, j) of the Jacobian.
        expected = np.array(oracle(x)).reshape(n, 6, n).transpose(1, 0, 2)
        assert np.abs(shaped(name, "hessian_mixed", x) - expected).max() <= DERIVATIVES
