"""Frames of bodies in terms of symbolic geometry parameters, and the screws of their motions.

A sequence of elementary motions connects the base to a body. Motion m has the value v_m(q, u, p)
and the unit screw S_m. The power of a wrench W on a body with the twist V is a sum over the
elementary motions between base and body.

    W.V = sum_m (W.S_m) dv_m/dt.

Sums of this form over all elementary motions give the derivatives of a loop equation and of the
tool pose.

Source:
    R. S. Ball, A Treatise on the Theory of Screws, 1900, for the reciprocal product.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from ...chain.forward import Pose
from ...model.mechanism import Mechanism
from ...model.placements import Placement, Rotation
from ...terms.terms import Terms
from ...terms.vectors import (
    IDENTITY,
    ORIGIN,
    ZERO,
    Basis,
    Vector,
    added,
    combination,
    cross,
    dot,
    subtracted,
)
from .mechanism_geometry import Step


@dataclass(frozen=True)
class ElementaryMotion:
    """An elementary rotation or translation between the base and a body.

    Attributes:
        value: The rotation angle or translation length, as a function of actuated coordinates q,
            passive coordinates u and parameters p.
        axis: The direction of the rotation axis or translation, in the base frame.
        point: A point of the rotation axis in the base frame, or None for a translation.
    """

    value: sp.Expr
    axis: Vector
    point: Vector | None


@dataclass(frozen=True)
class Reached:
    """The pose of a frame in the base, and the variable motions between the base and the frame.

    Attributes:
        pose: The axes and the origin of the frame, in the base frame.
        motions: The elementary motions with variable values, ordered from the base to the frame.
    """

    pose: Pose
    motions: tuple[ElementaryMotion, ...] = ()

    def moved(self, terms: Terms, placement: Placement) -> "Reached":
        """Return the pose and motions of another frame, placed relative to this frame."""
        (basis, origin), motions = self.pose, list(self.motions)
        for motion in placement:
            if isinstance(motion, Rotation):
                k = "xyz".index(motion.axis)
                angle = terms.let(motion.angle)
                if motion.angle.free_symbols:
                    motions.append(ElementaryMotion(motion.angle, basis[k], origin))
                basis = _turned(terms, basis, k, *terms.cos_sin(angle))
                continue
            motions += [
                ElementaryMotion(length, axis, None)
                for axis, length in zip(basis, motion.vector, strict=True)
                if length.free_symbols
            ]
            lengths = tuple(terms.let(length) for length in motion.vector)
            origin = added(terms, origin, combination(terms, lengths, basis))
        return Reached((basis, origin), tuple(motions))


BASE = Reached((IDENTITY, ORIGIN))


@dataclass(frozen=True)
class Wrench:
    """A wrench on a body: a force along a line, and a couple.

    Attributes:
        force: The force vector in base axes.
        point: A point of the line of action of the force, in the base frame.
        couple: The couple vector in base axes.
    """

    force: Vector
    point: Vector
    couple: Vector = ORIGIN

    def power(self, terms: Terms, motion: ElementaryMotion) -> sp.Expr:
        """Return the power of the wrench for a motion at unit speed."""
        if motion.point is None:
            return dot(terms, self.force, motion.axis)
        lever = subtracted(terms, self.point, motion.point)
        moment = added(terms, cross(terms, lever, self.force), self.couple)
        return dot(terms, moment, motion.axis)


def bodies(
    mechanism: Mechanism, terms: Terms, base: Placement, steps: Mapping[str, Step]
) -> dict[str, Reached]:
    """Return the pose and variable motions of every body, keyed by body name.

    Args:
        mechanism: The description.
        terms: Receives the terms.
        base: The motions from the base frame to the base body.
        steps: For each body except the base, the motions from its parent to the body.
    """
    found = {mechanism.base_frame: BASE.moved(terms, base)}
    for joint in mechanism.joints:
        found[joint.link] = found[joint.parent].moved(terms, steps[joint.link].transform)
    return found


def gradient(
    terms: Terms, powers: Iterable[tuple[sp.Expr, ElementaryMotion]], variables: Sequence[sp.Symbol]
) -> tuple[sp.Expr, ...]:
    """Return the derivative of a residual with respect to each variable.

    Args:
        terms: Table of named terms.
        powers: One pair for each motion: the derivative of the residual with respect to the value
            of the motion, and the motion itself.
        variables: The variables with respect to which the residual is differentiated.
    """
    sums: dict[sp.Symbol, sp.Expr] = dict.fromkeys(variables, ZERO)
    for power, motion in powers:
        for variable in motion.value.free_symbols & sums.keys():
            sums[variable] += power * terms.let(sp.diff(motion.value, variable))
    return tuple(terms.let(total) for total in sums.values())


def _turned(terms: Terms, basis: Basis, k: int, c: sp.Expr, s: sp.Expr) -> Basis:
    axes = list(basis)
    i, j = (k + 1) % 3, (k + 2) % 3
    axes[i] = combination(terms, (c, s), (basis[i], basis[j]))
    axes[j] = combination(terms, (c, -s), (basis[j], basis[i]))
    x, y, z = axes
    return x, y, z
