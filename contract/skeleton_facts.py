"""The rigid bodies of a robot in its manifest, as plain data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NoReturn

from .json_entry import Entry

JOINT_KINDS = ("revolute", "prismatic", "helical", "fixed")
CLOSURE_KINDS = ("pin", "slider", "ball", "weld")
SHAPE_KINDS = (
    *("link", "plate", "revolute", "helical", "ball", "universal", "pin", "weld"),
    *("guide", "carriage", "sleeve", "ram", "barrel", "piston", "rod"),
)
Vector = tuple[float, ...]
_SPACE = 3
_ROW = 4


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

    kind: str
    name: str
    points: tuple[Vector, ...]
    axis: Vector
    ends: str


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
    kind: str
    at: Vector
    axis: Vector
    coordinate: int
    ratio: float
    offset: float
    advance: float


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
    from_end: bool


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
    kind: str
    bodies: tuple[int, int]
    frames: tuple[tuple[Vector, ...], ...]


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
    parent: int | None
    placement: tuple[Vector, ...]
    joint: BodyJoint | None
    span: Span | None
    shapes: tuple[Shape, ...]


@dataclass(frozen=True, slots=True)
class SkeletonFacts:
    """The bodies: the ground in the base frame first, and a parent before its children.

    Attributes:
        bodies: They.
        tip: Index of the body that carries the tip.
        tip_placement: The first three rows of the tip's pose in that body's frame.
        posture: The q at which a serial robot is drawn where nobody chooses one; () with loops.
        size: The diagonal of the box around the robot at its reference [m].
        closures: The joints that close its loops, besides its struts.
    """

    bodies: tuple[Body, ...]
    tip: int
    tip_placement: tuple[Vector, ...]
    posture: tuple[float, ...]
    size: float
    closures: tuple[HeldFrames, ...]


def skeleton_facts(entry: Entry, coordinates: int) -> SkeletonFacts:
    """Reads and checks the bodies.

    Args:
        entry: The field of the manifest.
        coordinates: The number of entries of the configuration, or of q.

    Raises:
        ManifestError: If the field does not have the form that this version reads.
    """
    items = list(entry["bodies"])
    bodies = tuple(_body(item, k, coordinates) for k, item in enumerate(items))
    if not bodies or bodies[0].joint or bodies[0].span:
        entry["bodies"].fail("the ground first")
    for item, body in zip(items, bodies, strict=True):
        if body.span and any(bodies[k].span for k in body.span.bodies if k < len(bodies)):
            item["span"].fail("bodies that are no struts")
    tip = entry["tip"]
    size, posture = entry["size"].number(), entry.get("posture", []).numbers()
    if posture and len(posture) != coordinates:
        entry["posture"].fail(f"{coordinates} numbers")
    tip_body, placement = _below(tip["body"], len(bodies)), _rows(tip["placement"])
    closures = tuple(_held(item, len(bodies)) for item in entry.get("closures", []))
    return SkeletonFacts(bodies, tip_body, placement, posture, size, closures)


def _body(entry: Entry, k: int, coordinates: int) -> Body:
    fields = entry.fields()
    shapes = tuple(_shape(item) for item in entry.get("shapes", []))
    joint = _joint(entry["joint"], coordinates) if "joint" in fields else None
    span = _span(entry["span"], k) if "span" in fields else None
    parent = _below(entry["parent"], k) if joint else None
    placement = _rows(entry["placement"]) if joint else ()
    if (joint or span) is None and k:
        entry.fail("a joint or a span")
    return Body(entry["name"].text(), parent, placement, joint, span, shapes)


def _joint(entry: Entry, coordinates: int) -> BodyJoint:
    kind = entry["kind"].one_of(JOINT_KINDS)
    name = entry["name"].text()
    if kind == "fixed":
        return BodyJoint(name, kind, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), -1, 1.0, 0.0, 0.0)
    return BodyJoint(
        name,
        kind,
        _vector(entry["at"]),
        _vector(entry["axis"]),
        _below(entry["coordinate"], coordinates),
        entry.get("ratio", 1.0).number(),
        entry.get("offset", 0.0).number(),
        entry.get("advance", 0.0).number(),
    )


def _span(entry: Entry, k: int) -> Span:
    bodies = tuple(_below(item, k) for item in entry["bodies"])
    ends = tuple(_vector(item) for item in entry["ends"])
    if len(bodies) != 2 or len(ends) != 2:  # noqa: PLR2004
        entry.fail("two bodies and two ends")
    return Span(
        entry["name"].text(),
        (bodies[0], bodies[1]),
        (ends[0], ends[1]),
        _vector(entry["across"]),
        entry.get("from_end", False).flag(),
    )


def _held(entry: Entry, bodies: int) -> HeldFrames:
    pair = tuple(_below(item, bodies) for item in entry["bodies"])
    frames = tuple(_rows(item) for item in entry["frames"])
    if len(pair) != 2 or len(frames) != 2:  # noqa: PLR2004
        entry.fail("two bodies and two frames")
    kind = entry["kind"].one_of(CLOSURE_KINDS)
    return HeldFrames(entry["name"].text(), kind, (pair[0], pair[1]), frames)


def _shape(entry: Entry) -> Shape:
    return Shape(
        entry["kind"].one_of(SHAPE_KINDS),
        entry["name"].text(),
        tuple(_vector(point) for point in entry["points"]),
        _vector(entry["axis"]) if "axis" in entry.fields() else (),
        entry.get("ends", "").one_of(("", "pin", "ball")),
    )


def _below(entry: Entry, bound: int) -> int:
    index = entry.count()
    return index if index < bound else _refuse(entry, f"an index below {bound}")


def _refuse(entry: Entry, expected: str) -> NoReturn:
    entry.fail(expected)


def _vector(entry: Entry) -> Vector:
    found = entry.numbers()
    return found if len(found) == _SPACE else _refuse(entry, "three numbers")


def _rows(entry: Entry) -> tuple[Vector, ...]:
    rows = tuple(item.numbers() for item in entry)
    is_pose = len(rows) == _SPACE and all(len(row) == _ROW for row in rows)
    return rows if is_pose else _refuse(entry, "three rows of four numbers")
