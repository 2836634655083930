"""Files of linked bodies by their endings, and the chains that a user or a tree chooses there."""

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from ...model.errors import RobotError
from ...model.mechanism import Described
from ..toml_file import DescriptionError
from ..urdf import UrdfFile
from .identifiers import identifier
from .kinematic_tree import KinematicTree
from .mjcf.mjcf_file import MjcfFile
from .robot_xml import is_urdf, read_xml
from .srdf import group_ends, srdf_beside
from .tool_links import Ends
from .xacro_file import expanded, is_xacro

SUFFIXES = (".urdf", ".xacro", ".xml")
Chain = tuple[str | None, str | None, str]
"""Base and tip links, None where the tree decides, and the end of the robot's name."""


class LinkedBodies(Protocol):
    """A file that describes a tree of links: a URDF or an MJCF model."""

    @property
    def tree(self) -> KinematicTree:
        """Links and joints by name."""

    def ends(self, base: str | None, tip: str | None) -> tuple[Ends, ...]:
        """The chains between the given links; where one is not given, those that are meant."""

    def robot(self, base: str | None, tip: str | None, name: str | None) -> Described:
        """The chain between two links, with the loops that its joints are part of."""


def is_imported(file: Path) -> bool:
    """Whether a file's ending is that of a URDF, a xacro file or an MJCF model."""
    return file.suffix.lower() in SUFFIXES


def opened(file: Path, arguments: Sequence[str] = ()) -> LinkedBodies:
    """A file of linked bodies, read.

    Args:
        file: A URDF, a xacro file that makes one, or an MJCF model.
        arguments: Values of a xacro file's arguments, each as ``name:=value``.

    Raises:
        DescriptionError: The file is wrong, or is no xacro file and arguments are given.
    """
    if is_xacro(file):
        return UrdfFile(f"{file} (expanded)", expanded(file, arguments))
    if arguments:
        expected = "a xacro file: no other takes arguments"
        raise DescriptionError(str(file), None, "", arguments[0], expected)
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
    """The chains of a file: those of groups of an SRDF, or else those that its tree means.

    Args:
        file: A file of linked bodies.
        arguments: Arguments of a xacro file.
        base: The base link; by default the root.
        groups: Names of groups.
        srdf: The file with the groups; by default the one beside.

    Returns:
        Base, tip and an end of the robot's name for each; the end is empty where there is one.

    Raises:
        RobotError: A file is wrong, or there is no such group.
    """
    source = opened(file, arguments)
    found: list[Chain] = [
        chain for group in groups for chain in _of_group(source, file, group, srdf)
    ]
    if not groups:
        found = [(base, end.tip, end.tip) for end in source.ends(base, None)]
        if len(found) == 1:
            # The tip is left to the reader, whose notes name the other ends.
            return ((base, None, ""),)
    if len(found) == 1:
        return ((*found[0][:2], ""),)
    return tuple((first, tip, identifier(name)) for first, tip, name in found)


def _of_group(source: LinkedBodies, file: Path, group: str, srdf: Path | None) -> list[Chain]:
    """The chains of a group; each is named by the group, or by its tip where there are several."""
    groups = srdf or srdf_beside(file)
    if groups is None:
        raise RobotError(f"{file}: expected an SRDF of that name beside it, or --srdf FILE")
    pairs = group_ends(groups, source.tree, group)
    return [(base, tip, group if len(pairs) == 1 else tip) for base, tip in pairs]
