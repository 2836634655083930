"""The rigid bodies of a robot as an entry of the manifest, for drawings and viewers."""

from typing import Any

from ..chain.body_shapes import Shape, Skeleton
from ..chain.rigid_bodies import Array, CarryingJoint, HeldFrames, Span, TreeBody


def skeleton_entry(found: Skeleton) -> dict[str, Any]:
    """The bodies as plain data in metres and radians; a pose by its first three rows.

    Args:
        found: The bodies with their shapes.
    """
    closures = [_held(closure) for closure in found.closures]
    return {
        "size": float(f"{found.size:.6g}"),
        **({"posture": list(found.posture)} if found.posture else {}),
        "tip": {"body": found.tip, "placement": _pose(found.tip_placement)},
        "bodies": [
            _body(body, shapes) for body, shapes in zip(found.bodies, found.shapes, strict=True)
        ],
        **({"closures": closures} if closures else {}),
    }


def _body(body: TreeBody, shapes: tuple[Shape, ...]) -> dict[str, Any]:
    entry: dict[str, Any] = {"name": body.name}
    if body.joint is not None:
        entry |= {"parent": body.parent, "placement": _pose(body.placement)}
        entry["joint"] = _joint(body.joint)
    if body.span is not None:
        entry["span"] = _span(body.span)
    return {**entry, **({"shapes": [_shape(shape) for shape in shapes]} if shapes else {})}


def _joint(joint: CarryingJoint) -> dict[str, Any]:
    entry: dict[str, Any] = {"name": joint.name, "kind": joint.kind}
    if joint.kind == "fixed":
        return entry
    entry |= {"at": _vector(joint.at), "axis": _vector(joint.axis)}
    entry["coordinate"] = joint.coordinate
    plain = {"ratio": 1.0, "offset": 0.0, "advance": 0.0}
    numbers = {name: getattr(joint, name) for name in plain}
    return entry | {name: value for name, value in numbers.items() if value != plain[name]}


def _span(span: Span) -> dict[str, Any]:
    return {
        "name": span.name,
        "bodies": list(span.bodies),
        "ends": [_vector(end) for end in span.ends],
        "across": _vector(span.across),
        **({"from_end": True} if span.from_end else {}),
    }


def _held(closure: HeldFrames) -> dict[str, Any]:
    return {
        "name": closure.name,
        "kind": closure.kind,
        "bodies": list(closure.bodies),
        "frames": [_pose(frame) for frame in closure.frames],
    }


def _shape(shape: Shape) -> dict[str, Any]:
    entry: dict[str, Any] = {"kind": shape.kind, "name": shape.name}
    entry["points"] = [list(point) for point in shape.points]
    if shape.axis:
        entry["axis"] = list(shape.axis)
    return {**entry, **({"ends": shape.ends} if shape.ends else {})}


def _pose(T: Array) -> list[list[float]]:
    return [_vector(row) for row in T[:3]]


def _vector(values: Array) -> list[float]:
    return [float(value) + 0.0 for value in values]
