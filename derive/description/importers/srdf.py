"""Reads the joint groups of SRDF files.

Source:
    The SRDF specification of <group>. A group contains <chain>, <link>, <joint> and <group>.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import NoReturn

from lxml import etree

from ..suggestions import hint
from ..toml_file import file_error, listed
from .kinematic_tree import KinematicTree
from .robot_xml import parsed, read_xml
from .xacro_file import expanded, is_xacro

MAX_NESTED = 16


def group_ends(file: Path, tree: KinematicTree, group: str) -> tuple[tuple[str, str], ...]:
    """Return the base link and the tip link of each chain in a group.

    Args:
        file: An SRDF file, or a xacro file that expands to SRDF.
        tree: The tree of links and joints.
        group: Name of the group.

    Returns:
        One pair (base, tip) for each chain. If the group contains other groups, each contained
        group is a chain.

    Raises:
        DescriptionError: The file is not a valid SRDF, the group is unknown, or its links form no
            chain.
    """
    return tuple(_Srdf(file, tree).ends(group, 0))


def srdf_in_folder(file: Path) -> Path | None:
    """Return the SRDF file in the folder of a file.

    An SRDF file with the name of ``file`` is preferred. If no SRDF file has this name, the folder
    must contain exactly one SRDF file.
    """
    stem = file.name.split(".")[0]
    there = sorted(path for path in file.parent.glob("*.srdf*") if path.is_file())
    of_the_name = [path for path in there if path.name.split(".")[0] == stem]
    found = of_the_name or there
    return found[0] if len(found) == 1 else None


class _Srdf:
    def __init__(self, file: Path, tree: KinematicTree) -> None:
        text = expanded(file, ()) if is_xacro(file) else read_xml(file)
        self.file, self.tree = str(file), tree
        self.root = parsed(self.file, text)
        groups = self.root.findall("group")
        self.groups = {str(element.get("name")): element for element in groups}

    def ends(self, group: str, depth: int) -> Iterator[tuple[str, str]]:
        if group not in self.groups or depth > MAX_NESTED:
            names = listed(self.groups) or "none"
            self._fail(self.root, group, f"one of the groups {names}{hint(group, self.groups)}")
        element = self.groups[group]
        inner = [str(part.get("name")) for part in element.findall("group")]
        if inner:
            found = [pair for part in inner for pair in self.ends(part, depth + 1)]
            self._check_joints(element, found)
            yield from found
        elif len(element):
            yield self._own(element)

    def _own(self, element: etree._Element) -> tuple[str, str]:
        chains = element.findall("chain")
        if len(chains) == 1:
            base, tip = str(chains[0].get("base_link")), str(chains[0].get("tip_link"))
            if {base, tip} <= set(self.tree.links) and self.tree.path_down(base, tip):
                self._check_joints(element, [(base, tip)])
                return base, tip
            self._fail(chains[0], f"{base} to {tip}", "a chain between links of the robot")
        links = self._links(element)
        tips = [link for link in links if not self._carries(link, links)]
        if len(tips) != 1:
            self._fail(element, element.get("name"), "a group whose joints are one chain")
        return self._base(tips[0], links), tips[0]

    def _check_joints(self, element: etree._Element, pairs: list[tuple[str, str]]) -> None:
        """Raise an error if the group lists a moving joint outside its chains."""
        joints = [joint for base, tip in pairs for joint in self.tree.path_down(base, tip) or ()]
        kinds = {joint.name: joint.kind for joint in self.tree.joints if joint not in joints}
        for joint in element.findall("joint"):
            if kinds.get(str(joint.get("name")), "fixed") != "fixed":
                expected = "a joint of the chain or the groups that the group names"
                self._fail(joint, joint.get("name"), expected)

    def _links(self, element: etree._Element) -> list[str]:
        """Return the links of an SRDF group.

        The result contains the links that the group names, except the root link of the tree. It
        also contains the child links of the joints that the group names.
        """
        carried = {joint.name: joint.child for joint in self.tree.joints}
        for joint in element.findall("joint"):
            if joint.get("name") not in carried:
                self._fail(joint, joint.get("name"), "a joint of the robot")
        links = [carried[str(joint.get("name"))] for joint in element.findall("joint")]
        named = [str(link.get("name")) for link in element.findall("link")]
        links += [link for link in named if link in self.tree.joint_to]
        return list(dict.fromkeys(links))

    def _carries(self, link: str, links: list[str]) -> bool:
        return any(joint.child in links for joint in self.tree.below[link])

    def _base(self, tip: str, links: list[str]) -> str:
        link = tip
        while link in links:
            link = self.tree.joint_to[link].parent
        return link

    def _fail(self, element: etree._Element, value: object, expected: str) -> NoReturn:
        raise file_error(self.file, element.sourceline, "<group>", value, expected) from None
