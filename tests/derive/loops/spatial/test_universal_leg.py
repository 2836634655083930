"""Closed-form solution of loops with a rod between a universal joint and a ball joint."""

from dataclasses import replace
from functools import cache

import casadi as ca
import numpy as np
import pytest
import sympy as sp

from chasles.derive import DescriptionError, Frame, Mechanism, derive
from chasles.derive.loops.solve.solved_loops import forward_branches
from chasles.derive.loops.spatial.turning_leg import TurningLeg
from chasles.derive.loops.spatial.universal_leg import UniversalLeg
from chasles.derive.model.mechanism import Closure
from chasles.derive.model.robot import Rotation, Translation
from chasles.derive.terms.casadi_graph import lower
from tests.support.loops.closures import Model
from tests.support.loops.mechanisms import BASE, at, near, pin, rsur
from tests.support.loops.solved import solved

CLOSED = 1e-12
FUNCTIONS = ["chain", "chain_rates", "configuration", "margin", "chain_all", "actuators_all"]


def turned_round():
    """Return the mechanism with a reversed rod."""
    return Mechanism(
        "turned_round",
        (
            pin("rocker", BASE, "output", 3, 1, 0, ("x", sp.pi / 2)),
            pin("crank", BASE, "input"),
            pin("yoke", "input", "fork", 1, 0, "1/5", ("y", sp.pi / 2)),
            pin("swing", "fork", "rod", 0, 0, 0, ("x", sp.pi / 2), direction=-1),
        ),
        ("crank",),
        closures=(Closure("ball", "ball", Frame("rod", at(2)), Frame("output", at(2))),),
        tool_body="output",
        reference=near(("crank", 1), ("rocker", "21/10"), ("yoke", "3/5"), ("swing", "-27/10")),
    )


def spherical():
    """Return a spherical four-bar linkage whose loop is closed by a pin away from the center."""
    crank, coupler, rocker, ground = (sp.pi * sp.Rational(k, 36) for k in (8, 16, 14, 15))
    outside = Translation((0, 0, 1))
    return Mechanism(
        "spherical",
        (
            pin("crank", BASE, "input"),
            pin("elbow", "input", "coupler", 0, 0, 0, ("x", crank)),
            pin("wrist", "coupler", "output", 0, 0, 0, ("x", coupler)),
        ),
        ("crank",),
        closures=(
            Closure(
                "rocker",
                "pin",
                Frame("output", (Rotation("x", rocker), outside)),
                Frame(BASE, (Rotation("x", ground), outside)),
            ),
        ),
        tool_body="output",
        reference=near(("crank", 1), ("elbow", 2), ("wrist", "3/2")),
    )


BUILDERS = {f.__name__: f for f in (rsur, turned_round)}


@cache
def kernels(name):
    functions = derive(BUILDERS[name](), functions=FUNCTIONS).functions
    names = [f.name for f in functions]
    return dict(zip(names, lower(functions, "test"), strict=True))


def run(name, function, rows):
    return np.array([np.array(kernels(name)[function](*row)).ravel() for row in rows])


def random_q(count, spread=np.pi):
    return np.random.default_rng(0).uniform(-spread, spread, (count, 1))


@pytest.mark.parametrize("name", BUILDERS)
def test_universal_leg_is_solved_in_two_steps_with_four_branches(name):
    h = solved(BUILDERS[name]())
    assert [type(step) for step in h.forward.steps] == [TurningLeg, UniversalLeg]
    assert not h.forward.open
    assert len(forward_branches(h)) == 4


@pytest.mark.parametrize("name", BUILDERS)
def test_loops_close_where_margins_are_positive(name):
    model, q = Model(BUILDERS[name]()), random_q(400)
    z, margin = (run(name, f, [(row,) for row in q]) for f in ("configuration", "margin"))
    closes = (margin >= 0).all(-1)
    assert closes.sum() > 100
    assert closes.all() == (name == "rsur")
    np.testing.assert_array_equal(np.isfinite(z).all(-1), closes)
    assert model.gap(z[closes]).max() < CLOSED


@pytest.mark.parametrize("name", BUILDERS)
def test_solution_lies_on_the_branch_of_the_reference(name):
    mechanism = BUILDERS[name]()
    at_reference = solved(mechanism).at_reference
    for joint, value in at_reference.items():
        assert np.cos(value - float(mechanism.reference_of(joint))) > 0.8
    # If the reference configuration contains the flipped angles of the universal joint, the loop
    # solver must select the second branch.
    over = {"yoke": at_reference["yoke"] + np.pi, "swing": np.pi - at_reference["swing"]}
    if name == "turned_round":
        values = [(n, sp.Rational(f"{over.get(n, v):.3f}")) for n, v in at_reference.items()]
        other = solved(replace(mechanism, reference=tuple(values))).at_reference
        assert np.cos(other["yoke"] - over["yoke"]) == pytest.approx(1)
        assert np.cos(other["swing"] - over["swing"]) == pytest.approx(1)


@pytest.mark.parametrize("name", BUILDERS)
def test_chain_rates_match_automatic_differentiation(name):
    q = random_q(60, 0.8)
    x, xd = ca.SX.sym("x"), ca.SX.sym("xd")
    oracle = ca.Function("oracle", [x, xd], [ca.jtimes(kernels(name)["chain"](x), x, xd)])
    rates = run(name, "chain_rates", [(row, 0.7) for row in q])
    expected = np.array([np.array(oracle(row, 0.7)).ravel() for row in q])
    is_finite = np.isfinite(rates).all(-1)
    assert is_finite.sum() > 20
    np.testing.assert_allclose(rates[is_finite], expected[is_finite], rtol=1e-9, atol=1e-11)


def test_all_four_branches_close_and_are_distinct():
    model = Model(rsur())
    places = [model.names.index(n) for n in ("rocker", "yoke", "swing")]
    for row in random_q(20, 0.3):
        theta = np.array(kernels("rsur")["chain_all"](row)[0]).reshape(4, 3)
        z = np.zeros((4, 4))
        z[:, model.actuated] = row
        z[:, places] = theta
        assert model.gap(z).max() < CLOSED
        apart = np.exp(1j * theta[:, None]) - np.exp(1j * theta)
        assert np.abs(apart + 9 * np.eye(4)[..., None]).max(-1).min() > 1e-3


def test_pin_through_the_center_acts_like_a_ball():
    mechanism = spherical()
    h, model = solved(mechanism), Model(mechanism)
    assert [type(step) for step in h.forward.steps] == [UniversalLeg]
    assert len(forward_branches(h)) == 2
    all_values = lower(derive(mechanism, functions=["chain_all"]).functions, "test")[0]
    for crank in np.linspace(-3, 3, 21):
        z = np.array(all_values([crank])[0]).reshape(2, 3)
        assert model.gap(z).max() < CLOSED
        assert np.abs(np.subtract(*np.exp(1j * z))).max() > 0.1


def test_axes_that_do_not_meet_have_no_closed_form():
    whole = rsur()
    *others, swing = whole.joints
    aside = replace(swing, before=at("1/10", "1/10", "1/5", ("x", sp.pi * sp.Rational(2, 5))))
    h = solved(replace(whole, joints=(*others, aside)))
    assert set(h.forward.open) == {"rocker", "yoke", "swing"}


def test_too_short_rod_is_rejected():
    (ball,) = rsur().closures
    short = replace(ball, b=Frame("rod", at("1/10", 0, "1/4")))
    with pytest.raises(DescriptionError, match="'ball' does not close"):
        derive(replace(rsur(), closures=(short,)))
