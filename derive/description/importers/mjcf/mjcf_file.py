"""Reads the chain between two bodies of a MuJoCo model, with its loops."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

from ....model.errors import DescriptionError
from ....model.mechanism import Closure, Described, Mechanism, Strut
from ....model.robot import SerialRobot
from ...chain_between import between, outwards
from ...toml_file import file_error
from ..identifiers import identifier, prefix
from ..kinematic_tree import KinematicTree
from ..limits import without_limits
from ..tool_links import Ends, NoChain, chosen_ends, leader_between, only_chain
from .mjcf_bodies import Bodies, BodyJoint
from .mjcf_loops import ModelLoops
from .mjcf_model import compiled
from .mjcf_tendons import tendon_couplings


class MjcfFile:
    """An MJCF model.

    Bodies and sites of the model become links. Hinges and slides become joints.
    """

    def __init__(self, file: Path) -> None:
        """Read the model.

        Raises:
            DescriptionError: MuJoCo cannot read the file, or a loop is not supported.
        """
        self.file = file
        self.model = compiled(file)
        self.bodies = Bodies(self.model)
        try:
            self.loops = ModelLoops(self.model, self.bodies)
        except DescriptionError as error:
            self._fail("", None, f"a robot ({error})")

    @property
    def tree(self) -> KinematicTree:
        """The tree of links and joints."""
        return self.bodies.tree

    def ends(self, base: str | None, tip: str | None) -> tuple[Ends, ...]:
        """Return the chains between base and tip. An end that is None is inferred.

        Raises:
            DescriptionError: A link is unknown, or no chain exists.
        """
        try:
            self._check_tip(tip)
            return chosen_ends(self.tree, base, tip)
        except NoChain as error:
            self._fail(error.field, error.value, error.expected)

    def robot(self, base: str | None, tip: str | None, name: str | None) -> Described:
        """Return the chain between two links.

        Args:
            base: A body or site. The default base is the world, or the child body of a free joint.
            tip: A body or site. The default tip is the end of the longest chain.
            name: Name of the robot. By default, the name of the model.

        Returns:
            A Mechanism if equalities close loops through the chain, otherwise a SerialRobot.

        Raises:
            DescriptionError: The chain does not exist, or contains unsupported elements.
        """
        try:
            self._check_tip(tip)
            ends = only_chain(self.tree, base, tip)
            return self._between(ends, prefix(name or self.model.name))
        except NoChain as error:
            self._fail(error.field, error.value, error.expected)
        except DescriptionError as error:
            if error.file:
                raise
            self._fail("", None, f"a robot ({error})")

    def _check_tip(self, tip: str | None) -> None:
        """Raise an error if the tip is on a rod between two ball joints.

        Raises:
            NoChain: The joints do not determine the pose of the tip.
        """
        if tip in self.loops.rod_links:
            expected = (
                "a tip whose pose the joints determine; this body is a rod between two ball "
                "joints, which rotates freely about the line between them. Replace one ball joint "
                "by two hinges with intersecting axes, and keep the tip"
            )
            raise NoChain("tip", tip, expected)

    def _between(self, ends: Ends, name: str) -> Described:
        carried = {joint.child: joint for joint in self.bodies.joints}
        path = [carried[joint.child] for joint in self.tree.path(ends.base, ends.tip) or ()]
        loop_joints = self.loops.through(path)
        if loop_joints:
            return self._with_loops(ends, name, loop_joints)
        self.loops.check_laws(path, is_in_a_tree=False)
        check_leaders(path, ends)
        base = identifier(ends.base)
        joints = outwards([joint.joint() for joint in path], base)
        pulled, motors = tendon_couplings(self.model.drives, path)
        return SerialRobot(
            name,
            tuple(replace(joint, parent="") for joint in joints),
            self.model.name,
            self._source(ends),
            base_frame=base,
            tool_frame=identifier(ends.tip),
            notes=(*ends.notes, *self._notes(path, loop_joints, [motor.name for motor in motors])),
            couplings=(*(joint.coupling for joint in path if joint.coupling), *pulled),
            motors=motors,
        )

    def _with_loops(
        self, ends: Ends, name: str, loop_joints: Sequence[Closure | Strut]
    ) -> Described:
        """Build the robot with the common ancestor of base, tip and loops as its first base.

        Then change the base to the link ``ends.base``.
        """
        links = {ends.base, ends.tip, *self.loops.links(loop_joints)}
        root = self.tree.common_ancestor(sorted(links))
        connected = {
            joint.child for link in links for joint in self.tree.path_down(root, link) or ()
        }
        tree = [joint for joint in self.bodies.joints if joint.child in connected]
        self.loops.check_laws(tree, is_in_a_tree=True)
        base_frame, tool_frame = identifier(ends.base), identifier(ends.tip)
        found = Mechanism(
            name=name,
            joints=tuple(joint.joint() for joint in tree),
            actuated=self.loops.actuated(tree),
            closures=tuple(
                loop_joint for loop_joint in loop_joints if isinstance(loop_joint, Closure)
            ),
            struts=tuple(loop_joint for loop_joint in loop_joints if isinstance(loop_joint, Strut)),
            drives=self.loops.motors(tree),
            couplings=self.loops.couplings(tree),
            tool_body=tool_frame,
            title=self.model.name,
            source=self._source(ends),
            base_frame=identifier(root),
            tool_frame=tool_frame,
            reference=self.loops.reference(tree),
            notes=(*ends.notes, *self._notes(tree, loop_joints)),
            springs=self.loops.springs(tree),
        )
        return between(found, base_frame, tool_frame, str(self.file))

    def _source(self, ends: Ends) -> str:
        return f"MJCF {self.file.name}, {ends.base} to {ends.tip}"

    def _notes(
        self,
        tree: Sequence[BodyJoint],
        loop_joints: Sequence[object],
        tendons: Collection[str] = (),
    ) -> Iterator[str]:
        """Yield notes on the joints of a robot, and on omitted parts of the model."""
        yield from self.loops.notes
        yield from (note for joint in tree for note in joint.notes)
        drives = self.model.drives
        yield from drives.notes([j.name for j in tree], [j.child for j in tree], tendons)
        # Passive joints in loops need no limits.
        named = [
            j.name for j in tree if j.is_unlimited and (not loop_joints or j.name in drives.joints)
        ]
        yield from without_limits(named)

    def _fail(self, field: str, value: object, expected: str) -> NoReturn:
        raise file_error(str(self.file), None, field, value, expected) from None


def check_leaders(path: Sequence[BodyJoint], ends: Ends) -> None:
    """Raise an error if the chain contains a coupled joint but not the joint's leader.

    Raises:
        NoChain: The leader of a coupled joint is not in the chain.
    """
    names = {joint.name for joint in path}
    for joint in path:
        if joint.leader and joint.leader not in names:
            expected = leader_between(joint.name, ends)
            raise NoChain("joint equality", joint.leader, expected)
