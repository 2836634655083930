"""The same mechanism has the same forward kinematics in all link conventions."""

import pytest
import sympy as sp

from chasles.derive import (
    Parameter,
    SerialRobot,
    derive,
    product_of_exponentials,
    read,
    read_text,
)
from chasles.derive.description.conventions import CONVENTIONS
from tests.laws.lie import exp_screw
from tests.support.convention_robots import BY_NAME, derived_fk, equal, joint, product, q, robot
from tests.support.derivations import ROBOTS

a, d, e = sp.symbols("a d e", real=True)
ZERO, ONE, HALF = sp.Integer(0), sp.Integer(1), sp.pi / 2
PARAMETERS = tuple(Parameter(str(s), sp.Rational(k, 7)) for k, s in enumerate((a, d, e), 2))


def fixed(convention, **given):
    return joint(convention, "end", "fixed", **given)


# One mechanism in all link conventions: a revolute joint about z, a parallel revolute joint at
# distance a, a tilted prismatic joint at height d. The tool is offset by e along the axis of the
# prismatic joint.
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


def test_mechanism_is_defined_in_every_convention():
    assert set(MECHANISM) == set(BY_NAME)
    assert len(BY_NAME) == len(CONVENTIONS)


@pytest.mark.parametrize("other", [name for name in MECHANISM if name != "dh"])
def test_conventions_agree_with_dh_on_pose_and_screws(other):
    first, second = robot(*MECHANISM["dh"]), robot(*MECHANISM[other])
    assert equal(product(first), product(second))
    S_first, M_first = product_of_exponentials(first)
    S_second, M_second = product_of_exponentials(second)
    assert equal(S_first, S_second)
    assert equal(M_first, M_second)


@pytest.mark.parametrize("convention", MECHANISM)
def test_derived_fk_equals_product_in_every_convention(convention):
    described = robot(*MECHANISM[convention])
    assert equal(derived_fk(described), product(described))


def test_mixed_conventions_give_the_same_fk():
    mixed = robot(
        MECHANISM["dh"][0],
        joint("s_model", "j2", alpha=HALF, y=d),
        joint("hayati5", "j3", "prismatic", d=e),
    )
    assert equal(derived_fk(mixed), product(robot(*MECHANISM["urdf"])))


def test_derived_fk_equals_product_with_symbolic_tilts():
    alpha, beta = sp.symbols("alpha beta", real=True)
    angles = (Parameter("alpha", HALF / 3, "angle"), Parameter("beta", HALF / 5, "angle"))
    chain = (
        joint("hayati5", "j2", a=a, alpha=alpha, beta=beta, d=d),
        joint("s_model", "j3", alpha=beta, beta=alpha, x=a, y=d, z=e),
    )
    described = SerialRobot("generic", chain, parameters=(*PARAMETERS, *angles))
    difference = derived_fk(described) - product(described)
    numbers = {s: sp.Rational(k, 9) for k, s in enumerate((*q, a, d, e, alpha, beta), 1)}
    assert max(abs(entry.xreplace(numbers).evalf(30)) for entry in difference) < sp.Float("1e-28")


# --- a second mechanism in files: two parallel axes, tilted by 60 degrees ---

SPATIAL = {
    "dh": """
d = "d1"
a = "a1"
alpha = 60
[[joints]]
theta = 90
d = "d2"
a = "a2"
[[joints]]
a = "a3"
""",
    "mdh": """
d = "d1"
[[joints]]
alpha = 60
a = "a1"
theta = 90
d = "d2"
[[joints]]
a = "a2"
[tool]
xyz = ["a3", 0, 0]
""",
    "hayati": """
a = "a1"
alpha = 60
[[joints]]
theta = 90
a = "a2"
[[joints]]
a = "a3"
[base]
xyz = [0, 0, "d1"]
[tool]
xyz = [0, 0, "d2"]
""",
    "mdh5": """
[[joints]]
a = "a1"
c = "d1"
alpha = 60
theta = 90
[[joints]]
a = "a2"
c = "d2"
[tool]
xyz = ["a3", 0, 0]
""",
    "hayati5": """
d = "d1"
[[joints]]
a = "a1"
alpha = 60
d = "d2"
theta = 90
[[joints]]
a = "a2"
[tool]
xyz = ["a3", 0, 0]
""",
    "s_model": """
alpha = 60
x = "a1"
y = "d1*sin(60)"
z = "d1*cos(60)"
[[joints]]
theta = 90
x = "a2"
z = "d2"
[[joints]]
x = "a3"
""",
    "poe": """
axis = [0, 0, 1]
[[joints]]
axis = [0, "-sqrt(3)", 1]
point = ["a1", 0, "d1"]
[[joints]]
axis = [0, "-sin(60)", "1/2"]
point = ["a1", "a2/2 - d2*sin(60)", "d1 + a2*sqrt(3)/2 + d2/2"]
[tool]
xyz = ["a1", "a2/2 + a3/2 - d2*sin(60)", "d1 + (a2 + a3)*sqrt(3)/2 + d2/2"]
rpy = [0, -60, 90]
""",
    "urdf": """
direction = -1
axis = [0, 0, -5]
xyz = [0, 0, "d1"]
[[joints]]
xyz = ["a1", 0, 0]
rpy = [60, 0, 0]
axis = [0, 0, 1]
[[joints]]
xyz = [0, "a2", "d2"]
rpy = [0, 0, 90]
axis = [0, 0, 1]
[tool]
xyz = ["a3", 0, 0]
""",
    "urdf with fixed joints": """
convention = "urdf"
axis = [0, 0, 1]
[[joints]]
convention = "s_model"
type = "fixed"
z = "d1"
[[joints]]
convention = "urdf"
xyz = ["a1", 0, 0]
axis = [0, "-sin(60)", "1/2"]
[[joints]]
convention = "hayati"
type = "fixed"
alpha = 60
[[joints]]
convention = "dh"
type = "fixed"
theta = 90
d = "d2"
a = "a2"
[[joints]]
convention = "poe"
axis = [0, 0, 1]
[[joints]]
convention = "mdh"
type = "fixed"
a = "a3"
""",
}
FILE = """
name = "spatial"
convention = "{convention}"
units = {{ length = "mm", angle = "deg" }}
[parameters]
a1 = 100
a2 = 250
a3 = 180
d1 = 330
d2 = 40
[[joints]]{joints}
"""


def spatial(described, kind):
    """Return a mechanism from a robot file.

    The second revolute joint of the file gets the type `kind`, revolute or prismatic.
    """
    text = FILE.format(convention=described.split()[0], joints=SPATIAL[described])
    numbers = [k for k, one in enumerate(read_text(text).joints) if one.kind == "revolute"]
    before, *joints = text.split("[[joints]]")
    joints[numbers[1]] = f'\ntype = "{kind}"{joints[numbers[1]]}'
    return read_text("[[joints]]".join((before, *joints)))


def test_spatial_mechanism_is_defined_in_every_convention():
    assert set(BY_NAME) <= set(SPATIAL)


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_conventions_agree_on_spatial_mechanism(kind):
    found = {name: spatial(name, kind) for name in SPATIAL}
    products = {name: product(described) for name, described in found.items()}
    models = {
        name: product_of_exponentials(described)
        for name, described in found.items()
        if name != "urdf"
    }  # In the `urdf` model, the second joint rotates in the opposite direction.
    assert len(found) == 9
    for other in found:
        assert equal(products["dh"], products[other]), other
    for other, model in models.items():
        for first, second in zip(models["dh"], model, strict=True):
            assert equal(first, second), other
    S, M = product_of_exponentials(found["urdf"])
    assert equal(S[:, 0], -models["dh"][0][:, 0])
    assert equal(M, models["dh"][1])


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
@pytest.mark.parametrize("described", SPATIAL)
def test_derived_fk_of_spatial_mechanism_equals_product(described, kind):
    found = spatial(described, kind)
    assert len(found.coordinates) == 3
    assert equal(derived_fk(found), product(found))


@pytest.mark.parametrize("described", ["dh", "poe", "urdf with fixed joints"])
def test_product_of_exponentials_of_spatial_mechanism_equals_pose(described):
    found = spatial(described, "revolute")
    S, M = product_of_exponentials(found)
    T = sp.eye(4)
    for k in range(3):
        T = T * exp_screw(S[:, k], q[k])
    assert equal(T * M, product(found))


def test_product_of_exponentials_with_helical_joint_equals_pose():
    text = FILE.format(convention="mdh", joints=SPATIAL["mdh"])
    before, first, second, third = text.split("[[joints]]")
    second = f'\ntype = "helical"\npitch = "a3/7"{second}'
    found = read_text("[[joints]]".join((before, first, second, third)))
    S, M = product_of_exponentials(found)
    T = exp_screw(S[:, 0], q[0]) * exp_screw(S[:, 1], q[1]) * exp_screw(S[:, 2], q[2]) * M
    assert equal(T, product(found))
    assert equal(derived_fk(found), product(found))
    pitch = S[:3, 1].dot(S[3:, 1])
    assert sp.expand(pitch) == sp.Symbol("a3", real=True) / 7


def test_screw_axis_at_zero_matches_hand_calculation():
    """The second axis passes through (a1, 0, d1).

    The direction of this axis is (0, -sin(60 deg), cos(60 deg)).
    """
    S, _ = product_of_exponentials(spatial("dh", "revolute"))
    a1, d1 = sp.symbols("a1 d1", real=True)
    direction = sp.Matrix([0, -sp.sqrt(3) / 2, sp.Rational(1, 2)])
    moment = sp.Matrix([a1, 0, d1]).cross(direction)
    assert equal(S[:, 1], sp.Matrix([*moment, *direction]))


def test_conventions_agree_with_symbolic_tilt_parameter():
    found = {}
    for name, joints in SPATIAL.items():
        if name in BY_NAME and name != "poe":
            text = FILE.format(convention=name, joints=joints).replace("(60)", "(tilt)")
            tilted = text.replace("= 60", '= "tilt"').replace("[60,", '["tilt",')
            found[name] = read_text(tilted.replace("d1 = 330", "d1 = 330\ntilt = 60"))
    products = {name: product(described) for name, described in found.items()}
    assert len(found) == 7
    for name, described in found.items():
        assert equal(products["dh"], products[name]), name
        assert equal(derived_fk(described), products[name]), name


@pytest.mark.parametrize("name", ["puma560", "lynxmotion", "scara", "photo_robot"])
def test_derived_fk_of_shipped_robots_equals_product(name):
    """The expected pose is the product of elementary matrices at exact rational values."""
    described = read(ROBOTS / f"{name}.toml")
    (entries,) = derive(described, functions=["fk"]).function("fk").expanded()
    joints = sp.symbols(f"q1:{len(described.coordinates) + 1}", real=True)
    symbols = [*joints, *(p.symbol for p in described.parameters)]
    expected = product(described, joints)
    compared = 0
    for shift in (1, 5):
        numbers = {s: sp.Rational(3 * k + shift, 7) for k, s in enumerate(symbols)}
        for entry, plain in zip(entries, expected, strict=True):
            difference = entry.xreplace(numbers).evalf(30) - plain.xreplace(numbers).evalf(30)
            assert abs(difference) < sp.Float("1e-26")
            compared += 1
    assert compared == 2 * 16
