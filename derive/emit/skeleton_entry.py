"""The rigid bodies of a robot as an entry of the manifest, for drawings and viewers."""

from typing import Any

from ..chain.body_shapes import Shape, Skeleton, skeleton
from ..chain.rigid_bodies import Array, BodyJoint, HeldFrames, RigidBodies, Span, TreeBody
from ..derivation import Derivation
from ..model.mechanism import Coordinate


def skeleton_of(derivation: Derivation) -> Skeleton:
    """The bodies of a derived robot, its shapes at the reference of its loops."""
    robot, hybrid, terms = derivation.robot, derivation.hybrid, derivation.terms
    reference = hybrid.at_reference if hybrid else {c.name: 0.0 for c in robot.coordinates}
    actuated = [c.moves if isinstance(c, Coordinate) else c.name for c in robot.coordinates]
    return skeleton(RigidBodies(robot, terms, reference), actuated)


def skeleton_entry(found: Skeleton) -> dict[str, Any]:
    """The bodies as plain data: lengths in metres, angles in radians, poses as their first three rows.

    Args:
        found: The bodies with their shapes.
    """
    closures = [_held(closure) for closure in found.closures]
    return {
        "size": float(f"{found.size:.6g}"),
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


def _joint(joint: BodyJoint) -> dict[str, Any]:
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
