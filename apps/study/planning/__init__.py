"""Planning: paths among obstacles, on maps and in the coordinates of robots."""

from .connecting_trees import connecting_trees
from .obstacles import Obstacle, ball, block, capsule, mesh
from .occupancy_map import OccupancyMap, occupancy_map
from .roadmap import Plan, Roadmap, Space, roadmap
from .robot_space import RobotSpace, robot_space
from .shortening import shortened
from .success import Trial, Trials, success

__all__ = [
    "Obstacle",
    "OccupancyMap",
    "Plan",
    "Roadmap",
    "RobotSpace",
    "Space",
    "Trial",
    "Trials",
    "ball",
    "block",
    "capsule",
    "connecting_trees",
    "mesh",
    "occupancy_map",
    "roadmap",
    "robot_space",
    "shortened",
    "success",
]
