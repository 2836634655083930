"""Test the geometric meaning, textbook form, and derivatives of loop equations."""

from dataclasses import replace
from functools import cache

import casadi as ca
import numpy as np
import pytest
import sympy as sp

from chasles.derive import DescriptionError
from chasles.derive.loops.model.constraints import (
    configuration_names,
    constraints,
    jacobian,
    jacobian_dot,
)
from chasles.derive.model.mechanism import Closure, Frame, Mechanism, Strut
from chasles.derive.terms.casadi_graph import lower
from chasles.derive.terms.symbolic_function import Argument, Result, SymbolicFunction
from chasles.derive.terms.terms import Terms
from tests.support.loops import mechanisms
from tests.support.loops.continued import closed_configuration
from tests.support.loops.mechanisms import BASE, at, body_poses, pin
from tests.support.tolerances import DERIVATIVES

CLOSED = 1e-11
"""Tolerance of loop residuals for configurations from a formula with a square root."""


class Case:
    """A mechanism, its loop equations, and functions of its configuration z and rates zd."""

    def __init__(self, mechanism):
        self.mechanism = mechanism
        self.terms = Terms({p.symbol: p.value for p in mechanism.parameters})
        self.names = [variable.name for variable in configuration_names(mechanism)]
        n = len(self.names)
        self.z, self.zd = (sp.symbols(f"{c}1:{n + 1}", real=True) for c in ("z", "zd"))
        self.equations = constraints(mechanism, self.terms, self.z)
        self.residual = [entry for loop in self.equations for entry in loop.residual]
        self.shape = (len(self.residual), n)
        self.functions = {}

    def function(self, name):
        """Return a CasADi function, converted at its first use."""
        if name not in self.functions:
            self.functions[name] = self._lowered(name, self._entries(name))
        return self.functions[name]

    def _entries(self, name):
        if name == "residual":
            return self.residual
        if name == "facing":
            return [e for loop in self.equations for e in loop.facing]
        if name == "J":
            rows = jacobian(self.equations, self.terms, self.z)
        else:
            rows = jacobian_dot(self.equations, self.terms, self.z, self.zd)
        return [entry for row in rows for entry in row]

    def _lowered(self, name, entries):
        inputs = tuple(
            Argument(n, s, (len(s),), "", "") for n, s in (("z", self.z), ("zd", self.zd))
        )
        outputs = (Result(name, tuple(entries), (len(entries),), "", ""),)
        function = SymbolicFunction(name, "", "", inputs, outputs, self.terms)
        return lower([function], self.mechanism.name)[0]

    def at(self, name, values, rates=None):
        z = [values[n] for n in self.names]
        zd = rates if rates is not None else [0] * len(z)
        return np.array(self.function(name)(z, zd)).ravel()

    def printed(self, entry):
        """Replace all names in an expression by their definitions."""
        while True:
            wider = entry.xreplace(self.terms.definitions).xreplace(self.terms.constants)
            if wider == entry:
                return entry
            entry = wider


BUILT = {
    "four_bar": mechanisms.four_bar,
    "four_bar_rod": mechanisms.four_bar_rod,
    "slider_crank": mechanisms.slider_crank,
    "arm": mechanisms.excavator_arm,
    "parallelogram": mechanisms.parallelogram,
    "trammel": mechanisms.trammel,
    "slotted_rocker": mechanisms.slotted_rocker,
    "welded": mechanisms.welded,
    "planar_3rrr": mechanisms.planar_3rrr,
    "rssr": mechanisms.rssr,
    "bennett": mechanisms.bennett,
    "sarrus": mechanisms.sarrus,
    "rail": mechanisms.rail,
    "rail_weld": lambda: mechanisms.rail("weld"),
    "rail_pin": lambda: mechanisms.rail("pin"),
    "rail_ball": lambda: mechanisms.rail("ball"),
    "delta": mechanisms.delta,
    "stewart": mechanisms.stewart,
}
WITHOUT_DELTA = [name for name in BUILT if name != "delta"]
"""Names of all mechanisms except the delta robot, whose ball-ended rods also occur in ``rssr`` and
``stewart``."""
PLANAR = (
    *("four_bar", "four_bar_rod", "slider_crank", "arm", "parallelogram", "trammel"),
    *("slotted_rocker", "welded", "planar_3rrr"),
)
TILTED = at("1/10", "1/5", "3/10", ("x", sp.pi / 2), ("y", sp.pi / 6), ("z", sp.pi / 4))


@cache
def case(name):
    return Case(BUILT[name]())


@cache
def closed(name):
    mechanism = BUILT[name]()
    return _welded_pose(mechanism) if name == "rail_weld" else closed_configuration(mechanism)


def _welded_pose(mechanism):
    """Return the base-frame pose of the body that is welded to the rail.

    The rotation of the welded body is Rz(yaw) Ry(pitch) Rx(roll).
    """
    (weld,) = mechanism.closures
    T = _matrix(weld.a.placement) @ np.linalg.inv(_matrix(weld.b.placement))
    yaw, roll = np.arctan2(T[1, 0], T[0, 0]), np.arctan2(T[2, 1], T[2, 2])
    pitch = np.arctan2(-T[2, 0], np.hypot(T[0, 0], T[1, 0]))
    x, y, z = T[:3, 3]
    return {"x": x, "y": y, "z": z, "yaw": yaw, "pitch": pitch, "roll": roll}


def _matrix(placement, mechanism=None):
    parameters = mechanism.parameters if mechanism else ()
    return mechanisms.matrix(placement, {p.symbol: p.value for p in parameters})


# --- equations as printed ---


def test_four_bar_residual_matches_textbook_equations():
    c = case("four_bar")
    (loop,) = c.equations
    l1, l2, l3, l4 = sp.symbols("l1:5", real=True)
    z1, z2, z3 = c.z
    assert loop.kind == "planar"
    assert loop.units == ("m", "m")
    assert [c.printed(entry) for entry in loop.residual] == [
        l1 * sp.cos(z1) + l2 * sp.cos(z1 + z2) - l3 * sp.cos(z3) - l4,
        l1 * sp.sin(z1) + l2 * sp.sin(z1 + z2) - l3 * sp.sin(z3),
    ]


def test_cylinder_length_multiplies_cosine_and_sine_of_its_swing():
    c = case("arm")
    (loop,) = c.equations
    _, boom, lift, swing = c.z
    x, y = (c.printed(entry) for entry in loop.residual)
    begin, half = sp.Rational(3, 2) - 1, sp.Rational(1, 2)
    assert sp.expand(x - begin - (lift + 2) * sp.cos(swing)) == sp.sin(boom) / 2 - 2 * sp.cos(boom)
    assert sp.expand(y + 1 - (lift + 2) * sp.sin(swing)) == -2 * sp.sin(boom) - half * sp.cos(boom)


def test_ball_ended_rod_gives_a_single_distance_equation():
    (loop,) = case("rssr").equations
    assert loop.kind == "distance"
    assert len(loop.residual) == 1
    assert [e.kind for e in case("delta").equations] == ["distance"] * 6


def test_configuration_variables_are_named_in_order():
    assert case("arm").names == ["waist", "boom", "lift", "lift_swing"]
    assert case("planar_3rrr").names[3:6] == ["x", "y", "yaw"]
    assert case("stewart").names[6:] == [f"leg{k}" for k in range(6)]
    assert [v.unit for v in configuration_names(case("trammel").mechanism)] == ["m", "m", "rad"]
    assert case("delta").names[-1] == "roll"


@pytest.mark.parametrize(
    ("name", "kind", "count"),
    [
        ("slotted_rocker", "planar", 2),
        ("welded", "planar", 3),
        ("trammel", "planar", 2),
        ("bennett", "spatial", 5),
        ("rail", "spatial", 5),
        ("rail_weld", "spatial", 6),
        ("rail_pin", "spatial", 5),
        ("rail_ball", "point", 3),
        ("sarrus", "spatial", 5),
    ],
)
def test_loop_kind_and_equation_count_match_the_closure(name, kind, count):
    (loop,) = case(name).equations
    assert loop.kind == kind
    assert len(loop.residual) == len(loop.units) == count


def test_identically_satisfied_equations_are_omitted():
    slides = mechanisms.free("body", BASE, "body")[:3]
    stage = Mechanism(
        "stage",
        (*slides[:2], replace(slides[2], link="body")),
        ("x",),
        closures=(Closure("rail", "slider", Frame(BASE, at(0, 0, "1/2")), Frame("body")),),
    )
    (loop,) = Case(stage).equations
    assert loop.units == ("m", "m")
    tilted = mechanisms.ground(stage, TILTED)
    (loop,) = Case(tilted).equations
    assert loop.units == ("m", "m")


def test_equations_satisfied_by_cancellation_are_omitted():
    skew = (1, 2, 3, ("z", sp.Rational(1, 3)), ("x", sp.Rational(2, 7)))
    screw = replace(pin("screw", BASE, "nut", *skew), kind="helical", pitch="1/100")
    ram = replace(pin("ram", BASE, "rod", *skew), kind="prismatic")
    jack = Mechanism(
        "jack",
        (screw, ram),
        ("screw",),
        closures=(
            Closure(
                "thrust",
                "pin",
                Frame("nut", at(0, 0, 0, ("y", 1))),
                Frame("rod", at(0, 0, 0, ("y", 1))),
            ),
        ),
    )
    axial = replace(jack, closures=(replace(jack.closures[0], a=Frame("nut"), b=Frame("rod")),))
    (loop,) = Case(axial).equations
    assert loop.units == ("m", "m", "m")
    (loop,) = Case(jack).equations
    assert loop.units == ("m", "m", "m", "1", "1")


# --- geometric meaning of the equations ---


def open_ends(c, loop, z, poses):
    """Return the closure error of a loop joint, computed from the body poses."""
    loop_joint = loop.loop.loop_joint
    T_a, T_b = (
        poses[p.body] @ _matrix(p.placement, c.mechanism) for p in (loop_joint.a, loop_joint.b)
    )
    T = np.linalg.inv(T_a) @ T_b
    if isinstance(loop_joint, Strut):
        given = {p.symbol: p.value for p in c.mechanism.parameters}
        length = float(loop_joint.length.subs(given)) + z.get(loop_joint.name, 0)
        return abs(np.linalg.norm(T[:3, 3]) - length)
    # In a planar loop, the two pin axes of a closure may point in opposite directions.
    turn = abs(abs(T[2, 2]) - 1) if loop.kind == "planar" else np.linalg.norm(T[:2, 2])
    return {
        "pin": np.linalg.norm(T[:3, 3]) + turn,
        "ball": np.linalg.norm(T[:3, 3]),
        "slider": np.linalg.norm(T[:2, 3]) + np.linalg.norm(T[:3, :3] - np.eye(3)),
        "weld": np.linalg.norm(T - np.eye(4)),
    }[loop_joint.kind]


@pytest.mark.parametrize("name", WITHOUT_DELTA)
def test_residuals_vanish_only_at_closed_configurations(name):
    c, z = case(name), closed(name)
    assert (c.equations[0].kind == "planar") == (name in PLANAR)
    assert np.max(np.abs(c.at("residual", z))) < CLOSED
    poses = body_poses(c.mechanism, z)
    assert max(open_ends(c, loop, z, poses) for loop in c.equations) < CLOSED
    assert np.all(c.at("facing", z) > 1 - CLOSED)
    random = np.random.default_rng(1)
    for _ in range(5):
        off = {n: value + random.uniform(-0.5, 0.5) for n, value in z.items()}
        residual, offset = c.at("residual", off), 0
        poses = body_poses(c.mechanism, off)
        for loop in c.equations:
            own = residual[offset : offset + len(loop.residual)]
            offset += len(own)
            gap = open_ends(c, loop, off, poses)
            # The residual also contains swing angles, so it may exceed the gap between the rod
            # ends.
            assert np.linalg.norm(own) > gap / 20
            assert np.linalg.norm(own) > 1e-6


@pytest.mark.parametrize("name", PLANAR)
def test_residual_norm_is_independent_of_plane_orientation(name):
    flat, tilted = case(name), Case(mechanisms.ground(BUILT[name](), TILTED))
    random = np.random.default_rng(2)
    for _ in range(3):
        z = {n: random.uniform(-2, 2) for n in flat.names}
        sizes = [np.linalg.norm(c.at("residual", z)) for c in (flat, tilted)]
        assert sizes[1] == pytest.approx(sizes[0], abs=1e-12)


def test_four_bar_residual_vanishes_at_law_of_cosines_solution():
    c = case("four_bar")
    l1, l2, l3, l4 = 1, 3, 2.5, 3
    for crank in np.linspace(-3, 3, 13):
        x, y = l1 * np.cos(crank), l1 * np.sin(crank)
        d = np.hypot(l4 - x, y)
        at_rocker = np.arccos((l3**2 + d**2 - l2**2) / (2 * l3 * d))
        for side in (1, -1):
            rocker = np.arctan2(y, x - l4) - side * at_rocker
            tip = np.array([l4 + l3 * np.cos(rocker) - x, l3 * np.sin(rocker) - y])
            z = {"crank": crank, "elbow": np.arctan2(tip[1], tip[0]) - crank, "rocker": rocker}
            assert np.max(np.abs(c.at("residual", z))) < CLOSED
            z["elbow"] += 1e-3
            assert np.max(np.abs(c.at("residual", z))) > 1e-4


def test_bennett_linkage_satisfies_half_angle_relation():
    alpha, beta = np.pi / 6, np.pi / 2
    c, z = case("bennett"), closed("bennett")
    ratio = np.sin((beta + alpha) / 2) / np.sin((beta - alpha) / 2)
    assert np.tan(z["j1"] / 2) * np.tan(z["j2"] / 2) == pytest.approx(ratio, abs=CLOSED)
    assert z["j3"] == pytest.approx(-z["j1"], abs=CLOSED)
    assert np.max(np.abs(c.at("residual", z))) < CLOSED


def test_slider_crank_residual_vanishes_at_known_configuration():
    c = case("slider_crank")
    reach = np.sqrt(3**2 - 0.75**2)
    z = {"crank": np.pi / 2, "elbow": -np.pi / 2 - np.arcsin(0.25), "cross": reach}
    assert np.max(np.abs(c.at("residual", z))) < CLOSED


@pytest.mark.parametrize(
    "cranks",
    [(78.52393138, 176.46904472, -29.82437852), (0.16983617, 88.26254206, -129.56592854)],
    ids=["first case", "second case"],
)
def test_planar_3rrr_residual_vanishes_at_published_inverse(cranks):
    c = case("planar_3rrr")
    z = {"x": 0.020, "y": 0.050, "yaw": 0}
    for k, (leg, crank) in enumerate(zip((210, 330, 90), np.radians(cranks), strict=True), 1):
        out = np.exp(1j * np.radians(leg))
        rod = 0.020 + 0.050j + 0.13 * out - (0.29 * out + 0.17 * np.exp(1j * crank))
        z |= {f"crank{k}": crank, f"rod{k}_swing": np.angle(rod) - crank}
    # The publication prints angles in degrees with eight decimal places.
    assert np.max(np.abs(c.at("residual", z))) < 1e-10


# --- products of exponentials around loops ---


def cross_matrix(w):
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def exponential(screw, value):
    """Return the exponential (4, 4) of a unit screw times a joint value, by Rodrigues' formula."""
    v, w = screw[:3], screw[3:]
    T = np.eye(4)
    if not np.any(w):
        T[:3, 3] = v * value
        return T
    W = cross_matrix(w)
    T[:3, :3] += np.sin(value) * W + (1 - np.cos(value)) * W @ W
    T[:3, 3] = (np.eye(3) - T[:3, :3]) @ np.cross(w, v) + w * (w @ v) * value
    return T


def value_along(screw, T):
    """Return the joint value at which a screw motion is closest to a given transform."""
    v, w = screw[:3], screw[3:]
    if not np.any(w):
        return v @ T[:3, 3]
    R = T[:3, :3]
    sine = w @ [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
    return np.arctan2(sine, np.trace(R) - 1)


def across_loop_joint(c, loop, z):
    """Return the motion of the closing joint between the two ends of the loop."""
    given = {p.symbol: p.value for p in c.mechanism.parameters}
    spelled = lambda M: sp.Matrix(M).applyfunc(c.terms.spelled)  # noqa: E731
    numeric = lambda M: np.array(spelled(M).subs(given).evalf(), dtype=float)  # noqa: E731
    ways = {"a": np.eye(4), "b": np.eye(4)}
    for side, factors in (("a", loop.factors), ("b", loop.factors[::-1])):
        for factor in factors:
            if factor.side == side:
                ways[side] = ways[side] @ exponential(numeric(factor.screw).ravel(), z[factor.name])
    rest = np.linalg.inv(ways["a"]) @ ways["b"] @ np.linalg.inv(numeric(loop.home))
    free = [factor for factor in loop.factors if factor.side == "loop joint"]
    return rest, [(factor.name, numeric(factor.screw).ravel()) for factor in free]


def center(screws):
    """Return the common point p of revolute axes, whose screws (v, omega) satisfy v = p x omega."""
    A = np.vstack([-cross_matrix(screw[3:]) for screw in screws])
    return np.linalg.lstsq(A, np.concatenate([screw[:3] for screw in screws]), rcond=None)[0]


@pytest.mark.parametrize("name", WITHOUT_DELTA)
def test_loop_product_of_exponentials_is_identity(name):
    c, z = case(name), closed(name)
    for loop in c.equations:
        rest, free = across_loop_joint(c, loop, z)
        turning = [screw for _, screw in free if np.any(screw[3:])]
        if len(turning) >= 3:
            # A rotation of a ball joint does not move its center. The distance between the two ball
            # centers is the length of the rod or cylinder.
            begin, end = center(turning[:3]), center(turning[-3:])
            moved = rest[:3, :3] @ end + rest[:3, 3]
            length = np.linalg.norm(end - begin) + z.get(loop.name, 0)
            assert np.linalg.norm(moved - begin) == pytest.approx(length, abs=CLOSED)
            continue
        for name_of_free, screw in free:
            value = z.get(name_of_free)
            if value is None:
                value = value_along(screw, rest)
            rest = np.linalg.inv(exponential(screw, value)) @ rest
        np.testing.assert_allclose(rest, np.eye(4), atol=CLOSED)


# --- derivatives ---


@pytest.mark.parametrize("name", WITHOUT_DELTA)
def test_constraint_jacobian_and_rate_match_automatic_differentiation(name):
    c = case(name)
    n = len(c.names)
    z, zd = ca.SX.sym("z", n), ca.SX.sym("zd", n)
    J = ca.jacobian(c.function("residual")(z, zd), z)
    J_dot = ca.reshape(ca.jtimes(ca.vec(J), z, zd), *J.shape)
    oracle = ca.Function("oracle", [z, zd], [J, J_dot])
    random = np.random.default_rng(4)
    for _ in range(5):
        values = random.uniform(-1.5, 1.5, n)
        rates = random.uniform(-1, 1, n)
        by_name = dict(zip(c.names, values, strict=True))
        wanted, wanted_dot = (np.array(ca.densify(M)) for M in oracle(values, rates))
        got = c.at("J", by_name, rates).reshape(c.shape)
        got_dot = c.at("J_dot", by_name, rates).reshape(c.shape)
        np.testing.assert_allclose(got, wanted, rtol=DERIVATIVES, atol=DERIVATIVES)
        np.testing.assert_allclose(got_dot, wanted_dot, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("name", ["four_bar", "welded", "bennett", "rssr", "rail"])
def test_constraint_jacobian_and_rate_match_finite_differences(name):
    c, z = case(name), closed(name)
    values = np.array([z[n] for n in c.names])
    rates = np.random.default_rng(5).uniform(-1, 1, len(values))
    step = 1e-6

    def differences(function, direction):
        ahead, behind = (
            c.at(function, dict(zip(c.names, values + s * step * direction, strict=True)))
            for s in (1, -1)
        )
        return (ahead - behind) / (2 * step)

    J = np.stack([differences("residual", e) for e in np.eye(len(values))], axis=1)
    np.testing.assert_allclose(c.at("J", z).reshape(c.shape), J, atol=1e-8)
    np.testing.assert_allclose(c.at("J_dot", z, rates), differences("J", rates), atol=1e-8)


# --- loops that raise an error ---


def test_pin_ended_rod_in_spatial_loop_is_rejected():
    whole = mechanisms.rssr()
    pinned = replace(whole, struts=(replace(whole.struts[0], ends="pin"),))
    with pytest.raises(
        DescriptionError, match="'rod': the ends are pins, but the loop is not planar"
    ):
        Case(pinned)


def test_loop_without_any_closed_configuration_is_rejected():
    slides = mechanisms.free("body", BASE, "body")[:2]
    stage = Mechanism(
        "stage",
        (slides[0], replace(slides[1], link="body")),
        ("x",),
        closures=(Closure("hook", "ball", Frame(BASE, at(0, 0, "1/2")), Frame("body")),),
    )
    with pytest.raises(
        DescriptionError,
        match=r"a loop does not close in any configuration; the residual of 'hook' is 0\.5",
    ):
        Case(stage)


def test_a_mechanism_without_loops_has_no_equations():
    serial = Mechanism("serial", (pin("j", BASE, "b"),), ("j",))
    c = Case(serial)
    assert c.equations == ()
    assert jacobian((), c.terms, c.z) == ()
