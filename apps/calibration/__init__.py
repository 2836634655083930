"""Calibration: from measurements of a robot's tool to the robot that explains them.

    robot = chasles.load("ur5e", parametric=True)
    q, observation = read_measurements("tracker.csv", robot)
    found = identify(robot, q, observation)
    print(found)

It needs SciPy, `pip install 'chasles[calibration]'`.
"""

from .calibrated_file import robot_file
from .design import Design, design
from .identify import identify
from .model_choice import MODELS, Chosen, Model, best_model, cross_validated
from .observed.circles import Axis, Circles
from .observed.contacts import Distances, PlaneContacts, SphereContacts
from .observed.measurement_table import Measured, read_measurements
from .observed.observations import Observation, Poses, Positions
from .observed.stations import Stations
from .result import Calibration
from .tool_errors import FirstOrder, MonteCarlo, random_arms, tool_errors

__all__ = [
    "MODELS",
    "Axis",
    "Calibration",
    "Chosen",
    "Circles",
    "Design",
    "Distances",
    "FirstOrder",
    "Measured",
    "Model",
    "MonteCarlo",
    "Observation",
    "PlaneContacts",
    "Poses",
    "Positions",
    "SphereContacts",
    "Stations",
    "best_model",
    "cross_validated",
    "design",
    "identify",
    "random_arms",
    "read_measurements",
    "robot_file",
    "tool_errors",
]
