"""Calibration: from measurements of a robot's tool to the robot that explains them.

    robot = chasles.load("ur5e", parametric=True)
    q, observation = read_measurements("tracker.csv", robot)
    found = identify(robot, q, observation)
    print(found)

It needs SciPy, `pip install 'chasles[calibration]'`.
"""

from .calibrated_file import robot_file
from .identify import Calibration, identify
from .measurement_table import Measured, read_measurements
from .observations import Observation, Poses, Positions

__all__ = [
    "Calibration",
    "Measured",
    "Observation",
    "Poses",
    "Positions",
    "identify",
    "read_measurements",
    "robot_file",
]
