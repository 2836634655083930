"""Drawings: a robot's rigid bodies, their poses, and pictures of them.

    robot = chasles.load("ur5e")
    bodies = skeleton(robot)
    bodies.poses(q)            # (..., bodies, 4, 4) in the base frame
    chasles.draw(robot, q, file="ur5e.pdf")

Pictures need matplotlib, `pip install 'chasles[draw]'`.
"""

from .animation import animate
from .figure import draw
from .skeleton import Body, BodyJoint, Shape, Skeleton, Span, skeleton

__all__ = ["Body", "BodyJoint", "Shape", "Skeleton", "Span", "animate", "draw", "skeleton"]
