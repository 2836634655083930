"""Test the deflection of joints by gravity, including the exported files.

For comparison, Pinocchio computes torques, and CasADi computes derivatives.
"""

from functools import cache

import numpy as np
import pytest
import sympy as sp
from numpy.testing import assert_allclose

from chasles.derive import DescriptionError, read, read_text
from chasles.derive.chain.poe import placement_matrix
from chasles.derive.model.robot import Load, PointMass
from tests.support.convention_robots import sagging_ur5e
from tests.support.parametric import IN_TOOL_FRAME, check, functions_of, nominal

RANDOM = np.random.default_rng(11)
MIXED = """
name = "mixed"
convention = "dh"
gravity = ["0.5", 0, "-9.7"]
[[joints]]
alpha = "1.2"
d = "0.2"
[[joints]]
type = "prismatic"
alpha = "0.3"
theta = "0.4"
link = "slider"
[[joints]]
name = "elbow"
link = "forearm"
a = "-0.4"
alpha = "0.5"
direction = -1
[[joints]]
type = "fixed"
a = "0.1"
link = "plate"
[[joints]]
link = "hand"
alpha = "-1.5"
a = "0.1"
mimic = { joint = "elbow", multiplier = "1/2", offset = "0.1" }
[[masses]]
link = "slider"
mass = 3
[[masses]]
link = "plate"
mass = "2.5"
at = ["0.1", "0.02", "-0.3"]
[[masses]]
link = "hand"
mass = "1.5"
at = ["0.01", "0.03", "0.07"]
"""

LOADED = MIXED.replace('mass = "2.5"', 'mass = "m_plate"')
LOADED += '[parameters]\nm_plate = { value = "2.5", unit = "kg" }\n'
"""The robot file MIXED, in which a parameter replaces one mass."""
UNLOADED = MIXED.partition("[[masses]]")[0]


@cache
def loaded():
    return functions_of(read_text(LOADED), IN_TOOL_FRAME)


def test_sag_derivatives_match_automatic_differentiation_of_pose():
    check(*loaded())


def numbers(placement, values):
    return np.array(sp.N(placement_matrix(placement).xreplace(values)), dtype=float)


def generalized_gravity(robot, q):
    pin = pytest.importorskip("pinocchio", reason="Pinocchio, the oracle, is not installed")
    values = {p.symbol: p.value for p in robot.parameters}
    model, parent, before = pin.Model(), 0, numbers(robot.base, values)
    model.gravity.linear = np.array([float(g) for g in robot.load.gravity])
    for name, joint in zip(robot.link_names, robot.joints, strict=True):
        before = before @ numbers(joint.before, values)
        if joint.kind != "fixed":
            kind = pin.JointModelPZ() if joint.kind == "prismatic" else pin.JointModelRZ()
            parent = model.addJoint(parent, kind, pin.SE3(before), joint.name)
            before = np.eye(4)
        before = before @ numbers(joint.after, values)
        for point in robot.load.masses:
            if point.link == name:
                at = [float(x.xreplace(values)) for x in point.at]
                inertia = pin.Inertia(
                    float(point.mass.xreplace(values)), np.array(at), np.zeros((3, 3))
                )
                model.appendBodyToJoint(parent, inertia, pin.SE3(before))
    moved = np.array([float(v) for v in robot.joint_values([sp.Float(x) for x in q])])
    by_joint = -pin.computeGeneralizedGravity(model, model.createData(), moved)
    return np.array(robot.joint_values_D_q(), dtype=float).T @ by_joint


def test_compliance_columns_match_pinocchio_gravity_torques():
    derived, functions = loaded()
    robot, p = derived.robot, nominal(derived)
    compliant = [k for k, g in enumerate(derived.geometry.parameters) if g.part == "compliance"]
    assert [derived.geometry.parameters[k].joint for k in compliant] == [
        joint.name for joint in robot.coordinates
    ]
    for _ in range(5):
        q = RANDOM.uniform(-2, 2, len(robot.coordinates))
        J = np.array(functions["jacobian_p"](q, p)).reshape(6, -1)
        by_compliance = np.array(functions["identification_jacobian"](q, p)).reshape(6, -1)
        expected = J * generalized_gravity(robot, q)
        assert_allclose(by_compliance[:, compliant], expected, atol=1e-11)


def test_robot_without_gravity_has_no_compliance_parameters(tmp_path):
    path = tmp_path / "ur5e.toml"
    path.write_text(sagging_ur5e())
    sagging = read(path)
    assert [str(mass.mass) for mass in sagging.load.masses] == ["m_upper_arm", "23/10", "m_held"]
    values = {p.name: (p.value, p.kind) for p in sagging.parameters}
    assert values["m_held"] == (sp.Rational(9, 2), "mass")
    rigid, _ = functions_of(read_text(UNLOADED.replace("gravity", "# gravity")), ["fk_p"])
    assert all(g.part != "compliance" for g in rigid.geometry.parameters)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('link = "plate"\nmass', 'link = "arm"\nmass', "one of the links"),
        ("mass = 3\n", "", "kilograms"),
        ("mass = 3\n", "mass = 3\nweight = 2\n", "weight"),
        (
            "[[joints]]\nalpha",
            '[parameters]\nm = { value = 3, unit = "kg" }\n[[joints]]\na = "m / 2"\nalpha',
            "a mass",
        ),
    ],
    ids=["unknown link", "no mass", "unknown key", "mass as length"],
)
def test_invalid_mass_entries_raise_specific_errors(old, new, expected):
    with pytest.raises(DescriptionError, match=expected):
        read_text(MIXED.replace(old, new))


def test_gravity_without_masses_is_rejected():
    with pytest.raises(DescriptionError, match="masses"):
        read_text(UNLOADED)


def test_point_mass_on_unknown_link_is_rejected():
    robot = read_text(MIXED)
    with pytest.raises(DescriptionError, match="nowhere"):
        type(robot)(robot.name, robot.joints, load=Load((PointMass("nowhere", 1, (0, 0, 0)),)))
