"""Converts the bodies of a compiled MJCF model to links and joints.

MuJoCo places a body by its pose in the parent frame and then applies its joints in order. Joint k
rotates about an axis through its anchor, or moves along this axis. This angle or distance is the
joint coordinate minus the reference value of the joint. After the conversion, the link of each
joint has its origin at the anchor. If the last anchor is not the origin of the body, a fixed joint
is added. Each link then has the pose of the body with the same name.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import mpmath as mp
import numpy as np
import sympy as sp

from ....model.errors import DescriptionError
from ....model.kinds import JointKind
from ....model.placements import Vector
from ....model.robot import Coupling, Joint
from ....model.tolerances import EVALUATION_DIGITS
from ...conventions.urdf_origin import urdf
from ...mechanism_file import PLATFORMS
from ..identifiers import identifier
from ..kinematic_tree import KinematicTree, TreeJoint, TreeJointKind
from .mjcf_couplings import Equation, Law, joint_equations
from .mjcf_model import CompiledModel, angle, direction, length, lengths, roll_pitch_yaw, snapped

WORLD = "world"
FREE, BALL, SLIDE, HINGE = range(4)
"""Joint type codes of MuJoCo."""
FREE_WORDS: Mapping[int, Literal["free", "ball"]] = {FREE: "free", BALL: "ball"}
KINDS: Mapping[int, JointKind] = {SLIDE: "prismatic", HINGE: "revolute"}
BALL_FREEDOMS = 3
ORIGIN = (sp.S.Zero, sp.S.Zero, sp.S.Zero)
Quaternion = tuple[mp.mpf, mp.mpf, mp.mpf, mp.mpf]


@dataclass(frozen=True)
class BodyJoint:
    """A joint between two links of an MJCF model.

    Attributes:
        name: Name of the joint. An unnamed joint gets the name of its body.
        parent: The parent link.
        child: The child link.
        kind: Joint type: revolute, prismatic or fixed. A joint with more degrees of freedom has its
            MuJoCo type.
        xyz: Origin of the joint in the parent frame (meter).
        rpy: Roll, pitch and yaw of the joint origin (radian).
        axis: Direction of motion in the origin frame.
        limits: Minimum and maximum coordinate (radian or meter).
        coupling: Linear equation of a coupled joint, or None.
        leader: Name of the joint that this coupled joint follows, or "".
        notes: Notes on angles that were rounded to multiples of pi/12.
    """

    name: str
    parent: str
    child: str
    kind: JointKind | Literal["free", "ball"]
    xyz: Vector = ORIGIN
    rpy: Vector = ORIGIN
    axis: Vector = (sp.S.Zero, sp.S.Zero, sp.S.One)
    limits: tuple[sp.Expr | None, sp.Expr | None] = (None, None)
    coupling: Coupling | None = None
    leader: str = ""
    notes: tuple[str, ...] = ()

    def joint(self) -> Joint:
        """Return the robot joint with the names of its parent and child links.

        Raises:
            DescriptionError: The joint has several degrees of freedom.
        """
        if self.kind == "free" or self.kind == "ball":  # noqa: PLR1714
            raise DescriptionError(
                f"joint {self.name!r}: expected hinges, slides and fixed bodies between base and "
                f"tip, got a {self.kind} joint (--base {self.child} starts after it)"
            )
        given: dict[str, sp.Expr | Vector] = {"xyz": self.xyz, "rpy": self.rpy, "axis": self.axis}
        before, after = urdf(self.kind, **given)
        return Joint(
            name=identifier(self.name),
            kind=self.kind,
            before=before,
            after=after,
            link=identifier(self.child),
            parent=identifier(self.parent),
            limits=self.limits,
            convention=urdf,
            given=urdf.scalars(given),
        )

    @property
    def in_tree(self) -> TreeJoint:
        """The joint as part of a tree of named joints."""
        if self.kind == "fixed":
            return TreeJoint(self.name, "fixed", self.parent, self.child)
        if self.kind == "free" or self.kind == "ball":  # noqa: PLR1714
            return TreeJoint(self.name, self.kind, self.parent, self.child)
        kind: TreeJointKind = "follower" if self.coupling else "moving"
        slides = self.kind == "prismatic"
        return TreeJoint(self.name, kind, self.parent, self.child, self.leader, slides)

    @property
    def is_unlimited(self) -> bool:
        """Whether the joint is not coupled and has no limits."""
        return self.kind in KINDS.values() and self.coupling is None and self.limits == (None, None)


class Bodies:
    """All links and joints of an MJCF model.

    Attributes:
        names: Link names in the order of the bodies.
        sites: Link names, keyed by the index of the site. Only named sites have links.
        joints: The joints. A parent comes before its children.
    """

    def __init__(self, model: CompiledModel) -> None:
        self.model, self.arrays = model, model.arrays
        self.names = {
            k: (self.model.named("mjOBJ_BODY", k) or f"body{k}") if k else WORLD
            for k in range(self.arrays.nbody)
        }
        taken = {*self.names.values()}
        self.sites = {
            k: f"{name}_site" if name in taken else name
            for k in range(self.arrays.nsite)
            if (name := self.model.named("mjOBJ_SITE", k))
        }
        self.laws = tuple(self._laws())
        names = [self.joint_name(k) for k in range(self.arrays.njnt)]
        with_leader = [law for law in self.laws if law.leader]
        self.joints = tuple(self._all({e.joint: e for e in joint_equations(with_leader, names)}))
        self.tree = _tree(self.joints)

    def release(self, ball: BodyJoint) -> None:
        """Replace a ball joint by a free joint with the world as parent.

        The origin of the free joint is the pose of the ball joint in the initial configuration of
        the model.
        """
        data = self.model.mujoco.MjData(self.arrays)
        self.model.mujoco.mj_kinematics(self.arrays, data)
        k = next(k for k in range(self.arrays.njnt) if self.joint_name(k) == ball.name)
        rpy, notes = snapped(roll_pitch_yaw(data.xquat[self.arrays.jnt_bodyid[k]]))
        xyz, own = lengths(data.xanchor[k]), _of_joint(ball.name, notes)
        free = replace(ball, parent=WORLD, kind="free", xyz=xyz, rpy=rpy, notes=own)
        self.joints = tuple(free if joint is ball else joint for joint in self.joints)
        self.tree = _tree(self.joints)

    def split(self, names: Collection[str]) -> None:
        """Replace free joints and ball joints by series of joints with one degree of freedom."""
        split = [_series(joint) if joint.name in names else [joint] for joint in self.joints]
        self.joints = tuple(joint for joints in split for joint in joints)
        self.tree = _tree(self.joints)

    def joint_name(self, k: int) -> str:
        """Return the name of a joint. An unnamed joint gets the name of its body."""
        body = int(self.arrays.jnt_bodyid[k])
        place = k - int(self.arrays.body_jntadr[body])
        return self.model.named("mjOBJ_JOINT", k) or f"{self.names[body]}_joint{place + 1}"

    def _all(self, equations: Mapping[str, Equation]) -> Iterator[BodyJoint]:
        for body in range(1, self.arrays.nbody):
            yield from self._of_body(body, equations)
        for k, name in self.sites.items():
            parent = self.names[int(self.arrays.site_bodyid[k])]
            at, turned = self.arrays.site_pos[k], self.arrays.site_quat[k]
            yield _mounted(parent, name, at, turned)

    def _of_body(self, body: int, equations: Mapping[str, Equation]) -> Iterator[BodyJoint]:
        """Yield the joints of a body.

        If the body has no joints, or the anchor of its last joint is not the body origin, a fixed
        joint to the body origin follows.
        """
        name, arrays = self.names[body], self.arrays
        first, count = int(arrays.body_jntadr[body]), int(arrays.body_jntnum[body])
        link = self.names[int(arrays.body_parentid[body])]
        at, turned = arrays.body_pos[body], tuple(map(mp.mpf, arrays.body_quat[body]))
        anchor = np.zeros(3)
        for k in range(first, first + count):
            next_anchor = arrays.jnt_pos[k]
            ends_at_body = k == first + count - 1 and not next_anchor.any()
            child = name if ends_at_body else f"{name}_{k - first + 1}"
            at = at + _rotated(turned, next_anchor - anchor)
            yield self._moving(k, link, child, at, turned, equations)
            link, at, turned, anchor = child, np.zeros(3), _UNTURNED, next_anchor
        if link != name:
            at = at + _rotated(turned, -anchor)
            yield _mounted(link, name, at, turned)

    def _moving(
        self,
        k: int,
        parent: str,
        child: str,
        at: np.ndarray,
        turned: Quaternion,
        equations: Mapping[str, Equation],
    ) -> BodyJoint:
        kind = int(self.arrays.jnt_type[k])
        name = self.joint_name(k)
        if kind not in KINDS:
            rpy, notes = snapped(roll_pitch_yaw(turned))
            own = _of_joint(name, notes)
            return BodyJoint(name, parent, child, FREE_WORDS[kind], lengths(at), rpy, notes=own)
        axis = direction(self.model, k)
        reference = float(self.arrays.qpos0[self.arrays.jnt_qposadr[k]])
        if kind == HINGE:
            turned = _times(turned, _turn(self.arrays.jnt_axis[k], -reference))
        else:
            at = at + _rotated(turned, -reference * self.arrays.jnt_axis[k])
        rpy, notes = snapped(roll_pitch_yaw(turned))
        equation = equations.get(name)
        return BodyJoint(
            name,
            parent,
            child,
            KINDS[kind],
            xyz=lengths(at),
            rpy=rpy,
            axis=axis,
            limits=self._limits(k),
            coupling=equation.coupling if equation else None,
            leader=next(iter(equation.ratios), "") if equation else "",
            notes=_of_joint(name, notes),
        )

    def _limits(self, k: int) -> tuple[sp.Expr | None, sp.Expr | None]:
        if not self.arrays.jnt_limited[k]:
            return None, None
        exact = angle if int(self.arrays.jnt_type[k]) == HINGE else length
        lower, upper = (exact(value) for value in self.arrays.jnt_range[k])
        return lower, upper

    def _laws(self) -> Iterator[Law]:
        """Yield the active linear equalities y - y0 = a0 + a1 (x - x0) of joints."""
        arrays, eq = self.arrays, self.model.mujoco.mjtEq.mjEQ_JOINT
        start = {k: length(arrays.qpos0[arrays.jnt_qposadr[k]]) for k in range(arrays.njnt)}
        for k in range(arrays.neq):
            if int(arrays.eq_type[k]) != int(eq) or not arrays.eq_active0[k]:
                continue
            follower, leader = int(arrays.eq_obj1id[k]), int(arrays.eq_obj2id[k])
            a0, a1, *bent = (length(value) for value in arrays.eq_data[k][:5])
            name, offset = self.joint_name(follower), start[follower] + a0
            if leader < 0:
                yield Law(name, "", sp.S.Zero, offset)
            elif not any(bent):
                yield Law(name, self.joint_name(leader), a1, offset - a1 * start[leader])


def _tree(joints: Sequence[BodyJoint]) -> KinematicTree:
    links = (WORLD, *(joint.child for joint in joints))
    return KinematicTree(links, tuple(joint.in_tree for joint in joints))


def _series(joint: BodyJoint) -> Iterator[BodyJoint]:
    """Yield the joints with one degree of freedom that replace a free joint or ball joint.

    The joints move along or about the axes of the joint frame.
    """
    freedoms = PLATFORMS["free"]
    freedoms = freedoms if joint.kind == "free" else freedoms[-BALL_FREEDOMS:]
    parent, xyz, rpy, notes = joint.parent, joint.xyz, joint.rpy, joint.notes
    for word, kind, axis in freedoms:
        is_last = word == freedoms[-1][0]
        child = joint.child if is_last else f"{joint.child}_{word}"
        name = f"{joint.name}_{word}"
        yield BodyJoint(name, parent, child, kind, xyz, rpy, axis, notes=notes)
        parent, xyz, rpy, notes = child, ORIGIN, ORIGIN, ()


def _mounted(parent: str, child: str, at: np.ndarray, turned: Sequence[float]) -> BodyJoint:
    name = f"{child}_mount"
    rpy, notes = snapped(roll_pitch_yaw(turned))
    return BodyJoint(name, parent, child, "fixed", lengths(at), rpy, notes=_of_joint(name, notes))


def _of_joint(name: str, notes: Iterable[str]) -> tuple[str, ...]:
    return tuple(f"joint {name}: {note}" for note in notes)


# --- quaternions whose scalar comes first ---

_UNTURNED: Quaternion = (mp.mpf(1), mp.mpf(0), mp.mpf(0), mp.mpf(0))


def _times(a: Quaternion, b: Quaternion) -> Quaternion:
    (aw, ax, ay, az), (bw, bx, by, bz) = a, b
    with mp.workdps(EVALUATION_DIGITS):
        return (
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        )


def _turn(axis: np.ndarray, by: float) -> Quaternion:
    with mp.workdps(EVALUATION_DIGITS):
        sine = mp.sin(mp.mpf(by) / 2)
        x, y, z = (sine * mp.mpf(value) for value in axis)
        return mp.cos(mp.mpf(by) / 2), x, y, z


def _rotated(quaternion: Quaternion, vector: np.ndarray) -> np.ndarray:
    w, x, y, z = quaternion
    pure = (mp.mpf(0), *map(mp.mpf, vector))
    _, *found = _times(_times(quaternion, pure), (w, -x, -y, -z))
    return np.array([float(value) for value in found])
