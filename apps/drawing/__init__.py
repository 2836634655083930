"""Drawings of robots: rigid bodies, body poses and technical drawings.

    robot = chasles.load("ur5e")
    bodies = skeleton(robot)
    bodies.poses(q)            # (..., bodies, 4, 4) in the base frame
    chasles.draw(robot, q, file="ur5e.pdf")

Drawings need matplotlib: `pip install 'chasles[draw]'`.
"""

from .animation import animate
from .figure import draw
from .skeleton import Body, BodyJoint, Shape, Skeleton, Span, skeleton

__all__ = ["Body", "BodyJoint", "Shape", "Skeleton", "Span", "animate", "draw", "skeleton"]
