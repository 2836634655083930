"""Robot files: a file becomes a robot, or an error that names its line.

A robot file holds the numbers of a data sheet::

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

Every number is exact: an integer, a decimal, or a text that :mod:`chasles.derive.model.exact`
reads.

The file of a robot with loops lists its joints as a tree, by ``parent``, and the members that close
the loops: ``[[closures]]``, ``[[rods]]`` and ``[[cylinders]]``; ``actuated`` names the coordinates.
A file may extend another file with other values of its parameters. The file of a robot as built may
name the robot as designed (``nominal``), by its file or as a robot that is installed with chasles:
from it the inverse is led.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ..model.convention import Convention
from ..model.errors import RobotError
from ..model.mechanism import Described, Mechanism
from .cleaned_robot import cleaned_with_warning
from .conventions import CONVENTIONS
from .conventions.suited import with_suitable_conventions
from .file_text import text_of
from .importers.chains import SUFFIXES, chains, is_imported, opened
from .importers.identifiers import prefix
from .mechanism_file import MechanismFile, has_loops
from .serial_file import AUTO, RobotFile
from .shipped_files import located, nominal_file
from .toml_file import DescriptionError, TomlFile
from .urdf import UrdfFile

__all__ = ["DescriptionError", "read", "read_text"]

SUFFIX = ".toml"


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
    """Reads a robot from any file that chasles knows; the ending determines the format.

    Args:
        source: A robot file (.toml), a URDF (.urdf), a xacro file (.xacro) or an MJCF model (.xml);
            as text also the name of a robot that is installed with chasles, or ``robot:NAME`` of
            the package robot_descriptions.
        base: The link whose frame is the base frame, in a tree of links; by default the root.
        tip: The link whose frame is the tool frame; by default the end of the longest chain.
        group: A group of an SRDF next to the file, instead of base and tip.
        name: The robot's name; by default the file's own.
        arguments: Values of a xacro file's arguments, each as ``name:=value``.
        conventions: The conventions that a robot file may name; the shipped ones by default.
        exact: Whether every number is taken as it is written. Otherwise numbers lose noise, and
            rounded angles, directions and arrangements become exact; ``cleaning`` of the robot
            lists them.

    Returns:
        The robot, in metres and radians: a Mechanism if the file closes loops, names actuated
        joints, or names the body that carries a joint; else a SerialRobot. ``notes`` name the
        chosen tip if the file has others.

    Raises:
        DescriptionError: The file, or a file that it extends, cannot be read or is wrong, has
            another ending, has no such chain, or holds several arms.
        RobotError: There is no robot of that name.
    """
    file, words = located(source)
    words = (*words, *arguments)
    if is_imported(file):
        return _chain(file, base, tip, group, name, words, exact=exact)
    wrong = {"base": base, "tip": tip, "group": group, "arguments": words}
    for field, value in wrong.items():
        if value:
            expected = f"none; it applies to files that end in {', '.join(SUFFIXES)}"
            raise DescriptionError(str(file), None, field, value, expected)
    if file.is_file() and file.suffix.lower() != SUFFIX:
        expected = f"a file that ends in one of {', '.join((SUFFIX, *SUFFIXES))}"
        raise DescriptionError(str(file), None, "", None, expected)
    robot = _of_toml(text_of(file), str(file), conventions, exact)
    return replace(robot, name=prefix(name)) if name else robot


def read_text(
    text: str,
    *,
    format: str = "toml",  # noqa: A002
    file: str = "<text>",
    conventions: Sequence[Convention] = CONVENTIONS,
    exact: bool = False,
) -> Described:
    """Reads a robot from text.

    Args:
        text: The text of a robot file, or of a URDF.
        format: "toml" or "urdf". A xacro file or an MJCF model is read as a file.
        file: The name of the file in errors; a file that it extends is searched in its folder.
        conventions: The conventions that a robot file may name; the shipped ones by default.
        exact: Whether every number is taken as it is written, see :func:`read`.

    Returns:
        The robot, see :func:`read`.

    Raises:
        DescriptionError: The text, or a file that it extends, is wrong, or the format is unknown.
    """
    if format == "urdf":
        robot = UrdfFile(file, text).robot(None, None, None)
        return robot if exact else cleaned_with_warning(robot, file)
    if format != "toml":
        raise DescriptionError(file, None, "format", format, "'toml' or 'urdf'")
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
    """The chain between two links, or of a group, of a file of linked bodies."""
    if group:
        if base or tip:
            expected = "either a group, or base and tip"
            raise DescriptionError(str(file), None, "group", group, expected)
        found = chains(file, arguments, None, (group,), None)
        if len(found) > 1:
            tips = ", ".join(str(chain[1]) for chain in found)
            expected = f"a group of one chain; this one ends at {tips}: choose a tip"
            raise DescriptionError(str(file), None, "group", group, expected)
        base, tip, _ = found[0]
    robot = opened(file, arguments).robot(base, tip, name)
    return robot if exact else cleaned_with_warning(robot, str(file))


def _of_toml(text: str, file: str, conventions: Sequence[Convention], exact: bool) -> Described:
    """The robot of a robot file's text."""
    written = TomlFile(file, text)
    heir = written if "extends" in written.table else None
    source = written if heir is None else _extended(heir)
    if has_loops(source.table):
        described = MechanismFile(source.file, source.text, heir, conventions).mechanism()
        robot = described if exact else cleaned_with_warning(described, file)
        return _with_nominal(source, robot, conventions) if "nominal" in source.table else robot
    arm = RobotFile(source.file, source.text, heir, conventions).robot()
    cleaned = arm if exact else cleaned_with_warning(arm, file)
    is_auto = source.table.get("convention") == AUTO
    return with_suitable_conventions(cleaned) if is_auto else cleaned


def _with_nominal(file: TomlFile, robot: Mechanism, conventions: Sequence[Convention]) -> Mechanism:
    """The robot with the nominal robot that its file names."""
    keys = ("nominal",)
    path = nominal_file(Path(file.file), file.string(keys, ""))
    try:
        nominal = read(path, conventions=conventions)
        if not isinstance(nominal, Mechanism) or nominal.nominal is not None:
            file.fail(keys, "the file of a robot with loops that names no nominal robot itself")
        return replace(robot, nominal=nominal)
    except DescriptionError as error:
        if error.field == "nominal" and error.file == file.file:
            raise
        expected = "the name of a robot that is installed with chasles, or a robot file beside this"
        file.fail(keys, f"{expected} one ({error})")
    except RobotError as error:
        file.fail(keys, f"the file of the robot as designed ({error})")


def _extended(heir: TomlFile) -> TomlFile:
    """The file that another file extends."""
    keys = ("extends",)
    path = Path(heir.file).parent / heir.string(keys, "")
    try:
        text = text_of(path)
    except DescriptionError as error:
        heir.fail(keys, f"a robot file beside this one ({error})")
    extended = TomlFile(str(path), text)
    if "extends" in extended.table:
        heir.fail(keys, "a file that extends no other")
    return extended
