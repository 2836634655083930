"""Finds the chain between any two links of a tree.

The path leads from the base link up to the common ancestor of both links, and then down to the tip
link. Between the base link and the common ancestor, parent link and child link of each joint are
exchanged. A joint has the pose T_parent_link = before * motion(q) * after.

    T_link_parent = inverse(after) * motion(-q) * inverse(before).

The name, the value and the limits of the joint coordinate do not change.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

from ..model.convention import Convention, Placements
from ..model.errors import DescriptionError
from ..model.kinds import JointKind
from ..model.mechanism import Closure, Described, Frame, Mechanism, Strut
from ..model.placements import inverse
from ..model.robot import Coupling, Joint, SerialRobot, joints_to_root
from .suggestions import hint
from .toml_file import file_error, listed

Closing = Closure | Strut | Coupling


@dataclass(frozen=True)
class _InversePlacements:
    """Computes the placements of a joint whose parent and child links are exchanged."""

    convention: Convention

    def __call__(self, kind: JointKind, **values: object) -> Placements:
        before, after = self.convention.place(kind, **values)
        return inverse(after), inverse(before)


@cache
def inverse_convention(convention: Convention) -> Convention:
    """Return the convention for joints whose parent and child links are exchanged.

    The fields of the convention do not change.
    """
    if isinstance(convention.place, _InversePlacements):
        return convention.place.convention
    return Convention(
        f"{convention.name}_inverse",
        convention.fields,
        _InversePlacements(convention),
        convention.source,
        f"the inverse of {convention.words}",
        second_part=convention.second_part,
    )


def inverted(joint: Joint) -> Joint:
    """Exchange parent link and child link of a joint. The joint coordinate does not change."""
    return replace(
        joint,
        before=inverse(joint.after),
        after=inverse(joint.before),
        link=joint.parent,
        parent=joint.link,
        direction=-joint.direction,
        convention=joint.convention and inverse_convention(joint.convention),
    )


def outwards(path: Iterable[Joint], base: str) -> Iterator[Joint]:
    """Yield the joints of a path.

    Args:
        path: The joints in the order of the path.
        base: The first body of the path.
    """
    for joint in path:
        found = joint if joint.parent == base else inverted(joint)
        yield found
        base = found.link


def between(robot: Described, base: str | None, tip: str | None, file: str) -> Described:
    """Return the chain between two frames of a robot, and the loops that contain its joints.

    Args:
        robot: The description, with the numbers as written in the file.
        base: A link, the base frame or the tool frame. If ``base`` is None, the chain starts at the
            base frame.
        tip: A link, the base frame or the tool frame. If ``tip`` is None, the chain ends at the
            tool frame.
        file: File name for error messages.

    Returns:
        A SerialRobot if the chain has no loop and no drive, otherwise a Mechanism.

    Raises:
        DescriptionError: A link is unknown, both ends are the same link, or a part of the
            description refers to a link outside the chain.
    """
    base, tip = base or robot.base_frame, tip or robot.tool_frame
    if (base, tip) == (robot.base_frame, robot.tool_frame):
        return robot
    joints = robot.joints if isinstance(robot, Mechanism) else _with_parents(robot)
    frames = _frames(robot, joints)
    for field, name in (("base", base), ("tip", tip)):
        if name not in frames:
            expected = f"a link of the file ({listed(frames)}){hint(name, frames)}"
            raise file_error(file, None, field, name, expected)
    if base == tip:
        raise file_error(file, None, "tip", tip, "a link other than the base")
    try:
        if isinstance(robot, Mechanism):
            return _in_mechanism(robot, base, tip, frames)
        return _in_chain(robot, base, tip, frames, joints)
    except DescriptionError as error:
        expected = f"links between which a chain exists ({error})"
        raise file_error(file, None, "base, tip", f"{base}, {tip}", expected) from None


def _with_parents(robot: SerialRobot) -> tuple[Joint, ...]:
    """Return the joints of a serial robot as a tree that starts at the base frame."""
    links = robot.link_names
    parents = (robot.base_frame, *links)
    return tuple(
        replace(joint, parent=parent, link=link)
        for joint, parent, link in zip(robot.joints, parents, links, strict=False)
    )


def _frames(robot: Described, joints: Sequence[Joint]) -> Mapping[str, Frame]:
    tool_body = robot.tool_body if isinstance(robot, Mechanism) else joints[-1].link
    links = {joint.link: Frame(joint.link) for joint in joints}
    base = Frame(robot.base_frame, inverse(robot.base))
    return links | {robot.base_frame: base, robot.tool_frame: Frame(tool_body, robot.tool)}


def _path(joints: Sequence[Joint], start: str, end: str) -> list[Joint]:
    carrying = {joint.link: joint for joint in joints}
    up, down = joints_to_root(carrying, start), joints_to_root(carrying, end)
    while up and down and up[-1] is down[-1]:
        up.pop()
        down.pop()
    return [*up, *reversed(down)]


def _in_chain(
    robot: SerialRobot,
    base: str,
    tip: str,
    frames: Mapping[str, Frame],
    joints: Sequence[Joint],
) -> SerialRobot:
    if robot.load or robot.springs:
        raise DescriptionError("expected no masses and springs for a chain between two links")
    start, end = frames[base], frames[tip]
    path = tuple(outwards(_path(joints, start.body, end.body), start.body))
    couplings = tuple(
        robot.coupling_of(joint.name) for joint in path if robot.is_coupled(joint.name)
    )
    coordinates = {joint.name for joint in path}.union(*(dict(rule.ratios) for rule in couplings))
    return replace(
        robot,
        joints=tuple(replace(joint, parent="") for joint in path),
        base=inverse(start.placement),
        tool=end.placement,
        base_frame=base,
        tool_frame=tip,
        transmissions=tuple(t for t in robot.transmissions if t.coordinate in coordinates),
        couplings=couplings,
        motors=tuple(motor for motor in robot.motors if motor.name in coordinates),
    )


def _in_mechanism(robot: Mechanism, base: str, tip: str, frames: Mapping[str, Frame]) -> Described:
    if robot.load:
        raise DescriptionError("expected no masses for the part of a robot between two links")
    start, end = frames[base], frames[tip]
    up = _path(robot.joints, start.body, robot.base_frame)
    joints = (*outwards(up, start.body), *(joint for joint in robot.joints if joint not in up))
    placed = inverse(start.placement)
    if start.body != base:
        mount = Joint(f"{base}_mount", "fixed", placed, link=start.body, parent=base)
        joints, placed = (mount, *joints), ()
    kept, closing = _with_loops(joints, (*robot.loop_joints, *robot.couplings), end.body)
    loop_joints = [item for item in closing if not isinstance(item, Coupling)]
    members = {joint.name for joint in kept} | {loop_joint.name for loop_joint in loop_joints}
    drives = tuple(drive for drive in robot.drives if drive.joint in members)
    known = members | {drive.name for drive in drives}
    known |= {c.swing_name for c in loop_joints if isinstance(c, Strut)}
    found = replace(
        robot,
        joints=kept,
        actuated=tuple(name for name in robot.actuated if name in known),
        closures=tuple(loop_joint for loop_joint in loop_joints if isinstance(loop_joint, Closure)),
        struts=tuple(loop_joint for loop_joint in loop_joints if isinstance(loop_joint, Strut)),
        drives=drives,
        couplings=tuple(item for item in closing if isinstance(item, Coupling)),
        tool_body=end.body,
        base=placed,
        tool=end.placement,
        base_frame=base,
        tool_frame=tip,
        reference=tuple(pair for pair in robot.reference if pair[0] in known),
        transmissions=tuple(t for t in robot.transmissions if t.coordinate in known),
        springs=tuple(pair for pair in robot.springs if pair[0] in known),
    )
    chain = found.main_chain
    is_serial = {joint.name for joint in chain.moving} == {*found.actuated}
    if closing or drives or not is_serial:
        return found
    return replace(chain, notes=found.notes, transmissions=found.transmissions)


def _with_loops(
    joints: Sequence[Joint], closing: Sequence[Closing], tool_body: str
) -> tuple[tuple[Joint, ...], list[Closing]]:
    """Return the joints of the tree, and the closures, struts and couplings of a chain.

    A loop or coupling is kept if it shares a moving joint with the chain, or with another kept loop
    or coupling.
    """
    carrying = {joint.link: joint for joint in joints}
    moving = {joint.name for joint in joints if joint.kind != "fixed"}

    def path(body: str) -> set[str]:
        return {joint.name for joint in joints_to_root(carrying, body)}

    link_of = {joint.name: joint.link for joint in joints}
    kept, left = path(tool_body), list(range(len(closing)))
    paths: list[set[str]] = []
    loops: list[set[str]] = []
    for item in closing:
        if isinstance(item, Coupling):
            names = {item.joint, *(name for name, _ in item.ratios)}
            paths.append(set().union(*(path(link_of[n]) for n in names & link_of.keys())))
            loops.append(names)
        else:
            a, b = path(item.a.body), path(item.b.body)
            paths.append(a | b)
            loops.append({item.name, *((a ^ b) & moving)})
    around = kept & moving
    while meeting := [k for k in left if loops[k] & around]:
        left = [k for k in left if k not in meeting]
        around = around.union(*(loops[k] for k in meeting))
        kept = kept.union(*(paths[k] for k in meeting))
    found = [item for k, item in enumerate(closing) if k not in left]
    return tuple(joint for joint in joints if joint.name in kept), found
