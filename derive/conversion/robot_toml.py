"""Writes the robot file of a serial robot.

Each joint of the robot has a convention, for example Denavit-Hartenberg.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import sympy as sp

from ..model.convention import Convention
from ..model.kinds import UNITS
from ..model.placements import Placement, Vector
from ..model.robot import Joint, Parameter, SerialRobot, Spring, Transmission
from .number_text import NumberText, literal, literals
from .origins import Origin, fields_of, placed

_WAVES = ("sin1", "cos1", "sin2", "cos2")


def robot_toml(robot: SerialRobot) -> str:
    """Return the text of a robot file, in meter and radian, with all numbers exact.

    Args:
        robot: The robot, in which every joint states its convention.
    """
    return "\n".join(_Writer(robot, NumberText.of(robot)).lines()) + "\n"


@dataclass(frozen=True)
class _Writer:
    robot: SerialRobot
    numbers: NumberText

    def lines(self) -> Iterator[str]:
        """Yield the lines of the robot file."""
        robot = self.robot
        conventions = [joint.convention for joint in robot.joints if joint.convention]
        common = max(dict.fromkeys(conventions), key=conventions.count)
        yield f"name = {_text(robot.name)}"
        yield f"title = {_text(robot.title or robot.name)}"
        if robot.source:
            yield f"source = {_text(robot.source)}"
        yield f'convention = "{common.name}"'
        yield 'units = { length = "m", angle = "rad" }'
        if robot.load or robot.springs:
            gravity = (robot.load or robot.springs).gravity  # type: ignore[union-attr]
            yield f"gravity = {literals(gravity)}"
        yield from self._frame("base", robot.base, robot.base_frame, "0")
        yield from self._frame("tool", robot.tool, robot.tool_frame, "ee")
        if robot.parameters:
            yield from ("", "[parameters]", *map(self._parameter, robot.parameters))
        for joint, link in zip(robot.joints, robot.link_names, strict=True):
            yield from self._joint(joint, link, common)
        yield from _couplings(robot)
        for mass in robot.load.masses if robot.load else ():
            yield from ("", "[[masses]]", f"link = {_text(mass.link)}")
            yield from (f"mass = {literal(mass.mass)}", f"at = {literals(mass.at)}")
        for spring in robot.springs.rows if robot.springs else ():
            yield from _spring(spring)
        for transmission in robot.transmissions:
            yield from _transmission(transmission)

    def _frame(self, which: str, placement: Placement, name: str, default: str) -> Iterator[str]:
        if not placement and name == default:
            return
        yield from ("", f"[{which}]")
        if name != default:
            yield f"name = {_text(name)}"
        yield from self._origin(placed(placement))

    def _origin(self, origin: Origin) -> Iterator[str]:
        for name, vector in zip(("xyz", "rpy"), origin, strict=True):
            if any(vector):
                kind = "lengths" if name == "xyz" else "angles"
                yield f"{name} = {self.numbers.field(vector, kind)}"  # type: ignore[arg-type]

    def _parameter(self, parameter: Parameter) -> str:
        fields = [f"value = {self.numbers.scalar(parameter.value, parameter.kind)}"]
        fields.append(f'unit = "{UNITS[parameter.kind]}"')
        if parameter.meaning:
            fields.append(f"meaning = {_text(parameter.meaning)}")
        if parameter.assumed:
            fields.append("assumed = true")
        return f"{parameter.name} = {{ {', '.join(fields)} }}"

    def _joint(self, joint: Joint, link: str, common: Convention) -> Iterator[str]:
        yield from ("", "[[joints]]", f"name = {_text(joint.name)}")
        if joint.kind != "revolute":
            yield f'type = "{joint.kind}"'
        convention = joint.convention or common
        if convention is not common:
            yield f'convention = "{convention.name}"'
        written = self._fields(joint, convention)
        yield from (f"{name} = {text}" for name, text in written.items())
        if joint.pitch != 0:
            yield f"pitch = {self.numbers.scalar(joint.pitch, '')}"
        if joint.direction != 1:
            yield f"direction = {joint.direction}"
        lower, upper = joint.limits
        if lower is not None and upper is not None:
            yield f"limits = {literals((lower, upper))}"
        yield f"link = {_text(link)}"
        known = {*written, *(("limits",) if lower is not None else ()), "pitch"}
        assumed = [name for name in joint.assumed if name in known]
        if assumed:
            yield f"assumed = {json.dumps(assumed)}"

    def _fields(self, joint: Joint, convention: Convention) -> Mapping[str, str]:
        """Return the joint axis, and the joint fields that differ from their defaults."""
        values = fields_of(joint, convention)
        return {
            field.name: self.numbers.field(values[field.name], field.kind)
            for field in convention.fields
            if not (field.is_of_motion and joint.kind == "fixed")
            and (field.needed_to or field.name in joint.assumed or _is_set(values[field.name]))
        }


def _is_set(value: sp.Expr | Vector) -> bool:
    return any(value) if isinstance(value, tuple) else value != 0


def _couplings(robot: SerialRobot) -> Iterator[str]:
    if robot.couplings:
        yield from ("", "[couplings]")
    for rule in robot.couplings:
        parts = [f"{name} = {literal(ratio)}" for name, ratio in rule.ratios]
        parts += [f"offset = {literal(rule.offset)}"] if rule.offset != 0 or not parts else []
        yield f"{rule.joint} = {{ {', '.join(parts)} }}"
    if robot.motors:
        yield from ("", "[motors]")
    for motor in robot.motors:
        parts = ['type = "prismatic"'] if motor.kind == "prismatic" else []
        lower, upper = motor.limits
        if lower is not None and upper is not None:
            parts.append(f"limits = {literals((lower, upper))}")
            parts += ["assumed = true"] if motor.assumed else []
        yield f"{motor.name} = {{ {', '.join(parts)} }}"


def _spring(spring: Spring) -> Iterator[str]:
    yield from ("", "[[springs]]", f"coordinate = {_text(spring.coordinate)}")
    yield f"compliance = {literal(spring.compliance)}"
    yield from (f"axis = {literals(spring.axis)}", f"point = {literals(spring.point)}")
    yield from (f"mass = {literal(spring.mass)}", f"center = {literals(spring.center)}")


def _transmission(transmission: Transmission) -> Iterator[str]:
    yield from ("", "[[transmissions]]", f"coordinate = {_text(transmission.coordinate)}")
    yield f"gain = {literal(transmission.gain)}"
    for name, wave in zip(_WAVES, transmission.waves, strict=True):
        if wave != 0:
            yield f"{name} = {literal(wave)}"


def _text(words: str) -> str:
    return json.dumps(words, ensure_ascii=False)
