"""Replaces the numbers of a description by exact values."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction

import sympy as sp

from ..model.cleaning import CleanedNumber, CleanedUnit
from ..model.convention import Field
from ..model.placements import Placement, Rotation, Vector, rotation, translation
from ..model.robot import Joint, Parameter
from .arrangement import Distances
from .noise import exact_angle, exact_direction, without_noise

_UNITS: dict[str, CleanedUnit] = {"length": "m", "angle": "rad", "direction": "1"}
_UPRIGHT = re.compile(r"\\mathrm\{(\w+)\}")
_ABOUT = {"x": "roll", "y": "pitch", "z": "yaw"}


@dataclass
class ExactNumbers:
    """Finds the exact values for the numbers of a description.

    Attributes:
        tolerance: Length noise (meter).
        points: Exact points, keyed by the noise-free points of the description.
        numbers: The replaced numbers of the description, with their exact values.
    """

    tolerance: Fraction
    points: Mapping[Vector, Vector] = field(default_factory=dict)
    numbers: list[CleanedNumber] = field(default_factory=list)

    def parameter(self, parameter: Parameter) -> Parameter:
        """Return a parameter with an exact value. Ratios stay as they are."""
        if parameter.kind == "ratio":
            return parameter
        at = f"parameter {parameter.name}"
        return replace(parameter, value=self.scalar(at, "", parameter.kind, parameter.value))

    def joint(self, joint: Joint) -> Joint:
        """Return a joint with exact numbers."""
        convention = joint.convention
        if convention is None or not joint.given:
            before = self.placement(joint.name, joint.before)
            return replace(joint, before=before, after=self.placement(joint.name, joint.after))
        values = dict(joint.given)
        known = len(self.numbers)
        given = {
            each.name: self.of_field(joint.name, each, [values[c] for c in each.components])
            if not (each.is_of_motion and joint.kind == "fixed")
            else _grouped(each, [values[c] for c in each.components])
            for each in convention.fields
        }
        if len(self.numbers) == known:
            return joint
        before, after = convention(joint.kind, **given)
        return replace(joint, before=before, after=after, given=convention.scalars(given))

    def of_field(self, at: str, each: Field, values: Sequence[sp.Expr]) -> sp.Expr | Vector:
        """Return the exact value of a convention field."""
        kind = each.kind.removesuffix("s")
        if kind == "direction":
            x, y, z = values
            taken: Iterable[sp.Expr] = exact_direction((x, y, z))
            found = zip(_called(each), values, taken, strict=True)
            return _grouped(each, [self.noted(at, name, kind, *pair) for name, *pair in found])
        if kind == "length" and each.is_vector:
            x, y, z = values
            return self.point(at, (x, y, z), _called(each))
        pairs = zip(_called(each), values, strict=True)
        return _grouped(each, [self.scalar(at, name, kind, value) for name, value in pairs])

    def point(self, at: str, vector: Vector, names: Sequence[str] = "xyz") -> Vector:
        """Return a point without noise in its coordinates.

        If the point is a rotated copy of another point, its coordinates become exact.
        """
        without = self.without_noise(vector)
        x, y, z = (
            self.noted(at, name, "length", found, taken)
            for name, found, taken in zip(
                names, vector, self.points.get(without, without), strict=True
            )
        )
        return x, y, z

    def without_noise(self, vector: Vector) -> Vector:
        """Return a vector of lengths without noise. Symbolic components stay as they are."""
        x, y, z = (
            length if length == 0 or length.free_symbols else without_noise(length, self.tolerance)
            for length in vector
        )
        return x, y, z

    def placement(self, at: str, placement: Placement) -> Placement:
        """Return a placement with exact numbers."""
        cleaned: Placement = ()
        for motion in placement:
            if isinstance(motion, Rotation):
                angle = self.scalar(at, _ABOUT[motion.axis], "angle", motion.angle)
                cleaned += rotation(motion.axis, angle)
            else:
                cleaned += translation(*self.point(at, motion.vector))
        return cleaned

    def length(self, at: str, value: sp.Expr, distances: Distances) -> sp.Expr:
        """Return a strut length without noise.

        A rounded distance is replaced by the exact distance.
        """
        if value == 0 or value.free_symbols:
            return value
        taken = distances.exact(without_noise(value, self.tolerance))
        return self.noted(at, "length", "length", value, taken)

    def scalar(self, at: str, name: str, kind: str, value: sp.Expr) -> sp.Expr:
        """Return an exact length or angle."""
        if value == 0 or value.free_symbols:
            return value
        is_angle = kind == "angle"
        taken = exact_angle(value) if is_angle else without_noise(value, self.tolerance)
        return self.noted(at, name, kind, value, taken)

    def noted(self, at: str, name: str, kind: str, found: sp.Expr, taken: sp.Expr) -> sp.Expr:
        """Return the exact number and record the change."""
        if found != taken:
            self.numbers.append(CleanedNumber(at, name, found, taken, _UNITS[kind]))
        return taken


def _called(each: Field) -> tuple[str, ...]:
    return tuple(_UPRIGHT.sub(r"\1", name) for name in each.headings or each.components)


def _grouped(each: Field, values: Sequence[sp.Expr]) -> sp.Expr | Vector:
    if not each.is_vector:
        return values[0]
    x, y, z = values
    return x, y, z
