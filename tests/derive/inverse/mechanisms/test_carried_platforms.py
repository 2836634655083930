"""Inverse kinematics of robots with joints before or after a platform, tested with NumPy."""

import numpy as np
import pytest

from chasles.derive import derive, explain
from chasles.derive.terms.branches import patterns
from chasles.derive.terms.casadi_graph import lower
from tests.support.generators.carried_platforms import drawn_platform
from tests.support.loops.closures import Model

POSES = 20
REACH = {"revolute": 0.3, "prismatic": 0.05}
"""Maximum deviation of an actuated coordinate from its reference value (radian or meter)."""
CLOSED, SAME = 1e-12, 1e-9
GIVEN = {0: [], 1: [], 2: [], 3: ["before"], 7: [], 8: ["axis_0"], 13: ["before"]}
"""For each random seed, the redundant joints of the robot, whose values are inputs of the inverse
kinematics function."""


def configurations(mechanism, seed):
    model, rng = Model(mechanism), np.random.default_rng(seed)
    at = dict(mechanism.reference)
    z = np.repeat([[float(at.get(name, 0)) for name in model.names]], POSES, 0)
    reach = [REACH[c.kind] for c in mechanism.coordinates]
    z[:, model.actuated] += rng.uniform(-1, 1, (POSES, len(reach))) * reach
    z = model.newton(z, model.actuated)
    return model, z[model.gap(z) < CLOSED]


def slots_at(ik, T, given):
    """Return coordinates (k, N, n) and residuals (k, N) of all k solution slots at N poses."""
    (kernel,) = lower([ik], "carried")
    q, residual = [], []
    for signs in patterns(ik):
        choice = [np.repeat(np.array(signs)[:, None], len(T), 1)] if signs else []
        found = kernel(
            T.reshape(-1, 16).T, *(given[:, [k]].T for k in range(given.shape[1])), *choice
        )
        q.append(np.array(found[0]).T)
        residual.append(np.array(found[1])[0])
    return np.array(q), np.array(residual)


@pytest.mark.parametrize("seed", GIVEN)
def test_pose_and_redundant_joints_determine_the_generating_coordinates(seed):
    mechanism = drawn_platform(seed)
    functions = derive(mechanism, functions=["ik"])
    (ik,) = (f for f in functions.functions if f.name in ("ik", "ik_legs"))
    names = [argument.name for argument in ik.inputs[1:]]
    assert names == GIVEN[seed]
    model, z = configurations(mechanism, seed)
    assert len(z) > POSES / 2
    q = z[:, model.actuated] / model.ratio
    given = z[:, model.places_of(names)]
    slots, residual = slots_at(ik, model.tip(z), given)
    own = np.abs(slots - q).max(-1) < SAME
    assert (own & (residual < SAME)).any(0).all()
    for slot, left in zip(slots, residual, strict=True):
        at = z.copy()
        at[:, model.actuated] = slot * model.ratio
        assert model.gap(at)[left < SAME].max(initial=0.0) < SAME


def test_tilted_tool_of_a_delta_with_a_vertical_axis_is_out_of_reach():
    mechanism = drawn_platform(0)
    ik = derive(mechanism, functions=["ik"]).function("ik")
    model, z = configurations(mechanism, 0)
    T = model.tip(z)
    c, s = np.cos(0.01), np.sin(0.01)
    T[:, :3, :3] = T[:, :3, :3] @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    _, residual = slots_at(ik, T, np.zeros((len(T), 0)))
    assert not (residual < 0.005).any()


def test_explanation_names_the_steps_of_the_moving_joints():
    message = str(explain(drawn_platform(1)))
    assert "axis_0, by subproblem" in message
    assert "No closed-form inverse" not in message
