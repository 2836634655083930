"""The chain that is meant where nobody names its ends, by rules that a user can read.

1. Fingers and wheels end the arm (:mod:`~chasles.derive.description.importers.end_parts`), and so
   does a ball joint that carries no joint.
2. The arm is the longest chain of joints with a coordinate of their own. Arms of equal length that
   end in different joints are several robots.
3. Among the links that are fixed to the last joint, the tip is the first with a well-known name, in
   the order of ``TOOL_NAMES``; else the only end that is no sensor; else the link that the last
   joint carries.
4. The base is the root of the tree, or the link that the last floating or planar joint carries.
"""

import difflib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from ...model.errors import RobotError
from .end_parts import EndPart, Way, arms_of, freedom, has_a_word, named_parts, tool_rank
from .kinematic_tree import KinematicTree, TreeJoint

SENSOR_WORDS = ("camera", "optical", "sensor", "imu", "laser", "lidar", "collision")
"""A link with such a word in its name is no tool."""
MOST_LINKS = 500
"""Links of a tree in which a tip may be guessed: a bound of the work that a file can cause."""
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
    """The ends of a chain, and what their choice leaves out.

    Attributes:
        base: The base link.
        tip: The tip link.
        others: The ends that were not chosen.
        before: The joints before a base that was not given, the floating or planar joint last.
        left_out: Fingers and other end parts that are not part of the arm.
    """

    base: str
    tip: str
    others: tuple[str, ...] = ()
    before: tuple[str, ...] = ()
    left_out: tuple[EndPart, ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        """The choices as notes; none where both ends were given."""
        return tuple(filter(None, (self._of_tip, self._of_base, self._of_end_parts)))

    @property
    def _of_tip(self) -> str:
        return f"tip: {self.tip}; also there: {_few(self.others)}" if self.others else ""

    @property
    def _of_base(self) -> str:
        if not self.before:
            return ""
        *earlier, last = self.before
        text = f"base: {self.base}, which the floating or planar joint {last} carries"
        return f"{text}; left out before it: {_few(earlier)}" if earlier else text

    @property
    def _of_end_parts(self) -> str:
        parts = [f"{kind} {_few(names)}" for kind, names in named_parts(self.left_out)]
        if not parts:
            return ""
        text = f"not part of the arm: {'; '.join(parts)}"
        hand = [part for part in self.left_out if part.kind in ("fingers", "short branches")]
        wheels = [part for part in self.left_out if part.kind == "wheels"]
        joints = [part.joint for part in (*hand, *wheels)]
        first = next((joint for joint in joints if joint.kind == "moving"), None)
        return text if first is None else f"{text} (--tip {first.child} includes {first.name})"


def _few(names: Sequence[str]) -> str:
    """Names with commas between, a long list cut."""
    more = len(names) - MOST_OTHERS
    return f"{', '.join(names[:MOST_OTHERS])}{f' and {more} more' if more > 0 else ''}"


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
        return _guessed_ends(tree, base)
    root = base or tree.root_of(tip)
    way = tree.way(root, tip)
    if way is None:
        raise NoChain("tip", tip, f"a link below {root}")
    if not way:
        raise NoChain("tip", tip, "a link other than the base")
    return (_ends(way, base, root, tip),)


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
    _check_joints(tree.way(found[0].base, found[0].tip) or ())
    return found[0]


def _check_joints(way: Sequence[TreeJoint]) -> None:
    """Refuses joints of several freedoms between base and tip.

    Raises:
        NoChain: There is one; the message says how to choose the ends around it.
    """
    for joint in way:
        if joint.kind in ("ball", "free"):
            kind = "a ball joint" if joint.kind == "ball" else "a floating or planar joint"
            raise NoChain(
                "joint",
                joint.name,
                f"revolute, prismatic and fixed joints between base and tip, not {kind} "
                f"(--base {joint.child} begins behind it, --tip {joint.parent} ends before it)",
            )


def leader_between(follower: str, ends: Ends) -> str:
    """Return the words of an error about a follower whose leader is not in the chain."""
    return (
        f"a joint between {ends.base} and {ends.tip} that {follower} follows; without the "
        f"coupling, {follower} has a coordinate of its own"
    )


def _only_root(tree: KinematicTree) -> str:
    if not tree.links:
        raise NoChain("link", None, "links; the file has none, perhaps it only defines macros")
    if len(tree.roots) != 1:
        found = ", ".join(tree.roots) or "none"
        raise NoChain("base", None, f"a choice of the base link (there are: {found})")
    return tree.roots[0]


def _guessed_ends(tree: KinematicTree, base: str | None) -> tuple[Ends, ...]:
    """The chains that are meant below a link: one, or one for each arm of equal length."""
    root = base or _only_root(tree)
    if tree.root_of(root) in tree.joint_to or len(tree.links) > MOST_LINKS:
        raise NoChain("tip", None, f"a tip link: this is no tree of at most {MOST_LINKS} links")
    arms = arms_of(tree, root)
    longest = _longest(arms.ways)
    leaves = [link for link in tree.outwards(root) if not tree.below[link]]
    if not longest:
        return (_without_motion(root, leaves, arms.left_out),)
    tips = [_tip(tree, arm[-1].child) for arm in longest]
    return tuple(
        replace(
            _ends(arm, base, root, tip),
            others=tuple(dict.fromkeys(link for link in (*tips, *leaves) if link != tip)),
            left_out=arms.left_out,
        )
        for arm, tip in zip(longest, tips, strict=True)
    )


def _without_motion(base: str, leaves: Sequence[str], left_out: Sequence[EndPart]) -> Ends:
    """The only end of a tree in which no joint of an arm has a coordinate: its reader says why."""
    if leaves == [base]:
        raise NoChain("tip", base, "a link other than the base, and a joint that moves it")
    if len(leaves) == 1:
        return Ends(base, leaves[0])
    parts = [f"{kind} move: {_few(names)}" for kind, names in named_parts(left_out)]
    if parts:
        raise NoChain("tip", None, f"a choice of the tip link (only {'; '.join(parts)})")
    raise NoChain("tip", None, "a joint that moves, or a choice of the tip link")


def _ends(way: Sequence[TreeJoint], base: str | None, root: str, tip: str) -> Ends:
    """The ends of a chain: without a base, it begins behind the last floating or planar joint."""
    free = [k for k, joint in enumerate(way) if joint.kind == "free"]
    if base is not None or not free:
        return Ends(root, tip)
    before = [joint.name for joint in way[: free[-1] + 1] if joint.kind != "fixed"]
    return Ends(way[free[-1]].child, tip, before=tuple(before))


def _longest(ways: Sequence[Way]) -> list[Way]:
    """The ways with most coordinates, one for each last joint with a coordinate of its own.

    Followers behind that joint belong to the way unless they branch.
    """
    most = max(map(freedom, ways), default=0)
    by_last: dict[str, list[Way]] = {}
    for way in ways:
        if most and freedom(way) == most:
            last = [joint.name for joint in way if joint.kind in ("moving", "ball")][-1]
            by_last.setdefault(last, []).append(way)
    return [
        group[0] if any(len(a) == len(b) for a, b in pairwise(group)) else group[-1]
        for group in (sorted(found, key=len) for found in by_last.values())
    ]


def _tip(tree: KinematicTree, link: str) -> str:
    """The tool frame among the links that are fixed to the last link."""
    links = list(tree.rigid(link))
    named = [part for part in links if tool_rank(part) is not None]
    if named:
        return min(named, key=lambda part: tool_rank(part) or 0)
    fixed = {joint.parent for part in links for joint in tree.below[part] if joint.kind == "fixed"}
    tools = [part for part in links if part not in fixed]
    tools = [part for part in tools if not has_a_word(part, SENSOR_WORDS)]
    return tools[0] if len(tools) == 1 else link
