"""Counts bodies, joints and degrees of freedom for the mobility formulas."""

from collections.abc import Sequence

import numpy as np
import sympy as sp

from ...chain.poe import placement_matrix
from ...model.mechanism import FREEDOM, Closure, Mechanism, Strut
from ...model.robot import Joint, Placement
from ...model.tolerances import ZERO_SINGULAR_VALUE
from ...terms.terms import Terms
from ..model.planes import across, holds, linkages

PLANAR, SPATIAL = 3, 6
"""Dimensions of the motion groups SE(2) of planar loops and SE(3) of spatial loops."""


def virtual_joints(mechanism: Mechanism, terms: Terms) -> list[tuple[Joint, ...]]:
    """Return the sequences of virtual joints of a mechanism.

    Virtual joints only describe the pose of a free body.

    A spatial sequence of virtual joints has three prismatic joints and then three revolute joints.
    A planar sequence of virtual joints has two prismatic joints and then one revolute joint.
    Virtual joints are not actuated. Closures, struts, the tool and other joints are attached only
    to the last body of a sequence of virtual joints.
    """
    taken: set[str] = set()
    found = []
    for joint in mechanism.joints:
        for order in (SPATIAL, PLANAR):
            run = _run(mechanism, joint, order)
            if run and joint.name not in taken and _is_virtual(mechanism, terms, run):
                found.append(run)
                taken |= {member.name for member in run}
    return found


def _run(mechanism: Mechanism, first: Joint, length: int) -> tuple[Joint, ...]:
    """Return ``length`` successive joints from ``first``, or () if the chain branches or ends."""
    run = [first]
    while len(run) < length:
        after = [joint for joint in mechanism.joints if joint.parent == run[-1].link]
        if len(after) != 1:
            return ()
        run.append(after[0])
    return tuple(run)


def _is_virtual(mechanism: Mechanism, terms: Terms, run: Sequence[Joint]) -> bool:
    sliders = PLANAR if len(run) == SPATIAL else PLANAR - 1
    expected = ["prismatic"] * sliders + ["revolute"] * (len(run) - sliders)
    attached = {
        frame.body for loop_joint in mechanism.loop_joints for frame in (loop_joint.a, loop_joint.b)
    }
    between = {joint.link for joint in run[:-1]}
    actuated = {c.moves for c in mechanism.coordinates}
    if (
        [joint.kind for joint in run] != expected
        or between & (attached | {mechanism.tool_body})
        or actuated & {joint.name for joint in run}
    ):
        return False
    sliding, turning = (axes := _axes(terms, run))[:sliders], axes[sliders:]
    spans = _rank(sliding) == sliders and _rank(turning) == len(turning)
    return spans and (len(run) == SPATIAL or holds(turning[0], turning, sliding))


def _axes(terms: Terms, run: Sequence[Joint]) -> list[sp.Matrix]:
    """Return the axis directions of consecutive joints at zero joint values."""
    R, axes = sp.eye(3), []
    for joint in run:
        R = R * placement_matrix(joint.before)[:3, :3]
        axes.append(R[:, 2].applyfunc(terms.value))
        R = R * placement_matrix(joint.after)[:3, :3]
    return axes


def _rank(axes: Sequence[sp.Matrix]) -> int:
    stacked = np.array([[float(x) for x in axis] for axis in axes])
    return int(np.linalg.matrix_rank(stacked, tol=ZERO_SINGULAR_VALUE))


class Counts:
    """Numbers of bodies, joints and degrees of freedom of a mechanism.

    Attributes:
        mechanism: The description.
        terms: The table of named symbolic expressions.
        planar: The planar linkages.
        in_plane: Names of the closures and struts of planar loops.
        order: Dimension of the motion group of the mechanism: 3 if all bodies move in parallel
            planes, otherwise 6.
        virtual: Sequences of virtual joints. Virtual joints only describe the pose of a free body.
        loop_orders: Dimension of the motion group of each independent loop.
    """

    def __init__(self, mechanism: Mechanism, terms: Terms) -> None:
        """Classify the loops and find the virtual joints."""
        self.mechanism, self.terms = mechanism, terms
        self.planar, _ = linkages(mechanism)
        self.in_plane = {name for linkage in self.planar for name in linkage.loop_joints}
        self.order = PLANAR if self._is_one_plane() else SPATIAL
        orders = [self._order_of(loop_joint) for loop_joint in mechanism.loop_joints]
        self.virtual: list[tuple[Joint, ...]] = []
        for run in virtual_joints(mechanism, terms):
            # Virtual joints add as many degrees of freedom as one loop through the platform
            # removes, so the counts omit the virtual joints and this loop.
            if len(run) in orders:
                orders.remove(len(run))
                self.virtual.append(run)
        # Like a gear pair, a coupling closes a loop and removes one freedom.
        self.loop_orders = (*orders, *([self.order] * len(mechanism.couplings)))

    @property
    def bodies(self) -> int:
        """Number of bodies, including the base."""
        moving = sum(joint.kind != "fixed" for joint in self.mechanism.joints)
        struts = sum(1 + strut.is_cylinder for strut in self.mechanism.struts)
        return 1 + moving + struts - sum(len(run) - 1 for run in self.virtual)

    @property
    def joints(self) -> int:
        """Number of joints, including the ends of struts."""
        struts = sum(2 + strut.is_cylinder for strut in self.mechanism.struts)
        members = len(self.mechanism.closures) + len(self.mechanism.couplings) + struts
        return self._tree_joints() + members

    @property
    def freedoms(self) -> int:
        """Sum of the joint degrees of freedom in the motion group of the whole mechanism."""
        loop_joints = sum(
            _freedom(loop_joint, self.order) for loop_joint in self.mechanism.loop_joints
        )
        pairs = (self.order - 1) * len(self.mechanism.couplings)
        return self._tree_joints() + loop_joints + pairs

    @property
    def loop_freedoms(self) -> int:
        """Sum of the joint degrees of freedom, with each loop joint counted in its own loop."""
        loop_joints = sum(_freedom(c, self._order_of(c)) for c in self.mechanism.loop_joints)
        pairs = (self.order - 1) * len(self.mechanism.couplings)
        return self._tree_joints() + loop_joints + pairs

    def _tree_joints(self) -> int:
        """Return the number of moving tree joints, without virtual joints."""
        moving = sum(joint.kind != "fixed" for joint in self.mechanism.joints)
        return moving - sum(map(len, self.virtual))

    def _order_of(self, loop_joint: Closure | Strut) -> int:
        on_balls = isinstance(loop_joint, Strut) and loop_joint.ends == "ball"
        return PLANAR if loop_joint.name in self.in_plane and not on_balls else SPATIAL

    def _is_one_plane(self) -> bool:
        """Whether all joints, closures and struts move in parallel planes."""
        if len(self.in_plane) < len(self.mechanism.loop_joints):
            return False
        orientation = {self.mechanism.base_frame: sp.eye(3)}
        turning: list[sp.Matrix] = []
        sliding: list[sp.Matrix] = []
        for joint in self.mechanism.joints:
            R = orientation[joint.parent] * _turned(self.terms, joint.before)
            orientation[joint.link] = R * _turned(self.terms, joint.after)
            if joint.kind == "helical":
                return False
            if joint.kind != "fixed":
                (sliding if joint.kind == "prismatic" else turning).append(R[:, 2])
        for linkage in self.planar:
            n = linkage.axes[linkage.root].n.applyfunc(self.terms.value)
            turning.append(orientation[linkage.root] * n)
        n = turning[0] if turning else across(sliding, self.terms.value)
        return n is not None and holds(n, turning, sliding)


def _turned(terms: Terms, placement: Placement) -> sp.Matrix:
    return placement_matrix(placement)[:3, :3].applyfunc(terms.value)


def _freedom(loop_joint: Closure | Strut, order: int) -> int:
    """Return the degrees of freedom of a closure or strut in a planar or spatial loop."""
    if isinstance(loop_joint, Closure):
        return 1 if loop_joint.kind == "ball" and order == PLANAR else FREEDOM[loop_joint.kind]
    end = FREEDOM[loop_joint.ends] if order == SPATIAL else 1
    return 2 * end + loop_joint.is_cylinder - loop_joint.has_universal
