"""Every convention against every other on one mechanism, and against the matrices of its source."""

from itertools import combinations

import pytest
import sympy as sp

from chasles.derive import Joint, Parameter, Robot, derive, to_poe
from chasles.derive.conventions import CONVENTIONS
from chasles.derive.poe import placement_matrix

q = sp.symbols("q1:4", real=True)
a, d, e = sp.symbols("a d e", real=True)
ZERO, ONE, HALF = sp.Integer(0), sp.Integer(1), sp.pi / 2
PARAMETERS = tuple(Parameter(str(s), sp.Rational(k, 7)) for k, s in enumerate((a, d, e), 2))


def joint(convention, name, kind="revolute", **given):
    fields = CONVENTIONS[convention].fields
    vectors = {"lengths", "angles", "direction"}
    zero = {f: (ZERO, ZERO, ZERO) if what in vectors else ZERO for f, what in fields.items()}
    if "axis" in zero and "axis" not in given:
        given["axis"] = (ZERO, ZERO, ONE)
    before, after = CONVENTIONS[convention].place(kind, **{**zero, **given})
    return Joint(name, kind, before, after)


def fixed(convention, **given):
    return joint(convention, "end", "fixed", **given)


# One mechanism in every convention: turn about z; at distance a, turn about a parallel axis; tilted
# by a right angle and d along, a slider; the tool e further along the slider.
MECHANISM = {
    "dh": (
        joint("dh", "j1", a=a),
        joint("dh", "j2", d=d, alpha=HALF),
        joint("dh", "j3", "prismatic", d=e),
    ),
    "mdh": (
        joint("mdh", "j1"),
        joint("mdh", "j2", a=a, d=d),
        joint("mdh", "j3", "prismatic", alpha=HALF, d=e),
    ),
    "hayati": (
        joint("hayati", "j1", a=a),
        joint("hayati", "j2", alpha=HALF),
        joint("hayati", "j3", "prismatic"),
        fixed("mdh5", b=d, c=e),
    ),
    "mdh5": (
        joint("mdh5", "j1"),
        joint("mdh5", "j2", a=a, c=d),
        joint("mdh5", "j3", "prismatic", alpha=HALF),
        fixed("mdh5", c=e),
    ),
    "hayati5": (
        joint("hayati5", "j1"),
        joint("hayati5", "j2", a=a, d=d),
        joint("hayati5", "j3", "prismatic", alpha=HALF, d=e),
    ),
    "s_model": (
        joint("s_model", "j1", x=a),
        joint("s_model", "j2", alpha=HALF, y=d),
        joint("s_model", "j3", "prismatic", z=e),
    ),
    "poe": (
        joint("poe", "j1"),
        joint("poe", "j2", point=(a, ZERO, ZERO)),
        joint("poe", "j3", "prismatic", axis=(ZERO, -ONE, ZERO)),
        fixed("urdf", xyz=(a, -e, d), rpy=(HALF, ZERO, ZERO)),
    ),
    "urdf": (
        joint("urdf", "j1", axis=(ZERO, ZERO, ONE)),
        joint("urdf", "j2", xyz=(a, ZERO, d)),
        joint("urdf", "j3", "prismatic", rpy=(HALF, ZERO, ZERO)),
        fixed("urdf", xyz=(ZERO, ZERO, e)),
    ),
}


def robot(*joints):
    return Robot("mechanism", tuple(joints), parameters=PARAMETERS)


def product(described):
    """Forward kinematics as the plain product of elementary matrices."""
    T = placement_matrix(described.base)
    values = iter(described.joint_values(q[: len(described.coordinates)]))
    for part in described.joints:
        T = T * placement_matrix(part.before)
        if part.kind != "fixed":
            value = next(values)
            motion = sp.eye(4)
            if part.kind != "prismatic":
                motion[:2, :2] = [[sp.cos(value), -sp.sin(value)], [sp.sin(value), sp.cos(value)]]
            motion[2, 3] = value if part.kind == "prismatic" else part.pitch * value
            T = T * motion
        T = T * placement_matrix(part.after)
    return T * placement_matrix(described.tool)


def derived_fk(described):
    (entries,) = derive(described, ("fk",)).function("fk").expanded()
    return sp.Matrix(4, 4, entries)


def equal(A, B):
    """Equality as polynomials in cosines and sines of the separate angles."""
    difference = (sp.Matrix(A) - sp.Matrix(B)).applyfunc(lambda x: sp.expand(x, trig=True))
    return difference.applyfunc(lambda x: sp.expand(sp.trigsimp(x))) == sp.zeros(*difference.shape)


def test_all_conventions_are_here():
    assert set(MECHANISM) == set(CONVENTIONS)


@pytest.mark.parametrize(("one", "other"), list(combinations(MECHANISM, 2)))
def test_every_convention_against_every_other(one, other):
    first, second = robot(*MECHANISM[one]), robot(*MECHANISM[other])
    assert equal(product(first), product(second))
    S_first, M_first = to_poe(first)
    S_second, M_second = to_poe(second)
    assert equal(S_first, S_second)
    assert equal(M_first, M_second)


@pytest.mark.parametrize("convention", MECHANISM)
def test_the_derived_equations_are_the_plain_product(convention):
    described = robot(*MECHANISM[convention])
    assert equal(derived_fk(described), product(described))


def test_conventions_mixed_in_one_chain():
    mixed = robot(
        MECHANISM["dh"][0],
        joint("s_model", "j2", alpha=HALF, y=d),
        joint("hayati5", "j3", "prismatic", d=e),
    )
    assert equal(derived_fk(mixed), product(robot(*MECHANISM["urdf"])))


def test_generic_parameters_of_every_convention():
    """Tilts that are symbols: no structure to find, and still the same product."""
    alpha, beta = sp.symbols("alpha beta", real=True)
    angles = (Parameter("alpha", HALF / 3, "angle"), Parameter("beta", HALF / 5, "angle"))
    chain = (
        joint("dh", "j1", a=a, alpha=alpha, d=d),
        joint("hayati5", "j2", a=a, alpha=alpha, beta=beta, d=d),
        joint("s_model", "j3", alpha=beta, beta=alpha, x=a, y=d, z=e),
    )
    described = Robot("generic", chain, parameters=(*PARAMETERS, *angles))
    difference = derived_fk(described) - product(described)
    numbers = {s: sp.Rational(k, 9) for k, s in enumerate((*q, a, d, e, alpha, beta), 1)}
    assert max(abs(entry.xreplace(numbers).evalf(30)) for entry in difference) < sp.Float("1e-28")


# --- the sources' own matrices ---


def motion_matrix(convention, variable, kind="revolute", **given):
    described = robot(joint(convention, "j", kind, **given))
    return product(described).subs(q[0], variable)


def test_well_manipulator_6():
    b, c, alpha, theta = sp.symbols("b c alpha theta", real=True)
    ca, sa, ct, st = sp.cos(alpha), sp.sin(alpha), sp.cos(theta), sp.sin(theta)
    printed = [[ct, -st, 0, a], [ca * st, ca * ct, -sa, b], [sa * st, sa * ct, ca, c], [0, 0, 0, 1]]
    assert equal(motion_matrix("mdh5", theta, a=a, b=b, c=c, alpha=alpha), sp.Matrix(printed))


def test_well_manipulator_8():
    alpha, beta, theta = sp.symbols("alpha beta theta", real=True)
    Rx, Ry, Rz = (sp.rot_ccw_axis1, sp.rot_ccw_axis2, sp.rot_ccw_axis3)
    R = Rx(alpha) * Ry(beta)
    p = R * sp.Matrix([0, 0, d]) + sp.Matrix([a, 0, 0])
    printed = sp.eye(4)
    printed[:3, :3], printed[:3, 3] = R * Rz(theta), p
    found = motion_matrix("hayati5", theta, a=a, alpha=alpha, beta=beta, d=d)
    assert equal(found, printed)


def test_photographic_robot_1():
    alpha, theta, r, length = sp.symbols("alpha theta r l", real=True)
    ca, sa, ct, st = sp.cos(alpha), sp.sin(alpha), sp.cos(theta), sp.sin(theta)
    printed = [
        [ct, -ca * st, st * sa, length * ct],
        [st, ca * ct, -ct * sa, length * st],
        [0, sa, ca, r],
        [0, 0, 0, 1],
    ]
    assert equal(motion_matrix("dh", theta, a=length, alpha=alpha, d=r), sp.Matrix(printed))


def test_photographic_robot_2():
    alpha, beta, theta, x, y, z = sp.symbols("alpha beta theta x y z", real=True)
    ca, sa, cb, sb = sp.cos(alpha), sp.sin(alpha), sp.cos(beta), sp.sin(beta)
    ct, st = sp.cos(theta), sp.sin(theta)
    printed = [
        [
            cb * ct,
            ct * sa * sb - ca * st,
            sa * st + ca * sb * ct,
            z * (sa * st + ca * sb * ct) - y * (ca * st - ct * sa * sb) + x * cb * ct,
        ],
        [
            cb * st,
            st * sa * sb + ca * ct,
            -sa * ct + ca * sb * st,
            # The paper prints cos(alpha) cos(beta) where the product gives cos(alpha) cos(theta).
            -z * (sa * ct - ca * sb * st) + y * (ca * ct + st * sa * sb) + x * cb * st,
        ],
        [-sb, cb * sa, ca * cb, z * ca * cb - x * sb + y * cb * sa],
        [0, 0, 0, 1],
    ]
    given = {"alpha": alpha, "beta": beta, "x": x, "y": y, "z": z}
    assert equal(motion_matrix("s_model", theta, **given), sp.Matrix(printed))


def test_craig():
    alpha, theta = sp.symbols("alpha theta", real=True)
    ca, sa, ct, st = sp.cos(alpha), sp.sin(alpha), sp.cos(theta), sp.sin(theta)
    printed = [
        [ct, -st, 0, a],
        [st * ca, ct * ca, -sa, -sa * d],
        [st * sa, ct * sa, ca, ca * d],
        [0, 0, 0, 1],
    ]
    assert equal(motion_matrix("mdh", theta, a=a, alpha=alpha, d=d), sp.Matrix(printed))


def test_hayati():
    alpha, beta, theta = sp.symbols("alpha beta theta", real=True)
    Rx, Ry, Rz = (sp.rot_ccw_axis1, sp.rot_ccw_axis2, sp.rot_ccw_axis3)
    printed = sp.eye(4)
    printed[:3, :3] = Rz(theta) * Rx(alpha) * Ry(beta)
    printed[:3, 3] = Rz(theta) * sp.Matrix([a, 0, 0])
    assert equal(motion_matrix("hayati", theta, a=a, alpha=alpha, beta=beta), printed)
