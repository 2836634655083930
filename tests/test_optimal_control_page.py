"""The program on the page about optimal control runs if CasADi replaces acados."""

import contextlib
import io
import sys
from types import ModuleType

import casadi as ca
import numpy as np
import pytest

import chasles
from tests.support.pages import examples, run, text

PAGE = "how-to/optimal-control.md"
FIELDS = {
    "model": {
        "name",
        "x",
        "u",
        "f_expl_expr",
        "con_h_expr",
        "con_h_expr_e",
        "cost_expr_ext_cost_e",
    },
    "cost": {"cost_type_e"},
    "constraints": {
        *("idxbx_0", "idxbxe_0", "lbx_0", "ubx_0", "idxbx", "lbx", "ubx", "idxbu", "lbu", "ubu"),
        *("lh", "uh", "lh_e", "uh_e", "idxbx_e", "lbx_e", "ubx_e"),
    },
    "solver_options": {
        *("N_horizon", "tf", "integrator_type", "nlp_solver_type", "hessian_approx"),
        "regularize_method",
    },
}
"""Fields of acados objects that the examples on the optimal-control page may set."""


class Fields:
    """An object with arbitrary nested fields, as in acados."""

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        setattr(self, name, Fields())
        return getattr(self, name)


class Solver:
    """Solves a problem as acados does, by multiple shooting with Runge-Kutta steps."""

    def __init__(self, ocp):
        assert vars(ocp).keys() == FIELDS.keys()
        for part, names in FIELDS.items():
            assert vars(getattr(ocp, part)).keys() == names, part
        self.N, limits = ocp.solver_options.N_horizon, ocp.constraints
        problem, model = ca.Opti(), ocp.model
        x = self.x = problem.variable(model.x.numel(), self.N + 1)
        u = problem.variable(model.u.numel(), self.N)
        step = runge_kutta(model, ocp.solver_options.tf / self.N)
        path = ca.Function("path", [model.x, model.u], [model.con_h_expr])
        end = ca.Function("end", [model.x], [model.con_h_expr_e, model.cost_expr_ext_cost_e])
        problem.subject_to(x[limits.idxbx_0.tolist(), 0] == limits.lbx_0)
        assert np.array_equal(limits.idxbxe_0, limits.idxbx_0)
        for k in range(self.N):
            between(problem, limits.lbu, u[limits.idxbu.tolist(), k], limits.ubu)
            problem.subject_to(x[:, k + 1] == step(x[:, k], u[:, k]))
            if k > 0:  # the first state is fixed
                between(problem, limits.lbx, x[limits.idxbx.tolist(), k], limits.ubx)
                between(problem, limits.lh, path(x[:, k], u[:, k]), limits.uh)
        between(problem, limits.lbx_e, x[limits.idxbx_e.tolist(), self.N], limits.ubx_e)
        last, cost = end(x[:, self.N])
        between(problem, limits.lh_e, last, limits.uh_e)
        problem.minimize(cost)
        quiet = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes"}}
        problem.solver("ipopt", quiet)
        self.problem = problem

    def set(self, stage, field, value):
        assert field == "x"
        self.problem.set_initial(self.x[:, stage], value)

    def solve(self):
        self.states = self.problem.solve().value(self.x).T


def runge_kutta(model, h):
    """Return a step of the classical Runge-Kutta method, the default of acados."""
    f = ca.Function("f", [model.x, model.u], [model.f_expl_expr])
    k1 = f(model.x, model.u)
    k2 = f(model.x + h / 2 * k1, model.u)
    k3 = f(model.x + h / 2 * k2, model.u)
    k4 = f(model.x + h * k3, model.u)
    change = h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return ca.Function("step", [model.x, model.u], [model.x + change])


def between(problem, lower, value, upper):
    """Add the constraint lower <= value <= upper, or value = lower if both bounds are equal."""
    lower, upper = np.asarray(lower), np.asarray(upper)
    if np.array_equal(lower, upper):
        problem.subject_to(value == lower)
    else:
        problem.subject_to(problem.bounded(lower, value, upper))


@pytest.fixture(scope="module")
def page():
    """Return (names that the Python blocks define, printed lines)."""
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        names = run(PAGE)
    return names, printed.getvalue().splitlines()


def test_blocks_print_their_comments(page):
    _, printed = page
    assert len(printed) == 2
    for line in printed:
        assert f"# {line}" in text(PAGE)


def test_motion_is_within_the_limits(page):
    names, _ = page
    robot, dt = chasles.load("excavator"), names["fastest"] / names["N"]
    controls = names["solution"].value(names["controls"]).T
    s = np.linspace(0, dt, 10)[:, None, None]
    qd = names["qd_path"][:-1] + s * controls
    q = names["q_path"][:-1] + s * names["qd_path"][:-1] + s**2 / 2 * controls
    poses = robot.fk(q.reshape(-1, 4))
    assert np.all(np.abs(controls) <= names["acceleration_limits"] + 1e-6)
    assert np.all(np.abs(qd) <= names["rate_limits"] + 1e-6)
    assert np.all(np.abs(qd) @ names["volumes"] <= names["flow_limit"] + 1e-6)
    assert np.all(q >= robot.limits[:, 0] - 1e-6)
    assert np.all(q <= robot.limits[:, 1] + 1e-6)
    assert np.min([poses[:, 2, 3], (poses @ names["heel"])[:, 2]]) > names["clearance"] - 0.01
    np.testing.assert_allclose(poses[-1], robot.fk(names["q_end"]), atol=1e-6)
    np.testing.assert_allclose(q[0, 0], names["q_start"], atol=1e-6)
    assert names["fastest"] < 0.95 * names["straight"]


def test_problem_for_acados_has_the_same_solution(page, monkeypatch):
    (block,) = examples(PAGE, "py")
    acados = ModuleType("acados_template")
    acados.AcadosModel, acados.AcadosOcp, acados.AcadosOcpSolver = Fields, Fields, Solver
    monkeypatch.setitem(sys.modules, "acados_template", acados)
    names = dict(page[0])
    exec(compile(block, PAGE, "exec"), names)
    states = names["solver"].states
    np.testing.assert_allclose(states[:, 8], names["fastest"], rtol=1e-3)
    np.testing.assert_allclose(states[0, :4], names["q_start"], atol=1e-6)
    np.testing.assert_allclose(states[-1, 4:8], 0, atol=1e-6)
    heights = names["robot"].fk(states[:, :4])[:, 2, 3]
    assert heights.min() >= names["clearance"] - 1e-6
