"""Mobility of a mechanism, from two counting formulas and from a rank.

The counting formulas assume independent constraints. The rank of the constraint Jacobian at closed
configurations gives the mobility without this assumption. If the formulas and the rank give
different mobilities, the mechanism is overconstrained, or a rod can rotate about its own axis.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from chasles.contract import check_type

from ...chain.kinematics import coordinates
from ...model.errors import InputValueError
from ...model.mechanism import Mechanism
from ...terms.terms import Terms
from ..model.constraints import ClosureEquations, configuration_names, constraints
from .closed_loops import ClosedLoops
from .freedoms import SPATIAL, Counts


@dataclass(frozen=True)
class Mobility:
    """Degrees of freedom of a mechanism, by formulas and by the rank of the closure equations.

    Attributes:
        bodies: Number n of bodies, including the base. A rod counts as one body, and a cylinder as
            two bodies.
        joints: Number j of joints, including the ends of rods and cylinders.
        freedoms: Sum of the degrees of freedom of all joints, for ``kutzbach``. In a planar
            mechanism (order 3), only freedoms in the plane count.
        order: Dimension of the space of body motions: 3 if all bodies move in one plane, otherwise
            6.
        loop_freedoms: Sum of the degrees of freedom of all joints, for ``by_loops``. For a joint in
            a planar loop, only freedoms in the plane of this loop count.
        loop_orders: Dimension of the space of body motions in each independent loop.
        idle: Number of struts with ball joints at both ends. Each such strut can rotate about its
            own axis without moving another body (idle rotation).
        coordinates: Number of configuration variables z: joint values, cylinder displacements,
            swing angles of pin-ended struts, and the pose variables of a free platform.
        rank: Rank of the Jacobian of the loop closure equations at closed configurations.
        equations: Number of loop closure equations.
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
        """Gruebler-Kutzbach mobility: order (bodies - 1 - joints) + freedoms.

        If the order is 6, the mobility includes idle rotations.
        """
        return self.order * (self.bodies - 1 - self.joints) + self.freedoms

    @property
    def by_loops(self) -> int:
        """Mobility counted loop by loop: ``loop_freedoms`` minus the sum of ``loop_orders``."""
        return self.loop_freedoms - sum(self.loop_orders)

    @property
    def true(self) -> int:
        """Actual mobility, without idle rotations: ``coordinates`` minus ``rank``."""
        return self.coordinates - self.rank

    @property
    def is_overconstrained(self) -> bool:
        """Whether ``true`` exceeds ``kutzbach`` or ``by_loops``, both without idle rotations."""
        return self.true > self.by_loops - self.idle or self.true > self._kutzbach_but_idle

    @property
    def report(self) -> tuple[str, ...]:
        """Lines of text that state the mobility by each method, and then the disagreements."""
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
        """Lines of text about differences between formulas, rank and number of actuators."""
        return tuple(self._disagreements())

    def _disagreements(self) -> Iterator[str]:
        if self.idle:
            yield f"idle: {self.idle} members between ball joints spin about their own axes"
        repeated = self.equations - self.rank
        if repeated:
            yield f"repeated: {repeated} of {self.equations} equations follow from the others"
        moving = " without idle rotations" if self.idle else ""
        for name, counted in (
            ("Gruebler-Kutzbach", self._kutzbach_but_idle),
            ("loop by loop", self.by_loops - self.idle),
        ):
            if counted != self.true:
                why = ": overconstrained" if self.true > counted else ""
                yield f"{name} gives {counted}{moving}, actual mobility {self.true}{why}"
        if self.actuated != self.true:
            yield f"actuated coordinates: {self.actuated}, degrees of freedom: {self.true}"


def mobility(mechanism: Mechanism) -> Mobility:
    """Compute the degrees of freedom by formulas and by the rank of the closure equations.

    Bodies connected by fixed joints count as one body. A rod counts as a body with two joints. A
    cylinder counts as two bodies with three joints. Virtual joints, which describe the pose of a
    free platform, do not count. Geared motors do not count, because motor, bearing and gear pair
    together add no freedom.

    Args:
        mechanism: A robot with loops, for example from ``read``.

    Returns:
        The numbers of bodies, joints and equations. ``kutzbach`` and ``by_loops`` are the mobility
        by formula. ``true`` is the actual mobility, from the rank of the loop closure equations.

    Raises:
        LoopError: The loops do not close at the reference configuration.

    Source:
        Gogu, Mechanism and Machine Theory 40 (2005), 1068-1097, for the formulas and their limits.
    """
    check_type("mobility: mechanism", mechanism, Mechanism)
    terms = Terms({p.symbol: p.value for p in mechanism.parameters})
    z = coordinates("_z", len(configuration_names(mechanism)))
    return mobility_of(ClosedLoops(mechanism), constraints(mechanism, terms, z))


def kutzbach(links: int, joints: int, freedom: int, *, order: int = SPATIAL) -> int:
    """Return the Gruebler-Kutzbach mobility: order (links - 1 - joints) + freedom.

    ``kutzbach(links=14, joints=15, freedom=15)`` is 3. The formula assumes independent constraints.
    For an overconstrained mechanism, the result can be negative.

    Args:
        links: Number of links, including the base.
        joints: Number of joints.
        freedom: Sum of the degrees of freedom of all joints.
        order: Dimension of the space of link motions: 6 in space, 3 in a plane or about a point, 2
            for planar translations.

    Raises:
        InputTypeError: An argument is not an int.
        InputValueError: The order is not from 1 to 6, the joints are too few to connect the links,
            or some joint would have less than 1 or more than ``order`` degrees of freedom.
    """
    for name, count in {"links": links, "joints": joints, "freedom": freedom}.items():
        check_type(f"kutzbach: {name}", count, int)
    check_type("kutzbach: order", order, int)
    if not 1 <= order <= SPATIAL:
        raise InputValueError(f"kutzbach: expected order from 1 to {SPATIAL}, found {order}")
    if links < 1 or joints < links - 1:
        raise InputValueError(
            f"kutzbach: expected at least 1 link and {max(links - 1, 0)} joints to connect "
            f"{links} links, found {joints} joints"
        )
    if not joints <= freedom <= order * joints:
        raise InputValueError(
            f"kutzbach: expected freedom from {joints} to {order * joints} (1 to {order} for each "
            f"of {joints} joints), found {freedom}"
        )
    return order * (links - 1 - joints) + freedom


def mobility_of(loops: ClosedLoops, equations: Sequence[ClosureEquations]) -> Mobility:
    """Return the degrees of freedom of a mechanism.

    Args:
        loops: The numerically closed loops.
        equations: The independent equations of each loop.

    Raises:
        LoopError: The loops do not close at the reference configuration.
    """
    mechanism = loops.mechanism
    counts = Counts(mechanism, Terms({p.symbol: p.value for p in mechanism.parameters}))
    swings, z = len(mechanism.swings), len(configuration_names(mechanism))
    found = sum(len(loop.residual) for loop in equations)
    return Mobility(
        bodies=counts.bodies,
        joints=counts.joints,
        freedoms=counts.freedoms,
        order=counts.order,
        loop_freedoms=counts.loop_freedoms,
        loop_orders=counts.loop_orders,
        idle=sum(s.ends == "ball" and not s.has_universal for s in mechanism.struts),
        coordinates=z,
        rank=loops.rank() + swings,
        # If the loops close only in the least-squares sense, there is one equation per passive
        # variable.
        equations=sum(loops.passive) + swings if loops.in_least_squares else found,
        actuated=len(mechanism.actuated),
    )
