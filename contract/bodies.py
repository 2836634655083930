"""The rigid bodies of a robot, for drawings and viewers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from .records import Place, PoseRows, Vector, one_of

JointKind = Annotated[str, one_of(("revolute", "prismatic", "helical", "fixed"))]
ClosureKind = Annotated[str, one_of(("pin", "slider", "ball", "weld"))]
EndKind = Annotated[str, one_of(("", "pin", "ball"))]
_SHAPE_KINDS = (
    *("link", "plate", "revolute", "helical", "ball", "universal", "pin", "weld"),
    *("guide", "carriage", "sleeve", "ram", "barrel", "piston", "rod"),
)
ShapeKind = Annotated[str, one_of(_SHAPE_KINDS)]


@dataclass(frozen=True, slots=True)
class Shape:
    """A line, a plate or the symbol of a joint on a body.

    Attributes:
        kind: "link" (a line through points) or "plate" (the hull of points); a joint's symbol at
            its one point: "revolute", "helical", "universal", "ball"; "pin", "ball" or "weld" of
            the joint that closes a loop; "guide" (from end to end) and the "carriage" on it, or
            "sleeve" and the "ram" in it (to its end), of a slide; "barrel", "piston" and "rod" of a
            strut, from end to end.
        name: The joint, closure or strut; the body of a link or plate.
        points: The points in the body's frame, (points, 3) [m].
        axis: The direction of the joint's axis in the body's frame; () without one.
        ends: "pin" or "ball" at the ends of a strut, else "".
    """

    kind: ShapeKind
    name: str
    points: tuple[Vector, ...]
    axis: Vector = ()
    ends: EndKind = ""


@dataclass(frozen=True, slots=True)
class BodyJoint:
    """The joint that carries a body; its value is ``ratio * z[coordinate] + offset``.

    Attributes:
        name: Its name.
        kind: "revolute", "prismatic", "helical" or "fixed".
        at: A point of its axis in the body's frame [m].
        axis: The direction of its axis there, of length 1.
        coordinate: Index of its coordinate in the configuration z, of a serial robot in q; -1 of
            a fixed joint.
        ratio: Value of the joint per unit of the coordinate.
        offset: Value of the joint where the coordinate is 0 [rad or m].
        advance: Advance of a helical joint along its axis [m/rad].
    """

    name: str
    kind: JointKind
    at: Vector = (0.0, 0.0, 0.0)
    axis: Vector = (0.0, 0.0, 1.0)
    coordinate: int = -1
    ratio: float = 1.0
    offset: float = 0.0
    advance: float = 0.0


@dataclass(frozen=True, slots=True)
class Span:
    """The two points between which a strut lies: a rod, or one half of a cylinder.

    Attributes:
        name: Name of the strut.
        bodies: The bodies at its beginning and its end, by index.
        ends: These points in the frames of those bodies [m].
        across: A direction in the frame of the first body: the strut's y axis is the part of it at
            right angles to the strut.
        from_end: Whether the body's frame is at the strut's end instead of its beginning.
    """

    name: str
    bodies: tuple[int, int]
    ends: tuple[Vector, Vector]
    across: Vector
    from_end: bool = False


@dataclass(frozen=True, slots=True)
class HeldFrames:
    """A joint that closes a loop: it holds two frames on two bodies together.

    Attributes:
        name: Its name.
        kind: "pin" (their origins and z axes meet), "slider" (it slides along both z axes), "ball"
            (their origins meet) or "weld".
        bodies: The two bodies, by index.
        frames: The first three rows of the frames' poses in those bodies.
    """

    name: str
    kind: ClosureKind
    bodies: tuple[int, int]
    frames: tuple[PoseRows, PoseRows]


@dataclass(frozen=True, slots=True)
class Body:
    """A rigid body.

    Attributes:
        name: Its name.
        parent: Index of the body that carries its joint; None for the ground and for struts.
        placement: The first three rows of its pose in the parent where its joint's value is 0.
        joint: The joint that carries it; None for the ground and for struts.
        span: The points between which a strut lies; None for all other bodies.
        shapes: Its shapes, in its own frame. Bodies that are fixed to each other have theirs on the
            first of them.
    """

    name: str
    parent: int | None = None
    placement: PoseRows = ()
    joint: BodyJoint | None = None
    span: Span | None = None
    shapes: tuple[Shape, ...] = ()


@dataclass(frozen=True, slots=True)
class PlacedTip:
    """The frame of the tip: the body that carries it, and its pose in that body's frame."""

    body: int
    placement: PoseRows


@dataclass(frozen=True, slots=True)
class SkeletonFacts:
    """The bodies: the ground in the base frame first, and a parent before its children.

    Attributes:
        size: The diagonal of the box around the robot at its reference [m].
        tip: The frame of the tip.
        bodies: The bodies.
        posture: The q at which a serial robot is drawn by default; () with loops.
        closures: The joints that close its loops, besides its struts.
    """

    size: float
    tip: PlacedTip
    bodies: tuple[Body, ...]
    posture: tuple[float, ...] = ()
    closures: tuple[HeldFrames, ...] = ()


def check_bodies(found: SkeletonFacts, coordinates: int, place: Place) -> None:
    """Checks what the annotations cannot say: indices, and the joint or span of each body.

    Args:
        found: The bodies.
        coordinates: The number of entries of the configuration, or of q.
        place: The field of the manifest.

    Raises:
        ManifestError: If a condition is violated.
    """
    bodies, at = found.bodies, place["bodies"]
    if not bodies or bodies[0].joint or bodies[0].span:
        at.fail([body.name for body in bodies[:1]], "the ground first")
    for k, body in enumerate(bodies[1:], 1):
        joint, span = body.joint, body.span
        if not joint and not span:
            at[k].fail(body.name, "a joint or a span")
        if joint:
            _check_index(body.parent, k, at[k]["parent"])
            if joint.kind != "fixed":
                _check_index(joint.coordinate, coordinates, at[k]["joint"]["coordinate"])
        if span:
            for end in span.bodies:
                _check_index(end, k, at[k]["span"]["bodies"])
            if any(bodies[end].span for end in span.bodies):
                at[k]["span"].fail(span.bodies, "bodies that are not struts")
    _check_index(found.tip.body, len(bodies), place["tip"]["body"])
    for k, closure in enumerate(found.closures):
        for end in closure.bodies:
            _check_index(end, len(bodies), place["closures"][k]["bodies"])
    if found.posture and len(found.posture) != coordinates:
        place["posture"].fail(found.posture, f"{coordinates} numbers")


def _check_index(index: int | None, bound: int, place: Place) -> None:
    if index is None or not 0 <= index < bound:
        place.fail(index, f"an index below {bound}")
