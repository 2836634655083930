"""Ends of a closure by a ball or a pin: the joints that move each end, and common points."""

from collections.abc import Sequence
from typing import NamedTuple

import sympy as sp

from ...model.mechanism import Closure, Frame
from ...model.robot import Joint, Translation
from ...terms.vectors import ZERO, Vector, named
from ..planar.planes import Loop
from ..planar.reference import vanishes
from .body_frames import pose_along
from .struts import Legs


class BallEnd(NamedTuple):
    """One end of a closure by a ball, or by a pin, whose points are balls.

    Attributes:
        closure: The closure.
        way: The joints from the loop's meeting body to the end.
        frame: The ball's frame on the end's body.
        target: The ball's frame on the other body.
        open: Places in the way of the joints whose values are not known.
    """

    closure: Closure
    way: Sequence[Joint]
    frame: Frame
    target: Frame
    open: tuple[int, ...]

    def last(self, *kinds: str) -> list[int]:
        """Places of the last unknown joints, where they are of these kinds, else none."""
        places = self.open[-len(kinds) :]
        return [*places] if tuple(self.way[k].kind for k in places) == kinds else []

    def ball(self, legs: Legs, k: int) -> Vector:
        """The ball in the axes of a joint, at zero, after which all values are known.

        Args:
            legs: The mechanism, as far as it is solved.
            k: Place of the joint in the way.
        """
        values, placement, after = legs.known.values, self.frame.placement, self.way[k].after
        return pose_along(legs.mechanism, legs.terms, self.way[k + 1 :], placement, values, after)[
            1
        ]


class Fork(NamedTuple):
    """The point where the axes of two revolute joints meet.

    Attributes:
        centre: A frame at the point, with the axes of the first joint at zero.
        axes: The first joint's x, y and z axes where it is at zero, in the second's axes.
        height: Of the second joint's origin above the point, along its axis (metre).
    """

    centre: Frame
    axes: tuple[Vector, Vector, Vector]
    height: sp.Expr


def ball_ends(legs: Legs, loop: Loop) -> tuple[BallEnd, ...]:
    """Both ends of a loop that a ball closes; none of other loops."""
    closer = loop.closer
    if not isinstance(closer, Closure) or closer.kind != "ball":
        return ()
    return _ends(legs, loop, closer, ZERO)


def pin_ends(legs: Legs, loop: Loop) -> tuple[tuple[BallEnd, BallEnd], ...]:
    """Both ends of a loop that a pin closes, each by two points of its axis; none of others."""
    closer = loop.closer
    if not isinstance(closer, Closure) or closer.kind != "pin":
        return ()
    origins, others = (_ends(legs, loop, closer, height) for height in (ZERO, sp.Integer(1)))
    return tuple(zip(origins, others, strict=True))


def _ends(legs: Legs, loop: Loop, closer: Closure, height: sp.Expr) -> tuple[BallEnd, ...]:
    a, b = _up(closer.a, height), _up(closer.b, height)
    ends = ((loop.to_a, a, b), (loop.to_b, b, a))
    return tuple(BallEnd(closer, *end, _open(legs, end[0])) for end in ends)


def _up(frame: Frame, height: sp.Expr) -> Frame:
    """A frame moved along its z axis."""
    if not height:
        return frame
    return Frame(frame.body, (*frame.placement, Translation((ZERO, ZERO, height))))


def _open(legs: Legs, way: Sequence[Joint]) -> tuple[int, ...]:
    return tuple(
        k
        for k, joint in enumerate(way)
        if joint.kind != "fixed" and joint.name not in legs.known.values
    )


def fork_of(legs: Legs, way: Sequence[Joint], i: int, k: int) -> Fork | None:
    """Where the axes of two revolute joints meet; None where they do not.

    Args:
        legs: The mechanism, as far as it is solved.
        way: The joints.
        i: Place of the first revolute joint.
        k: Place of the second; the joints in between are known.
    """
    terms, let = legs.terms, legs.terms.let
    # From each joint's axes, at zero, to what follows.
    columns, origin = pose_along(
        legs.mechanism, terms, way[i + 1 : k], way[k].before, legs.known.values, way[i].after
    )
    w = columns[2]
    across = let(w[0] ** 2 + w[1] ** 2)
    skew = let(w[0] * origin[1] - w[1] * origin[0])
    if vanishes(terms, across) or not vanishes(terms, skew):
        return None
    height = let(let(w[0] * origin[0] + w[1] * origin[1]) / across)
    up = let(origin[2] - height * w[2])
    centre = Frame(way[i].parent, (*way[i].before, Translation((ZERO, ZERO, up))))
    x, y, z = (named(terms, (column[k] for column in columns)) for k in range(3))
    return Fork(centre, (x, y, z), height)
