"""Finds the end parts of an arm: fingers, wheels, short branches and ball joints.

A finger is a joint with one of ``FINGER_WORDS`` in its name. If at least ``JOINTS_OF_AN_ARM``
joints precede a finger, all branches on its parent link are fingers too. A joint that follows a
moving joint is also a finger if the name of its parent link contains a word of ``FINGER_WORDS``. If
several prismatic or coupled joints start at one link after a moving joint, these joints are fingers
too, unless they carry a tool frame.

Most hands have several branches that start at one link. Such branches count as fingers if each
branch has at most ``LONGEST_FINGER`` joints and at least ``JOINTS_OF_AN_ARM`` joints precede the
link.

A joint is a wheel if its name or the name of its child link matches the pattern ``WHEEL``. A base
joint also counts as a wheel if it carries only wheels.

A ball joint counts as the end of a rod or a rope if no moving joint comes after it in the tree.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from typing import Literal

from .kinematic_tree import KinematicTree, TreeJoint

FINGER_WORDS = ("finger", "thumb", "knuckle", "gripper", "jaw", "claw")
"""Words in the names of hand joints."""
WHEEL = re.compile(r"wheel(?!chair|[ _-]?base)|cast[eo]r", re.IGNORECASE)
"""Pattern for the names of wheel joints and wheel links."""
TOOL_NAMES = (
    "tool0",
    "tcp",
    "ee_link",
    "end_effector",
    "end_effector_link",
    "end_link",
    "flange",
    "ee",
    "eef",
    "link_eef",
    "ee_frame",
    "attachment_site",
    "grasp_site",
    "pinch",
    "tool_frame",
    "tool_link",
    "tool",
    "hand",
    "palm",
)
"""Names of tool frames. The most common names come first. Prefixes such as ``left_`` are
allowed."""
LONGEST_FINGER = 4
JOINTS_OF_AN_ARM = 4
FREEDOMS_OF_A_BALL = 3
TreePath = tuple[TreeJoint, ...]
EndPartKind = Literal["fingers", "wheels", "short branches", "ball joints"]


@dataclass(frozen=True)
class EndPart:
    """A joint that does not belong to the arm.

    The joint and all links after the joint are excluded from the arm.
    """

    kind: EndPartKind
    joint: TreeJoint


@dataclass(frozen=True)
class Arms:
    """Chains of moving joints that start at a base link, and joints outside these chains."""

    paths: tuple[TreePath, ...]
    left_out: tuple[EndPart, ...]


def arms_of(tree: KinematicTree, base: str) -> Arms:
    """Return the chains of moving joints from a base link. Fingers, wheels etc. are excluded."""
    heights = _heights(tree, base)
    paths: list[TreePath] = []
    left_out: list[EndPart] = []
    waiting: list[tuple[str, TreePath]] = [(base, ())]
    while waiting:
        link, path = waiting.pop()
        if path:
            paths.append(path)
        moved = tree.moved(link)
        kinds = [_end_part(tree, joint, moved, path, heights) for joint in moved]
        pairs = list(zip(moved, kinds, strict=True))
        left_out += [EndPart(kind, joint) for joint, kind in pairs if kind is not None]
        arms = [joint for joint, kind in reversed(pairs) if kind is None]
        waiting += [(joint.child, (*path, joint)) for joint in arms]
    return Arms(tuple(paths), tuple(left_out))


def freedom(path: Sequence[TreeJoint]) -> int:
    """Return the number of coordinates after the last floating or planar joint of a chain."""
    behind = takewhile(lambda joint: joint.kind != "free", reversed(path))
    counts = {"moving": 1, "ball": FREEDOMS_OF_A_BALL}
    return sum(counts.get(joint.kind, 0) for joint in behind)


def has_a_word(name: str, words: Iterable[str]) -> bool:
    """Whether a name contains one of several words."""
    return any(word in name.lower() for word in words)


def tool_rank(link: str) -> int | None:
    """Return the index of a link name in ``TOOL_NAMES``, or None."""
    words = link.lower()
    for rank, name in enumerate(TOOL_NAMES):
        if re.fullmatch(rf"(.*[^a-z0-9])?{name}", words):
            return rank
    return None


def _end_part(
    tree: KinematicTree,
    joint: TreeJoint,
    moved: Sequence[TreeJoint],
    path: TreePath,
    heights: Mapping[str, int],
) -> EndPartKind | None:
    """Return the kind of end part (such as fingers) at a joint, or None for a joint of the arm."""
    if joint.kind == "ball" and not heights[joint.child]:
        return "ball joints"
    if _is_wheel(joint) or (not freedom(path) and _steers_wheels(tree, joint)):
        return "wheels"
    is_behind = has_a_word(joint.parent, FINGER_WORDS) or _is_jaw(tree, joint, moved, heights)
    if _is_finger(joint) or (path and is_behind):
        return "fingers"
    if len(moved) < 2 or freedom(path) < JOINTS_OF_AN_ARM:  # noqa: PLR2004
        return None
    if any(map(_is_finger, moved)):
        return "fingers"
    short = all(heights[other.child] < LONGEST_FINGER for other in moved)
    return "short branches" if short else None


def _is_jaw(
    tree: KinematicTree, joint: TreeJoint, moved: Sequence[TreeJoint], heights: Mapping[str, int]
) -> bool:
    ends = [other for other in moved if not heights[other.child] and not _has_a_tool(tree, other)]
    return joint in ends and any(
        (joint.is_prismatic and other.is_prismatic) or _leader(joint) == _leader(other)
        for other in ends
        if other != joint
    )


def _has_a_tool(tree: KinematicTree, joint: TreeJoint) -> bool:
    return any(tool_rank(part) is not None for part in tree.rigid(joint.child))


def _leader(joint: TreeJoint) -> str:
    return joint.leader or joint.name


def _heights(tree: KinematicTree, base: str) -> dict[str, int]:
    """Return, for each link, the maximum number of moving joints on a branch after the link."""
    found: dict[str, int] = {}
    for link in reversed(list(tree.outwards(base))):
        lengths = (found[j.child] + (j.kind != "fixed") for j in tree.below[link])
        found[link] = max(lengths, default=0)
    return found


def _is_finger(joint: TreeJoint) -> bool:
    return has_a_word(joint.name, FINGER_WORDS)


def _is_wheel(joint: TreeJoint) -> bool:
    return any(WHEEL.search(name) for name in (joint.name, joint.child))


def _steers_wheels(tree: KinematicTree, joint: TreeJoint) -> bool:
    """Whether a joint carries only wheels."""
    carried = tree.moved(joint.child)
    return joint.kind == "moving" and bool(carried) and all(map(_is_wheel, carried))


def named_parts(left_out: Iterable[EndPart]) -> Iterator[tuple[EndPartKind, list[str]]]:
    """Yield each kind of end part with the names of its joints. Mimic joints are omitted."""
    names: dict[EndPartKind, list[str]] = {}
    for part in left_out:
        if part.joint.kind != "follower":
            names.setdefault(part.kind, []).append(part.joint.name)
    yield from names.items()
