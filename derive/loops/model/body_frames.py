"""Pose of a frame on a body for given joint values."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import sympy as sp

from ...chain.forward import Forward, Pose
from ...chain.groups import groups
from ...chain.poe import placement_matrix
from ...model.mechanism import Frame, Mechanism
from ...model.robot import Joint, Placement, SerialRobot, Translation, symbols_of
from ...terms.terms import Terms
from ...terms.vectors import added, combination, dot, named, subtracted


def pose_of(
    mechanism: Mechanism, terms: Terms, frame: Frame, values: Mapping[str, sp.Expr]
) -> Pose:
    """Return the pose of a frame on a body, as axes and origin in the base frame.

    Args:
        mechanism: The description.
        terms: Names of the terms.
        frame: A frame on a body.
        values: Values of the joints from the base to the body (radian or meter).
    """
    path = mechanism.path_to(frame.body)
    return pose_along(mechanism, terms, path, frame.placement, values, mechanism.base)


def pose_along(
    mechanism: Mechanism,
    terms: Terms,
    path: Sequence[Joint],
    tool: Placement,
    values: Mapping[str, sp.Expr],
    base: Placement = (),
) -> Pose:
    """Return the last frame of a joint sequence, as axes and origin in the first frame.

    Args:
        mechanism: The description of the mechanism.
        terms: Names of the terms.
        path: The joints, in order from the base.
        tool: The frame on the last body.
        values: Values of the moving joints by name (radian or meter).
        base: The placement of the first joint's frame.
    """
    moved = tuple(values[joint.name] for joint in path if joint.kind != "fixed")
    parts = tuple((j.kind, j.before, j.after, j.pitch, j.direction) for j in path)
    # Frame poses are cached, because all branches of the loop solution need the same poses.
    return terms.memoize(
        ("pose", base, parts, tool, moved),
        lambda: _pose_along(mechanism, terms, path, tool, moved, base),
    )


def relative_entries(terms: Terms, A: Pose, B: Pose) -> list[sp.Expr]:
    """Return the sixteen entries of the relative pose A^-1 B, row by row."""
    (axes, origin), (others, other) = A, B
    columns = [[dot(terms, axis, column) for axis in axes] for column in others]
    moved = subtracted(terms, other, origin)
    columns.append([dot(terms, axis, moved) for axis in axes])
    rows = [[column[i] for column in columns] for i in range(3)]
    return [entry for row in (*rows, [sp.S.Zero] * 3 + [sp.S.One]) for entry in row]


def _pose_along(
    mechanism: Mechanism,
    terms: Terms,
    path: Sequence[Joint],
    tool: Placement,
    q: Sequence[sp.Expr],
    base: Placement,
) -> Pose:
    if all(joint.kind == "fixed" for joint in path):
        T = placement_matrix(base)
        for joint in path:
            T = T * placement_matrix(joint.before) * placement_matrix(joint.after)
        T = T * placement_matrix(tool)
        x, y, z, p = (named(terms, T[:3, k]) for k in range(4))
        return (x, y, z), p
    if tool and isinstance(tool[-1], Translation) and _has_terms(mechanism, tool[-1]):
        axes, origin = _pose_along(mechanism, terms, path, tool[:-1], q, base)
        offset = combination(terms, named(terms, tool[-1].vector), axes)
        return axes, added(terms, origin, offset)
    robot = SerialRobot(
        mechanism.name,
        tuple(replace(joint, parent="") for joint in path),
        base=base,
        tool=tool,
        parameters=mechanism.parameters,
    )
    return Forward(terms, groups(robot, terms, robot.joint_values(q))).tool_pose()


def _has_terms(mechanism: Mechanism, motion: Translation) -> bool:
    """Whether a translation contains a symbol that is not a parameter of the robot."""
    return not symbols_of((motion,)) <= {parameter.symbol for parameter in mechanism.parameters}
