"""Writes a kinematic loop as a product of exponentials of its joint twists."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import sympy as sp

from ...chain.poe import placement_matrix
from ...model.mechanism import Closure, Frame, Strut
from ...model.robot import Joint
from ...model.values import MAX_OPERATIONS
from ...terms.lie import adjoint, inverse_se3, pose, screw_axis
from ...terms.terms import Terms
from .phasors import ZERO
from .planes import Axes, Linkage, Loop, tidied_entry

SPELLED = 64
"""Maximum number of terms of a matrix entry. A matrix entry with more terms is replaced by a named
term."""
Side = Literal["a", "loop joint", "b"]


@dataclass(frozen=True)
class Factor:
    """The exponential of one joint in the product of exponentials of a loop.

    Attributes:
        name: Name of the joint, swing angle, cylinder or closure freedom in the exponent. The
            degrees of freedom of a closure are not entries of the full configuration z. A ball
            joint has three exponentials, whose names end with ``.x``, ``.y`` and ``.z``.
        screw: Joint twist (v, omega) at zero joint values, shape (6, 1), in the frame of the body
            at which the loop starts. The joint twist has unit speed: omega has norm 1 for a
            revolute joint, and v has norm 1 for a slider.
        side: Position of the joint in the loop: on branch a, on branch b, or as the loop joint. The
            loop runs backwards through branch b, so the exponents of branch b have a minus sign.
    """

    name: str
    screw: sp.ImmutableMatrix
    side: Side


def around(
    terms: Terms, loop: Loop, linkage: Linkage | None
) -> tuple[tuple[Factor, ...], sp.ImmutableMatrix]:
    """Return the exponentials of a loop, and the displacement around the loop at zero joint values.

    Args:
        terms: The shared terms.
        loop: The loop.
        linkage: The planar linkage of the loop, or None for a spatial loop.
    """
    out, T_a = _branch(terms, loop.to_a, "a")
    back, T_b = _branch(terms, loop.to_b, "b")
    loop_joint = loop.loop_joint
    if isinstance(loop_joint, Strut) and loop_joint.ends == "pin" and linkage is not None:
        T_a = _short(terms, T_a * _in_plane(loop_joint.a, linkage.axes[loop_joint.a.body]))
        T_b = _short(terms, T_b * _in_plane(loop_joint.b, linkage.axes[loop_joint.b.body]))
    else:
        T_a = _short(terms, T_a * placement_matrix(loop_joint.a.placement))
        T_b = _short(terms, T_b * placement_matrix(loop_joint.b.placement))
        if linkage is not None and terms.value((T_a[:3, 2]).dot(T_b[:3, 2])) < 0:
            # A pin of a planar loop may connect frames with opposite z axes.
            T_b = T_b * sp.diag(1, -1, -1, 1)
    between, M = _through(loop_joint)
    middle = [
        Factor(name, _screw(terms, adjoint(T_a) * screw), "loop joint") for name, screw in between
    ]
    home = _short(terms, T_a * M * inverse_se3(T_b))
    return (*out, *middle, *back[::-1]), sp.ImmutableMatrix(home)


def _branch(terms: Terms, path: Sequence[Joint], side: Side) -> tuple[list[Factor], sp.Matrix]:
    """Return the joint exponentials of a branch, and its last body's pose at zero joint values."""
    factors: list[Factor] = []
    T = sp.eye(4)
    for joint in path:
        T = _short(terms, T * placement_matrix(joint.before))
        if joint.kind != "fixed":
            pitch = sp.oo if joint.kind == "prismatic" else joint.pitch
            axis = adjoint(T) * _unit(2, pitch) * joint.direction
            factors.append(Factor(joint.name, _screw(terms, axis), side))
        T = _short(terms, T * placement_matrix(joint.after))
    return factors, T


def _short(terms: Terms, matrix: sp.Matrix) -> sp.Matrix:
    """Replace long matrix entries by named terms, and expand the other entries."""
    return matrix.applyfunc(
        lambda entry: (
            terms.let(entry)
            if terms.addends(entry) > SPELLED or _is_measured(terms, entry)
            else tidied_entry(terms, sp.expand(entry))
        )
    )


def _is_measured(terms: Terms, entry: sp.Expr) -> bool:
    """Whether an entry is a constant expression with more than ``MAX_OPERATIONS`` operations."""
    return terms.is_number(entry) and int(sp.count_ops(entry)) > MAX_OPERATIONS


def _through(loop_joint: Closure | Strut) -> tuple[list[tuple[str, sp.Matrix]], sp.Matrix]:
    """Return the joint screws of a closure or strut, and the displacement between its ends."""
    name, turn, slide = loop_joint.name, _unit(2), _unit(2, sp.oo)
    if isinstance(loop_joint, Closure):
        freedoms = {
            "pin": [(name, turn)],
            "slider": [(name, slide)],
            "ball": _ball(name, sp.eye(4)),
            "weld": [],
        }
        return freedoms[loop_joint.kind], sp.eye(4)
    # Pins rotate about z, and a strut lies along x. For a strut with ball ends, the choice of these
    # axes has no effect.
    M = pose(sp.eye(3), sp.Matrix([loop_joint.length, 0, 0]))
    slides = [(name, _unit(0, sp.oo))] if loop_joint.is_cylinder else []
    if loop_joint.ends == "ball":
        begin, end = _ball(f"{name}.begin", sp.eye(4)), _ball(f"{name}.end", M)
        return [*begin, *slides, *end], M
    end = [(f"{name}.end", adjoint(M) * turn)]
    return [(loop_joint.swing_name, turn), *slides, *end], M


def _ball(name: str, T: sp.Matrix) -> list[tuple[str, sp.Matrix]]:
    return [(f"{name}.{axis}", adjoint(T) * _unit(k)) for k, axis in enumerate("xyz")]


def _unit(k: int, pitch: sp.Expr = ZERO) -> sp.Matrix:
    return screw_axis(sp.eye(3)[:, k], sp.zeros(3, 1), pitch)


def _in_plane(frame: Frame, axes: Axes) -> sp.Matrix:
    """Return a pose on a body.

    Its axes are the axes of the loop plane, and its origin is the origin of a body frame.
    """
    return pose(sp.Matrix.hstack(*axes), placement_matrix(frame.placement)[:3, 3])


def _screw(terms: Terms, screw: sp.Matrix) -> sp.ImmutableMatrix:
    return sp.ImmutableMatrix(_short(terms, screw))
