"""Robots as files describe them become robots in exact numbers; every changed number is listed.

Each number is judged by itself, by the rules of :mod:`~chasles.derive.description.noise`: lengths
lose noise, angles and directions that were rounded become exact. The same number becomes the same
exact number at every joint, so that axes that were parallel stay parallel.
"""

import re
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction

import sympy as sp

from ..model.cleaning import CleanedNumber, CleanedUnit, Cleaning
from ..model.convention import Field
from ..model.placements import Placement, Rotation, Vector, rotation, translation
from ..model.robot import Joint, Parameter, Robot
from ..model.tolerances import NOISE
from .noise import exact_angle, exact_direction, without_noise
from .pose_error import pose_error, robot_size

_UNITS: dict[str, CleanedUnit] = {"length": "m", "angle": "rad", "direction": "1"}
_UPRIGHT = re.compile(r"\\mathrm\{(\w+)\}")
_ABOUT = {"x": "roll", "y": "pitch", "z": "yaw"}


def cleaned(robot: Robot) -> Robot:
    """The robot in exact numbers, with the list of all numbers that were changed.

    Args:
        robot: A serial robot with the numbers of its file.

    Returns:
        The robot on placements of its conventions with cleaned fields; its ``cleaning`` lists the
        changes with a bound of their effect, and its ``notes`` say it in words.
    """
    work = _Work(Fraction(NOISE * (robot_size(robot) or 1.0)))
    parameters = tuple(work.parameter(parameter) for parameter in robot.parameters)
    base = work.placement("base", robot.base)
    joints = tuple(work.joint(joint) for joint in robot.joints)
    tool = work.placement("tool", robot.tool)
    if not work.numbers:
        return robot
    result = replace(robot, parameters=parameters, base=base, joints=joints, tool=tool)
    cleaning = Cleaning(tuple(work.numbers), *pose_error(robot, result))
    return replace(
        result, cleaning=cleaning, notes=(*robot.notes, cleaning.line, *cleaning.sentences)
    )


def cleaned_with_warning(robot: Robot, file: str) -> Robot:
    """Return the robot in exact numbers; warn if noise removal moves its tool far.

    Args:
        robot: A serial robot with the numbers of its file.
        file: The name of the file.
    """
    result = cleaned(robot)
    if result.cleaning.warning:
        warnings.warn(f"{file}: {result.cleaning.warning}", stacklevel=3)
    return result


@dataclass
class _Work:
    """The numbers changed so far, and the noise of lengths (metre)."""

    tolerance: Fraction
    numbers: list[CleanedNumber] = field(default_factory=list)

    def parameter(self, parameter: Parameter) -> Parameter:
        if parameter.kind == "ratio":
            return parameter
        at = f"parameter {parameter.name}"
        return replace(parameter, value=self.scalar(at, "", parameter.kind, parameter.value))

    def joint(self, joint: Joint) -> Joint:
        convention = joint.convention
        if convention is None or not joint.given:
            before = self.placement(joint.name, joint.before)
            return replace(joint, before=before, after=self.placement(joint.name, joint.after))
        values = dict(joint.given)
        known = len(self.numbers)
        given = {
            each.name: self.of_field(joint.name, each, [values[c] for c in each.components])
            if not (each.is_of_motion and joint.kind == "fixed")
            else _held(each, [values[c] for c in each.components])
            for each in convention.fields
        }
        if len(self.numbers) == known:
            return joint
        before, after = convention(joint.kind, **given)
        return replace(joint, before=before, after=after, given=convention.scalars(given))

    def of_field(self, at: str, each: Field, values: Sequence[sp.Expr]) -> sp.Expr | Vector:
        kind = each.kind.removesuffix("s")
        if kind == "direction":
            x, y, z = values
            taken: Iterable[sp.Expr] = exact_direction((x, y, z))
            found = zip(_called(each), values, taken, strict=True)
            return _held(each, [self.noted(at, name, kind, *pair) for name, *pair in found])
        pairs = zip(_called(each), values, strict=True)
        return _held(each, [self.scalar(at, name, kind, value) for name, value in pairs])

    def placement(self, at: str, placement: Placement) -> Placement:
        cleaned: Placement = ()
        for motion in placement:
            if isinstance(motion, Rotation):
                angle = self.scalar(at, _ABOUT[motion.axis], "angle", motion.angle)
                cleaned += rotation(motion.axis, angle)
            else:
                named = zip("xyz", motion.vector, strict=True)
                cleaned += translation(*(self.scalar(at, name, "length", v) for name, v in named))
        return cleaned

    def scalar(self, at: str, name: str, kind: str, value: sp.Expr) -> sp.Expr:
        if value == 0 or value.free_symbols:
            return value
        is_angle = kind == "angle"
        taken = exact_angle(value) if is_angle else without_noise(value, self.tolerance)
        return self.noted(at, name, kind, value, taken)

    def noted(self, at: str, name: str, kind: str, found: sp.Expr, taken: sp.Expr) -> sp.Expr:
        if found != taken:
            self.numbers.append(CleanedNumber(at, name, found, taken, _UNITS[kind]))
        return taken


def _called(each: Field) -> tuple[str, ...]:
    """Names of a field's components for a reader: roll, x, e_x."""
    return tuple(_UPRIGHT.sub(r"\1", name) for name in each.headings or each.components)


def _held(each: Field, values: Sequence[sp.Expr]) -> sp.Expr | Vector:
    """Values of a field's components in the form that its convention takes."""
    if not each.is_vector:
        return values[0]
    x, y, z = values
    return x, y, z
