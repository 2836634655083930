"""Chains of a few joints in any convention, and their poses as products of plain matrices."""

import sympy as sp

from chasles.derive import Joint, Parameter, Robot, derive
from chasles.derive.chain.poe import placement_matrix
from chasles.derive.description.conventions import CONVENTIONS

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
def robot(*joints):
    """A robot of joints, every symbol in them a parameter."""
    placements = [part for joint in joints for part in (*joint.before, *joint.after)]
    values = [v for part in placements for v in getattr(part, "vector", None) or (part.angle,)]
    symbols = {symbol for value in values for symbol in value.free_symbols}
    parameters = [Parameter(str(s), sp.Rational(1, 7)) for s in sorted(symbols, key=str)]
    return Robot("mechanism", tuple(joints), parameters=tuple(parameters))


def product(described, coordinates=q):
    """Forward kinematics as the plain product of elementary matrices."""
    T = placement_matrix(described.base)
    values = iter(described.joint_values(coordinates[: len(described.coordinates)]))
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
