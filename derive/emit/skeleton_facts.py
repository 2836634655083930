"""Writes the rigid bodies of a robot as manifest records, for drawings and viewers."""

from chasles.contract import Body, BodyJoint, ClosureFrames, PlacedTip, Shape, SkeletonFacts, Span

from ..chain import rigid_bodies
from ..chain.body_shapes import Skeleton
from ..chain.rigid_bodies import Array, TreeBody


def skeleton_facts(found: Skeleton) -> SkeletonFacts:
    """Returns the bodies as plain data in metres and radians; poses have three rows.

    Args:
        found: The bodies with their shapes.
    """
    return SkeletonFacts(
        float(f"{found.size:.6g}"),
        PlacedTip(found.tip, _pose(found.tip_placement)),
        tuple(_body(body, shapes) for body, shapes in zip(found.bodies, found.shapes, strict=True)),
        tuple(found.q_drawn),
        tuple(_closure_frames(closure) for closure in found.closures),
    )


def _body(body: TreeBody, shapes: tuple[Shape, ...]) -> Body:
    if body.joint is not None:
        return Body(
            body.name, body.parent, _pose(body.placement), joint=_joint(body.joint), shapes=shapes
        )
    return Body(body.name, span=_span(body.span) if body.span else None, shapes=shapes)


def _joint(joint: rigid_bodies.CarryingJoint) -> BodyJoint:
    if joint.kind == "fixed":
        return BodyJoint(joint.name, joint.kind)
    return BodyJoint(
        joint.name,
        joint.kind,
        _vector(joint.at),
        _vector(joint.axis),
        joint.coordinate,
        joint.ratio,
        joint.offset,
        joint.advance,
    )


def _span(span: rigid_bodies.Span) -> Span:
    begin, end = span.ends
    ends = _vector(begin), _vector(end)
    return Span(span.name, span.bodies, ends, _vector(span.across), span.from_end)


def _closure_frames(closure: rigid_bodies.ClosureFrames) -> ClosureFrames:
    a, b = closure.frames
    return ClosureFrames(closure.name, closure.kind, closure.bodies, (_pose(a), _pose(b)))


def _pose(T: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(_vector(row) for row in T[:3])


def _vector(values: Array) -> tuple[float, ...]:
    return tuple(float(value) + 0.0 for value in values)
