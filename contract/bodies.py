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
    """A shape that is drawn on a body: a line, a plate or the symbol of a joint.

    Attributes:
        kind: The shape of a body is a "link" (line through the points) or a "plate" (hull of the
            points). The symbol of a joint at one point is "revolute", "helical", "universal" or
            "ball". The symbol of a joint that closes a loop is "pin", "ball" or "weld". A prismatic
            joint is drawn as a "guide" between the ends of its travel and a "carriage", or as a
            "sleeve" and a "ram". A cylinder is drawn as "barrel" and "piston", and a rod as "rod"
            between its end points.
        name: Name of the drawn joint, closure or strut. For a link or plate, the name of the body.
        points: (points, 3) points in the frame of the body [m]. The points of a ram are its two
            ends.
        axis: Direction of the joint axis in the frame of the body, or () for a shape without axis.
        ends: For the shape of a strut, the kind of its end joints: "pin" or "ball". Otherwise "".
    """

    kind: ShapeKind
    name: str
    points: tuple[Vector, ...]
    axis: Vector = ()
    ends: EndKind = ""


@dataclass(frozen=True, slots=True)
class BodyJoint:
    """The joint between a body and its parent body.

    The joint value is ``ratio * z[coordinate] + offset``. For a serial robot, z is q. For a robot
    with loops, z is a configuration in the order of ``robot.configuration_variables``.

    Attributes:
        name: Name of the joint.
        kind: "revolute", "prismatic", "helical" or "fixed".
        at: (3,) a point on the joint axis in the frame of the body [m].
        axis: (3,) unit vector along the joint axis in the frame of the body.
        coordinate: Index of the joint's coordinate in the coordinate vector z, or -1 for a fixed
            joint.
        ratio: Joint displacement per unit of the coordinate.
        offset: Joint value if the coordinate is 0 [rad or m].
        advance: Translation of a helical joint along its axis per rotation angle [m/rad].
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
    """The end points that determine the pose of a strut (rod or cylinder half).

    The z axis of the strut frame points from the first end point to the second.

    Attributes:
        name: Name of the strut.
        bodies: Indices of the two bodies that the strut connects, first end first.
        ends: (2, 3) end points [m], each in the frame of the body at this end.
        across: (3,) a direction in the frame of the first body. Its component normal to the strut
            is the direction of the strut's y axis.
        from_end: Whether the origin of the strut frame is the second end instead of the first end.
    """

    name: str
    bodies: tuple[int, int]
    ends: tuple[Vector, Vector]
    across: Vector
    from_end: bool = False


@dataclass(frozen=True, slots=True)
class ClosureFrames:
    """A joint that closes a loop between two frames on two bodies.

    Attributes:
        name: Name of the closure.
        kind: "pin" (origins and z axes coincide), "slider" (translation along the common z axis),
            "ball" (origins coincide) or "weld".
        bodies: Indices of the two bodies that the closure connects.
        frames: Poses of the two closure frames, each relative to the body to which it is fixed, as
            4 x 4 matrices without the last row.
    """

    name: str
    kind: ClosureKind
    bodies: tuple[int, int]
    frames: tuple[PoseRows, PoseRows]


@dataclass(frozen=True, slots=True)
class Body:
    """A rigid body of a robot.

    A joint or the end points of a strut determine the pose of the body. The ground has neither a
    joint nor end points.

    Attributes:
        name: Name of the body.
        parent: Index of the parent body, which carries the joint that moves this body, or None for
            the ground and for struts.
        placement: (3, 4) pose of the body in the frame of the parent at joint value 0 [m], without
            the last row 0 0 0 1.
        joint: The joint that moves the body, or None for the ground and for struts.
        span: The end points of the strut if the body belongs to a strut, otherwise None.
        shapes: The drawn shapes in the frame of the body. For rigidly connected bodies, the first
            body contains all shapes.
    """

    name: str
    parent: int | None = None
    placement: PoseRows = ()
    joint: BodyJoint | None = None
    span: Span | None = None
    shapes: tuple[Shape, ...] = ()


@dataclass(frozen=True, slots=True)
class PlacedTip:
    """The tip frame, with its body and its pose in that body."""

    body: int
    placement: PoseRows


@dataclass(frozen=True, slots=True)
class SkeletonFacts:
    """The bodies of a robot. The ground is the first body, and parents precede children.

    Attributes:
        size: The diagonal of the robot's bounding box in the reference configuration [m].
        tip: The tip frame of the robot.
        bodies: The bodies.
        q_drawn: The default configuration q for drawings of a serial robot, or () for a robot with
            loops.
        closures: The joints that close loops, in addition to struts.
    """

    size: float
    tip: PlacedTip
    bodies: tuple[Body, ...]
    q_drawn: tuple[float, ...] = ()
    closures: tuple[ClosureFrames, ...] = ()


def check_bodies(found: SkeletonFacts, coordinates: int, place: Place) -> None:
    """Check the indices of bodies and coordinates, and that each body has a joint or end points.

    Args:
        found: The bodies.
        coordinates: The number of entries of z, or of q for a serial robot.
        place: The field of the manifest that contains the bodies.

    Raises:
        ManifestError: An index or a reference between bodies is invalid.
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
    if found.q_drawn and len(found.q_drawn) != coordinates:
        place["q_drawn"].fail(found.q_drawn, f"{coordinates} numbers")


def _check_index(index: int | None, bound: int, place: Place) -> None:
    if index is None or not 0 <= index < bound:
        place.fail(index, f"an index below {bound}")
