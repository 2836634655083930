"""Robots in a kinematic convention, and their forward kinematics as a matrix product."""

import sympy as sp

from chasles.derive import Joint, Parameter, SerialRobot, derive
from chasles.derive.chain.poe import placement_matrix
from chasles.derive.description.conventions import CONVENTIONS
from chasles.derive.model.placements import translation
from tests.support.derivations import ROBOTS

q = sp.symbols("q1:4", real=True)
BY_NAME = {convention.name: convention for convention in CONVENTIONS}


def joint(convention, name, kind="revolute", **given):
    before, after = BY_NAME[convention](kind, **given)
    return Joint(name, kind, before, after)


def robot(*joints):
    """Return a serial robot in which every symbol of a joint placement is a parameter."""
    placements = [part for joint in joints for part in (*joint.before, *joint.after)]
    values = [v for part in placements for v in getattr(part, "vector", None) or (part.angle,)]
    symbols = {symbol for value in values for symbol in value.free_symbols}
    parameters = [Parameter(str(s), sp.Rational(1, 7)) for s in sorted(symbols, key=str)]
    return SerialRobot("mechanism", tuple(joints), parameters=tuple(parameters))


def product(described, coordinates=q):
    """Return the forward kinematics as a product of elementary matrices."""
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
    (entries,) = derive(described, functions=("fk",)).function("fk").expanded()
    return sp.Matrix(4, 4, entries)


def equal(A, B):
    """Test whether two matrices are equal as polynomials in cosines and sines of single angles."""
    difference = (sp.Matrix(A) - sp.Matrix(B)).applyfunc(lambda x: sp.expand(x, trig=True))
    return difference.applyfunc(lambda x: sp.expand(sp.trigsimp(x))) == sp.zeros(*difference.shape)


def motion_matrix(convention, variable, kind="revolute", **given):
    described = robot(joint(convention, "j", kind, **given))
    return product(described).subs(q[0], variable)


def drawn_chain(convention, random, kinds):
    joints = []
    for k, kind in enumerate(kinds):
        given = {}
        for field in convention.fields:
            drawn = [str(round(x, 3)) for x in random.uniform(-1, 1, 3)]
            given[field.name] = field.value({field.name: drawn if field.is_vector else drawn[0]})
        before, after = convention(kind, **given)
        scalars = convention.scalars(given)
        joints.append(Joint(f"j{k}", kind, before, after, convention=convention, given=scalars))
    tool = translation(*(str(round(x, 3)) for x in random.uniform(-1, 1, 3)))
    return SerialRobot("drawn", tuple(joints), tool=tool)


LINKS = """
[[masses]]
link = "upper_arm"
mass = "m_upper_arm"
at = ["0.2", 0, "0.11"]
[[masses]]
link = "forearm"
mass = "2.3"
at = ["0.2", 0, "0.02"]
[[masses]]
link = "flange"
mass = "m_held"
at = [0, "0.03", "0.08"]
"""
NAMED = """
m_upper_arm = { value = 8.4, unit = "kg", meaning = "upper arm" }
m_held = { value = 4500, unit = "g", meaning = "held body and wrist" }
"""


def sagging_ur5e(gravity='[0, 0, "-9.81"]'):
    """Return the text of a UR5e robot file with gravity and link masses."""
    text = (ROBOTS / "ur5e.toml").read_text().replace("[parameters]", f"[parameters]{NAMED}")
    text = text.replace('convention = "dh"', f'convention = "dh"\ngravity = {gravity}')
    for joint, link in (
        ("shoulder_lift", "upper_arm"),
        ("elbow", "forearm"),
        ("wrist_3", "flange"),
    ):
        text = text.replace(f'name = "{joint}"', f'name = "{joint}"\nlink = "{link}"')
    return text + LINKS
