"""Closed-form solutions of spatial loops: legs with ball joints, and platforms on three spheres."""

from dataclasses import replace
from functools import cache

import casadi as ca
import numpy as np
import pytest
import sympy as sp

from chasles.derive import DescriptionError, derive
from chasles.derive.loops.solve.solved_loops import forward_branches
from chasles.derive.loops.spatial.cylinder_length import CylinderLength
from chasles.derive.loops.spatial.sliding_leg import SlidingLeg
from chasles.derive.loops.spatial.three_spheres import ThreeSpheres
from chasles.derive.loops.spatial.turning_leg import TurningLeg
from chasles.derive.model.mechanism import Frame, Mechanism, Strut
from chasles.derive.terms.casadi_graph import lower
from tests.support.loops.closures import Model
from tests.support.loops.mechanisms import BASE, at, delta, near, pin, rssr, slider, stewart
from tests.support.loops.solved import solved

CLOSED = 1e-12


def crank_and_slider():
    """A crank and a skew slider, connected by a rod with ball joints."""
    return Mechanism(
        "rssp",
        (
            pin("crank", BASE, "input"),
            slider("ram", BASE, "ram", 2, "1/2", -1, ("x", "2/5"), ("y", "3/10")),
        ),
        ("crank",),
        struts=(
            Strut("rod", Frame("input", at(1, 0, "1/5")), Frame("ram", at("1/10")), 3, ends="ball"),
        ),
        tool_body="ram",
        reference=near(("crank", 1), ("ram", "7/2")),
    )


def lift():
    """A cylinder with ball joints that rotates a lever about a skew axis."""
    return Mechanism(
        "lift",
        (pin("lever", BASE, "lever", 1, 0, 0, ("x", sp.Rational(4, 5))),),
        ("lift",),
        struts=(
            Strut(
                "lift",
                Frame(BASE, at(2, -1, 1)),
                Frame("lever", at("3/2", 0, "1/4")),
                1,
                True,
                "ball",
            ),
        ),
        reference=near(("lever", "5/4"), ("lift", "9/10")),
    )


def from_the_platform():
    """A delta robot with reversed rods and one reversed arm."""
    whole = delta()
    rods = tuple(replace(rod, a=rod.b, b=rod.a) for rod in whole.struts)
    joints = tuple(replace(j, direction=-1) if j.name == "arm1" else j for j in whole.joints)
    reference = tuple((n, -v if n == "arm1" else v) for n, v in whole.reference)
    return replace(whole, joints=joints, struts=rods, reference=reference)


def tripod():
    """Return a platform on three cylinders with ball joints at both ends."""
    legs = [
        Strut(f"leg{k}", Frame(BASE, at(*foot)), Frame("platform", at()), 1, True, "ball")
        for k, foot in enumerate(((1, 0, 0), (-1, 1, 0), (-1, -1, "1/5")))
    ]
    return Mechanism(
        "tripod",
        (
            slider("x", BASE, "along", 0, 0, 0, ("y", sp.pi / 2)),
            slider("y", "along", "across", 0, 0, 0, ("y", -sp.pi / 2), ("x", -sp.pi / 2)),
            slider("z", "across", "platform", 0, 0, 0, ("x", sp.pi / 2)),
        ),
        tuple(leg.name for leg in legs),
        struts=tuple(legs),
        tool_body="platform",
        reference=near(("z", 1), *((leg.name, "1/2") for leg in legs)),
    )


@pytest.mark.parametrize(("build", "step"), [(lift, TurningLeg), (tripod, ThreeSpheres)])
def test_negative_cylinder_lengths_give_nan_and_negative_margin(build, step):
    mechanism = build()
    made = derive(mechanism, functions=["chain", "margin"])
    assert {type(one) for one in made.hybrid.forward.steps} == {step}
    chain, margin = lower(made.functions, mechanism.name)
    own = np.array([float(mechanism.reference_of(name)) for name in mechanism.actuated])
    assert np.isfinite(np.array(chain(own))).all()
    for k in range(len(own)):
        q = own.copy()
        # The total length of a cylinder is 1 + q. A negative total length also fulfills the squared
        # length equation.
        q[k] = -2 - own[k]
        assert np.isnan(np.array(chain(q))).all()
        assert (np.array(margin(q)) < 0).all()


def test_reference_equally_near_two_branches_is_rejected():
    whole = crank_and_slider()
    h = solved(whole)
    far, near_ = (h.forward.reference.of(s.values["ram"]) for s in forward_branches(h))
    assert far - near_ > 1
    middle = sp.Rational(f"{(far + near_) / 2:.9f}")
    for offset in (0, sp.Rational(1, 10**6)):
        tie = replace(whole, reference=(*whole.reference[:1], ("ram", middle + offset)))
        with pytest.raises(
            DescriptionError, match="rod: both branches of the loop are equally near"
        ):
            _ = solved(tie).forward
    for offset, sign in ((sp.Rational(1, 100), 1), (-sp.Rational(1, 100), -1)):
        clear = replace(whole, reference=(*whole.reference[:1], ("ram", middle + offset)))
        (step,) = solved(clear).forward.steps
        assert step.sign == sign


BUILDERS = {f.__name__: f for f in (rssr, crank_and_slider, lift, delta, from_the_platform)}
KINDS = {
    "rssr": TurningLeg,
    "crank_and_slider": SlidingLeg,
    "lift": TurningLeg,
    "delta": ThreeSpheres,
    "from_the_platform": ThreeSpheres,
}


@cache
def derived(name):
    return derive(BUILDERS[name](), functions=FUNCTIONS[name])


@cache
def kernels(name):
    functions = derived(name).functions
    names = [f.name for f in functions]
    return dict(zip(names, lower(functions, "test"), strict=True))


FORWARD = ["chain", "chain_rates", "configuration", "margin", "chain_all"]
FUNCTIONS = dict.fromkeys(BUILDERS, FORWARD)
FUNCTIONS |= {
    name: [*FORWARD, "actuators", "actuator_rates", "actuator_margin", "actuators_all"]
    for name in ("delta", "from_the_platform")
}
FUNCTIONS["lift"] = [*FORWARD, "actuators", "actuator_rates"]


@cache
def reference(name):
    h = derived(name).hybrid
    return np.array([h.at_reference[c.moves] for c in h.mechanism.coordinates])


def random_q(name, n=100, spread=0.3):
    q = reference(name)
    return q + np.random.default_rng(0).uniform(-spread, spread, (n, len(q)))


def run(name, function, rows):
    return np.array([np.array(kernels(name)[function](*row)).ravel() for row in rows])


@pytest.mark.parametrize("name", BUILDERS)
def test_loops_close_on_the_branch_of_the_reference(name):
    model, q = Model(BUILDERS[name]()), random_q(name)
    z = run(name, "configuration", [(row,) for row in q])
    assert np.isfinite(z).all()
    assert model.gap(z).max() < CLOSED
    np.testing.assert_allclose(z[:, model.actuated], q, atol=1e-15)
    start = np.array([[float(model.mechanism.reference_of(n)) for n in model.names]])
    start[:, model.actuated] = reference(name)
    found = model.newton(start, model.actuated)
    (expected,) = run(name, "configuration", [(reference(name),)])
    np.testing.assert_allclose(found[0], expected, atol=1e-9)


@pytest.mark.parametrize("name", BUILDERS)
def test_spatial_loops_are_solved_by_the_expected_step(name):
    h = derived(name).hybrid
    assert [type(step) for step in h.forward.steps] == [KINDS[name]]
    assert not h.forward.open


@pytest.mark.parametrize("name", BUILDERS)
def test_chain_rates_match_automatic_differentiation(name):
    q = random_q(name, 30)
    n = q.shape[1]
    x, xd = ca.SX.sym("x", n), ca.SX.sym("xd", n)
    oracle = ca.Function("oracle", [x, xd], [ca.jtimes(kernels(name)["chain"](x), x, xd)])
    qd = np.random.default_rng(1).uniform(-1, 1, q.shape)
    found = run(name, "chain_rates", zip(q, qd, strict=True))
    expected = np.array([np.array(oracle(*row)).ravel() for row in zip(q, qd, strict=True)])
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-11)


@pytest.mark.parametrize("name", BUILDERS)
def test_both_branches_close_and_are_distinct(name):
    model, f = Model(BUILDERS[name]()), kernels(name)["chain_all"]
    assert len({*model.chain, *model.actuated}) == len(model.names)
    for row in random_q(name, 10):
        theta = np.array(f(row)[0]).reshape(2, -1)
        assert np.abs(theta[0] - theta[1]).max() > 1e-3
        z = np.zeros((2, len(model.names)))
        z[:, model.actuated] = row
        z[:, model.chain] = theta
        assert model.gap(z).max() < CLOSED


@pytest.mark.parametrize("name", BUILDERS)
def test_out_of_reach_is_nan_with_a_negative_margin(name):
    q = random_q(name, 300, 4.0)
    chain, margin = (run(name, f, [(row,) for row in q]) for f in ("chain", "margin"))
    closes = (margin >= 0).all(-1)
    np.testing.assert_array_equal(np.isfinite(chain).all(-1), closes)
    model = Model(BUILDERS[name]())
    z = run(name, "configuration", [(row,) for row in q[closes]])
    assert model.gap(z).max() < 1e-9
    assert closes.any()
    assert (~closes).any() or name in ("rssr", "crank_and_slider")


@pytest.mark.parametrize("name", ["lift", "delta", "from_the_platform"])
def test_actuators_and_their_rates_invert_the_chain(name):
    q = random_q(name)
    qd = np.random.default_rng(2).uniform(-1, 1, q.shape)
    theta = run(name, "chain", [(row,) for row in q])
    thetad = run(name, "chain_rates", zip(q, qd, strict=True))
    found = run(name, "actuators", [(row,) for row in theta])
    np.testing.assert_allclose(found, q, atol=CLOSED)
    rates = run(name, "actuator_rates", zip(theta, thetad, strict=True))
    np.testing.assert_allclose(rates, qd, atol=1e-11)


def test_delta_pose_beyond_rod_length_has_negative_margin():
    """The target position is farther from the arm's plane than the rod length."""
    f = kernels("delta")
    for y in (0.9, 1.5, 4.0):
        theta = np.array([0.0, y, -0.3, 0, 0, 0])
        margin = np.array(f["actuator_margin"](theta)).ravel()
        assert np.isnan(np.array(f["actuators"](theta)).ravel()[0])
        assert margin[0] < 0


def test_stewart_actuators_are_the_leg_lengths():
    mechanism = stewart()
    made = derive(mechanism, functions=["actuators"])
    h = made.hybrid
    assert {type(step) for step in h.backward.steps} == {CylinderLength}
    assert set(h.forward.open) == {"x", "y", "z", "yaw", "pitch", "roll"}
    (kernel,) = lower(made.functions, "test")
    model = Model(mechanism)
    theta = np.array([0.1, -0.05, 1.1, 0.2, -0.1, 0.15])
    z = np.zeros((1, len(model.names)))
    z[0, model.chain] = theta
    z[0, model.actuated] = np.array(kernel(theta)).ravel()
    assert model.gap(z).max() < CLOSED


def test_spatial_loop_open_at_the_reference_is_rejected():
    short = replace(rssr(), struts=(replace(rssr().struts[0], length=sp.Rational(1, 10)),))
    with pytest.raises(DescriptionError, match=r"'rod' does not close .* 386.3 mm too short"):
        derive(short)


def test_reference_selects_the_delta_branch():
    up = replace(delta(), reference=tuple((n, -v if n == "z" else v) for n, v in delta().reference))
    whole = derived("delta").hybrid
    (usual,) = whole.forward.steps
    turned = solved(up)
    (step,) = turned.forward.steps
    assert {step.branch, usual.branch} == {"above", "below"}
    assert turned.at_reference["z"] > 0 > whole.at_reference["z"]
    assert len(usual.name(delta()).split(" and ")) == 6
    assert usual.joints[0] == "rod0l"
