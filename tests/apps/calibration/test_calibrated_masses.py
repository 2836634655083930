"""Calibrated robot files of mechanisms keep the masses.

MuJoCo gives the actuator forces that hold the masses.
"""

import numpy as np

import chasles
from chasles.calibration.calibrated_file import mechanism_text
from chasles.derive import read_text, write
from chasles.study import PointMass, gravity_forces
from tests.support.compiling import compiled_quickly
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
