"""Factory calibrations of UR arms agree with DH products and Pinocchio's URDF reader."""

import random
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
import yaml

from chasles.derive import DescriptionError, derive, read
from chasles.derive.description.importers.ur_calibration import apply_calibration
from chasles.derive.terms.casadi_graph import lower
from tests.support.derivations import ROBOTS
from tests.support.tolerances import ORACLE
from tests.support.ur_files import DELTAS, LINKS, conf

MADE, POSES = 2, 3

FORUM = {
    "theta": "-8.20642406610186392e-05, -0.103609197138685979, 0.673631891251821102, "
    "-0.57016974724960845, -4.59636351675856217e-05, 9.74999561134540574e-07",
    "a": "-0.000161187342296687116, 0.00304003843792177708, 0.0916468555721788314, "
    "-9.62964975953143595e-05, -2.97595340762196176e-05, 0",
    "d": "0.000505390894843998906, 11.1984514757821039, -92.5270326908668181, "
    "81.3282683520703529, -0.000212852818740727479, -0.000126145560998547346",
    "alpha": "-0.00032142399895862539, -0.00565024518540147101, -0.00378922621833689211, "
    "-0.00106533274011644252, 0.000999586303470856308, 0",
}
"""Calibration values of a UR controller, published by the robot's owner at
https://forum.universal-robots.com/t/calibrated-kinamatics-info/18921."""
DRIVER = {
    "theta": "-7.290070070824746e-05, -0.01713897289704999, -0.03707159413492756, "
    "0.054279462160583214, 1.488984257025741e-07, 1.551499479707493e-05",
    "a": "4.6311376834935676e-05, -0.00012568315331862312, 0.00186216581161458, "
    "9.918593870679266e-05, 4.215462720453189e-06, 0",
    "d": "0.00065609212979853, 1.4442162376284788, 0.854147723854608, "
    "-2.2989425877563705, -1.573498686836816e-05, 1.9072435590711256e-05",
    "alpha": "0.000211987863869334, -0.0072553625957652995, -0.013483226769541364, "
    "0.0013495820227329425, -0.001263136163679901, 0",
}
"""Calibration values from ur_calibration/test/calibration_test.cpp, a test of Universal Robots' ROS
driver."""
FACTORY = """\
kinematics:
  shoulder: {x: 0, y: 0, z: 0.08920113858084797, roll: 0, pitch: 0, yaw: 1.5413963267648517e-05}
  upper_arm:
    x: 8.28481932000539e-05
    y: 0
    z: 0
    roll: 1.570279330556899
    pitch: 0
    yaw: 9.424823964845411e-05
  forearm:
    x: -0.4251460319702735
    y: 0
    z: 0
    roll: 0.0002772716329760363
    pitch: 0.0007418165917468576
    yaw: 8.206177758992794e-05
  wrist_1:
    x: -0.39231335412023205
    y: 0.0007036784286606588
    z: 0.11004902881674888
    roll: 3.1351985141209435
    pitch: -3.1400954402443415
    yaw: 3.1415185610293745
  wrist_2:
    x: 3.6501405590628345e-05
    y: -0.09472118612480705
    z: 0.0001791428279527357
    roll: 1.5689050644312028
    pitch: 0
    yaw: -1.320607040336194e-05
  wrist_3:
    x: 0.0001539900804308166
    y: 0.08242132708937032
    z: 0.00012632686207930083
    roll: 1.5723290218826846
    pitch: 3.141592653589793
    yaw: -3.14158677108863
  hash: calib_1234
"""
"""The calibration of one UR5 in the format of the ROS driver."""
UR5 = {"d1": "0.089159", "a2": "-0.425", "a3": "-0.39225", "d4": "0.10915", "d5": "0.09465"}
UR5 |= {"d6": "0.0823"}
UR10 = {"d1": "0.1273", "a2": "-0.612", "a3": "-0.5723", "d4": "0.163941", "d5": "0.1157"}
UR10 |= {"d6": "0.0922"}


def arm(sizes=None):
    """Return the UR5e, or an arm of the same structure with other dimensions."""
    robot = read(ROBOTS / "ur5e.toml")
    if sizes is None:
        return robot
    parameters = tuple(replace(p, value=sp.Rational(sizes[p.name])) for p in robot.parameters)
    return replace(robot, parameters=parameters)


def rows(robot, deltas):
    defaults = {parameter.symbol: parameter.value for parameter in robot.parameters}
    own = [[float(dict(j.given)[name].xreplace(defaults)) for name in DELTAS] for j in robot.moving]
    return np.array(own) + np.array([np.fromstring(deltas[name], sep=",") for name in DELTAS]).T


def plain_dh(table, q):
    pose = np.eye(4)
    for (theta, d, a, alpha), value in zip(table, q, strict=True):
        c, s, ca, sa = *(f(theta + value) for f in (np.cos, np.sin)), np.cos(alpha), np.sin(alpha)
        pose = pose @ np.array(
            [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
        )
    return pose


def forward(robot):
    (fk,) = lower(derive(robot, functions=("fk",)).functions, "r")
    return lambda q: np.array(fk(q)).reshape(4, 4)


def random_deltas(dice):
    """Return realistic deviations, with large offsets along the nearly parallel axes 2 to 4."""
    theta, d, a, alpha = ([dice.gauss(0, 2e-4) for _ in LINKS] for _ in DELTAS)
    a[-1] = alpha[-1] = 0.0
    d[1], d[2] = dice.uniform(-20, 20), dice.uniform(-60, 60)
    for k in (1, 2):
        alpha[k] = dice.choice((-1, 1)) * dice.uniform(1e-3, 4e-3) / max(1, abs(d[k]))
        a[k] += dice.gauss(0, 1e-3)
    d[3] = -d[1] - d[2]
    return {
        name: ", ".join(map(repr, values))
        for name, values in zip(DELTAS, (theta, d, a, alpha), strict=True)
    }


def compare(path, robot, deltas, dice):
    path.write_text(conf(deltas))
    measured = apply_calibration(robot, path)
    fk, table = forward(measured), rows(robot, deltas)
    for _ in range(POSES):
        q = [dice.uniform(-np.pi, np.pi) for _ in LINKS]
        far = 1 + np.abs(table[:, 1]).max()
        assert np.abs(fk(q) - plain_dh(table, q)).max() <= ORACLE * far
    return measured


@pytest.mark.parametrize("deltas", [FORUM, DRIVER], ids=["forum", "driver"])
def test_controller_calibration_matches_plain_dh_product(tmp_path, deltas):
    measured = compare(tmp_path / "calibration.conf", arm(UR10), deltas, random.Random(1))
    lengths = [value for j in measured.joints for name, value in j.given if name[:3] == "xyz"]
    assert max(abs(float(value)) for value in lengths) < 0.62
    assert measured.notes == ("calibration: calibration.conf",)
    forearm = dict(measured.joints[2].given)
    assert forearm["xyz_y"] == forearm["xyz_z"] == 0, "the upper arm's x axis points to it"


def test_random_calibration_matches_plain_dh_product(tmp_path):
    dice = random.Random(7)
    for _ in range(MADE):
        compare(tmp_path / "made.conf", arm(), random_deltas(dice), dice)


def urdf_of(kinematics):
    """Return a URDF as generated by ur_description from the link poses of a calibration file."""
    rows = [
        ("base_link-base_link_inertia", "base_link", "inertia", "0 0 0", "0 0 3.141592653589793")
    ]
    parent = "inertia"
    for link in LINKS:
        at = kinematics[link]
        xyz, rpy = (
            " ".join(str(at[c]) for c in cs) for cs in (("x", "y", "z"), ("roll", "pitch", "yaw"))
        )
        rows.append((f"{link}_joint", parent, f"{link}_link", xyz, rpy))
        parent = f"{link}_link"
    rows.append(
        ("wrist_3-flange", parent, "flange", "0 0 0", "0 -1.5707963267948966 -1.5707963267948966")
    )
    rows.append(
        ("flange-tool0", "flange", "tool0", "0 0 0", "1.5707963267948966 0 1.5707963267948966")
    )
    parts = ['<robot name="ur"><link name="base_link"/>']
    for name, parent, child, xyz, rpy in rows:
        kind = "revolute" if name.endswith("_joint") else "fixed"
        parts += [
            f'<link name="{child}"/><joint name="{name}" type="{kind}"><parent link="{parent}"/>',
            f'<child link="{child}"/><origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="0 0 1"/>',
            '<limit lower="-6.3" upper="6.3" effort="1" velocity="1"/></joint>',
        ]
    return "\n".join([*parts, "</robot>"])


def pinocchio_forward(text, base, tip):
    pin = pytest.importorskip("pinocchio", reason="the oracle needs the extra `crosscheck`")
    model = pin.buildModelFromXML(text)
    data = model.createData()

    def pose(q):
        pin.forwardKinematics(model, data, np.array(q))
        pin.updateFramePlacements(model, data)
        from_base = data.oMf[model.getFrameId(base)].inverse()
        return (from_base * data.oMf[model.getFrameId(tip)]).homogeneous

    return pose


@pytest.fixture
def factory(tmp_path):
    path = tmp_path / "my_robot.yaml"
    path.write_text(FACTORY)
    return path


def test_driver_calibration_matches_pinocchio_pose_of_urdf(factory):
    """The pose agrees with Pinocchio in the controller's base frame and in the URDF base frame.

    The robot in the controller's base frame has DH parameters.
    """
    text = urdf_of(yaml.safe_load(FACTORY)["kinematics"])
    nominal = factory.with_name("ur.urdf")
    nominal.write_text(text.replace("0.08920113858084797", "0.089159"))
    dice = random.Random(3)
    for robot, base in (
        (arm(UR5), "inertia"),
        (read(nominal, base="base_link", tip="tool0"), "base_link"),
    ):
        measured = apply_calibration(robot, factory)
        assert "calib_1234" in measured.source
        fk, oracle = forward(measured), pinocchio_forward(text, base, "tool0")
        for _ in range(4 * POSES):
            q = [dice.uniform(-np.pi, np.pi) for _ in LINKS]
            assert np.abs(fk(q) - oracle(q)).max() <= ORACLE
        assert np.abs(forward(robot)(q) - oracle(q)).max() > 1e-6


def test_calibration_keeps_names_limits_and_tool(factory):
    before = arm(UR5)
    after = apply_calibration(before, factory)
    assert [(j.name, j.link, j.limits) for j in after.joints] == [
        (j.name, j.link, j.limits) for j in before.joints
    ]
    assert (after.name, after.tool, after.base_frame) == (before.name, before.tool, "0")


def refused(path, text, robot=None):
    path.write_text(text)
    with pytest.raises(DescriptionError) as caught:
        apply_calibration(robot or arm(UR5), path)
    assert str(caught.value).startswith(str(path))
    return str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("kinematics:", "kinematic:", ":1: kinematics: expected a table kinematics"),
        ("  wrist_1:", "  wrist1:", "kinematics.wrist_1: expected a table with x, y, z, roll"),
        ("x: -0.425", "u: -0.425", ":11: kinematics.forearm.x: expected a number"),
        ("-0.4251460319702735", "far", ":11: kinematics.forearm.x: expected a decimal number"),
        ("-0.4251460319702735", "pi/7", "expected a decimal number, found 'pi/7'"),
        ("-0.4251460319702735", "-0.6127", "expected the calibration of a Universal Robots UR5e"),
        ("kinematics:", "kinematics: [", "expected valid YAML"),
    ],
    ids=["no kinematics", "no joint", "no x", "not a number", "expression", "other arm", "syntax"],
)
def test_invalid_yaml_calibration_raises_specific_error(factory, old, new, words):
    assert words in refused(factory, FACTORY.replace(old, new))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("delta_d", "delta_e", "delta_d: expected delta_d = [six numbers]"),
        ("11.1984514757821039, ", "", ":3: delta_d: expected delta_d = [six numbers]"),
        ("11.1984514757821039", "eleven", ":3: delta_d: expected a decimal number"),
        ("-2.97595340762196176e-05, 0", "-2.97e-05, 0.1", ":4: delta_a: expected 0 for the last"),
        ("11.1984514757821039", "1e30", "a number is out of range: larger than 1e30"),
    ],
    ids=["no delta_d", "five numbers", "not a number", "last delta_a", "too large"],
)
def test_invalid_conf_calibration_raises_specific_error(tmp_path, old, new, words):
    assert words in refused(tmp_path / "c.conf", conf(FORUM).replace(old, new), arm(UR10))


def test_calibration_of_unsuitable_robot_or_file_is_rejected(factory, tmp_path):
    panda = read(ROBOTS / "panda.toml")
    assert (
        "belongs to a UR arm such as ur5 or ur5e; expected six consecutive revolute joints"
        in refused(factory, FACTORY, panda)
    )
    four_bar = read(ROBOTS / "four_bar.toml")
    assert "belongs to a UR arm" in refused(factory, FACTORY, four_bar)
    measured = apply_calibration(arm(UR5), factory)
    assert "expected an arm in DH parameters" in refused(tmp_path / "c.conf", conf(FORUM), measured)
    with pytest.raises(DescriptionError, match="a readable file"):
        apply_calibration(arm(UR5), tmp_path / "none.yaml")
    assert "expected a calibration file, .yaml or .conf" in refused(tmp_path / "c.txt", FACTORY)
