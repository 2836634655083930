"""Drawings: a robot's rigid bodies, their poses, and pictures of them.

    robot = chasles.load("ur5e")
    bodies = skeleton(robot)
    bodies.poses(q)            # (..., bodies, 4, 4) in the base frame

Pictures need matplotlib, `pip install 'chasles[draw]'`.
"""

from .skeleton import Body, BodyJoint, Shape, Skeleton, Span, skeleton

__all__ = ["Body", "BodyJoint", "Shape", "Skeleton", "Span", "skeleton"]
