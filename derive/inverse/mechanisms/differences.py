"""Geometric difference between a built robot with loops and its design.

The built robot and its design are compared at the same actuated coordinates, with closed loops. A
revolute joint is represented by a line, a ball joint by a point, and a prismatic joint by a
direction. Each body of the built robot is aligned with the same body of the design. Therefore, the
geometric difference depends neither on the body frames nor on the position of a frame along its
joint axis.
"""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...loops.model.numeric_mechanism import NumericMechanism
from ...model.mechanism import Closure, Mechanism, Strut
from ...model.robot import Joint

FloatArray = NDArray[np.float64]
Poses = Mapping[str, FloatArray]


class Feature(NamedTuple):
    """A point and directions that are fixed to a body, in the base frame.

    Attributes:
        point: Position (3,) of the point (meter).
        axes: Directions (k, 3) that are fixed to the body, such as the axis of a joint.
        across: Matrix (3, 3) that projects the differences of points before they are compared.
    """

    point: FloatArray
    axes: FloatArray
    across: FloatArray


def apart(built: Mechanism, design: Mechanism) -> tuple[float, float]:
    """Return the largest differences of two robots: a distance (meter) and an angle (radian).

    The comparison includes rod lengths and zero offsets of actuators.

    Args:
        built: The robot as built.
        design: The design.
    """
    mine, other = NumericMechanism(built), NumericMechanism(design)
    moved = [
        abs(mine.length(a, mine.values) - other.length(b, mine.values))
        for a, b in zip(built.struts, design.struts, strict=True)
    ]
    turned = [0.0]
    here = _configuration(mine, mine.values)
    shared = {c.moves: mine.values[c.moves] for c in built.coordinates}
    there = _configuration(other, other.values | shared)
    size, twists = _size(there), dict[str, FloatArray]()
    for body, own in here.items():
        center = _center(there[body])
        features, others = (_about(center, of) for of in (own, there[body]))
        rows, left = _rows(features, others, size)
        twist: FloatArray = np.asarray(np.linalg.lstsq(rows, -left, rcond=None)[0])
        twists[body] = twist
        rest = (left + rows @ twist).reshape(-1, 3)
        for k, feature in zip(_starts(features), features, strict=True):
            moved.append(float(np.linalg.norm(rest[k])))
            axes = rest[k + 1 : k + 1 + len(feature.axes)]
            turned += [float(np.linalg.norm(axis)) / size for axis in axes]
    for along, is_length in _zeros(mine, twists, size):
        (moved if is_length else turned).append(along)
    return max(moved), max(turned)


def _configuration(
    bodies: NumericMechanism, values: Mapping[str, float]
) -> dict[str, list[Feature]]:
    m = bodies.mechanism
    at = bodies.nearest(values, bodies.unknown, [loop_joint.name for loop_joint in m.loop_joints])
    poses = bodies.poses(at)
    found: dict[str, list[Feature]] = {body: [] for body in poses}
    found[m.base_frame].append(_pose(np.asarray(np.linalg.inv(bodies.matrix(m.base)))))
    found[m.tool_body].append(_pose(poses[m.tool_body] @ bodies.matrix(m.tool)))
    for joint in m.joints:
        feature = _of_joint(joint, poses[joint.parent] @ bodies.matrix(joint.before))
        for body in (joint.parent, joint.link):
            found[body].append(feature)
    for loop_joint in m.loop_joints:
        normal = bodies.normal(loop_joint, poses)
        ends = zip(
            (loop_joint.a.body, loop_joint.b.body), bodies.frames(poses, loop_joint), strict=True
        )
        for body, T in ends:
            found[body].append(_of_loop_joint(loop_joint, T, normal))
    return found


def _of_joint(joint: Joint, T: FloatArray) -> Feature:
    if joint.kind == "fixed":
        return _pose(T)
    n = joint.direction * T[:3, 2]
    is_slide = joint.kind == "prismatic"
    return Feature(T[:3, 3], n[None], np.zeros((3, 3)) if is_slide else np.eye(3) - np.outer(n, n))


def _of_loop_joint(
    loop_joint: Closure | Strut, T: FloatArray, normal: FloatArray | None
) -> Feature:
    if isinstance(loop_joint, Strut) or loop_joint.kind == "ball":
        across = np.eye(3) if normal is None else np.eye(3) - np.outer(normal, normal)
        return Feature(T[:3, 3], np.zeros((0, 3)), across)
    if loop_joint.kind == "weld":
        return _pose(T)
    n = T[:3, 2]
    return Feature(T[:3, 3], n[None], np.eye(3) - np.outer(n, n))


def _pose(T: FloatArray) -> Feature:
    return Feature(T[:3, 3], T[:3, :3].T, np.eye(3))


def _size(configuration: Mapping[str, list[Feature]]) -> float:
    points = np.array([f.point for of in configuration.values() for f in _about(_center(of), of)])
    return float(np.linalg.norm(points - points.mean(0), axis=1).max()) or 1.0


def _center(features: list[Feature]) -> FloatArray:
    feet = _about(np.zeros(3), features)
    return np.asarray(np.mean([foot.point for foot in feet], axis=0))


def _about(center: FloatArray, features: list[Feature]) -> list[Feature]:
    return [f._replace(point=center + f.across @ (f.point - center)) for f in features]


def _starts(features: list[Feature]) -> Iterator[int]:
    first = 0
    for feature in features:
        yield first
        first += 1 + len(feature.axes)


def _rows(
    features: list[Feature], others: list[Feature], size: float
) -> tuple[FloatArray, FloatArray]:
    rows, left = [], []
    for one, other in zip(features, others, strict=True):
        rows.append(np.hstack([one.across, -one.across @ _cross(one.point) / size]))
        left.append(one.across @ (one.point - other.point))
        for n, m in zip(one.axes, other.axes, strict=True):
            rows.append(np.hstack([np.zeros((3, 3)), -_cross(n)]))
            # Opposite directions of a single joint axis are equivalent, but opposite directions of
            # the axes of a pose are different.
            left.append(size * (n - (m if len(one.axes) > 1 or n @ m > 0 else -m)))
    return np.concatenate(rows), np.concatenate(left)


def _zeros(
    bodies: NumericMechanism, twists: Mapping[str, FloatArray], size: float
) -> Iterator[tuple[float, bool]]:
    m, poses = bodies.mechanism, bodies.poses(bodies.values)
    driven = {c.moves for c in m.coordinates}
    for joint in m.joints:
        if joint.name in driven:
            n = (poses[joint.parent] @ bodies.matrix(joint.before))[:3, 2]
            v, w = np.split(twists[joint.link] - twists[joint.parent], 2)
            is_slide = joint.kind == "prismatic"
            yield abs(float(n @ v if is_slide else n @ w / size)), is_slide


def _cross(v: FloatArray) -> FloatArray:
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
