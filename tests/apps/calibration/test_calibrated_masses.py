"""Calibrated robot files keep the masses.

MuJoCo gives the actuator forces that hold the masses.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import chasles
from chasles.calibration.calibrated_file import mechanism_text, robot_file
from chasles.derive import read_text, write
from chasles.study import PointMass, gravity_forces
from tests.support.compiling import compiled, compiled_quickly
from tests.support.oracles.mujoco_statics import mujoco_loads
from tests.support.skeletons import described_skeleton

BOOM = """\
name = "boom"
convention = "urdf"
actuated = ["lift", "reach"]
units = { length = "mm", angle = "deg" }
gravity = [0.5, 0, -9.81]
base = { xyz = [0, 100, 0], rpy = [0, 0, 30] }
tool = { body = "stick", xyz = [200, 0, 0] }

[[joints]]
name = "boom"
link = "boom"
axis = [0, -1, 0]
limits = [-20, 80]

[[joints]]
name = "stick"
link = "stick"
xyz = [500, 0, 0]
rpy = [0, 20, 0]
axis = [0, -1, 0]

[[cylinders]]
name = "lift"
a = { body = "0", xyz = [150, 0, -150] }
b = { body = "boom", xyz = [250, 0, 20] }
limits = [150, 400]

[[cylinders]]
name = "reach"
a = { body = "boom", xyz = [200, 0, 100] }
b = { body = "stick", xyz = [-50, 0, 120] }
limits = [150, 400]

[[masses]]
link = "boom"
mass = 12
at = [200, 10, 50]

[[masses]]
link = "stick"
mass = "7.5"
at = [80, -20, 30]

[[masses]]
link = "lift_barrel"
mass = 3
at = [0, 0, 60]

[[masses]]
link = "lift_piston"
mass = 2
at = [0, 0, -40]
"""
ARM = """\
name = "arm"
convention = "dh"
units = { length = "mm", angle = "deg" }
gravity = [0.5, 1, -9.81]
base = { xyz = [0, 100, 0], rpy = [0, 20, 30] }
tool = { xyz = [0, 0, 80], rpy = [10, 0, 0] }
parameters = { payload = { value = "2.5", unit = "kg" } }
joints = [
  { type = "fixed", d = 50, link = "stand" },
  { name = "waist", d = 300, alpha = 90, link = "turret", direction = -1 },
  { name = "slide", type = "prismatic", theta = 20, alpha = -80, limits = [0, 500] },
  { name = "elbow", a = 200, d = 40, link = "hand" },
  { type = "fixed", a = 100, alpha = 30, link = "plate" },
]
masses = [
  { link = "stand", mass = 40, at = [10, 0, 0] },
  { link = "turret", mass = 12, at = [-20, 10, 50] },
  { link = "link3", mass = 5, at = [0, 30, -60] },
  { link = "hand", mass = "1.5", at = [0, 0, 20] },
  { link = "plate", mass = "payload", at = [40, -20, 30] },
]
"""
COUPLINGS = "\n[couplings]\nelbow = { motor = '1/3', waist = 1, offset = 20 }\n"
OF_COUPLINGS = ["chain", "actuators", "actuators_D_chain"]
FUNCTIONS = ("configuration",)
RIGHT = 1e-9
"""Largest difference from MuJoCo, relative to the largest force."""


def test_calibrated_mechanism_file_keeps_masses_and_gravity(tmp_path):
    write(read_text(BOOM), tmp_path, functions=FUNCTIONS, parametric=True, languages=("c",))
    with compiled_quickly():
        robot = chasles.load(tmp_path)
        q, load = robot.q_reference, robot.manifest.load
        nominal = np.array([item.value for item in robot.geometry])
        text = mechanism_text(robot, nominal, "built", "test", "")
        masses = [PointMass(m.link, m.mass, m.at) for m in load.masses]
        built = read_text(text)
        own = [PointMass(m.link, float(m.mass), [*map(float, m.at)]) for m in built.load.masses]
        assert np.array(built.load.gravity, float).tolist() == [*load.gravity]
        skeleton = described_skeleton(built)
        for gravity in np.vstack([load.gravity, 9.81 * np.eye(3)]):
            wanted = mujoco_loads(robot, q, masses, np.zeros(6), gravity).actuators
            found = gravity_forces(skeleton.robot, q, own, gravity=gravity)
            assert np.abs(found + wanted).max() <= RIGHT * np.abs(wanted).max(initial=1.0)


@pytest.mark.parametrize("more", ["", COUPLINGS], ids=["arm", "arm with a belt"])
def test_calibrated_arm_file_keeps_masses_and_gravity(tmp_path, more):
    functions = ["fk_p", "jacobian_p", *(OF_COUPLINGS if more else ())]
    robot = compiled(read_text(ARM + more), tmp_path, functions, ["c"])
    p = np.array([item.value for item in robot.geometry])
    built = read_text(robot_file(robot, p, "built", "test"))
    masses, own = (
        [PointMass(m.link, float(m.mass), [*map(float, m.at)]) for m in load.masses]
        for load in (robot.manifest.load, built.load)
    )
    # The stand does not move.
    assert [m.mass for m in own] == [12, 5, 1.5, 2.5]
    assert np.array(built.load.gravity, float).tolist() == [*robot.manifest.load.gravity]
    arm, q = described_skeleton(built).robot, np.array([0.4, 0.3, -0.7])
    for gravity in np.vstack([built.load.gravity, 9.81 * np.eye(3)]).astype(float):
        wanted = gravity_forces(robot, q, masses, gravity=gravity)
        assert_allclose(gravity_forces(arm, q, own, gravity=gravity), wanted, rtol=0, atol=1e-9)
        if not more:
            loads = mujoco_loads(robot, q, masses, np.zeros(6), gravity).actuators
            assert_allclose(wanted, -loads, rtol=0, atol=1e-9)
