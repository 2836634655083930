"""The view of a mechanism: along the normal of its loops' plane, or from above and aside."""

import math
from collections.abc import Sequence

import numpy as np

from ...chain.posture import from_aside
from ...loops.planar.planes import linkages
from ...model.mechanism import Mechanism
from ...model.tolerances import SAME_POINT, SAME_VIEW
from .poses import Array, Poses


def view(mechanism: Mechanism, poses: Poses) -> tuple[Array, bool]:
    """The picture's directions to the right, up and towards the eye, and whether it is a plane's.

    Loops that are planar, in planes that are parallel in this configuration, are projected on that
    plane, with the base's z axis upright where the plane contains it. So is a robot without loops
    whose joints move in one plane. All others are seen from above and aside.

    Returns:
        The three directions in the base frame as rows (3, 3), and whether the view is planar.
    """
    normal = _common_normal(mechanism, poses)
    if normal is None:
        return from_aside(), False
    up = _across(np.array([0.0, 0.0, 1.0]), normal)
    if up is None:
        return np.eye(3), True
    right = np.cross(up, normal)
    return np.array([right, up, normal]) * _facing(right), True


def _facing(right: Array) -> Array:
    """Signs of the picture's directions that let x, or else y, go to the right."""
    leading = right[0] if abs(right[0]) > SAME_VIEW else right[1]
    return np.array([[-1.0], [1.0], [-1.0]]) if leading < 0 else np.ones((3, 1))


def _common_normal(mechanism: Mechanism, poses: Poses) -> Array | None:
    planar, spatial = linkages(mechanism, poses.terms)
    if spatial:
        return None
    if not planar:
        return _normal_of_tree(mechanism, poses)
    normals = []
    for linkage in planar:
        n = linkage.axes[linkage.root].n.applyfunc(poses.terms.value)
        normals.append(poses.body[linkage.root][:3, :3] @ np.array(n, dtype=float).ravel())
    return normals[0] if _are_parallel(normals) else None


def _normal_of_tree(mechanism: Mechanism, poses: Poses) -> Array | None:
    """The direction of all revolute axes, where no slider leaves their plane."""
    axes: dict[str, list[Array]] = {"revolute": [], "prismatic": [], "helical": []}
    for joint in mechanism.joints:
        axes.setdefault(joint.kind, []).append(poses.fixed[joint.name][:3, 2])
    turning, sliding = axes["revolute"], axes["prismatic"]
    if not turning or axes["helical"] or not _are_parallel(turning):
        return None
    return turning[0] if all(abs(turning[0] @ axis) < SAME_VIEW for axis in sliding) else None


def _are_parallel(directions: Sequence[Array]) -> bool:
    return all(np.linalg.norm(np.cross(directions[0], d)) < SAME_VIEW for d in directions)


def _across(direction: Array, normal: Array) -> Array | None:
    """The unit projection of a direction on a plane; None where the direction is the normal."""
    inside: Array = direction - normal * (normal @ direction)
    length = float(np.linalg.norm(inside))
    return inside / length if length > math.sqrt(SAME_POINT) else None
