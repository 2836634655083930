"""Mobility of a mechanism: degrees of freedom by two counts and by the rank of its equations.

Counting presumes that every constraint is independent of the others; the rank of the constraint
Jacobian at closed configurations presumes nothing. Where they disagree the mechanism is
overconstrained, or a member can turn without moving anything.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from ..model.mechanism import Mechanism
from .closing import ClosedLoops
from .freedoms import SPATIAL, Counts


@dataclass(frozen=True)
class Mobility:
    """Degrees of freedom of a mechanism, found in three ways.

    Attributes:
        bodies: n, the base included; rods are bodies, cylinders two.
        joints: j, ends of rods and cylinders included.
        freedoms: Sum of the joints' degrees of freedom f in the group of order ``order``.
        order: lambda, 3 where all bodies move in one plane, else 6.
        loop_freedoms: Sum of f where each joint counts in the group of its loop.
        loop_orders: lambda of each independent loop.
        idle: Number of members on balls, which turn about themselves and move nothing.
        coordinates: Number of entries of z.
        rank: Rank of the constraint Jacobian at random closed configurations.
        equations: Number of its rows.
        actuated: Number of actuated coordinates.
    """

    bodies: int
    joints: int
    freedoms: int
    order: int
    loop_freedoms: int
    loop_orders: tuple[int, ...]
    idle: int
    coordinates: int
    rank: int
    equations: int
    actuated: int

    @property
    def kutzbach(self) -> int:
        """Gruebler-Kutzbach: lambda (n - 1 - j) + sum f, idle turns included if lambda is 6."""
        return self.order * (self.bodies - 1 - self.joints) + self.freedoms

    @property
    def by_loops(self) -> int:
        """Sum f less lambda of every independent loop, idle turns included."""
        return self.loop_freedoms - sum(self.loop_orders)

    @property
    def true(self) -> int:
        """Coordinates less the rank of the constraint Jacobian; idle turns are no coordinates."""
        return self.coordinates - self.rank

    @property
    def is_overconstrained(self) -> bool:
        """Whether constraints repeat others: the mechanism has more freedoms than counted."""
        return self.true > self.by_loops - self.idle or self.true > self._kutzbach_but_idle

    @property
    def report(self) -> tuple[str, ...]:
        """The counts in lines to read, and every disagreement between them."""
        n, j, f = self.bodies, self.joints, self.freedoms
        lost = " - ".join(["", *map(str, self.loop_orders)])
        return (
            f"Gruebler-Kutzbach: {self.order} ({n} - 1 - {j}) + {f} = {self.kutzbach}",
            f"loop by loop: {self.loop_freedoms}{lost} = {self.by_loops}",
            f"constraint Jacobian: {self.coordinates} coordinates - rank {self.rank} = {self.true}",
            *self.disagreements,
        )

    @property
    def _kutzbach_but_idle(self) -> int:
        return self.kutzbach - (self.idle if self.order == SPATIAL else 0)

    @property
    def disagreements(self) -> tuple[str, ...]:
        """The disagreements between the counts, a line each."""
        return tuple(self._disagreements())

    def _disagreements(self) -> Iterator[str]:
        if self.idle:
            yield f"idle: {self.idle} members on balls turn about themselves"
        repeated = self.equations - self.rank
        if repeated:
            yield f"repeated: {repeated} of {self.equations} equations follow from the others"
        moving = " without idle turns" if self.idle else ""
        for name, counted in (
            ("Gruebler-Kutzbach", self._kutzbach_but_idle),
            ("loop by loop", self.by_loops - self.idle),
        ):
            if counted != self.true:
                why = ": overconstrained" if self.true > counted else ""
                yield f"{name} counts {counted}{moving}, true are {self.true}{why}"
        if self.actuated != self.true:
            yield f"actuated coordinates: {self.actuated}, degrees of freedom: {self.true}"


def mobility(mechanism: Mechanism) -> Mobility:
    """The degrees of freedom of a mechanism, counted and by the rank of its constraints.

    Bodies that fixed joints hold together are one. A rod is a body with two joints, a cylinder two
    bodies with two joints and a slider between. A platform on virtual joints counts as one body
    without them (:func:`~chasles.derive.loops.freedoms.virtual_joints`). A motor behind a gear is
    not counted: with its bearing and the gear pair it adds no freedom.

    Args:
        mechanism: The description, with a reference configuration from which it closes.

    Raises:
        RobotError: The loops do not close from the reference.

    Source:
        Gogu, Mechanism and Machine Theory 40 (2005), 1068-1097, for the counts and their limits.
    """
    loops = ClosedLoops(mechanism)
    counts = Counts(mechanism, loops.terms)
    return Mobility(
        bodies=counts.bodies,
        joints=counts.joints,
        freedoms=counts.freedoms,
        order=counts.order,
        loop_freedoms=counts.loop_freedoms,
        loop_orders=counts.loop_orders,
        idle=sum(strut.ends == "ball" for strut in mechanism.struts),
        coordinates=len(loops.z),
        rank=loops.rank(),
        equations=len(loops.entries),
        actuated=len(mechanism.actuated),
    )
