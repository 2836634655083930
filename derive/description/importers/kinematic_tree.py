"""Represents named links and joints as a tree, and finds the path from base to tip."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import takewhile
from typing import Literal

TreeJointKind = Literal["moving", "follower", "fixed", "free", "ball"]
"""Kinds of joints. A joint has its own coordinate, mimics another joint, or is fixed. A chain
starts after a floating or planar joint, and contains no ball joint."""


@dataclass(frozen=True)
class TreeJoint:
    """A joint that connects two links.

    Attributes:
        name: Name of the joint.
        kind: Kind of the joint.
        parent: The parent link.
        child: The child link.
        leader: The leader of a mimic joint.
        is_prismatic: Whether the joint is prismatic.
    """

    name: str
    kind: TreeJointKind
    parent: str
    child: str
    leader: str = ""
    is_prismatic: bool = False


@dataclass(frozen=True)
class KinematicTree:
    """Links and joints of the file, in the order of the file.

    Attributes:
        links: Names of all links.
        joints: The joints. A link has at most one parent joint.
    """

    links: tuple[str, ...]
    joints: tuple[TreeJoint, ...]

    @cached_property
    def joint_to(self) -> Mapping[str, TreeJoint]:
        """The parent joint of each link except the root."""
        return {joint.child: joint for joint in self.joints}

    @cached_property
    def below(self) -> Mapping[str, tuple[TreeJoint, ...]]:
        """The child joints of each link."""
        found: dict[str, list[TreeJoint]] = {link: [] for link in self.links}
        for joint in self.joints:
            found[joint.parent].append(joint)
        return {link: tuple(joints) for link, joints in found.items()}

    @property
    def roots(self) -> tuple[str, ...]:
        """The links without a parent joint."""
        return tuple(link for link in self.links if link not in self.joint_to)

    def path_down(self, base: str, tip: str) -> tuple[TreeJoint, ...] | None:
        """Return the joints from a link to a descendant.

        The value is None if the tip is not a descendant.
        """
        joints: list[TreeJoint] = []
        link = tip
        while link != base:
            if link not in self.joint_to or len(joints) > len(self.joints):
                return None
            joints.append(self.joint_to[link])
            link = joints[-1].parent
        return tuple(joints[::-1])

    def path(self, base: str, tip: str) -> tuple[TreeJoint, ...] | None:
        """Return the joints from a link up to the common ancestor, then down to another link.

        The result is None if the links are not connected.
        """
        root = self.root_of(base)
        up, down = self.path_down(root, base), self.path_down(root, tip)
        if up is None or down is None:
            return None
        shared = sum(
            1 for _ in takewhile(lambda pair: pair[0] is pair[1], zip(up, down, strict=False))
        )
        return (*reversed(up[shared:]), *down[shared:])

    def common_ancestor(self, links: Iterable[str]) -> str:
        """Return the lowest link that is an ancestor of all listed links."""
        first, *others = links
        above = self.path_down(self.root_of(first), first) or ()
        candidates = (first, *(joint.parent for joint in reversed(above)))
        return next(
            link
            for link in candidates
            if all(self.path_down(link, other) is not None for other in others)
        )

    def root_of(self, link: str) -> str:
        """Return the root above a link, or the link itself if its parents form a cycle."""
        start = link
        for _ in self.links:
            if link not in self.joint_to:
                return link
            link = self.joint_to[link].parent
        return start

    def outwards(self, link: str) -> Iterator[str]:
        """Yield a link and then all its descendants. Parents come first."""
        waiting = [link]
        while waiting:
            reached = waiting.pop()
            yield reached
            waiting += [joint.child for joint in reversed(self.below[reached])]

    def rigid(self, link: str) -> Iterator[str]:
        """Yield a link and all descendants that are fixed to it."""
        waiting = [link]
        while waiting:
            reached = waiting.pop()
            yield reached
            fixed = [joint for joint in self.below[reached] if joint.kind == "fixed"]
            waiting += [joint.child for joint in reversed(fixed)]

    def moved(self, link: str) -> tuple[TreeJoint, ...]:
        """Return the moving joints on a link, and on the links that are fixed to it."""
        return tuple(
            joint
            for part in self.rigid(link)
            for joint in self.below[part]
            if joint.kind != "fixed"
        )
