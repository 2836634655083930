"""The parts of a serial robot's drawing, from its bodies."""

from collections.abc import Sequence

import numpy as np

from ...chain.body_shapes import Shape, Skeleton
from ...chain.rigid_bodies import tree_poses
from .parts import DrawnSlide, Hinge, Scene, Solid
from .poses import Array


def arm(skeleton: Skeleton, coordinates: Sequence[str]) -> tuple[Scene, tuple[Array, Array] | None]:
    """The parts of a serial robot in its posture.

    Args:
        skeleton: Its bodies.
        coordinates: The names of the joints with a coordinate of their own, in the order of q.

    Returns:
        The scene, and the two ends of the line from the ground to the first joint; None where the
        joint itself is on the ground.
    """
    return _Arm(skeleton, coordinates).built()


class _Arm:
    """The parts, one shape at a time; the solid of each body has the body's index."""

    def __init__(self, skeleton: Skeleton, coordinates: Sequence[str]) -> None:
        self.skeleton = skeleton
        self.index = {name: k for k, name in enumerate(coordinates, 1)}
        self.poses = tree_poses(skeleton.bodies, skeleton.posture)
        self.solids = [Solid(is_main=True, is_line=True) for _ in skeleton.bodies]
        self.solids[0] = Solid(is_base=True)
        self.parents = self._parents()
        self.hinges: list[Hinge] = []
        self.slides: list[DrawnSlide] = []

    def built(self) -> tuple[Scene, tuple[Array, Array] | None]:
        foot = self._pedestal()
        for k, shapes in enumerate(self.skeleton.shapes):
            for shape in shapes:
                self._shape(k, shape)
        for k, solid in enumerate(self.solids[1:], 1):
            if not solid.points:
                solid.points.append(self.poses[min(k, len(self.poses) - 1)][:3, 3])
        tool = self.poses[self.skeleton.tip] @ self.skeleton.tip_placement
        scene = Scene(self.solids, self.hinges, self.slides, (), (), tool, np.eye(4))
        return scene, foot

    def _parents(self) -> list[int]:
        """The solid that carries each body's joint: bodies that are fixed to others have none."""
        bodies = self.skeleton.bodies
        root = [0]
        for k, body in enumerate(bodies[1:], 1):
            is_fixed = body.joint is not None and body.joint.kind == "fixed"
            root.append(root[body.parent] if is_fixed else k)
        return [0, *(root[body.parent] for body in bodies[1:])]

    def _pedestal(self) -> tuple[Array, Array] | None:
        """Makes the line from the ground to the first joint a body of its own."""
        lines = [s for s in self.skeleton.shapes[0] if s.kind == "link"]
        if not lines:
            return None
        points = [np.array(point) for point in lines[0].points]
        self.solids.append(Solid(points, is_main=True, is_line=True))
        last = len(self.solids) - 1
        self.parents = [last if k and p == 0 else p for k, p in enumerate(self.parents)]
        return points[0], points[1]

    def _shape(self, k: int, shape: Shape) -> None:
        points = [self._at(k, point) for point in shape.points]
        axis = self.poses[k][:3, :3] @ np.array(shape.axis) if shape.axis else None
        if shape.kind == "link" and k:
            self.solids[k].points.extend(points)
        elif shape.kind in ("revolute", "helical") and axis is not None:
            own = self._coordinate(k)
            sense = np.sign(self._ratio(k)) * axis
            self.hinges.append(
                Hinge(shape.name, "pin", points[0], sense, self.parents[k], k, own, is_main=True)
            )
        elif shape.kind == "carriage" and axis is not None:
            ends = self._shapes(shape.name, "guide")
            self._slide(k, shape, points[0], axis, travel=tuple(ends))
        elif shape.kind == "ram" and axis is not None:
            (start,) = self._shapes(shape.name, "sleeve")
            self.solids[k].points[:0] = [start, points[-1]]
            self._slide(k, shape, points[-1], axis, mouth=start)

    def _slide(
        self,
        k: int,
        shape: Shape,
        at: Array,
        axis: Array,
        travel: tuple[Array, ...] = (),
        mouth: Array | None = None,
    ) -> None:
        start = travel[0] if travel else at if mouth is None else mouth
        self.slides.append(
            DrawnSlide(
                *(shape.name, start, at, axis, self.parents[k], k, mouth, travel),
                coordinate=self._coordinate(k),
                is_main=True,
            )
        )

    def _shapes(self, name: str, kind: str) -> list[Array]:
        """The points of the shape of a kind that a joint has on the body that carries it."""
        return [
            self._at(k, point)
            for k, shapes in enumerate(self.skeleton.shapes)
            for shape in shapes
            if (shape.kind, shape.name) == (kind, name)
            for point in shape.points
        ]

    def _at(self, k: int, point: tuple[float, ...]) -> Array:
        T = self.poses[k]
        found: Array = T[:3, :3] @ np.array(point) + T[:3, 3]
        return found

    def _coordinate(self, k: int) -> int | None:
        """The index, from 1, of the coordinate that moves a body's joint; None where it follows."""
        joint = self.skeleton.bodies[k].joint
        return self.index.get(joint.name) if joint else None

    def _ratio(self, k: int) -> float:
        joint = self.skeleton.bodies[k].joint
        return joint.ratio if joint else 1.0
