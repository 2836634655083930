"""Parametric functions of robots with loops agree with robots derived at fixed parameter values."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
import sympy as sp
from numpy.testing import assert_allclose

from chasles.derive import DescriptionError, read
from chasles.derive.chain.poe import placement_matrix
from chasles.derive.loops.parametric.parametric_loops import ParametricLoops
from chasles.derive.model.mechanism import Frame
from chasles.derive.model.placements import Rotation, Translation, inverse
from chasles.derive.terms.casadi_graph import lower
from tests.support.derivations import ROBOTS
from tests.support.loops.continued import closed_configuration
from tests.support.loops.mechanisms import ALONG_X, ALONG_Y, near, slider_crank
from tests.support.loops.parametric import loops_of, nominal, reference
from tests.support.loops.solved import solved

RODS = ("five_bar", "delta", "excavator")
"""Names of robots with a planar loop, with spatial loops, and with loops that contain a cylinder.
"""
EVERY = ("four_bar", "slider_crank", "delta", "stewart_gough", "excavator")
"""Robots with loops of every kind: a pin, a slider, rods, and actuated cylinders."""
SLIDERS = {
    "x": (ALONG_X, near(("crank", 1), ("elbow", -1), ("cross", 3))),
    "y": (ALONG_Y, near(("crank", 1), ("elbow", "3/4"), ("cross", "15/4"))),
}
"""Rotation of the slider's frame and reference configuration, keyed by the normal of the loop's
plane."""


def closed(loops, functions, w, p):
    """Solve the loop equations for the passive joint values by Newton's method."""
    w, n = w.copy(), len(loops.hybrid.q)
    for _ in range(20):
        c, D = (np.array(part) for part in functions["closure_p"](w, p))
        D = D.reshape(len(c), len(w))
        w[n:] -= np.linalg.solve(D[:, n:], c.ravel())
    assert np.abs(c).max() < 1e-12
    return w


@pytest.mark.parametrize("name", EVERY)
def test_loop_derivatives_match_automatic_differentiation(name):
    loops, functions = loops_of(name)
    random = np.random.default_rng(2)
    p = nominal(loops) + random.uniform(-0.02, 0.02, len(loops.geometry.parameters))
    w = reference(loops) + random.uniform(-0.05, 0.05, loops.arguments["w"].size)
    symbols = ca.SX.sym("w", len(w)), ca.SX.sym("p", len(p))
    residual, by_w = functions["closure_p"](*symbols)
    T = functions["tool_p"](*symbols)
    by_p = functions["closure_p_D_p"](*symbols)
    wanted = [ca.jacobian(residual, s) for s in symbols] + [ca.jacobian(T, s) for s in symbols]
    made = [by_w, by_p, T, *(functions[f"tool_p_D_{x}"](*symbols) for x in "wp")]
    both = ca.Function("both", symbols, [*wanted, *made])
    c_w, c_p, T_w, T_p, *found = (np.array(part) for part in both(w, p))
    assert_allclose(found[0].reshape(c_w.shape), c_w, atol=1e-12)
    assert_allclose(found[1].reshape(c_p.shape), c_p, atol=1e-12)
    pose = found[2].reshape(4, 4)
    for D, twist in ((T_w, found[3]), (T_p, found[4])):
        rates = D.T.reshape(-1, 4, 4)
        omega = rates[:, :3, :3] @ pose[:3, :3].T
        v = rates[:, :3, 3].T
        turned = np.array([omega[:, 2, 1], omega[:, 0, 2], omega[:, 1, 0]])
        assert_allclose(twist.reshape(6, -1), np.vstack([v, turned]), atol=1e-12)


def off(frame, shift):
    moved = Translation(tuple(sp.Rational(f"{x:.6f}") for x in shift))
    return replace(frame, placement=(moved, *frame.placement))


@pytest.mark.parametrize("name", RODS)
def test_changed_rod_parameters_match_redescribed_mechanism(name):
    loops, functions = loops_of(name)
    random = np.random.default_rng(3)
    p, names = nominal(loops), [item.name for item in loops.geometry.parameters]
    struts = []
    for strut in loops.hybrid.mechanism.struts:
        shifts = np.zeros((2, 3))
        for side, shift in zip("ab", shifts, strict=True):
            for k, axis in enumerate("xyz"):
                if (number := f"{strut.name}_{side}_{axis}") in names:
                    shift[k] = round(random.uniform(-2e-3, 2e-3), 6)
                    p[names.index(number)] += shift[k]
        longer = round(random.uniform(-2e-3, 2e-3), 6)
        p[names.index(f"{strut.name}_length")] += longer
        a, b = off(strut.a, shifts[0]), off(strut.b, shifts[1])
        length = strut.length + sp.Rational(f"{longer:.6f}")
        struts.append(replace(strut, a=a, b=b, length=length))
    built = replace(loops.hybrid.mechanism, struts=tuple(struts))
    w, n = reference(loops), len(loops.hybrid.q)
    step = np.array([0.02 if c.unit == "m" else 0.1 for c in built.coordinates])
    w[:n] += random.uniform(-1, 1, n) * step
    w = closed(loops, functions, w, p)
    z = closed_configuration(built, w[:n])
    for variable, value in zip(loops.unknown, w[n:], strict=True):
        assert abs(np.remainder(value - z[variable.name] + np.pi, 2 * np.pi) - np.pi) < 1e-9


def test_out_of_plane_parameters_are_omitted():
    loops, _ = loops_of("four_bar")
    names = {item.name for item in loops.geometry.parameters if item.part in ("axis", "loop")}
    assert {"crank_shift_x", "rocker_pin_a_y"} <= names
    assert not {name for name in names if "tilt" in name or name.endswith("_z")}


def slider_crank_on(guide, at_reference):
    crank, elbow, cross = slider_crank().joints
    (gudgeon,) = slider_crank().closures
    joints = (crank, elbow, replace(cross, before=guide, after=inverse(guide)))
    closures = (replace(gudgeon, b=Frame("piston")),)
    return replace(slider_crank(), joints=joints, closures=closures, reference=at_reference)


@pytest.mark.parametrize("normal", SLIDERS)
def test_slider_of_a_planar_loop_tilts_in_the_plane(normal):
    guide, at_reference = SLIDERS[normal]
    loops = ParametricLoops(solved(slider_crank_on((Rotation(*guide),), at_reference)))
    names = [item.name for item in loops.geometry.parameters]
    assert [name for name in names if "cross_tilt" in name] == [f"cross_tilt_{normal}"]
    p, tilt = nominal(loops), sp.Rational(1, 50)
    p[names.index(f"cross_tilt_{normal}")] = tilt
    functions = dict(zip(loops.inner, lower([*loops.inner.values()], "tilted"), strict=True))
    w = closed(loops, functions, reference(loops), p)
    tilted = slider_crank_on((Rotation(*guide), Rotation(normal, tilt)), at_reference)
    z = closed_configuration(tilted)
    wanted = [z[variable.name] for variable in loops.unknown]
    assert_allclose(w[len(loops.hybrid.q) :], wanted, atol=1e-10)


def test_axis_parameters_of_free_bodies_are_omitted():
    loops, _ = loops_of("stewart_gough")
    assert {item.part for item in loops.geometry.parameters} == {
        *("parameter", "base", "tool", "loop", "transmission")
    }
    assert sum(item.part == "loop" for item in loops.geometry.parameters) == 6 * 7


def test_nominal_part_frames_match_joint_placements():
    loops, functions = loops_of("five_bar")
    frames = np.array(functions["parts_p"](nominal(loops))).reshape(-1, 4, 4)
    mechanism = loops.hybrid.mechanism
    values = {p.symbol: p.value for p in mechanism.parameters}
    joint = mechanism.joints[1]
    wanted = placement_matrix(joint.before).xreplace(values)
    assert_allclose(frames[2], np.array(wanted, dtype=float), atol=1e-15)
    assert_allclose(frames[-1, 0, 3], 0.3, atol=1e-15)


def test_redundant_loops_have_no_parametric_functions():
    mechanism = read(ROBOTS / "five_bar.toml")
    (rod,) = mechanism.struts
    again = replace(rod, name="again", swing="again_swing")
    with pytest.raises(DescriptionError, match="2 loop equations for 1 unknown"):
        ParametricLoops(solved(replace(mechanism, struts=(rod, again))))
