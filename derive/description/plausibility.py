"""Finds numbers that are plausible only in another unit.

In a format with units, an implausible number without a unit is an error. Formats such as URDF have
no units. In these formats, an implausible number only causes a note. A number with a stated unit is
always accepted.
"""

from collections.abc import Mapping

from ..model.cleaning import written
from ..model.kinds import ParameterKind
from ..model.placements import Rotation
from ..model.robot import Joint, SerialRobot
from ..model.tolerances import LARGEST_ANGLE, LONGEST_LENGTH, MAX_TURNED, SHORTEST_ARM
from .pose_error import lengths, robot_size

LARGEST: dict[ParameterKind, float] = {"length": LONGEST_LENGTH, "angle": LARGEST_ANGLE}
"""Largest length (meter) or angle (radian) that a file may contain without a stated unit."""
_DEFAULTS: dict[ParameterKind, tuple[str, str]] = {"length": ("m", "mm"), "angle": ("rad", "deg")}


LARGEST_LIMIT: dict[ParameterKind, float] = {"length": LONGEST_LENGTH, "angle": MAX_TURNED}
"""Largest joint limit (meter, radian) that needs no stated unit."""


def statement_of(kind: ParameterKind, largest: Mapping[ParameterKind, float] = LARGEST) -> str:
    """Return the text of an error that asks for the unit of a large number."""
    default, other = _DEFAULTS[kind]
    return (
        f"{'a length' if kind == 'length' else 'an angle'} of at most {largest[kind]:g} {default}, "
        f"the default unit; state the unit: units = {{ {kind} = "
        f'"{other}" }}, or "{default}" to keep this value'
    )


def implausible_values(robot: SerialRobot) -> tuple[str, ...]:
    """Return notes on numbers with doubtful units."""
    questions = [question for joint in robot.joints for question in _implausible_angles(joint)]
    questions += filter(None, map(_implausible_limits, robot.joints))
    longest = robot_size(robot)
    if longest > LONGEST_LENGTH:
        questions.append(f"a length of {longest:.6g} m: is the file in millimeters?")
    total = float(sum(lengths(robot)))
    if 0 < total < SHORTEST_ARM:
        questions.append(f"all lengths together are {total:.3g} m: are they in another unit?")
    return tuple(questions)


def _implausible_limits(joint: Joint) -> str:
    """Return a note on doubtful limits of a revolute joint, or ""."""
    limits = [limit for limit in joint.limits if limit is not None]
    if joint.kind != "revolute" or not any(abs(float(limit)) >= MAX_TURNED for limit in limits):
        return ""
    shown = " and ".join(map(written, limits))
    return f"joint {joint.name}: limits of {shown} rad: are they in degrees?"


def _implausible_angles(joint: Joint) -> list[str]:
    motions = [motion for part in (joint.before, joint.after) for motion in part]
    angles = [motion.angle for motion in motions if isinstance(motion, Rotation)]
    return [
        f"joint {joint.name}: an angle of {written(angle)} rad: is it in degrees?"
        for angle in dict.fromkeys(angles)
        if not angle.free_symbols and abs(float(angle)) > LARGEST_ANGLE
    ]
