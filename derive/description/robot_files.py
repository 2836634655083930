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
from ..model.mechanism import Mechanism
from ..model.robot import SerialRobot
from .cleaned_robot import cleaned_with_warning
from .conventions import CONVENTIONS
from .conventions.suited import suited
from .file_text import read_text
from .importers.chains import SUFFIXES, from_file, is_imported
from .mechanism_file import MechanismFile, has_loops
from .serial_file import AUTO, RobotFile
from .shipped_files import nominal_file
from .toml_file import DescriptionError, TomlFile

__all__ = ["DescriptionError", "load", "loads"]

SUFFIX = ".toml"


def load(
    path: str | Path, conventions: Sequence[Convention] = CONVENTIONS, exact: bool = False
) -> SerialRobot | Mechanism:
    """Reads a robot from any file that chasles knows; the ending says which it is.

    :func:`~chasles.derive.from_file` reads a chain between chosen links, and xacro with arguments.

    Args:
        path: A robot file (.toml), a URDF (.urdf), a xacro file (.xacro) or an MJCF model (.xml).
        conventions: The conventions that a robot file may name; the shipped ones by default.
        exact: Whether every number is taken as it is written. Otherwise numbers lose noise, and
            rounded angles, directions and arrangements become exact; ``cleaning`` of the robot
            lists them.

    Returns:
        The robot, in metres and radians: a Mechanism where the file closes loops, names actuated
        joints, or names the body that carries a joint; else a SerialRobot.

    Raises:
        DescriptionError: The file, or the file that it extends, cannot be read or is wrong, has
            another ending, or holds several arms.
    """
    file = Path(path)
    if is_imported(file):
        return from_file(file, exact=exact)
    if file.is_file() and file.suffix.lower() != SUFFIX:
        expected = f"a file that ends in one of {', '.join((SUFFIX, *SUFFIXES))}"
        raise DescriptionError(str(path), None, "", None, expected)
    return loads(read_text(path), str(path), conventions, exact)


def loads(
    text: str,
    file: str = "<text>",
    conventions: Sequence[Convention] = CONVENTIONS,
    exact: bool = False,
) -> SerialRobot | Mechanism:
    """Reads a robot from the text of a robot file.

    Args:
        text: TOML.
        file: Name of the file in errors; a file that it extends is looked for beside it.
        conventions: The conventions that the text may name; the shipped ones by default.
        exact: Whether every number is taken as it is written, see :func:`load`.

    Returns:
        The robot, see :func:`load`.

    Raises:
        DescriptionError: The text, or a file that it extends, is wrong.
    """
    written = TomlFile(file, text)
    heir = written if "extends" in written.table else None
    source = written if heir is None else _extended(heir)
    if has_loops(source.table):
        described = MechanismFile(source.file, source.text, heir, conventions).mechanism()
        robot = described if exact else cleaned_with_warning(described, file)
        return _with_nominal(source, robot, conventions) if "nominal" in source.table else robot
    arm = RobotFile(source.file, source.text, heir, conventions).robot()
    read = arm if exact else cleaned_with_warning(arm, file)
    return suited(read) if source.table.get("convention") == AUTO else read


def _with_nominal(file: TomlFile, robot: Mechanism, conventions: Sequence[Convention]) -> Mechanism:
    """The robot with the nominal robot that its file names."""
    keys = ("nominal",)
    path = nominal_file(Path(file.file), file.string(keys, ""))
    try:
        nominal = load(path, conventions)
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
        text = read_text(path)
    except DescriptionError as error:
        heir.fail(keys, f"a robot file beside this one ({error})")
    extended = TomlFile(str(path), text)
    if "extends" in extended.table:
        heir.fail(keys, "a file that extends no other")
    return extended
