"""Reads the chain between two links of a URDF with exact numbers.

Decimals are first read as written, and then replaced by exact values
(``cleaned_robot``).
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import NoReturn

import sympy as sp
from lxml import etree

from ..model.errors import DescriptionError
from ..model.exact import NotExact, read
from ..model.kinds import JointKind
from ..model.placements import Vector
from ..model.robot import Coupling, Joint, SerialRobot
from ..model.tolerances import UNLIMITED
from .chain_between import outwards
from .conventions.urdf_origin import urdf
from .importers.identifiers import identifier as _identifier
from .importers.identifiers import prefix
from .importers.kinematic_tree import KinematicTree, TreeJoint, TreeJointKind
from .importers.limits import without_limits
from .importers.robot_xml import local_name, parsed
from .importers.tool_links import Ends, NoChain, chosen_ends, leader_between, only_chain
from .importers.urdf_transmissions import DrivenJoints, TransmissionReader
from .plausibility import implausible_values
from .toml_file import file_error

DECIMAL = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
LIMITED_KINDS = ("revolute", "prismatic")
"""Joint types that require limits."""
FREE_KINDS = ("floating", "planar")
"""Joint types with several degrees of freedom. A chain can only start after a floating or planar
joint.
"""
KINDS: dict[str, JointKind] = {
    "revolute": "revolute",
    "continuous": "revolute",
    "prismatic": "prismatic",
    "fixed": "fixed",
}


def _states_no_range(limit: etree._Element | None) -> bool:
    """Whether the limits are missing or both 0. Some programs write 0 for unknown limits."""
    if limit is None:
        return True
    bounds = [limit.get(name, "0") for name in ("lower", "upper")]
    try:
        return not any(map(float, bounds))
    except ValueError:
        return False


class UrdfFile:
    """A parsed URDF, with the joints stored by child link."""

    def __init__(self, file: str, text: str) -> None:
        """Read the tree of links and joints.

        Args:
            file: File name for error messages.
            text: URDF text.

        Raises:
            DescriptionError: The text is not a valid URDF, or a joint refers to an unknown link.
        """
        self.file = file
        self.root = parsed(file, text)
        self.links = [self._attribute(link, "name") for link in self.root.findall("link")]
        for link in self.root.findall("link"):
            if self.links.count(str(link.get("name"))) > 1:
                self._fail(link, "name", link.get("name"), "a name that no other link has")
        self.joint_to: dict[str, etree._Element] = {}
        for joint in self.root.findall("joint"):
            child = self._link_of(joint, "child")
            if child in self.joint_to:
                self._fail(joint, "child", child, "a link that is not the child of another joint")
            self.joint_to[child] = joint
        self._refuse_circles()

    def _refuse_circles(self) -> None:
        """Raise an error if joints form a cycle."""
        based: set[str] = set()
        for child in self.joint_to:
            path: list[str] = []
            link = child
            while link in self.joint_to and link not in based:
                if link in path:
                    self._circle(path[path.index(link) :])
                path.append(link)
                link = self._link_of(self.joint_to[link], "parent")
            based.update(path)

    def _circle(self, links: list[str]) -> NoReturn:
        joints = [self.joint_to[link] for link in links]
        names = " and ".join(str(joint.get("name")) for joint in reversed(joints))
        expected = f"a link that is not a descendant of the joint; cyclic joints: {names}"
        self._fail(joints[0], "parent", self._link_of(joints[0], "parent"), expected)

    def robot(self, base: str | None, tip: str | None, name: str | None) -> SerialRobot:
        """Return the chain between two links.

        Args:
            base: The link of the base frame. By default, the root (see
                ``tool_links``).
            tip: The link of the tool frame. By default, the end of the longest chain.
            name: Name of the robot. By default, the name in the URDF.

        Returns:
            The robot with the frames, joints and links of the URDF. In names, "_" replaces
            characters that C does not allow. The field ``notes`` lists doubtful units. The field
            also states the selected tip if there are several tips.

        Raises:
            DescriptionError: The chain does not exist, or several chains have the same length.
        """
        try:
            ends = only_chain(self.tree, base, tip)
        except NoChain as error:
            self._no_chain(error)
        base, tip = ends.base, ends.tip
        elements = [self.joint_to[joint.child] for joint in self.tree.path(base, tip) or ()]
        self._check_leaders(elements, ends)
        joints = outwards(map(self._joint, elements), _identifier(base))
        driven = self._driven(elements)
        try:
            robot = SerialRobot(
                name=prefix(name or self._attribute(self.root, "name")),
                joints=tuple(replace(joint, parent="") for joint in joints),
                title=self.root.get("name", ""),
                source=f"URDF {Path(self.file).name}, {base} to {tip}",
                base_frame=_identifier(base),
                tool_frame=_identifier(tip),
                couplings=tuple(self._couplings(elements, driven)),
                motors=driven.motors,
            )
        except DescriptionError as error:
            if error.file:
                raise
            self._fail(self.root, "", None, f"joints that make a robot ({error})")
        unlimited = [
            str(element.get("name"))
            for element in elements
            if element.get("type") in LIMITED_KINDS
            and element.find("mimic") is None
            and _states_no_range(element.find("limit"))
        ]
        assumed = [
            f"joint {element.get('name')} states no axis; the axis is x, the default of URDF"
            for element in elements
            if KINDS[element.get("type", "")] != "fixed" and element.find("axis") is None
        ]
        found = (*without_limits(unlimited), *driven.notes, *implausible_values(robot))
        notes = (*ends.notes, *assumed, *found)
        return replace(robot, notes=notes)

    # --- the tree of the joints ---

    @cached_property
    def tree(self) -> KinematicTree:
        """Return the tree of links and joints."""
        joints = (
            TreeJoint(
                str(joint.get("name")),
                self._tree_kind(joint),
                self._link_of(joint, "parent"),
                child,
                leader=str(mimic.get("joint"))
                if (mimic := joint.find("mimic")) is not None
                else "",
                is_prismatic=joint.get("type") == "prismatic",
            )
            for child, joint in self.joint_to.items()
        )
        return KinematicTree(tuple(self.links), tuple(joints))

    def _tree_kind(self, joint: etree._Element) -> TreeJointKind:
        kind = joint.get("type", "")
        if kind in FREE_KINDS:
            return "free"
        if kind not in KINDS:
            self._fail(joint, "type", kind, f"one of {', '.join(KINDS)}")
        if kind == "fixed":
            return "fixed"
        return "moving" if joint.find("mimic") is None else "follower"

    def ends(self, base: str | None, tip: str | None) -> tuple[Ends, ...]:
        """Return the chains between base and tip. An end that is None is inferred.

        Raises:
            DescriptionError: A link is unknown, or no chain exists.
        """
        try:
            return chosen_ends(self.tree, base, tip)
        except NoChain as error:
            self._no_chain(error)

    def _no_chain(self, error: NoChain) -> NoReturn:
        """Raise the error for a missing chain.

        If macros are not expanded, the error suggests xacro.
        """
        elements = self.root.iterchildren(tag=etree.Element)
        macro = next((element for element in elements if element.prefix == "xacro"), None)
        name = f"<xacro:{local_name(macro)}>" if macro is not None else ""
        hint = f"; {name} is not expanded: give the file the ending .xacro" if name else ""
        self._fail(self.root, error.field, error.value, error.expected + hint)

    # --- a single joint of the file ---

    def _joint(self, element: etree._Element) -> Joint:
        kind = element.get("type", "")
        if kind not in KINDS:
            self._fail(element, "type", kind, f"one of {', '.join(KINDS)}")
        given = {
            "xyz": self._vector(element, "origin", "xyz", "0 0 0"),
            "rpy": self._vector(element, "origin", "rpy", "0 0 0"),
            "axis": self._vector(element, "axis", "xyz", "1 0 0"),
        }
        try:
            before, after = urdf(KINDS[kind], **given)
        except DescriptionError as error:
            axis = " ".join(map(str, given["axis"]))
            self._fail(element, "axis", axis, f"a direction ({error})")
        return Joint(
            name=_identifier(self._attribute(element, "name")),
            kind=KINDS[kind],
            before=before,
            after=after,
            link=_identifier(self._link_of(element, "child")),
            parent=_identifier(self._link_of(element, "parent")),
            limits=self._limits(element, kind),
            convention=urdf,
            given=urdf.scalars(given),
        )

    def _limits(self, element: etree._Element, kind: str) -> tuple[sp.Expr | None, sp.Expr | None]:
        limit = element.find("limit")
        if kind in ("fixed", "continuous") or limit is None:
            return None, None
        lower = self._number(limit, "lower", limit.get("lower", "0"))
        upper = self._number(limit, "upper", limit.get("upper", "0"))
        if lower == upper == 0 or upper - lower >= UNLIMITED:
            return None, None
        if not lower < upper:
            self._fail(limit, "limit", f"{lower}, {upper}", "a lower limit below the upper")
        return lower, upper

    def _driven(self, elements: Iterable[etree._Element]) -> DrivenJoints:
        """Return the joints of a chain with transmissions."""
        names = [
            self._attribute(element, "name")
            for element in elements
            if element.get("type") != "fixed" and element.find("mimic") is None
        ]
        return TransmissionReader(self.root, self._number, self._fail).driven(names)

    def _couplings(
        self, elements: Iterable[etree._Element], driven: DrivenJoints
    ) -> Iterator[Coupling]:
        """Yield the couplings of mimic joints and of joints with transmissions."""
        for element in (e for e in elements if e.get("type") != "fixed"):
            multiplier, offset = sp.Integer(1), sp.Integer(0)
            laws, leader = self._followed(element)
            for mimic in laws:
                offset += multiplier * self._number(mimic, "offset", mimic.get("offset", "0"))
                multiplier *= self._number(mimic, "multiplier", mimic.get("multiplier", "1"))
            name = self._attribute(leader, "name")
            ratios, shift = driven.rows.get(name, (((_identifier(name), sp.S.One),), sp.S.Zero))
            if laws or name in driven.rows:
                scaled = tuple((motor, multiplier * ratio) for motor, ratio in ratios)
                own = _identifier(self._attribute(element, "name"))
                yield Coupling(own, scaled, offset + multiplier * shift)

    def _followed(self, element: etree._Element) -> tuple[list[etree._Element], etree._Element]:
        laws, followed = [], [element]
        while (mimic := followed[-1].find("mimic")) is not None:
            name = self._attribute(mimic, "joint")
            named = [j for j in self.root.findall("joint") if j.get("name") == name]
            if not named or named[0] in followed:
                self._fail(mimic, "mimic", name, "another joint of the file, without a cycle")
            laws.append(mimic)
            followed.append(named[0])
        return laws, followed[-1]

    def _check_leaders(self, elements: Sequence[etree._Element], ends: Ends) -> None:
        """Raise an error if the leader of a mimic joint is outside the chain."""
        for element in (e for e in elements if e.get("type") != "fixed"):
            _, leader = self._followed(element)
            if leader not in elements:
                name = str(leader.get("name"))
                expected = leader_between(str(element.get("name")), ends)
                self._fail(element, "mimic", name, expected)

    # --- values ---

    def _vector(self, element: etree._Element, tag: str, attribute: str, default: str) -> Vector:
        child = element.find(tag)
        text = default if child is None else child.get(attribute, default)
        words = text.split()
        if len(words) != 3:  # noqa: PLR2004
            self._fail(element, f"{tag} {attribute}", text, "three numbers")
        x, y, z = (self._number(element, f"{tag} {attribute}", word) for word in words)
        return x, y, z

    def _number(self, element: etree._Element, field: str, text: str) -> sp.Expr:
        if not DECIMAL.fullmatch(text.strip()):
            self._fail(element, field, text, "a decimal number")
        try:
            return read(text.strip())
        except NotExact as error:
            self._fail(element, field, text, f"a number ({error})")

    def _link_of(self, joint: etree._Element, tag: str) -> str:
        child = joint.find(tag)
        if child is None or child.get("link") not in self.links:
            found = None if child is None else child.get("link")
            self._fail(joint, tag, found, f"<{tag} link=...> with a link of the file")
        return str(child.get("link"))

    def _attribute(self, element: etree._Element, name: str) -> str:
        value = element.get(name)
        if not value:
            self._fail(element, name, value, f'{name}="..."')
        return value

    def _fail(self, element: etree._Element, field: str, value: object, expected: str) -> NoReturn:
        about = f"{_tag(element)} {field}".strip()
        parent = element.getparent()
        if parent is not None and not element.get("name"):
            about = _tag(parent) + about
        raise file_error(self.file, element.sourceline, about, value, expected) from None


def _tag(element: etree._Element) -> str:
    return f"<{' '.join(str(word) for word in (element.tag, element.get('name')) if word)}>"
