"""Converts a robot to another file format, and measures the error of the written numbers."""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from chasles.contract import as_path, check_type, output_file

from ..description.cleaned_robot import cleaned
from ..description.conventions import dh, mdh, poe
from ..description.pose_error import pose_error, robot_size
from ..description.robot_files import read_text
from ..description.urdf import UrdfFile
from ..model.convention import Convention
from ..model.errors import DescriptionError, InputValueError
from ..model.mechanism import Described, Mechanism
from ..model.placements import Placement
from ..model.robot import SerialRobot
from .axis_tables import in_table, screw_form
from .origins import is_described, with_origins, with_values
from .printed_table import csv_table, latex_table
from .robot_toml import robot_toml
from .robot_urdf import robot_urdf, urdf_names, with_split_helical_joints
from .urdf_drives import urdf_drives

Format = Literal["toml", "urdf", "dh", "mdh", "poe"]
FORMATS: tuple[str, ...] = get_args(Format)
TABLES: dict[str, Convention] = {"dh": dh, "mdh": mdh, "poe": poe}
_LONG = 1e3
"""A note reports a DH table if a length ``a`` or ``d`` exceeds the robot's size by this factor."""
_VISIBLE = 1e-12
"""Maximum pose error (meter, radian) that a conversion does not report in a note."""


@dataclass(frozen=True)
class Conversion:
    """A robot that was converted to another format.

    Attributes:
        format: "toml", "urdf", "dh", "mdh" or "poe", as passed to ``convert``.
        text: The text of the robot file or of the URDF.
        robot: The converted robot, with the same rounded numbers as in ``text``.
        error: Upper bounds of the tool pose error within the joint limits: distance (meter) and
            angle (radian) between the converted and the original tool pose.
        notes: Sentences about changes to the robot, and about facts that the format cannot express.
    """

    format: Format
    text: str
    robot: SerialRobot
    error: tuple[float, float]
    notes: tuple[str, ...]

    @property
    def base(self) -> Placement:
        """Pose of the first frame of the joint table in the base frame."""
        return self.robot.base

    @property
    def tool(self) -> Placement:
        """Pose of the tool frame in the last frame of the joint table."""
        return self.robot.tool

    def save(self, path: str | Path) -> None:
        """Write the text to a file, or the joint table to a .csv or .tex file.

        Each row of a table contains the convention fields of one joint, in meter and radian, with
        up to 17 digits. In a .csv file, the first row is the base pose and the last row is the tool
        pose. In a .tex file, both poses follow the table.

        Args:
            path: The path of the file: .urdf for the format "urdf", and .toml for all other
                formats. A table ("dh", "mdh" or "poe") may also be a .csv file, or a .tex file for
                the LaTeX package booktabs.

        Raises:
            InputValueError: The suffix does not fit the format, or the file cannot be written.
        """
        path, table = as_path("path", path), TABLES.get(self.format)
        text_suffix = ".urdf" if self.format == "urdf" else ".toml"
        suffixes = (text_suffix, ".csv", ".tex") if table else (text_suffix,)
        if path.suffix not in suffixes:
            raise InputValueError(
                f"{path}: expected a file for {self.format!r} that ends in {', '.join(suffixes)}"
            )
        text = self.text
        if table and path.suffix != text_suffix:
            write = csv_table if path.suffix == ".csv" else latex_table
            text = write(with_values(self.robot), table)
        with output_file(path) as file:
            file.write_text(text, encoding="utf-8")


def convert(robot: Described, to: Format) -> Conversion:
    """Convert a serial robot to a robot file, to URDF, or to a table of joint parameters.

    Args:
        robot: A serial robot in any convention, for example from ``read``.
        to: The format. "toml" is a robot file with the robot's own conventions and parameters.
            "urdf" is URDF, with 17 digits in the joint origins. "dh" (standard Denavit-Hartenberg),
            "mdh" (modified, Craig) and "poe" (screw axes) are tables: robot files in which all
            joints have this convention. In a table, fixed joints become part of the links. Constant
            transforms that a table cannot represent become part of the base pose or of the tool
            pose.

    Returns:
        The conversion, with the text in the new format and upper bounds of the tool pose error.
        Multiples of pi/12 and short decimals stay exact. Other computed numbers have 17 digits.

    Raises:
        InputValueError: The format is unknown, the robot has loops, or the format cannot express
            the robot. The robot has masses, and a table would move the link frames in which their
            positions are given.
    """
    check_type("convert: robot", robot, SerialRobot, Mechanism)
    if to not in FORMATS:
        raise InputValueError(f"to: expected one of {', '.join(FORMATS)}, found {to!r}")
    if not isinstance(robot, SerialRobot):
        raise InputValueError(
            f"{robot.name}: only serial robots can be converted; this robot has loops or actuated "
            "joints, which only robot files describe"
        )
    written = _written(robot, to)
    text = robot_urdf(written) if to == "urdf" else robot_toml(written)
    error, changes = _error(robot, text, to)
    notes = (*_notes(robot, written, to), *changes)
    return Conversion(to, text, written, error, notes)


def _written(robot: SerialRobot, to: Format) -> SerialRobot:
    if to == "urdf":
        return with_origins(with_split_helical_joints(robot))
    is_complete = all(is_described(joint) for joint in robot.joints)
    if to == "toml":
        return robot if is_complete else with_origins(robot, keeps_links=robot.load is not None)
    table = TABLES[to]
    if is_complete and all(joint.convention is table for joint in robot.joints):
        return robot
    return in_table(robot, table)


def _error(
    robot: SerialRobot, text: str, to: Format
) -> tuple[tuple[float, float], tuple[str, ...]]:
    """Return the pose error of the written robot, and notes about the text.

    If the pose error is large, a note states its value.
    """
    form = "urdf" if to == "urdf" else "toml"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = read_text(text, format=form, file=f"{robot.name}.{form}")
    except DescriptionError as refused:
        raise InputValueError(
            f"{robot.name}: {form}: the format cannot express this robot ({refused})"
        ) from refused
    expected = [joint.name for joint in robot.coordinates]
    assert isinstance(found, SerialRobot)
    notes: tuple[str, ...] = ()
    names_read = [joint.name for joint in found.coordinates]
    if names_read != expected and sorted(names_read) == sorted(expected):
        raise InputValueError(
            f"{robot.name}: URDF would change the order of the coordinates, because joint 1 of a "
            f"four-bar linkage follows joint 2; new order: {', '.join(names_read)}"
        )
    if names_read != expected:
        # The URDF reader omits joints that are named like fingers or wheels.
        names = urdf_names(robot)
        found = cleaned(UrdfFile(f"{robot.name}.urdf", text).robot(names.base, names.tool, None))
        notes = (f"because of the names of its joints, read the URDF with tip={names.tool!r}",)
    same = with_split_helical_joints(robot) if to == "urdf" else robot
    error = pose_error(screw_form(same), screw_form(found))
    if max(error) <= _VISIBLE:
        return error, notes
    reason = "; exact=True keeps noisy decimals as written" if found.cleaning.numbers else ""
    return error, (
        *notes,
        f"reading the text moves the tool by up to {error[0]:.1e} m, {error[1]:.1e} rad{reason}",
    )


def _notes(robot: SerialRobot, written: SerialRobot, to: Format) -> Iterator[str]:
    if to == "urdf":
        yield from _urdf_notes(robot, written)
    for joint in robot.joints:
        if joint.limits.count(None) == 1:
            yield (
                f"joint {joint.name} has one limit; the format requires two, so the limit is "
                "omitted"
            )
    if robot.parameters and not written.parameters:
        yield "parameters are replaced by their values"
    absorbed = [j.name for j in robot.joints if j not in written.joints and j.kind == "fixed"]
    if absorbed and to in TABLES:
        yield f"fixed joints became part of the links: {', '.join(absorbed)}"
    if to in ("dh", "mdh"):
        yield from _long_rows(written)


def _urdf_notes(robot: SerialRobot, written: SerialRobot) -> Iterator[str]:
    for joint in robot.joints:
        if joint.kind == "helical":
            yield f"helical joint {joint.name}: a revolute and a prismatic joint that mimics it"
    left_out = {
        "masses": robot.load,
        "springs": robot.springs,
        "transmission errors": robot.transmissions,
    }
    if any(left_out.values()):
        yield f"URDF has no {', '.join(word for word, value in left_out.items() if value)}"
    if urdf_drives(written)[1]:
        yield "the hardware of <ros2_control> is a simulation"
    limited = [m.name for m in robot.motors if m.limits != (None, None)]
    if limited:
        yield f"URDF has no motor limits: {', '.join(limited)}"
    sliding = [motor.name for motor in robot.motors if motor.kind == "prismatic"]
    if sliding:
        yield f"URDF readers regard these prismatic motors as revolute: {', '.join(sliding)}"
    yield "effort and velocity limits are placeholders"


def _long_rows(written: SerialRobot) -> Iterator[str]:
    """Yield a note for each joint with long DH lengths, which nearly parallel axes cause."""
    size = max(robot_size(screw_form(written)), 1e-3)
    values = {parameter.symbol: parameter.value for parameter in written.parameters}
    for joint in written.moving:
        given = dict(joint.given)
        longest = max(abs(float(given[name].xreplace(values))) for name in ("a", "d"))
        if longest > _LONG * size:
            yield (
                f"joint {joint.name}: its axis is nearly parallel to the next axis, so that the "
                f'table has lengths of {longest:.1e} m; "poe" avoids them'
            )
