"""Reads the chain between two links of an SDF model, with its loops.

The joints of the model form a tree. A joint whose child already has a parent joint closes a loop.
Each frame of the model becomes a link. A fixed joint attaches this link to the link that carries
the frame. As in Drake, a joint with effort limit 0 is passive. Passive joints matter only in loops.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import mpmath as mp
import sympy as sp
from lxml import etree

from ....model.coupling import equation_of, solved_for
from ....model.errors import DescriptionError
from ....model.kinds import JointKind
from ....model.linear_equations import LinearEquation, eliminated
from ....model.mechanism import Closure, ClosureKind, Described, Frame, Mechanism, Strut
from ....model.placements import Placement, Rotation, Vector, align_z
from ....model.robot import Coupling, Joint, SerialRobot
from ....model.tolerances import EVALUATION_DIGITS, UNLIMITED
from ...chain_between import between, outwards
from ...conventions.urdf_origin import urdf
from ...plausibility import implausible_values
from ...pose_error import pose_in_digits
from ..identifiers import identifier, prefix
from ..kinematic_tree import KinematicTree, TreeJoint, TreeJointKind
from ..limits import without_limits
from ..mjcf.mjcf_model import length
from ..robot_xml import parsed
from ..tool_links import Ends, NoChain, chosen_ends, leader_between, only_chain
from .gearboxes import Gearboxes
from .sdf_frames import MODEL, WORLD, SdfFrames, merged, origin_of
from .universal_joints import split_universal_joints

KINDS: Mapping[str, JointKind] = {
    "revolute": "revolute",
    "continuous": "revolute",
    "prismatic": "prismatic",
    "fixed": "fixed",
}
CLOSURES: Mapping[str, ClosureKind] = {
    "revolute": "pin",
    "continuous": "pin",
    "prismatic": "slider",
    "fixed": "weld",
    "ball": "ball",
}
"""Kinds of closures by the type of the closing joint."""


class SdfFile:
    """A parsed SDF file that contains one model."""

    def __init__(self, file: str, text: str) -> None:
        """Read the links, frames and joints of the model.

        Raises:
            DescriptionError: The text is not valid SDF, includes other files, or does not contain
                exactly one model.
        """
        self.file = file
        root = parsed(file, text, "sdf")
        models = [*root.findall("model"), *root.findall("world/model")]
        model = models[0] if models else root
        split_universal_joints(model)
        self.frames = SdfFrames(file, model)
        self.fail = self.frames.fail
        for element in root.iter("include"):
            self.fail(element, "", None, "a file without <include>: insert the included model")
        if len(models) != 1 or model.find("model") is not None:
            self.fail(root, "model", len([*root.iter("model")]), "one model, without nested models")
        self.links = [*dict.fromkeys(self._links())]
        self.joints = {
            str(j.get("name")): j for j in model.findall("joint") if j.get("type") != "gearbox"
        }
        self.tree_joints: dict[str, etree._Element] = {}
        """The joints of the tree, keyed by the name of the child link."""
        self.closing: list[etree._Element] = []
        for joint in sorted(self.joints.values(), key=self._order):
            parent, child = self._ends(joint)
            if child in self.tree_joints or parent == child or child in self._above(parent):
                self.closing.append(joint)
            else:
                self.tree_joints[child] = joint

    def _links(self) -> Iterator[str]:
        if any((j.findtext("parent") or "").strip() == WORLD for j in self._all("joint")):
            yield WORLD
        for element in self._all("link"):
            yield str(element.get("name"))

    def _all(self, kind: str) -> list[etree._Element]:
        return list(self.frames.model.findall(kind))

    def _ends(self, joint: etree._Element) -> tuple[str, str]:
        parent, child = (
            self.frames.link_of(self.frames.text(joint, t)) for t in ("parent", "child")
        )
        if child == WORLD:
            self.fail(joint, "child", child, "a link: world is the parent of joints")
        return parent, child

    def _above(self, link: str) -> list[str]:
        found = [link]
        while found[-1] in self.tree_joints:
            found.append(self._ends(self.tree_joints[found[-1]])[0])
        return found

    def _order(self, joint: etree._Element) -> tuple[bool, bool]:
        """Return a key that sorts active joints before passive joints, and ball joints last."""
        return self._is_passive(joint), joint.get("type") == "ball"

    @staticmethod
    def _is_passive(joint: etree._Element) -> bool:
        effort = (joint.findtext("axis/limit/effort") or "").strip()
        return joint.get("type") in ("fixed", "ball") or (effort != "" and not effort.strip("0.+-"))

    # --- the tree of links and joints ---

    @cached_property
    def tree(self) -> KinematicTree:
        """The tree of all links, frames and joints."""
        joints = [
            TreeJoint(
                str(joint.get("name")),
                self._kind(joint),
                self._ends(joint)[0],
                child,
                leader=self._leader(joint),
                is_prismatic=joint.get("type") == "prismatic",
            )
            for child, joint in self.tree_joints.items()
        ]
        frames = [str(element.get("name")) for element in self._all("frame")]
        joints += [TreeJoint(f"{f}_mount", "fixed", self.frames.link_of(f), f) for f in frames]
        return KinematicTree((*self.links, *frames), tuple(joints))

    def _kind(self, joint: etree._Element) -> TreeJointKind:
        kind = joint.get("type", "")
        if kind == "ball":
            return "ball"
        if kind not in KINDS:
            self.fail(joint, "type", kind, f"one of {', '.join(CLOSURES)}, universal, gearbox")
        if kind == "fixed":
            return "fixed"
        return "follower" if self._leader(joint) else "moving"

    @staticmethod
    def _leader(joint: etree._Element) -> str:
        mimic = joint.find("axis/mimic")
        return "" if mimic is None else str(mimic.get("joint"))

    def ends(self, base: str | None, tip: str | None) -> tuple[Ends, ...]:
        """Return the chains between base and tip.

        If base or tip is None, the link is inferred.

        Raises:
            DescriptionError: A link is unknown, or no chain exists.
        """
        try:
            return chosen_ends(self.tree, base, tip)
        except NoChain as error:
            self.fail(self.frames.model, error.field, error.value, error.expected)

    def robot(self, base: str | None, tip: str | None, name: str | None) -> Described:
        """Return the chain between two links or frames.

        Args:
            base: The link of the base frame. The default is the root link of the model.
            tip: The link of the tool frame. The default is the end of the longest chain.
            name: Name of the robot. By default, the name of the model.

        Raises:
            DescriptionError: The chain does not exist, or contains unsupported elements.
        """
        model = self.frames.model
        try:
            ends = only_chain(self.tree, base, tip)
            return self._between(ends, prefix(name or self.frames.attribute(model, "name")))
        except NoChain as error:
            self.fail(model, error.field, error.value, error.expected)
        except DescriptionError as error:
            if error.file:
                raise
            self.fail(model, "", None, f"joints that make a robot ({error})")

    def _between(self, ends: Ends, name: str) -> Described:
        path = self.tree.path(ends.base, ends.tip) or ()
        return self._with_loops(ends, name) if self._in_loops(path) else self._serial(ends, name)

    def _source(self, ends: Ends) -> str:
        return f"SDF {Path(self.file).name}, {ends.base} to {ends.tip}"

    def _serial(self, ends: Ends, name: str) -> SerialRobot:
        path, base = self.tree.path(ends.base, ends.tip) or (), identifier(ends.base)
        names = {joint.name for joint in path}
        for joint in path:
            if joint.leader and joint.leader not in names:
                raise NoChain("mimic", joint.leader, leader_between(joint.name, ends))
        joints: list[Joint] = []
        link = ends.base
        for each in path:
            # If the path leads from a child link to its parent link, the fixed joint at the child
            # link comes first.
            is_down = each.parent == link
            joints += self._joints(each) if is_down else reversed([*self._joints(each)])
            link = each.child if is_down else each.parent
        robot = SerialRobot(
            name,
            tuple(replace(joint, parent="") for joint in outwards(joints, base)),
            str(self.frames.model.get("name")),
            self._source(ends),
            base_frame=base,
            tool_frame=identifier(ends.tip),
            couplings=self._geared(path),
        )
        return replace(
            robot, notes=(*ends.notes, *self._unlimited(path), *implausible_values(robot))
        )

    def _with_loops(self, ends: Ends, name: str) -> Described:
        base, tip = identifier(ends.base), identifier(ends.tip)
        root = self.tree.root_of(ends.base)
        tree = [j for link in self.tree.outwards(root) for j in self.tree.below[link]]
        balls = [joint for joint in tree if joint.kind == "ball"]
        rods = tuple(map(self._rod, balls))
        on_rods = {link for joint in balls for link in self.tree.rigid(joint.child)}
        tree = [joint for joint in tree if joint.child not in on_rods]
        ended = {rod.name for rod in rods}
        couplings = self._geared(tree)
        coupled = {coupling.joint for coupling in couplings}
        driven = [
            joint
            for joint in tree
            if joint.kind == "moving"
            and self._is_driven(joint.name)
            and identifier(joint.name) not in coupled
        ]
        robot = Mechanism(
            name=name,
            joints=tuple(joint for each in tree for joint in self._joints(each)),
            actuated=tuple(identifier(joint.name) for joint in driven),
            closures=tuple(
                self._closure(joint)
                for joint in self.closing
                if identifier(str(joint.get("name"))) not in ended
            ),
            struts=rods,
            couplings=couplings,
            tool_body=tip,
            title=str(self.frames.model.get("name")),
            source=self._source(ends),
            base_frame=identifier(root),
            tool_frame=tip,
            notes=(*ends.notes, *self._unlimited(driven)),
        )
        return between(robot, base, tip, self.file)

    def _in_loops(self, path: Sequence[TreeJoint]) -> bool:
        """Whether the path shares a joint with a loop, directly or through followers or gears."""
        around = {joint.name for joint in path if joint.kind != "fixed"}
        for coupling in self._couplings([joint for joint in path if joint.kind == "follower"]):
            around |= {name for name in self.joints if identifier(name) in dict(coupling.ratios)}
        meshed = [{*equation.factors} for equation in self._gears]
        for _ in meshed:
            around = around.union(*(group for group in meshed if group & around))
        loops = []
        for joint in self.closing:
            joints = self.tree.path(*self._ends(joint)) or ()
            loops.append({each.name for each in joints if each.kind != "fixed"})
        return any(around & loop for loop in loops)

    # --- a single joint of the model ---

    def _joints(self, joint: TreeJoint) -> Iterator[Joint]:
        """Yield a joint.

        If the joint frame differs from the frame of the child link, a fixed joint to the child link
        follows.
        """
        element = self.joints.get(joint.name)
        if element is None or joint.kind == "fixed":
            yield self._fixed(joint.name, joint.parent, joint.child, (joint.parent, joint.child))
            return
        kind = KINDS[element.get("type", "")]
        offset = self.frames.relative(joint.name, joint.child)
        middle = f"{joint.child}_{joint.name}" if offset else joint.child
        xyz, rpy = origin_of(self.frames.relative(joint.parent, joint.name))
        given: dict[str, sp.Expr | Vector] = {"xyz": xyz, "rpy": rpy, "axis": self._axis(element)}
        before, after = urdf(kind, **given)
        yield Joint(
            identifier(joint.name),
            kind,
            before,
            after,
            identifier(middle),
            identifier(joint.parent),
            self._limits(element),
            convention=urdf,
            given=urdf.scalars(given),
        )
        if offset:
            yield self._fixed(
                f"{joint.child}_mount", middle, joint.child, (joint.name, joint.child)
            )

    def _fixed(self, name: str, parent: str, child: str, frames: tuple[str, str]) -> Joint:
        xyz, rpy = origin_of(self.frames.relative(*frames))
        axis = (sp.S.Zero, sp.S.Zero, sp.S.One)
        given: dict[str, sp.Expr | Vector] = {"xyz": xyz, "rpy": rpy, "axis": axis}
        before, after = urdf("fixed", **given)
        names = identifier(name), identifier(child), identifier(parent)
        return Joint(
            names[0],
            "fixed",
            before,
            after,
            names[1],
            names[2],
            convention=urdf,
            given=urdf.scalars(given),
        )

    def _closure(self, joint: etree._Element) -> Closure:
        kind, name = joint.get("type", ""), str(joint.get("name"))
        if kind not in CLOSURES:
            self.fail(joint, "type", kind, f"one of {', '.join(CLOSURES)}")
        turned: Placement = () if kind in ("ball", "fixed") else align_z(self._axis(joint))
        a, b = (
            Frame(identifier(link), self.frames.relative(link, name) + turned)
            for link in self._ends(joint)
        )
        return Closure(identifier(name), CLOSURES[kind], a, b)

    def _rod(self, joint: TreeJoint) -> Strut:
        """Return the rod that represents a link between two ball joints.

        The rod has the name of the second ball joint.

        Raises:
            DescriptionError: The link between the two ball joints has further joints.
        """
        links = {*self.tree.rigid(joint.child)}
        closing = [each for each in self.closing if links & {*self._ends(each)}]
        types = [each.get("type") for each in closing]
        if types != ["ball"] or self.tree.moved(joint.child):
            raise DescriptionError(
                f"joint {joint.name!r}: a ball joint must close a loop or carry a rod with a "
                f"second ball joint; add another joint with the child {joint.child!r}"
            )
        second = str(closing[0].get("name"))
        (other,) = (link for link in self._ends(closing[0]) if link not in links)
        a, b = (
            Frame(identifier(link), self.frames.relative(link, name))
            for link, name in ((joint.parent, joint.name), (other, second))
        )
        xyz, _ = origin_of(self.frames.relative(joint.name, second))
        far = length(float(sp.sqrt(sum(part**2 for part in xyz))))
        return Strut(identifier(second), a, b, far, ends="ball")

    def _axis(self, joint: etree._Element, tag: str = "axis") -> Vector:
        xyz = joint.find(f"{tag}/xyz")
        words = ["0", "0", "1"] if xyz is None else (xyz.text or "").split()
        if len(words) != 3:  # noqa: PLR2004
            self.fail(joint, "xyz", " ".join(words), "three numbers")
        x, y, z = (self.frames.number(joint, "xyz", word) for word in words)
        if not any((x, y, z)):
            self.fail(joint, "xyz", " ".join(words), "a direction")
        frame = "" if xyz is None else xyz.get("expressed_in", "")
        if (joint.findtext(f"{tag}/use_parent_model_frame") or "").strip() in ("1", "true"):
            frame = MODEL
        turn = self.frames.relative(str(joint.get("name")), frame) if frame else ()
        turns = merged(tuple(motion for motion in turn if isinstance(motion, Rotation)))
        if not turns:
            return x, y, z
        with mp.workdps(EVALUATION_DIGITS):
            R = pose_in_digits(turns, {})
            v = [mp.mpf(value.p) / value.q for value in (x, y, z)]
            x, y, z = (length(float(sum(R[i, j] * v[j] for j in range(3)))) for i in range(3))
        return x, y, z

    def _limits(self, joint: etree._Element) -> tuple[sp.Expr | None, sp.Expr | None]:
        texts = [
            (joint.findtext(f"axis/limit/{side}") or "").strip() for side in ("lower", "upper")
        ]
        if joint.get("type") == "continuous":
            return None, None
        numbers = [
            None if text.lstrip("+-") in ("", "inf") else self.frames.number(joint, "limit", text)
            for text in texts
        ]
        lower, upper = (None if n is not None and abs(n) >= UNLIMITED else n for n in numbers)
        if lower is not None and upper is not None and not lower < upper:
            self.fail(joint, "limit", f"{lower}, {upper}", "a lower limit below the upper")
        return lower, upper

    def _couplings(self, joints: Sequence[TreeJoint]) -> Iterator[Coupling]:
        """Yield the couplings of the mimic joints.

        A mimic joint may follow another mimic joint. The coupling then refers to the joint at the
        end of this sequence, which is not a mimic joint.
        """
        for joint in joints:
            multiplier, offset, seen = sp.S.One, sp.S.Zero, [self.joints.get(joint.name)]
            while seen[-1] is not None and (mimic := seen[-1].find("axis/mimic")) is not None:
                leader = self.joints.get(str(mimic.get("joint")))
                if leader is None or leader in seen:
                    expected = "another joint of the model, without a cycle"
                    self.fail(seen[-1], "mimic", mimic.get("joint"), expected)
                own, shift, reference = (
                    self.frames.number(seen[-1], "mimic", mimic.findtext(tag) or default)
                    for tag, default in (("multiplier", "1"), ("offset", "0"), ("reference", "0"))
                )
                offset += multiplier * (shift - own * reference)
                multiplier *= own
                seen.append(leader)
            if len(seen) > 1 and seen[-1] is not None:
                name = identifier(str(seen[-1].get("name")))
                yield Coupling(identifier(joint.name), ((name, multiplier),), offset)

    @cached_property
    def _gears(self) -> tuple[LinearEquation, ...]:
        """The equations of the gearboxes between joints of the tree."""
        return tuple(Gearboxes(self.frames, self._axis).equations(self.tree, self.joints))

    def _geared(self, path: Sequence[TreeJoint]) -> tuple[Coupling, ...]:
        """Return the couplings of the mimic joints and of the gearboxes.

        The equations of gearboxes are solved for passive joints if possible.
        """
        couplings, names = tuple(self._couplings(path)), [j.name for j in path if j.kind != "fixed"]
        if not self._gears:
            return couplings
        rows = [
            LinearEquation({identifier(n): f for n, f in gear.factors.items()}, gear.value)
            for gear in self._gears
        ]
        rows = [*map(equation_of, couplings), *rows]
        last = [identifier(name) for name in reversed(names) if self._is_driven(name)]
        first = [identifier(name) for name in reversed(names) if not self._is_driven(name)]
        outside = {name for row in rows for name in row.factors} - {*first, *last}
        solved, _ = eliminated(rows, [*sorted(outside), *first, *last])
        return tuple(solved_for(n, solved[n]) for n in (*first, *last)[::-1] if n in solved)

    def _is_driven(self, name: str) -> bool:
        joint = self.joints[name]
        return not self._is_passive(joint) and not self._leader(joint)

    def _unlimited(self, joints: Sequence[TreeJoint]) -> tuple[str, ...]:
        names = [
            joint.name
            for joint in joints
            if joint.kind == "moving"
            and self.joints[joint.name].get("type") != "continuous"
            and self._limits(self.joints[joint.name]) == (None, None)
        ]
        return without_limits(names)
