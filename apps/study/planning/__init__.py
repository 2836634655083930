"""Path planning among obstacles, on maps and in the configuration space of robots."""

from .configuration_space import ConfigurationSpace, configuration_space
from .obstacles import Obstacle, box, capsule, mesh, sphere
from .occupancy_map import OccupancyMap, occupancy_map
from .plan import Plan, Space
from .roadmap import Roadmap, prm
from .rrt_connect import rrt_connect
from .shortcut import shortcut
from .success_study import SuccessStudy, Trial, success_study

__all__ = [
    "ConfigurationSpace",
    "Obstacle",
    "OccupancyMap",
    "Plan",
    "Roadmap",
    "Space",
    "SuccessStudy",
    "Trial",
    "box",
    "capsule",
    "configuration_space",
    "mesh",
    "occupancy_map",
    "prm",
    "rrt_connect",
    "shortcut",
    "sphere",
    "success_study",
]
