"""Infers the chain of an arm if the base or the tip is not specified.

The arm ends before fingers, wheels and final ball joints
(``end_parts``).

The arm is the chain with the largest number of coordinates. If the longest chains have equal length
but different last joints, each of these chains is a separate robot.

The tip is attached to the last joint. The first link with a name in ``TOOL_NAMES`` is the tip. The
base is the root of the tree, or the child link of the last floating or planar joint.
"""

import difflib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from ...model.errors import DescriptionError
from .end_parts import EndPart, TreePath, arms_of, freedom, has_a_word, named_parts, tool_rank
from .kinematic_tree import KinematicTree, TreeJoint

SENSOR_WORDS = ("camera", "optical", "sensor", "imu", "laser", "lidar", "collision")
"""Words in the names of links. A link whose name contains one of these words is a sensor, not a
tool."""
MAX_LINKS = 500
"""Maximum number of links. In a tree with more than 500 links, the tip is not inferred."""
MAX_OTHERS = 6
"""Maximum number of alternative tip links that a note lists."""


class NoChain(DescriptionError):
    """The chain between base and tip cannot be determined.

    The caller adds the file name to the error message.

    Attributes:
        field: What is wrong or missing, such as ``base``, ``tip``, ``link``, ``joint`` or
            ``mimic``.
        value: The wrong value, or None if the argument is missing.
        expected: A valid value, in words.
    """

    def __init__(self, field: str, value: str | None, expected: str) -> None:
        super().__init__(f"{field}: expected {expected}")
        self.field, self.value, self.expected = field, value, expected


@dataclass(frozen=True)
class Ends:
    """The base and tip link of a chain, other possible tip links, and excluded parts.

    Attributes:
        base: The base link.
        tip: The tip link.
        others: The other possible tip links.
        before: Names of the moving joints before the base link, if the base link was inferred. The
            last joint before the base is floating or planar.
        left_out: Fingers and other end parts.
    """

    base: str
    tip: str
    others: tuple[str, ...] = ()
    before: tuple[str, ...] = ()
    left_out: tuple[EndPart, ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        """Note on an inferred base or tip. The tuple is empty if both were given."""
        return tuple(filter(None, (self._of_tip, self._of_base, self._of_end_parts)))

    @property
    def _of_tip(self) -> str:
        return f"tip: {self.tip}; also there: {_few(self.others)}" if self.others else ""

    @property
    def _of_base(self) -> str:
        if not self.before:
            return ""
        *earlier, last = self.before
        text = f"base: {self.base}, the child of the floating or planar joint {last}"
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
    more = len(names) - MAX_OTHERS
    return f"{', '.join(names[:MAX_OTHERS])}{f' and {more} more' if more > 0 else ''}"


def chosen_ends(tree: KinematicTree, base: str | None, tip: str | None) -> tuple[Ends, ...]:
    """Return the base link and tip link of the chain.

    A link that is None is inferred.

    Args:
        tree: The tree of links and joints.
        base: The base link.
        tip: The tip link.

    Returns:
        The base link and tip link of the chain. If several arms have equal length, the links of
        each arm are returned in the order of the file.

    Raises:
        NoChain: A link is unknown, no chain exists, or the tree has several roots.
    """
    for link in (base, tip):
        if link is not None and link not in tree.links:
            close = difflib.get_close_matches(link, tree.links, n=3) or tree.links
            raise NoChain("link", link, f"a link of the file, such as {', '.join(close)}")
    if tip is None:
        return _guessed_ends(tree, base)
    root = base or tree.root_of(tip)
    path = tree.path(root, tip)
    if path is None:
        raise NoChain("tip", tip, f"a link that is connected to {root} by joints")
    if not path:
        raise NoChain("tip", tip, "a link other than the base")
    return (_ends(path, base, root, tip),)


def only_chain(tree: KinematicTree, base: str | None, tip: str | None) -> Ends:
    """Return the ends of the only chain between two links. See ``chosen_ends``.

    Raises:
        NoChain: There is no chain, or more than one.
    """
    found = chosen_ends(tree, base, tip)
    if len(found) > 1:
        tips = ", ".join(ends.tip for ends in found)
        raise NoChain(
            "tip", None, f"a choice of the tip link, because chains of equal length end at {tips}"
        )
    _check_joints(tree.path(found[0].base, found[0].tip) or (), found[0].base)
    return found[0]


def _check_joints(path: Sequence[TreeJoint], base: str) -> None:
    """Raise an error if a joint between base and tip has several degrees of freedom.

    Raises:
        NoChain: The chain has a joint with several degrees of freedom.
    """
    before = base
    for joint in path:
        behind = joint.child if joint.parent == before else joint.parent
        if joint.kind in ("ball", "free"):
            kind = "a ball joint" if joint.kind == "ball" else "a floating or planar joint"
            raise NoChain(
                "joint",
                joint.name,
                f"revolute, prismatic and fixed joints between base and tip, not {kind} "
                f"(to exclude this joint, use --base {behind} or --tip {before})",
            )
        before = behind


def leader_between(follower: str, ends: Ends) -> str:
    """Return the error text for a mimic joint whose leader is outside the chain."""
    return (
        f"a joint between {ends.base} and {ends.tip} that {follower} follows; without the "
        f"coupling, {follower} has its own coordinate"
    )


def _only_root(tree: KinematicTree) -> str:
    if not tree.links:
        raise NoChain("link", None, "links; the file has no links, perhaps only macros")
    if len(tree.roots) != 1:
        found = ", ".join(tree.roots) or "none"
        raise NoChain("base", None, f"a choice of the base link among {found}")
    return tree.roots[0]


def _guessed_ends(tree: KinematicTree, base: str | None) -> tuple[Ends, ...]:
    """Return the base and tip links of the longest arms that start at a link."""
    root = base or _only_root(tree)
    if tree.root_of(root) in tree.joint_to or len(tree.links) > MAX_LINKS:
        raise NoChain(
            "tip", None, f"a tip link, because the file is not a tree of at most {MAX_LINKS} links"
        )
    arms = arms_of(tree, root)
    longest = _longest(arms.paths)
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
    """Return the base and the only end link of a tree without arm joints, or raise an error."""
    if leaves == [base]:
        raise NoChain("tip", base, "a link other than the base, and a joint that moves it")
    if len(leaves) == 1:
        return Ends(base, leaves[0])
    parts = [f"{kind} move: {_few(names)}" for kind, names in named_parts(left_out)]
    if parts:
        raise NoChain("tip", None, f"a choice of the tip link (only {'; '.join(parts)})")
    raise NoChain("tip", None, "a joint that moves, or a choice of the tip link")


def _ends(path: Sequence[TreeJoint], base: str | None, root: str, tip: str) -> Ends:
    """Return the ends of a chain.

    By default, the base is the link after the last floating or planar joint.
    """
    free = [k for k, joint in enumerate(path) if joint.kind == "free"]
    if base is not None or not free:
        return Ends(root, tip)
    before = [joint.name for joint in path[: free[-1] + 1] if joint.kind != "fixed"]
    return Ends(path[free[-1]].child, tip, before=tuple(before))


def _longest(paths: Sequence[TreePath]) -> list[TreePath]:
    """Return the chains with the most coordinates, one chain for each last joint.

    A chain includes the mimic joints after its last joint, unless they branch.
    """
    most = max(map(freedom, paths), default=0)
    by_last: dict[str, list[TreePath]] = {}
    for path in paths:
        if most and freedom(path) == most:
            last = [joint.name for joint in path if joint.kind in ("moving", "ball")][-1]
            by_last.setdefault(last, []).append(path)
    return [
        group[0] if any(len(a) == len(b) for a, b in pairwise(group)) else group[-1]
        for group in (sorted(found, key=len) for found in by_last.values())
    ]


def _tip(tree: KinematicTree, link: str) -> str:
    """Return the tool frame among the links that are fixed to the last link."""
    links = list(tree.rigid(link))
    named = [part for part in links if tool_rank(part) is not None]
    if named:
        return min(named, key=lambda part: tool_rank(part) or 0)
    fixed = {joint.parent for part in links for joint in tree.below[part] if joint.kind == "fixed"}
    tools = [part for part in links if part not in fixed]
    tools = [part for part in tools if not has_a_word(part, SENSOR_WORDS)]
    return tools[0] if len(tools) == 1 else link
