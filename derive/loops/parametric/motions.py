"""Frames of a mechanism with its geometry as variables, and the screw of every motion on the way.

A body is reached by elementary motions, each by a value v(q, u, p). With S_m the screw of motion m
at unit speed and W a wrench on the body, the power of the wrench is

    W . V = sum_m (W . S_m) dv_m/dt,

so that one sum gives the derivative of a loop's equation, or of the tool's pose, by each variable.

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
    """An elementary motion on the way to a body.

    Attributes:
        value: Its angle or length, in q, u and p.
        axis: Its direction in the base frame.
        point: A point of the axis of a turn in the base frame; None of a slide.
    """

    value: sp.Expr
    axis: Vector
    point: Vector | None


@dataclass(frozen=True)
class Reached:
    """A frame, and the motions that lead to it from the base.

    Attributes:
        pose: Its axes and origin in the base frame.
        motions: The motions with variable values, the base first.
    """

    pose: Pose
    motions: tuple[ElementaryMotion, ...] = ()

    def moved(self, terms: Terms, placement: Placement) -> "Reached":
        """The frame behind more motions."""
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
    """A force along a line and a couple, on a body.

    Attributes:
        force: In the base axes.
        point: A point of the force's line in the base frame.
        couple: In the base axes.
    """

    force: Vector
    point: Vector
    couple: Vector = ORIGIN

    def power(self, terms: Terms, motion: ElementaryMotion) -> sp.Expr:
        """The named power on a body that moves at unit speed of a motion."""
        if motion.point is None:
            return dot(terms, self.force, motion.axis)
        lever = subtracted(terms, self.point, motion.point)
        moment = added(terms, cross(terms, lever, self.force), self.couple)
        return dot(terms, moment, motion.axis)


def bodies(
    mechanism: Mechanism, terms: Terms, base: Placement, steps: Mapping[str, Step]
) -> dict[str, Reached]:
    """Every body's frame by the body's name, the base first.

    Args:
        mechanism: The description.
        terms: Receives the named terms.
        base: Motions from the base frame to the base body.
        steps: Motions from its parent to each other body.
    """
    found = {mechanism.base_frame: BASE.moved(terms, base)}
    for joint in mechanism.joints:
        found[joint.link] = found[joint.parent].moved(terms, steps[joint.link].whole)
    return found


def gradient(
    terms: Terms, powers: Iterable[tuple[sp.Expr, ElementaryMotion]], variables: Sequence[sp.Symbol]
) -> tuple[sp.Expr, ...]:
    """The named sums of powers times dv/dx, for each variable x."""
    sums: dict[sp.Symbol, sp.Expr] = dict.fromkeys(variables, ZERO)
    for power, motion in powers:
        for variable in motion.value.free_symbols & sums.keys():
            sums[variable] += power * terms.let(sp.diff(motion.value, variable))
    return tuple(terms.let(total) for total in sums.values())


def _turned(terms: Terms, basis: Basis, k: int, c: sp.Expr, s: sp.Expr) -> Basis:
    """Axes turned about their k-th one."""
    axes = list(basis)
    i, j = (k + 1) % 3, (k + 2) % 3
    axes[i] = combination(terms, (c, s), (basis[i], basis[j]))
    axes[j] = combination(terms, (c, -s), (basis[j], basis[i]))
    x, y, z = axes
    return x, y, z
