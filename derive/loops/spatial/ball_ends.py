"""Ends of ball joints and pin joints that close loops."""

from collections.abc import Sequence
from typing import NamedTuple

import sympy as sp

from ...model.mechanism import Closure, Frame
from ...model.robot import Joint, Translation
from ...terms.generic_point import vanishes
from ...terms.vectors import ZERO, Vector, named
from ..model.body_frames import pose_along
from ..model.planes import Loop
from .struts import Legs


class BallEnd(NamedTuple):
    """One end of a ball joint that closes a loop.

    If a pin joint closes the loop, a point on the pin axis may act as the ball.

    Attributes:
        closure: The closure.
        path: The joints from the common body of the two loop branches to the ball.
        frame: The frame of the ball joint on the body at the end of ``path``.
        target: The frame of the ball joint on the other body that the ball joint connects.
        open: Indices of the unknown joints in ``path``.
    """

    closure: Closure
    path: Sequence[Joint]
    frame: Frame
    target: Frame
    open: tuple[int, ...]

    def last(self, *kinds: str) -> list[int]:
        """Return the indices of the last unknown joints if their types are ``kinds``, or []."""
        places = self.open[-len(kinds) :]
        return [*places] if tuple(self.path[k].kind for k in places) == kinds else []

    def ball(self, legs: Legs, k: int) -> Vector:
        """Return the ball position in the axes of joint k, with joint k at zero.

        The values of the joints after joint k must be known.

        Args:
            legs: The partially solved mechanism.
            k: Index of the joint in ``path``.
        """
        values, placement, after = legs.known.values, self.frame.placement, self.path[k].after
        return pose_along(legs.mechanism, legs.terms, self.path[k + 1 :], placement, values, after)[
            1
        ]


class Fork(NamedTuple):
    """The point at which the axes of two revolute joints intersect.

    Attributes:
        center: A frame with its origin at the intersection and with the axes of the first joint at
            angle zero.
        axes: The axes x, y and z of the first joint at angle zero, expressed in the axes of the
            second joint.
        height: Height of the origin of the second joint above the intersection, along the second
            axis (meter).
    """

    center: Frame
    axes: tuple[Vector, Vector, Vector]
    height: sp.Expr


def ball_ends(legs: Legs, loop: Loop) -> tuple[BallEnd, ...]:
    """Return the two ends of a ball joint that closes a loop.

    The tuple is empty if the loop is closed by a strut or by a joint that is not a ball joint.
    """
    loop_joint = loop.loop_joint
    if not isinstance(loop_joint, Closure) or loop_joint.kind != "ball":
        return ()
    return _ends(legs, loop, loop_joint, ZERO)


def pin_ends(legs: Legs, loop: Loop) -> tuple[tuple[BallEnd, BallEnd], ...]:
    """Return two points on the pin axis for each end of a pin joint that closes a loop.

    The tuple is empty if the loop is closed by a strut or by a joint that is not a pin joint.
    """
    loop_joint = loop.loop_joint
    if not isinstance(loop_joint, Closure) or loop_joint.kind != "pin":
        return ()
    origins, others = (_ends(legs, loop, loop_joint, height) for height in (ZERO, sp.Integer(1)))
    return tuple(zip(origins, others, strict=True))


def _ends(legs: Legs, loop: Loop, loop_joint: Closure, height: sp.Expr) -> tuple[BallEnd, ...]:
    a, b = _up(loop_joint.a, height), _up(loop_joint.b, height)
    ends = ((loop.to_a, a, b), (loop.to_b, b, a))
    return tuple(BallEnd(loop_joint, *end, _open(legs, end[0])) for end in ends)


def _up(frame: Frame, height: sp.Expr) -> Frame:
    """Return a frame moved along its z axis."""
    if not height:
        return frame
    return Frame(frame.body, (*frame.placement, Translation((ZERO, ZERO, height))))


def _open(legs: Legs, path: Sequence[Joint]) -> tuple[int, ...]:
    return tuple(
        k
        for k, joint in enumerate(path)
        if joint.kind != "fixed" and joint.name not in legs.known.values
    )


def fork_of(legs: Legs, path: Sequence[Joint], i: int, k: int) -> Fork | None:
    """Return the unique intersection of the axes of two revolute joints, or None.

    Args:
        legs: The partially solved mechanism.
        path: The joints.
        i: Index of the first revolute joint.
        k: Index of the second revolute joint.
    """
    terms, let = legs.terms, legs.terms.let
    # ``columns`` (the axes of the second joint) and ``origin`` are expressed in the frame of the
    # first joint at angle zero.
    columns, origin = pose_along(
        legs.mechanism, terms, path[i + 1 : k], path[k].before, legs.known.values, path[i].after
    )
    w = columns[2]
    across = let(w[0] ** 2 + w[1] ** 2)
    skew = let(w[0] * origin[1] - w[1] * origin[0])
    if vanishes(terms, across) or not vanishes(terms, skew):
        return None
    height = let(let(w[0] * origin[0] + w[1] * origin[1]) / across)
    up = let(origin[2] - height * w[2])
    center = Frame(path[i].parent, (*path[i].before, Translation((ZERO, ZERO, up))))
    x, y, z = (named(terms, (column[k] for column in columns)) for k in range(3))
    return Fork(center, (x, y, z), height)
