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
    """A line, a plate or a joint symbol on a body.

    Attributes:
        kind: "link" (a line through the points) or "plate" (the hull of the points). A shape of
            kind "revolute", "helical", "universal" or "ball" is the symbol of a joint at one point.
            For a joint that closes a loop, the symbol is "pin", "ball" or "weld". A prismatic joint
            is drawn as a "guide" between the ends of its travel and a "carriage", or as a "sleeve"
            and a "ram". The points of a ram are its two ends. A strut is drawn as "barrel" and
            "piston", or as a "rod" between its end points.
        name: Name of the joint, closure or strut. The name of a link or plate is the name of its
            body.
        points: The points in the body's frame, (points, 3) [m].
        axis: The direction of the joint's axis in the body's frame, or () for a shape without axis.
        ends: Kind of the joints at the ends of a strut, "pin" or "ball". Other shapes have the
            value "".
    """

    kind: ShapeKind
    name: str
    points: tuple[Vector, ...]
    axis: Vector = ()
    ends: EndKind = ""


@dataclass(frozen=True, slots=True)
class BodyJoint:
    """The joint between a body and its parent.

    The joint value is ``ratio * z[coordinate] + offset``.

    Attributes:
        name: Name of the joint.
        kind: "revolute", "prismatic", "helical" or "fixed".
        at: A point of the axis in the body's frame [m].
        axis: The unit direction of the axis in the body's frame.
        coordinate: Index of the coordinate in the configuration z, or in q for a serial robot. The
            index of a fixed joint is -1.
        ratio: Value of the joint per unit of the coordinate.
        offset: Joint value if the coordinate is 0 [rad or m].
        advance: Translation of a helical joint along its axis [m/rad].
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
    """The two end points of a strut body.

    Attributes:
        name: Name of the strut.
        bodies: Indices of the bodies at the first and the second end.
        ends: The end points of the strut in the frames of both bodies [m].
        across: A direction in the frame of the first body. The y axis of the strut is the component
            of this direction normal to the strut.
        from_end: Whether the body's frame is at the second end instead of the first end.
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
        frames: Poses of the two closure frames. Each frame is fixed to one of the two bodies. The
            pose of the frame relative to this body is a 4 x 4 matrix without the last row.
    """

    name: str
    kind: ClosureKind
    bodies: tuple[int, int]
    frames: tuple[PoseRows, PoseRows]


@dataclass(frozen=True, slots=True)
class Body:
    """A rigid body.

    Attributes:
        name: Name of the body.
        parent: Index of the body to which this body's joint is attached. None for the ground and
            for bodies of struts.
        placement: The first three rows of the body's pose in the frame of the parent, at joint
            value 0.
        joint: The joint that carries the body, or None for the ground and for bodies of struts.
        span: The end points of a strut body, or None for other bodies.
        shapes: The shapes in the frame of the body. If several bodies are rigidly connected, the
            first body contains all of their shapes.
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
