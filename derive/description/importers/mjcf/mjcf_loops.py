"""Finds the loops of a compiled MJCF model. Equalities between bodies or sites close the loops.

A ``connect`` equality joins two points with a ball joint. Two ``connect`` equalities between the
same bodies form a pin joint. The axis of the pin joint passes through the points of both
equalities. A ``weld`` equality fixes two frames to each other. A body becomes a rod in two cases:
its only joints are two ball joints of the tree, or one ball joint and one ``connect`` equality.
Other ball joints and free joints of a loop become series of joints with one degree of freedom.
Joint equalities are mimic relations in a chain, and couplings in a robot with loops. Couplings that
are not linear raise an error.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any, Literal

import sympy as sp

from ....model.errors import DescriptionError
from ....model.mechanism import Closure, ClosureKind, Drive, Frame, Strut
from ....model.placements import Vector, align_z, from_xyz_rpy
from ....model.robot import Coupling
from ....model.tolerances import COMPILED_DECIMALS
from ..identifiers import identifier
from .mjcf_bodies import FREE_WORDS, ORIGIN, Bodies, BodyJoint
from .mjcf_couplings import Equation, check_agreement, coupled_groups, joint_equations
from .mjcf_model import CompiledModel, length, lengths, roll_pitch_yaw

MAX_CONNECTS = 2
"""Maximum number of ``connect`` equalities between two bodies. Two ``connect`` equalities form a
pin joint.
"""


@dataclass(frozen=True)
class _End:
    """A link, and the frame on this link that an equality constrains.

    `xyz` is in meter and `rpy` is in radian.
    """

    link: str
    xyz: Vector
    rpy: Vector = ORIGIN


@dataclass(frozen=True)
class _Equality:
    """A ``connect`` or ``weld`` equality between two frames, or a rod between the frame origins."""

    name: str
    kind: Literal["connect", "weld", "rod"]
    a: _End
    b: _End
    length: sp.Expr = sp.S.Zero


class ModelLoops:
    """The closures of a model.

    Attributes:
        notes: Reasons why equalities are not modeled.
        rod_links: Names of links whose bodies are rods between two ball joints.
    """

    def __init__(self, model: CompiledModel, bodies: Bodies) -> None:
        """Read the equalities."""
        self.model, self.bodies, self.arrays = model, bodies, model.arrays
        self.rod_links: set[str] = set()
        self.carried = {joint.child: joint for joint in bodies.joints}
        read = tuple(self._read())
        rods = tuple(self._rods_in_tree(read))
        self.carried = {joint.child: joint for joint in bodies.joints}
        self.equalities = (*(self._as_rod(equality, read) for equality in read), *rods)
        around = [joint for equality in self.equalities for joint in self._around(equality)]
        bodies.split({joint.name for joint in around if joint.kind in FREE_WORDS.values()})
        self.carried = {joint.child: joint for joint in bodies.joints}
        self.notes: list[str] = []

    def through(self, path: Sequence[BodyJoint]) -> tuple[Closure | Strut, ...]:
        """Return the closures of all loops that share moving joints with a chain.

        A joint equality may connect the joints of two loops, like a gear pair.

        Raises:
            DescriptionError: A loop is not supported.
        """
        moving = {joint.name for joint in path if joint.kind != "fixed"}
        found: list[_Equality] = []
        left = list(self.equalities)
        around = {e.name: {joint.name for joint in self._around(e)} for e in self.equalities}
        geared = coupled_groups(self.bodies.laws)
        moving = moving.union(*(group for group in geared if group & moving))
        while meeting := [e for e in left if moving & around[e.name]]:
            found += meeting
            left = [equality for equality in left if equality not in meeting]
            moving = moving.union(*(around[e.name] for e in meeting))
            moving = moving.union(*(group for group in geared if group & moving))
        self.notes += [f"{equality.name}: not on the path to the tip" for equality in left]
        found.sort(key=self.equalities.index)
        return tuple(_closures(found))

    def links(self, loop_joints: Iterable[Closure | Strut]) -> set[str]:
        """Return the links to which the MJCF equalities of the given closures or rods refer."""
        names = {loop_joint.name for loop_joint in loop_joints}
        selected = [e for e in self.equalities if e.name in names]
        return {frame.link for equality in selected for frame in (equality.a, equality.b)}

    def check_laws(self, joints: Iterable[BodyJoint], is_in_a_tree: bool) -> None:
        """Raise an error if a joint of the robot has an unsupported coupling.

        Raises:
            DescriptionError: A joint of the robot has an unsupported coupling, or no joint
                positions satisfy all equalities.
        """
        by_name = {joint.name: joint for joint in joints}
        check_agreement(self.bodies.laws, [*by_name])
        self.model.drives.check_tendons(by_name)
        for k in range(self.arrays.neq):
            if not self._is(k, "mjEQ_JOINT") or not self.arrays.eq_active0[k]:
                continue
            joint = by_name.get(self.bodies.joint_name(int(self.arrays.eq_obj1id[k])))
            is_linear = self._is_linear(k) and (is_in_a_tree or self.arrays.eq_obj2id[k] >= 0)
            if joint is not None and not is_linear:
                name = self.model.named("mjOBJ_EQUALITY", k)
                equality = f"equality {name!r}" if name else "an equality"
                leader = int(self.arrays.eq_obj2id[k])
                to = f" to {self.bodies.joint_name(leader)!r}" if leader >= 0 else ""
                raise DescriptionError(
                    f"joint {joint.name!r} is coupled{to} by {equality}; the position of a "
                    "coupled joint must be linear in the position of another joint"
                )

    def _is_linear(self, k: int) -> bool:
        """Whether a joint equality fixes a joint or couples two joints linearly."""
        return int(self.arrays.eq_obj2id[k]) < 0 or not any(self.arrays.eq_data[k][2:5])

    def couplings(self, tree: Sequence[BodyJoint]) -> tuple[Coupling, ...]:
        """Return the couplings between the joints of a tree with loops."""
        inside = {joint.name for joint in tree}
        return tuple(e.coupling for e in self._equations(tree) if e.joint in inside)

    def motors(self, tree: Sequence[BodyJoint]) -> tuple[Drive, ...]:
        """Return the drives of the joints in a tree.

        The motor of each drive turns a hinge outside the tree.
        """
        inside, moved = {joint.name for joint in tree}, self.model.drives.joints
        turning = {joint.name for joint in self.bodies.joints if joint.kind == "revolute"}
        return tuple(
            Drive(identifier(e.joint), identifier(joint), 1 / ratio)
            for e in self._equations(tree)
            for joint, ratio in e.ratios.items()
            if e.joint in (turning & {*moved}) - inside
            and joint in inside.difference(moved)
            and e.offset == 0
        )

    def _equations(self, tree: Sequence[BodyJoint]) -> tuple[Equation, ...]:
        """Return the equations that express dependent joints by other joints of the tree."""
        return joint_equations(self.bodies.laws, [joint.name for joint in tree])

    def actuated(self, tree: Sequence[BodyJoint]) -> tuple[str, ...]:
        """Return the joints and motors with an actuator, in the order of the actuators.

        Raises:
            DescriptionError: No joint has an actuator.
        """
        names = [joint.name for joint in tree if joint.kind != "fixed"]
        drives, motors = self.model.drives, {drive.name for drive in self.motors(tree)}
        known = {*names, *(name for name in drives.joints if identifier(name) in motors)}
        moved = [name for name in dict.fromkeys(drives.joints) if name in known]
        if not moved:
            tendons = [t.name for t in drives.tendons if t.is_driven and t.moves(names, ())]
            pulled = f"; driven tendons are not modeled ({', '.join(tendons)})" if tendons else ""
            raise DescriptionError(
                "the loop joints have no actuator, so q is undefined: add one actuator for "
                f"each degree of freedom, such as <motor joint={names[0]!r}/> in <actuator>{pulled}"
            )
        return tuple(map(identifier, moved))

    def springs(self, tree: Sequence[BodyJoint]) -> tuple[tuple[str, sp.Expr], ...]:
        """Return the rest positions of the passive joints with springs."""
        drives = self.model.drives
        free = [name for name in drives.springs if name not in drives.joints]
        return tuple(
            (identifier(name), length(self.arrays.qpos_spring[self.arrays.jnt_qposadr[k]]))
            for k, name in enumerate(map(self.bodies.joint_name, range(self.arrays.njnt)))
            if name in free and name in {joint.name for joint in tree}
        )

    def reference(self, tree: Sequence[BodyJoint]) -> tuple[tuple[str, sp.Expr], ...]:
        """Return the nonzero joint values in the reference configuration of the model."""
        names = {joint.name for joint in tree}
        found = []
        for k in range(self.arrays.njnt):
            name = self.bodies.joint_name(k)
            if name in names:
                value = length(self.arrays.qpos0[self.arrays.jnt_qposadr[k]])
                found += [(identifier(name), value)] if value != 0 else []
        return tuple(found)

    def _around(self, equality: _Equality) -> list[BodyJoint]:
        """Return the moving joints between the two bodies of an MJCF equality constraint."""
        to_a, to_b = (self._path_to(end.link) for end in (equality.a, equality.b))
        return [j for j in (*to_a, *to_b) if (j in to_a) != (j in to_b) and j.kind != "fixed"]

    def _path_to(self, link: str) -> list[BodyJoint]:
        found = []
        while link in self.carried:
            found.append(self.carried[link])
            link = found[-1].parent
        return found

    # --- rods ---

    def _as_rod(self, equality: _Equality, others: Sequence[_Equality]) -> _Equality:
        """Convert a ``connect`` equality to a rod if one of the connected bodies is a rod.

        Other equalities are returned unchanged.
        """
        if equality.kind == "connect":
            for rod, end in ((equality.a, equality.b), (equality.b, equality.a)):
                ball = next((j for j in self._path_to(rod.link) if j.kind != "fixed"), None)
                if ball is not None and self._is_rod(ball, equality, others):
                    self.rod_links |= {*self.bodies.tree.rigid(ball.child)}
                    xyz = self._from_ball(ball, rod)
                    far = length(float(sp.sqrt(sum(part**2 for part in xyz))))
                    begin = _End(ball.parent, ball.xyz)
                    return _Equality(equality.name, "rod", begin, end, far)
        return equality

    def _rods_in_tree(self, others: Sequence[_Equality]) -> Iterator[_Equality]:
        """Yield rods between two ball joints of the tree.

        The body at the far end of a rod loses its ball joint and becomes a free body.
        """
        for joint in self.bodies.joints:
            ball = next((j for j in self._path_to(joint.parent) if j.kind != "fixed"), None)
            if joint.kind != "ball" or ball is None or ball.kind != "ball":
                continue
            links = set(self.bodies.tree.rigid(ball.child))
            moved = [other.name for other in self.bodies.tree.moved(ball.child)]
            if moved == [joint.name] and not any({e.a.link, e.b.link} & links for e in others):
                xyz = self._from_ball(ball, _End(joint.parent, joint.xyz))
                far = length(float(sp.sqrt(sum(part**2 for part in xyz))))
                self.bodies.release(joint)
                begin, end = _End(ball.parent, ball.xyz), _End(joint.child, ORIGIN)
                yield _Equality(identifier(ball.name), "rod", begin, end, far)

    def _is_rod(self, ball: BodyJoint, equality: _Equality, others: Sequence[_Equality]) -> bool:
        """Whether the link of a ball joint is a rod.

        A rod has no child joints and no other equalities.
        """
        links = set(self.bodies.tree.rigid(ball.child))
        attached = [e for e in others if {e.a.link, e.b.link} & links]
        return (
            ball.kind == "ball"
            and attached == [equality]
            and not self.bodies.tree.moved(ball.child)
        )

    def _from_ball(self, ball: BodyJoint, point: _End) -> Vector:
        """Return a point of a rod, relative to the ball joint of the rod."""
        x, y, z = point.xyz
        for joint in self._path_to(point.link):
            if joint is ball:
                break
            if joint.rpy != ORIGIN:
                raise DescriptionError(
                    f"rod {point.link!r}: expected a body that itself has the ball joint"
                )
            x, y, z = (a + b for a, b in zip(joint.xyz, (x, y, z), strict=True))
        return x, y, z

    # --- equalities ---

    def _read(self) -> Iterator[_Equality]:
        for k in range(self.arrays.neq):
            is_weld = self._is(k, "mjEQ_WELD")
            if not self.arrays.eq_active0[k] or not (is_weld or self._is(k, "mjEQ_CONNECT")):
                continue
            if not self._leads_by_hand(k):
                name = self.model.named("mjOBJ_EQUALITY", k) or f"loop{k + 1}"
                a, b = self._of_sites(k) if self._is_of_sites(k) else self._of_bodies(k, is_weld)
                yield _Equality(identifier(name), "weld" if is_weld else "connect", a, b)

    def _leads_by_hand(self, k: int) -> bool:
        """Whether an equality attaches a body to a mocap body.

        An equality with a mocap body closes no loop.
        """
        ids = [int(numbers[k]) for numbers in (self.arrays.eq_obj1id, self.arrays.eq_obj2id)]
        bodies = [self.arrays.site_bodyid[i] for i in ids] if self._is_of_sites(k) else ids
        return any(self.arrays.body_mocapid[body] >= 0 for body in bodies)

    def _is(self, k: int, kind: str) -> bool:
        return int(self.arrays.eq_type[k]) == int(getattr(self.model.mujoco.mjtEq, kind))

    def _is_of_sites(self, k: int) -> bool:
        return int(self.arrays.eq_objtype[k]) == int(self.model.mujoco.mjtObj.mjOBJ_SITE)

    def _of_sites(self, k: int) -> tuple[_End, _End]:
        a, b = (self._site(int(ids[k])) for ids in (self.arrays.eq_obj1id, self.arrays.eq_obj2id))
        return a, b

    def _site(self, site: int) -> _End:
        link = self.bodies.names[int(self.arrays.site_bodyid[site])]
        rpy = roll_pitch_yaw(self.arrays.site_quat[site])
        return _End(link, lengths(self.arrays.site_pos[site]), rpy)

    def _of_bodies(self, k: int, is_weld: bool) -> tuple[_End, _End]:
        """Return the two frames that an equality connects, one on each body.

        The data of a ``weld`` are the point on the second body, the point on the first body, and
        the relative orientation.
        """
        ids = (self.arrays.eq_obj1id, self.arrays.eq_obj2id)
        first, second = (self.bodies.names[int(numbers[k])] for numbers in ids)
        data: Any = self.arrays.eq_data[k]
        one, other = lengths(data[:3]), lengths(data[3:6])
        if is_weld:
            return _End(first, other, roll_pitch_yaw(data[6:10])), _End(second, one)
        return _End(first, one), _End(second, other)


def _closures(equalities: Sequence[_Equality]) -> Iterator[Closure | Strut]:
    """Yield a closure or strut for each equality between two bodies.

    ``connect`` equalities between the same bodies are merged.
    """
    for equality in equalities:
        if equality.kind == "weld":
            yield _closure(equality.name, "weld", equality.a, equality.b)
        if equality.kind == "rod":
            a, b = (_frame(end, ORIGIN) for end in (equality.a, equality.b))
            yield Strut(equality.name, a, b, equality.length, ends="ball")
    connects = [equality for equality in equalities if equality.kind == "connect"]
    pairs = {equality: frozenset((equality.a.link, equality.b.link)) for equality in connects}
    ordered = sorted(connects, key=lambda e: list(pairs.values()).index(pairs[e]))
    for _, run in groupby(ordered, key=pairs.__getitem__):
        first, *others = list(run)
        if not others:
            yield _closure(first.name, "ball", first.a, first.b)
        else:
            yield _pin(first, others)


def _pin(first: _Equality, others: Sequence[_Equality]) -> Closure:
    """Return the pin joint through the points of two ``connect`` equalities."""
    if len(others) + 1 > MAX_CONNECTS:
        raise DescriptionError(
            f"{len(others) + 1} connect equalities join {first.a.link!r} and {first.b.link!r}; "
            "expected one connect equality, two for a hinge, or a weld equality"
        )
    second = others[0]
    ends = (second.a, second.b) if second.a.link == first.a.link else (second.b, second.a)
    axes = [_between(begin, end) for begin, end in zip((first.a, first.b), ends, strict=True)]
    lengths_of = [float(sp.sqrt(sum(part**2 for part in axis))) for axis in axes]
    if abs(lengths_of[0] - lengths_of[1]) > 10 ** (3 - COMPILED_DECIMALS) or not lengths_of[0]:
        raise DescriptionError(
            f"equalities {first.name!r} and {second.name!r}: expected two points on one hinge "
            "axis, but their distances on the bodies differ: "
            f"{lengths_of[0]} m and {lengths_of[1]} m"
        )
    a, b = (
        Frame(identifier(end.link), from_xyz_rpy(end.xyz, ORIGIN) + align_z(axis))
        for end, axis in zip((first.a, first.b), axes, strict=True)
    )
    return Closure(first.name, "pin", a, b)


def _between(start: _End, end: _End) -> Vector:
    x, y, z = (b - a for a, b in zip(start.xyz, end.xyz, strict=True))
    return x, y, z


def _closure(name: str, kind: ClosureKind, a: _End, b: _End) -> Closure:
    angles = [ORIGIN if kind == "ball" else end.rpy for end in (a, b)]
    return Closure(name, kind, _frame(a, angles[0]), _frame(b, angles[1]))


def _frame(end: _End, rpy: Vector) -> Frame:
    return Frame(identifier(end.link), from_xyz_rpy(end.xyz, rpy))
