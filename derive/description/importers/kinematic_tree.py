"""The tree of links and joints of a file, by names alone: which way leads from a base to a tip."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

TreeJointKind = Literal["moving", "follower", "fixed", "free", "ball"]
"""A joint with a coordinate of its own, one that follows another joint, one that does not move, a
floating or planar joint, behind which a chain begins, and a ball joint, which no chain holds."""


@dataclass(frozen=True)
class TreeJoint:
    """A joint between two links.

    Attributes:
        name: Its name.
        kind: Its kind.
        parent: The link that carries it.
        child: The link that it carries.
        leader: The joint that a follower follows.
        is_prismatic: Whether it slides.
    """

    name: str
    kind: TreeJointKind
    parent: str
    child: str
    leader: str = ""
    is_prismatic: bool = False


@dataclass(frozen=True)
class KinematicTree:
    """Links and joints, in the order of the file.

    Attributes:
        links: Names of all links.
        joints: The joints; each link is the child of one joint at most.
    """

    links: tuple[str, ...]
    joints: tuple[TreeJoint, ...]

    @cached_property
    def joint_to(self) -> Mapping[str, TreeJoint]:
        """The joint that carries each link but the roots."""
        return {joint.child: joint for joint in self.joints}

    @cached_property
    def below(self) -> Mapping[str, tuple[TreeJoint, ...]]:
        """The joints that each link carries."""
        found: dict[str, list[TreeJoint]] = {link: [] for link in self.links}
        for joint in self.joints:
            found[joint.parent].append(joint)
        return {link: tuple(joints) for link, joints in found.items()}

    @property
    def roots(self) -> tuple[str, ...]:
        """The links that no joint carries."""
        return tuple(link for link in self.links if link not in self.joint_to)

    def way(self, base: str, tip: str) -> tuple[TreeJoint, ...] | None:
        """The joints from one link to another below it; None where the second is not below."""
        joints: list[TreeJoint] = []
        link = tip
        while link != base:
            if link not in self.joint_to or len(joints) > len(self.joints):
                return None
            joints.append(self.joint_to[link])
            link = joints[-1].parent
        return tuple(joints[::-1])

    def root_of(self, link: str) -> str:
        """The link above which there is none; the link itself where joints form a circle."""
        start = link
        for _ in self.links:
            if link not in self.joint_to:
                return link
            link = self.joint_to[link].parent
        return start

    def outwards(self, link: str) -> Iterator[str]:
        """A link and all links further out, each before those that it carries."""
        waiting = [link]
        while waiting:
            reached = waiting.pop()
            yield reached
            waiting += [joint.child for joint in reversed(self.below[reached])]

    def rigid(self, link: str) -> Iterator[str]:
        """A link and all links that are fixed to it further out."""
        waiting = [link]
        while waiting:
            reached = waiting.pop()
            yield reached
            fixed = [joint for joint in self.below[reached] if joint.kind == "fixed"]
            waiting += [joint.child for joint in reversed(fixed)]

    def moved(self, link: str) -> tuple[TreeJoint, ...]:
        """The joints that move a next link, on a link and the links that are fixed to it."""
        return tuple(
            joint
            for part in self.rigid(link)
            for joint in self.below[part]
            if joint.kind != "fixed"
        )
