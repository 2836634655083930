"""Selects the direction from which a robot is drawn."""

import math
from collections.abc import Sequence

import numpy as np

from ...chain.body_shapes import Skeleton
from ...chain.drawn_configuration import from_aside
from ...chain.rigid_bodies import Array, placed, tree_poses
from ...loops.model.planes import linkages
from ...model.mechanism import Mechanism
from ...model.tolerances import SAME_POINT, SAME_VIEW
from ...terms.terms import Terms


def view(
    mechanism: Mechanism, terms: Terms, skeleton: Skeleton, values: Sequence[float]
) -> tuple[Array, bool]:
    """Return the view directions of the drawing, and whether the drawing is planar.

    If all planar loops have parallel planes, the robot is viewed along the common normal of these
    planes. If the z axis of the base is parallel to these planes, it points upwards in the drawing.
    Planar robots without loops are viewed along their parallel joint axes. Robots that are not
    planar are viewed obliquely from above.

    Args:
        mechanism: The description.
        terms: The parameters of the mechanism, at default values.
        skeleton: Its bodies.
        values: The configuration z (radian or meter).

    Returns:
        The directions to the right, upwards and towards the eye as rows (3, 3), and whether the
        view is planar.
    """
    poses = tree_poses(skeleton.bodies, values)
    normal = _common_normal(mechanism, terms, skeleton, poses)
    return (from_aside(), False) if normal is None else (_along(normal), True)


def view_of_arm(skeleton: Skeleton) -> tuple[Array, bool]:
    """Return the view directions of the drawing of a serial robot, and whether the robot is planar.

    A planar robot is viewed along its parallel joint axes.
    """
    normal = _normal_of_tree(skeleton, tree_poses(skeleton.bodies, skeleton.q_drawn))
    return (from_aside(), False) if normal is None else (_along(normal), True)


def _along(normal: Array) -> Array:
    up = _across(np.array([0.0, 0.0, 1.0]), normal)
    if up is None:
        return np.eye(3)
    right = np.cross(up, normal)
    return np.array([right, up, normal]) * _facing(right)


def _facing(right: Array) -> Array:
    leading = right[0] if abs(right[0]) > SAME_VIEW else right[1]
    return np.array([[-1.0], [1.0], [-1.0]]) if leading < 0 else np.ones((3, 1))


def _common_normal(
    mechanism: Mechanism, terms: Terms, skeleton: Skeleton, poses: Sequence[Array]
) -> Array | None:
    planar, spatial = linkages(mechanism)
    if spatial:
        return None
    if not planar:
        return _normal_of_tree(skeleton, poses)
    turned = {body.name: T[:3, :3] for body, T in zip(skeleton.bodies, poses, strict=False)} | {
        mechanism.base_frame: placed(terms, mechanism.base)[:3, :3]
    }
    normals = []
    for linkage in planar:
        n = linkage.axes[linkage.root].n.applyfunc(terms.value)
        normals.append(turned[linkage.root] @ np.array(n, dtype=float).ravel())
    return normals[0] if _are_parallel(normals) else None


def _normal_of_tree(skeleton: Skeleton, poses: Sequence[Array]) -> Array | None:
    axes: dict[str, list[Array]] = {"revolute": [], "prismatic": [], "helical": [], "fixed": []}
    for body, T in zip(skeleton.bodies[1:], poses[1:], strict=False):
        assert body.joint is not None
        axes[body.joint.kind].append(T[:3, :3] @ body.joint.axis)
    turning, sliding = axes["revolute"], axes["prismatic"]
    if not turning or axes["helical"] or not _are_parallel(turning):
        return None
    return turning[0] if all(abs(turning[0] @ axis) < SAME_VIEW for axis in sliding) else None


def _are_parallel(directions: Sequence[Array]) -> bool:
    return all(np.linalg.norm(np.cross(directions[0], d)) < SAME_VIEW for d in directions)


def _across(direction: Array, normal: Array) -> Array | None:
    inside: Array = direction - normal * (normal @ direction)
    length = float(np.linalg.norm(inside))
    return inside / length if length > math.sqrt(SAME_POINT) else None
