"""The chain that is meant where nobody names its ends, by rules that a user can read.

1. A joint called a finger (``FINGER_WORDS``) ends the arm. So do several branches of at most
   ``LONGEST_FINGER`` joints on one link behind ``JOINTS_OF_AN_ARM`` joints, or of any length where
   one of them is called a finger: the fingers of a hand.
2. The arm is the longest chain of joints with a coordinate of their own. Arms of equal length that
   end in different joints are several robots.
3. Among the links that are fixed to the last joint, the tip is the first with a well-known name, in
   the order of ``TOOL_NAMES``; else the only end that is no sensor; else the link that the last
   joint carries.
4. The base is the root of the tree, or the link that the last joint of several freedoms carries.
"""

import difflib
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, takewhile

from ...model.errors import RobotError
from .kinematic_tree import KinematicTree, TreeJoint

FINGER_WORDS = ("finger", "thumb", "knuckle", "gripper", "jaw", "claw")
"""A moving joint with such a word in its name belongs to a hand."""
SENSOR_WORDS = ("camera", "optical", "sensor", "imu", "laser", "lidar", "collision")
"""A link with such a word in its name is no tool."""
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
"""Names of tool frames, the most usual first; a prefix such as ``left_`` may stand before them."""
MOST_LINKS = 500
"""Links of a tree in which a tip may be guessed: a bound of the work that a file can cause."""
LONGEST_FINGER = 4
JOINTS_OF_AN_ARM = 4
MOST_OTHERS = 6
"""Other ends that a note names."""


class NoChain(RobotError):
    """No chain between the links asked for; the caller adds the file.

    Attributes:
        field: What was asked for: ``base``, ``tip`` or ``link``.
        value: The value found; None where there is none.
        expected: Description of a right value.
    """

    def __init__(self, field: str, value: str | None, expected: str) -> None:
        super().__init__(f"{field}: expected {expected}")
        self.field, self.value, self.expected = field, value, expected


@dataclass(frozen=True)
class Ends:
    """The ends of a chain: the base link, the tip link, and the ends that were not chosen."""

    base: str
    tip: str
    others: tuple[str, ...] = ()

    @property
    def note(self) -> str:
        """The choice as a note; empty where there was none."""
        if not self.others:
            return ""
        shown = ", ".join(self.others[:MOST_OTHERS])
        more = len(self.others) - MOST_OTHERS
        return f"tip: {self.tip}; also there: {shown}{f' and {more} more' if more > 0 else ''}"


def chosen_ends(tree: KinematicTree, base: str | None, tip: str | None) -> tuple[Ends, ...]:
    """The chain between two links; where one is not given, those that are meant.

    Args:
        tree: Links and joints.
        base: The base link.
        tip: The tip link.

    Returns:
        The ends of one chain, or of one for each arm of equal length, in the order of the file.

    Raises:
        NoChain: A link is none of the tree, there is no chain, or the tree has several roots.
    """
    for link in (base, tip):
        if link is not None and link not in tree.links:
            close = difflib.get_close_matches(link, tree.links, n=3) or tree.links
            raise NoChain("link", link, f"a link of the file, such as {', '.join(close)}")
    if tip is None:
        return _guessed_ends(tree, base or _only_root(tree))
    root = base or tree.root_of(tip)
    way = tree.way(root, tip)
    if way is None:
        raise NoChain("tip", tip, f"a link below {root}")
    if not way:
        raise NoChain("tip", tip, "a link other than the base")
    return (Ends(base or base_below(way, root), tip),)


def only_chain(tree: KinematicTree, base: str | None, tip: str | None) -> Ends:
    """The ends of the only chain between two links, see :func:`chosen_ends`.

    Raises:
        NoChain: There is none, or there are several.
    """
    found = chosen_ends(tree, base, tip)
    if len(found) > 1:
        tips = ", ".join(ends.tip for ends in found)
        raise NoChain(
            "tip", None, f"a choice of the tip link (chains of equal length end at: {tips})"
        )
    return found[0]


def _only_root(tree: KinematicTree) -> str:
    if not tree.links:
        raise NoChain("link", None, "links; the file has none, perhaps it only defines macros")
    if len(tree.roots) != 1:
        found = ", ".join(tree.roots) or "none"
        raise NoChain("base", None, f"a choice of the base link (there are: {found})")
    return tree.roots[0]


def _guessed_ends(tree: KinematicTree, base: str) -> tuple[Ends, ...]:
    """The chains that are meant below a link: one, or one for each arm of equal length."""
    if tree.root_of(base) in tree.joint_to or len(tree.links) > MOST_LINKS:
        raise NoChain("tip", None, f"a tip link: this is no tree of at most {MOST_LINKS} links")
    arms = _longest(list(_arms(tree, base)))
    leaves = [link for link in tree.outwards(base) if not tree.below[link]]
    if not arms:
        return (_without_motion(tree, base, leaves),)
    tips = [_tip(tree, arm[-1].child) for arm in arms]
    return tuple(
        Ends(
            base_below(arm, base),
            tip,
            tuple(dict.fromkeys(link for link in (*tips, *leaves) if link != tip)),
        )
        for arm, tip in zip(arms, tips, strict=True)
    )


def _without_motion(tree: KinematicTree, base: str, leaves: Sequence[str]) -> Ends:
    """The only end of a tree in which no joint of an arm has a coordinate: its reader says why."""
    if leaves == [base]:
        raise NoChain("tip", base, "a link other than the base, and a joint that moves it")
    if len(leaves) == 1:
        return Ends(base, leaves[0])
    below = [joint for link in tree.outwards(base) for joint in tree.below[link]]
    fingers = [joint.name for joint in below if joint.kind == "moving"]
    if fingers:
        shown = ", ".join(fingers[:MOST_OTHERS])
        raise NoChain("tip", None, f"a choice of the tip link (only fingers move: {shown})")
    raise NoChain("tip", None, "a joint that moves, or a choice of the tip link")


def base_below(way: Sequence[TreeJoint], base: str) -> str:
    """The base, or the link of the last joint of several freedoms on the way from it."""
    return next((joint.child for joint in reversed(way) if joint.kind == "free"), base)


def _longest(ways: Sequence[tuple[TreeJoint, ...]]) -> list[tuple[TreeJoint, ...]]:
    """The ways with most coordinates, one for each last joint with a coordinate of its own.

    Followers behind that joint belong to the way unless they branch.
    """
    most = max(map(_freedom, ways), default=0)
    by_last: dict[str, list[tuple[TreeJoint, ...]]] = {}
    for way in ways:
        if most and _freedom(way) == most:
            last = [joint.name for joint in way if joint.kind == "moving"][-1]
            by_last.setdefault(last, []).append(way)
    return [
        group[0] if any(len(a) == len(b) for a, b in pairwise(group)) else group[-1]
        for group in (sorted(found, key=len) for found in by_last.values())
    ]


def _freedom(way: Sequence[TreeJoint]) -> int:
    """The number of own coordinates on a way, behind the last joint of several freedoms."""
    behind = takewhile(lambda joint: joint.kind != "free", reversed(way))
    return sum(joint.kind == "moving" for joint in behind)


def _arms(tree: KinematicTree, base: str) -> Iterator[tuple[TreeJoint, ...]]:
    """The ways of all moving joints from a link outwards, fingers left out."""
    heights = _heights(tree, base)
    waiting: list[tuple[str, tuple[TreeJoint, ...]]] = [(base, ())]
    while waiting:
        link, way = waiting.pop()
        if way:
            yield way
        moved = tree.moved(link)
        if not _are_fingers(moved, heights, way):
            arms = [joint for joint in reversed(moved) if not _is_finger(joint)]
            waiting += [(joint.child, (*way, joint)) for joint in arms]


def _are_fingers(
    moved: Sequence[TreeJoint], heights: Mapping[str, int], way: Sequence[TreeJoint]
) -> bool:
    """Whether several branches at the end of a way are the fingers of a hand."""
    if _freedom(way) < JOINTS_OF_AN_ARM:
        return False
    short = all(heights[joint.child] < LONGEST_FINGER for joint in moved)
    return len(moved) > 1 and (short or any(_is_finger(joint) for joint in moved))


def _heights(tree: KinematicTree, base: str) -> dict[str, int]:
    """The greatest number of moving joints in series further out, of each link."""
    found: dict[str, int] = {}
    for link in reversed(list(tree.outwards(base))):
        lengths = (found[j.child] + (j.kind != "fixed") for j in tree.below[link])
        found[link] = max(lengths, default=0)
    return found


def _is_finger(joint: TreeJoint) -> bool:
    return _has_a_word(joint.name, FINGER_WORDS)


def _tip(tree: KinematicTree, link: str) -> str:
    """The tool frame among the links that are fixed to the last link."""
    links = list(tree.rigid(link))
    named = [part for part in links if _rank(part) is not None]
    if named:
        return min(named, key=lambda part: _rank(part) or 0)
    fixed = {joint.parent for part in links for joint in tree.below[part] if joint.kind == "fixed"}
    tools = [part for part in links if part not in fixed]
    tools = [part for part in tools if not _has_a_word(part, SENSOR_WORDS)]
    return tools[0] if len(tools) == 1 else link


def _rank(link: str) -> int | None:
    """The place of a link's name in the list of well-known names; None where it is not there."""
    words = link.lower()
    for rank, name in enumerate(TOOL_NAMES):
        if re.fullmatch(rf"(.*[^a-z0-9])?{name}", words):
            return rank
    return None


def _has_a_word(name: str, words: Iterable[str]) -> bool:
    return any(word in name.lower() for word in words)
