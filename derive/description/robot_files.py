"""Reads robot files. Errors state the line in the file.

A robot file contains the numbers of a data sheet::

    name = "ur5e"
    title = "Universal Robots UR5e"
    source = "data sheet"
    convention = "dh"
    units = { length = "m", angle = "rad" }

    [parameters]
    d1 = "0.1625"

    [[joints]]
    name = "shoulder_pan"
    d = "d1"
    alpha = "pi/2"
    limits = ["-2*pi", "2*pi"]

Every number is exact: an integer, a decimal, or an expression for
``chasles.derive.model.exact``.

The file of a robot with loops lists a kinematic tree (``parent``) and the parts that close the
loops: ``[[closures]]``, ``[[rods]]`` and ``[[cylinders]]``. A file may extend another file and
change its parameter values. The file of a measured robot may refer to the designed robot. The entry
``nominal`` states the designed robot: a file, or the name of an installed robot. Newton's method
then refines the solutions of the designed robot.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ..model.convention import Convention
from ..model.errors import DescriptionError, InputTypeError, UnknownRobotError
from ..model.mechanism import Described, Mechanism
from .chain_between import between
from .cleaned_robot import cleaned_with_warning
from .conventions import CONVENTIONS
from .conventions.suited import with_suitable_conventions
from .file_text import check_length, text_of
from .importers.chains import SUFFIXES, chains, imported, is_imported
from .importers.identifiers import prefix
from .mechanism_file import MechanismFile, has_loops
from .serial_file import AUTO, RobotFile
from .shipped_files import located, nominal_file
from .toml_file import TomlFile, file_error
from .urdf import UrdfFile

__all__ = ["DescriptionError", "read", "read_text"]

SUFFIX = ".toml"
Ends = tuple[str | None, str | None]
"""Names of the base link and the tip link. None stands for the base frame or the tool frame of
the file."""


def read(
    source: str | Path,
    *,
    base: str | None = None,
    tip: str | None = None,
    group: str | None = None,
    name: str | None = None,
    arguments: Sequence[str] = (),
    conventions: Sequence[Convention] = CONVENTIONS,
    exact: bool = False,
) -> Described:
    """Read a robot from a file.

    The suffix of the file determines the format.

    Args:
        source: A robot file (.toml), URDF (.urdf), xacro file (.xacro), MJCF model (.xml) or SDF
            (.sdf). The source may also be the name of a robot installed with chasles, or
            ``robot:NAME`` for a robot in the package robot_descriptions.
        base: The link whose frame is the base frame. The default is the base of a robot file,
            otherwise the root of the link tree.
        tip: The link whose frame is the tool frame. The default is the tool of a robot file,
            otherwise the end of the longest chain.
        group: A group of the SRDF file in the same folder, which defines base and tip.
        name: Name of the robot. The default is the name in the file.
        arguments: Argument values of a xacro file, each as ``name:=value``.
        conventions: The conventions that a robot file may use; all conventions by default.
        exact: Whether to keep the numbers exactly as in the file. By default, rounding noise is
            removed: nearly exact angles, directions and axis arrangements become exact. The
            attribute ``cleaning`` of the robot lists the changed numbers.

    Returns:
        The robot, in meters and radians. The robot is a Mechanism if the file describes loops,
        lists the actuated joints, or names the parent of a joint. Otherwise, the robot is a
        SerialRobot. If several tips are possible, the attribute ``notes`` states the selected tip.

    Raises:
        DescriptionError: The file, or the file that it extends, cannot be read, is invalid or has
            an unsupported suffix. The error is also raised if no chain connects base and tip, or if
            the file has several arms and no tip is selected.
        UnknownRobotError: The robot name is unknown.
    """
    file, words = located(source)
    words = (*words, *arguments)
    if is_imported(file):
        return _chain(file, base, tip, group, name, words, exact=exact)
    wrong = {"group": group, "arguments": words}
    for field, value in wrong.items():
        if value:
            expected = f"none; it applies to files that end in {', '.join(SUFFIXES)}"
            raise file_error(str(file), None, field, value, expected)
    if file.is_file() and file.suffix.lower() != SUFFIX:
        expected = f"a file that ends in one of {', '.join((SUFFIX, *SUFFIXES))}"
        raise file_error(str(file), None, "", None, expected)
    robot = _of_toml(text_of(file), str(file), conventions, exact, (base, tip))
    return replace(robot, name=prefix(name)) if name else robot


def read_text(
    text: str,
    *,
    format: str = "toml",  # noqa: A002
    file: str = "<text>",
    conventions: Sequence[Convention] = CONVENTIONS,
    exact: bool = False,
) -> Described:
    """Read a robot from the text of a robot file or URDF.

    Args:
        text: The text.
        format: The format of the text: "toml" for a robot file, or "urdf". Use ``read`` for other
            formats.
        file: File name for error messages. A relative path in the field `extends` starts at the
            folder of this file.
        conventions: The conventions that a robot file may use; all conventions by default.
        exact: Whether to keep the numbers exactly as in the text. By default, rounding noise is
            removed, as in ``read``.

    Returns:
        The robot in meters and radians, with the same type as from ``read``.

    Raises:
        DescriptionError: The text, or the file that it extends, is invalid, the text is too long,
            or the format is unknown.
    """
    if not isinstance(text, str):
        raise InputTypeError(f"text: expected a str, got {text!r}")
    check_length(file, text)
    if format == "urdf":
        robot = UrdfFile(file, text).robot(None, None, None)
        return robot if exact else cleaned_with_warning(robot, file)
    if format != "toml":
        raise file_error(file, None, "format", format, "'toml' or 'urdf'")
    return _of_toml(text, file, conventions, exact)


def _chain(
    file: Path,
    base: str | None,
    tip: str | None,
    group: str | None,
    name: str | None,
    arguments: Sequence[str],
    *,
    exact: bool,
) -> Described:
    if group:
        if base or tip:
            expected = "either a group, or base and tip"
            raise file_error(str(file), None, "group", group, expected)
        found = chains(file, arguments, None, (group,), None)
        if len(found) > 1:
            tips = ", ".join(str(chain[1]) for chain in found)
            expected = f"a group of one chain; this one ends at {tips}: choose a tip"
            raise file_error(str(file), None, "group", group, expected)
        base, tip, _ = found[0]
    robot = imported(file, arguments, base, tip, name)
    return robot if exact else cleaned_with_warning(robot, str(file))


def _of_toml(
    text: str,
    file: str,
    conventions: Sequence[Convention],
    exact: bool,
    ends: Ends = (None, None),
    *,
    is_nominal: bool = False,
) -> Described:
    """Read a robot file from text.

    If a nominal robot file has the field `nominal`, an error is raised.
    """
    reader = reader_of(text, file, conventions)
    if is_nominal and "nominal" in reader.table:
        reader.fail(("nominal",), "none: a nominal robot names no nominal robot itself")
    described = between(reader.described(), *ends, file)
    robot = described if exact else cleaned_with_warning(described, file)
    if isinstance(robot, Mechanism):
        has_nominal = "nominal" in reader.table
        return _with_nominal(reader, robot, conventions, ends) if has_nominal else robot
    is_auto = reader.table.get("convention") == AUTO
    return with_suitable_conventions(robot) if is_auto else robot


def reader_of(text: str, file: str, conventions: Sequence[Convention]) -> RobotFile:
    """Return the reader for the text of a robot file.

    Raises:
        DescriptionError: The text is not TOML, or the extended file cannot be read.
    """
    written = TomlFile(file, text)
    extending = written if "extends" in written.table else None
    source = written if extending is None else _extended(extending)
    reader = MechanismFile if has_loops(source.table) else RobotFile
    return reader(source.file, source.text, extending, conventions)


def _with_nominal(
    file: TomlFile, robot: Mechanism, conventions: Sequence[Convention], ends: Ends
) -> Mechanism:
    """Add the nominal robot that the file names."""
    keys = ("nominal",)
    path = nominal_file(Path(file.file), file.string(keys, ""))
    try:
        if path.suffix.lower() == SUFFIX:
            text = text_of(path)
            nominal = _of_toml(text, str(path), conventions, False, ends, is_nominal=True)
        else:
            nominal = read(path, base=ends[0], tip=ends[1], conventions=conventions)
        if not isinstance(nominal, Mechanism):
            file.fail(keys, "the file of a robot with loops")
        return replace(robot, nominal=nominal)
    except (DescriptionError, UnknownRobotError) as error:
        at = (error.file, error.field) if isinstance(error, DescriptionError) else None
        if at == (file.file, "nominal"):
            raise
        expected = (
            "the name of a robot that is installed with chasles, or a robot file in this folder"
        )
        file.fail(keys, f"{expected} one ({error})")


def _extended(extending: TomlFile) -> TomlFile:
    """Return the file that a robot file extends."""
    keys = ("extends",)
    path = Path(extending.file).parent / extending.string(keys, "")
    if path.suffix.lower() != SUFFIX:
        extending.fail(keys, f"the name of a robot file, which ends in {SUFFIX}")
    try:
        extended = TomlFile(str(path), text_of(path))
    except DescriptionError as error:
        extending.fail(keys, f"a robot file in this folder ({error})")
    if "extends" in extended.table:
        extending.fail(keys, "a file that does not extend another file")
    return extended
