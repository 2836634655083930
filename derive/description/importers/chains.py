"""Opens URDF, xacro and MJCF files and finds their chains."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Protocol, TypeVar

from chasles.contract.isolation import IsolatedWorkError, Limits, isolated

from ...model.errors import DescriptionError
from ...model.exact import NotExact
from ...model.mechanism import Described
from ..toml_file import file_error
from ..urdf import UrdfFile
from .identifiers import identifier
from .kinematic_tree import KinematicTree
from .mjcf.mjcf_file import MjcfFile
from .robot_xml import is_urdf, read_xml
from .sdf.sdf_file import SdfFile
from .srdf import group_ends, srdf_in_folder
from .tool_links import Ends
from .xacro_file import expanded, is_xacro

SUFFIXES = (".urdf", ".xacro", ".xml", ".sdf")
READING = Limits()
"""Limits on the time and memory for reading one file."""
Result = TypeVar("Result")
Chain = tuple[str | None, str | None, str]
"""The base link, the tip link and the suffix of the robot name.
If the tip is None, it is inferred."""


class LinkedBodies(Protocol):
    """A file that contains a tree of links."""

    @property
    def tree(self) -> KinematicTree:
        """The tree of links and joints."""

    def ends(self, base: str | None, tip: str | None) -> tuple[Ends, ...]:
        """Return the chains between base and tip. If base or tip is None, the end is inferred."""

    def robot(self, base: str | None, tip: str | None, name: str | None) -> Described:
        """Return the chain between two links, and the loops that contain its joints."""


def is_imported(file: Path) -> bool:
    """Whether the file suffix is .urdf, .xacro, .xml or .sdf."""
    return file.suffix.lower() in SUFFIXES


def imported(
    file: Path,
    arguments: Sequence[str] = (),
    base: str | None = None,
    tip: str | None = None,
    name: str | None = None,
) -> Described:
    """Return the chain between two links of a file.

    Args:
        file: A URDF, a xacro file or an MJCF model.
        arguments: Values of the arguments of a xacro file, each as ``name:=value``.
        base: The link of the base frame. By default, the root of the tree.
        tip: The link of the tool frame. By default, the end of the longest chain.
        name: The robot's name; by default the name in the file.

    Raises:
        DescriptionError: The file is invalid, does not contain the chain, or exceeds a limit.
    """
    return within_limits(file, partial(_robot, file, arguments, base, tip, name))


def _robot(
    file: Path, arguments: Sequence[str], base: str | None, tip: str | None, name: str | None
) -> Described:
    return opened(file, arguments).robot(base, tip, name)


def within_limits(file: Path, work: Callable[[], Result]) -> Result:
    """Run a function in a separate process, with limits on time and memory."""
    try:
        return isolated(work, READING)
    except NotExact as error:
        expected = f"numbers in the supported range ({error})"
        raise file_error(str(file), None, "", None, expected) from None
    except IsolatedWorkError as error:
        expected = f"a file that can be read: {error}"
        raise file_error(str(file), None, "", None, expected) from None


def opened(file: Path, arguments: Sequence[str] = ()) -> LinkedBodies:
    """Read a file that contains a tree of links.

    Args:
        file: A URDF, a xacro file that expands to URDF, an MJCF model, or an SDF.
        arguments: Argument values of a xacro file, each as ``name:=value``.

    Raises:
        DescriptionError: The file is invalid, or arguments are given for a file that is not a xacro
            file.
    """
    if is_xacro(file):
        return UrdfFile(f"{file} (expanded)", expanded(file, arguments))
    if arguments:
        expected = "a xacro file: no other takes arguments"
        raise file_error(str(file), None, "", arguments[0], expected)
    if file.suffix.lower() == ".sdf":
        return SdfFile(str(file), read_xml(file))
    if file.suffix.lower() == ".xml" and not is_urdf(read_xml(file)):
        return MjcfFile(file)
    return UrdfFile(str(file), read_xml(file))


def chains(
    file: Path,
    arguments: Sequence[str],
    base: str | None,
    groups: Sequence[str],
    srdf: Path | None,
) -> tuple[Chain, ...]:
    """Return the chains of a file, from SRDF groups or from the tree.

    Args:
        file: A link-tree file.
        arguments: Argument values of a xacro file, each as ``name:=value``.
        base: The base link. By default, the root of the tree.
        groups: Names of the SRDF groups.
        srdf: The SRDF file. By default, an SRDF file in the folder of the description.

    Returns:
        The tuple (base, tip, suffix) for each chain. The suffix is added to the robot name, and is
        empty if there is only one chain.

    Raises:
        DescriptionError: A file is invalid, or a group is unknown.
    """
    return within_limits(file, partial(_chains, file, arguments, base, groups, srdf))


def _chains(
    file: Path,
    arguments: Sequence[str],
    base: str | None,
    groups: Sequence[str],
    srdf: Path | None,
) -> tuple[Chain, ...]:
    source = opened(file, arguments)
    found: list[Chain] = [
        chain for group in groups for chain in _of_group(source, file, group, srdf)
    ]
    if not groups:
        found = [(base, end.tip, end.tip) for end in source.ends(base, None)]
        if len(found) == 1:
            # The file reader selects the tip. The note of the file reader lists the other possible
            # tips.
            return ((base, None, ""),)
    if len(found) == 1:
        return ((*found[0][:2], ""),)
    return tuple((first, tip, identifier(name)) for first, tip, name in found)


def _of_group(source: LinkedBodies, file: Path, group: str, srdf: Path | None) -> list[Chain]:
    """Return the chains of an SRDF group.

    Each chain has a suffix for the robot name.
    """
    groups = srdf or srdf_in_folder(file)
    if groups is None:
        raise DescriptionError(
            f"{file}: expected an SRDF file with the same name in the same folder, or --srdf FILE"
        )
    pairs = group_ends(groups, source.tree, group)
    return [(base, tip, group if len(pairs) == 1 else tip) for base, tip in pairs]
