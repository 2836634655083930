"""Platforms on random legs with a ball joint.

The tested leg types are RPS, PRS, RRS, UPS, PUS and RUS.

A leg with two one-axis joints before its ball joint constrains the ball to a plane. A platform on
three such legs has three degrees of freedom.
"""

from dataclasses import replace
from itertools import product

import casadi as ca
import numpy as np
import pytest
import sympy as sp

from chasles.derive import Rotation, derive, explain
from chasles.derive.terms.casadi_graph import lower
from tests.support.loops.closures import Model
from tests.support.loops.legs_of_joints import agile_eye, drawn, driven_by_a_leg
from tests.support.loops.solved import solved

POSES = 12
KINDS = {1: ("RPS", "PRS", "RRS"), 10: ("UPS", "PUS", "RUS", "C", "C", "C")}
SLOTS = 4
"""Number of solution slots of the inverse kinematics function. The leg PRS or PUS and the leg RRS
or RUS have two solutions each."""
FOUND = 1e-8
MAPS = ("actuators", "actuator_rates")


def closed_configurations(mechanism, seed):
    """Return a NumPy model, and configurations (N, n_z) with closed loops near the reference."""
    model, rng = Model(mechanism), np.random.default_rng(seed)
    at = dict(mechanism.reference)
    start = np.array([float(at.get(name, 0)) for name in model.names])
    z = np.repeat(start[None], POSES, 0)
    # For a platform on six legs, main-chain joints are moved, because the loops close at every pose
    # but the actuators may be singular.
    moved = model.actuated if len(model.actuated) < len(model.chain) else model.chain
    z[:, moved] += rng.uniform(-0.06, 0.06, (POSES, len(moved)))
    z = model.newton(z, moved)
    return model, z[model.gap(z) < 1e-12]


def inverse_at(ik, model, z):
    """Return actuator values (k, N, n) and residuals (k, N) of all k solutions.

    Also returns the actuator values of the model in the configurations z.
    """
    (kernel,) = lower([ik], "drawn")
    T, slots = model.tip(z).reshape(-1, 16).T, []
    for signs in product((1.0, -1.0), repeat=len(ik.signs)):
        choice = np.repeat(np.array(signs)[:, None], len(z), 1)
        slots.append([np.array(part).T for part in kernel(T, choice)[:2]])
    arms, residual = (np.stack(parts) for parts in zip(*slots, strict=True))
    return arms, residual[..., 0], z[:, model.actuated]


def turned_apart(one, other):
    return np.abs(np.remainder(one - other + np.pi, 2 * np.pi) - np.pi).max(-1)


@pytest.mark.parametrize(("seed", "kinds"), KINDS.items(), ids=["three", "six"])
def test_leg_inverse_recovers_actuators_and_their_rates(seed, kinds):
    mechanism = drawn(seed, kinds)
    model, z = closed_configurations(mechanism, seed)
    assert len(z) > 3
    derivation = derive(mechanism, functions=["ik_legs", "actuators", "actuator_rates"])
    arms, residual, q = inverse_at(derivation.function("ik_legs"), model, z)
    assert len(arms) == SLOTS
    assert ((turned_apart(arms, q) < FOUND) & (residual < FOUND)).any(0).all()
    maps, rates = lower([derivation.function(name) for name in MAPS], "drawn")
    theta = z[:, model.chain]
    own = np.array(maps(theta.T)).T
    assert (turned_apart(arms, own) < FOUND).any(0).all()
    x, xd = ca.SX.sym("x", theta.shape[1]), ca.SX.sym("xd", theta.shape[1])
    oracle = ca.Function("oracle", [x, xd], [ca.jtimes(maps(x), x, xd)])
    moved = model.tangent(z, model.actuated).sum(-1)[:, model.chain]
    expected = np.array(oracle(theta.T, moved.T)).T
    np.testing.assert_allclose(np.array(rates(theta.T, moved.T)).T, expected, rtol=1e-6, atol=1e-7)


def test_legs_with_tilted_hinge_have_no_closed_form_inverse():
    flat = drawn(3, ("RRS", "RRS", "PRS"))
    angle = sp.Rational(3, 10)
    joints = tuple(
        replace(
            joint,
            before=(*joint.before, Rotation("x", angle)),
            after=(Rotation("x", -angle), *joint.after),
        )
        if joint.name == "r1_0"
        else joint
        for joint in flat.joints
    )
    assert not solved(flat).backward.open
    assert set(solved(replace(flat, joints=joints)).backward.open) == {"r0_0", "r1_0"}


def test_explanation_names_the_leg_steps():
    message = str(explain(drawn(1, ("RPS", "PRS", "RRS"))))
    for title in (
        "a displacement from a distance",
        "intersection of a line and a sphere",
        "intersection of a circle and a sphere",
    ):
        assert title in message
    assert message.count("a hinge that points to a ball") == 3


@pytest.mark.parametrize(("make", "modes"), [(driven_by_a_leg, 2), (agile_eye, 8)])
def test_leg_inverse_returns_distinct_working_modes(make, modes):
    """In each working mode, the length of a leg has the same sign at all poses."""
    mechanism = make()
    model, z = closed_configurations(mechanism, 0)
    assert len(z) > POSES / 2
    arms, residual, q = inverse_at(
        derive(mechanism, functions=["ik_legs"]).function("ik_legs"), model, z
    )
    solved = residual < FOUND
    assert (solved.sum(0) == modes).all()
    assert (solved & (turned_apart(arms, q) < FOUND)).any(0).all()
    for k in range(len(z)):
        mine = arms[solved[:, k], k]
        assert (turned_apart(mine[:, None], mine) + np.eye(modes)).min() > 1e-3
