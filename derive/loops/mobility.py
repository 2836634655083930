"""Mobility of a mechanism, counted and true, and its closed configurations in numbers.

Counting presumes that every constraint is independent of the others; the rank of the constraint
Jacobian at closed configurations does not. Where they disagree the mechanism is overconstrained, or
a member can turn without moving anything.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ..chain.poe import placement_matrix
from ..model.errors import RobotError
from ..model.mechanism import FREEDOM, Closure, Mechanism, Strut
from ..model.robot import Joint, Placement
from ..terms.casadi_graph import lower
from ..terms.symbolic_function import Argument, Result, SymbolicFunction
from ..terms.terms import Terms
from .constraints import LoopEquations, configuration_names, constraints, jacobian
from .planar.planes import across, holds, linkages

Vector = NDArray[np.float64]
PLANAR, SPATIAL = 3, 6
"""Dimension of the group in which a planar or a spatial loop moves."""
CLOSED = 1e-12
"""What is left of a closed loop in double precision (metre, or sine of an angle)."""
RANK = 1e-9
"""Singular values below this part of the largest are zero."""
REPEATED = 1e-4
"""Singular values of equations that repeat others near closure, as parts of the largest."""
ITERATIONS = 60
PROGRESS = 0.9
"""A step that leaves more than this part of the residual is none."""
POLISHING = 2
HALVINGS = 12
SAMPLES = 6
"""Random configurations at which the rank is taken; it is smaller only at singular ones."""
SPREAD = 0.3
"""How far they are from the reference: radian, and part of the mechanism's size."""


@dataclass(frozen=True)
class Mobility:
    """Degrees of freedom of a mechanism, by three ways of counting.

    Attributes:
        bodies: n, the base included; rods are bodies, cylinders two.
        joints: j, ends of rods and cylinders included.
        freedoms: Sum of the joints' degrees of freedom f in the group of order ``order``.
        order: lambda, 3 where all of it moves in one plane, else 6.
        loop_freedoms: Sum of f where each joint counts in the group of its loop.
        loop_orders: lambda of each independent loop.
        idle: Members on balls, each of which turns about itself and moves nothing.
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
        """Whether constraints repeat others, so that it moves more freely than is counted."""
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
        """What the counts do not agree in, a line each; nothing where they do."""
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
    """Counts the degrees of freedom of a mechanism, and finds the true ones.

    Bodies that fixed joints hold together are one. A rod is a body with two joints, a cylinder two
    bodies with two joints and a slider between. A platform that stands on virtual joints (see
    :func:`virtual_joints`) is one body without them. A motor behind a gear is not counted: with
    its bearing and the gear pair it adds nothing.

    Args:
        mechanism: The description, with a reference configuration from which it closes.

    Raises:
        RobotError: The loops do not close from the reference.

    Source:
        Gogu, Mechanism and Machine Theory 40 (2005), 1068-1097, for the counts and their limits.
    """
    numbers = _Numbers(mechanism)
    counts = _Counts(mechanism, numbers.terms)
    return Mobility(
        bodies=counts.bodies,
        joints=counts.joints,
        freedoms=counts.freedoms,
        order=counts.order,
        loop_freedoms=counts.loop_freedoms,
        loop_orders=counts.loop_orders,
        idle=sum(strut.ends == "ball" for strut in mechanism.struts),
        coordinates=len(numbers.z),
        rank=numbers.rank(),
        equations=len(numbers.entries),
        actuated=len(mechanism.actuated),
    )


def closed_configuration(
    mechanism: Mechanism, q: Sequence[float] | None = None
) -> dict[str, float]:
    """The full configuration z by name at which all loops close.

    Newton's method on the constraints, the actuated coordinates held: from the reference, then,
    if ``q`` is given, along the straight line from the reference's coordinates to q, so that the
    branch is the reference's.

    Args:
        mechanism: The description.
        q: Actuated coordinates in the order of ``mechanism.actuated`` (radian or metre); those of
            the reference where none are given.

    Returns:
        Value of each entry of z (radian or metre); residuals are below 1e-12.

    Raises:
        RobotError: The loops do not close; the message names the one that is open widest.
    """
    numbers = _Numbers(mechanism)
    z = numbers.closed(numbers.reference, numbers.passive)
    if q is not None:
        z = numbers.continued(z, numbers.actuated_at(q))
    return dict(zip(numbers.names, map(float, z), strict=True))


# --- configurations in numbers ---


class _Numbers:
    """The constraints of one mechanism in double precision."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.terms = Terms({p.symbol: p.value for p in mechanism.parameters})
        variables = configuration_names(mechanism)
        self.names = [variable.name for variable in variables]
        self.is_length = np.array([variable.unit == "m" for variable in variables])
        self.z = sp.symbols(f"z1:{len(variables) + 1}", real=True)
        self.equations = constraints(mechanism, self.terms, self.z)
        self.entries = [entry for loop in self.equations for entry in loop.residual]
        actuated = {c.moves for c in mechanism.coordinates}
        self.passive = np.array([name not in actuated for name in self.names])
        function = self._function(self.equations)
        self._kernel = lower([function], mechanism.name)[0]

    def _function(self, equations: Sequence[LoopEquations]) -> SymbolicFunction:
        rows = jacobian(equations, self.terms, self.z)
        facing = tuple(entry for loop in equations for entry in loop.facing)
        count, size = len(self.entries), len(self.z)
        z = Argument("z", self.z, (size,), "m, rad", "full configuration")
        outputs = (
            Result("residual", tuple(self.entries), (count,), "m, 1", "what is open"),
            Result("J", tuple(e for row in rows for e in row), (count, size), "", "by z"),
            Result("facing", facing, (len(facing),), "1", "above zero"),
        )
        return SymbolicFunction("loops", "Loops.", "", (z,), outputs, self.terms)

    @cached_property
    def reference(self) -> Vector:
        """The reference configuration as described, motors' coordinates through their gears."""
        given = dict(self.mechanism.reference)
        for c in self.mechanism.coordinates:
            if c.name in given:
                given[c.moves] = given[c.name] * c.ratio
        return np.array([self._float(given.get(name, sp.S.Zero)) for name in self.names])

    @cached_property
    def size(self) -> float:
        """The longest translation or rod of the mechanism (metre), 1 where all are zero."""
        placements = [p for joint in self.mechanism.joints for p in (joint.before, joint.after)]
        placements += [frame.placement for c in self.mechanism.closers for frame in (c.a, c.b)]
        lengths = [self._float(strut.length) for strut in self.mechanism.struts]
        for placement in placements:
            lengths.append(float(np.linalg.norm([self._float(x) for x in _shift(placement)])))
        return max(lengths, default=0.0) or 1.0

    def actuated_at(self, q: Sequence[float]) -> Mapping[int, float]:
        """The entries of z that actuated coordinates give, by index."""
        coordinates = self.mechanism.coordinates
        if len(q) != len(coordinates):
            raise RobotError(
                f"robot {self.mechanism.name!r}: {len(q)} coordinates, expected {len(coordinates)}"
            )
        return {
            self.names.index(c.moves): float(value) * self._float(c.ratio)
            for c, value in zip(coordinates, q, strict=True)
        }

    def evaluated(self, z: Vector) -> tuple[Vector, Vector, Vector]:
        """Residuals, Jacobian (equations, len(z)) and facing at a configuration."""
        residual, J, facing = (np.asarray(value).ravel() for value in self._kernel(z))
        return residual, J.reshape(len(self.entries), len(self.z)), facing

    def closed(self, z: Vector, free: Vector) -> Vector:
        """The closed configuration that Newton's method finds from z, only ``free`` entries moved.

        Raises:
            RobotError: It finds none.
        """
        z = z.copy()
        for _ in range(ITERATIONS):
            if _largest(self.evaluated(z)[0]) <= CLOSED:
                z = self._polished(z, free)
                break
            nearer = self._nearer(z, free, REPEATED)
            if nearer is None:
                nearer = self._nearer(z, free, RANK)
            if nearer is None:
                break
            z = nearer
        residual, _, facing = self.evaluated(z)
        if not _largest(residual) <= CLOSED or not np.all(facing > 0):
            raise RobotError(self._open(residual, facing))
        return z

    def _nearer(self, z: Vector, free: Vector, rcond: float) -> Vector | None:
        """A step of Newton's method, shortened until it helps; None where it does not."""
        residual, J, _ = self.evaluated(z)
        if not np.all(np.isfinite(residual)) or not np.all(np.isfinite(J)):
            return None
        step = _step(J, residual, free, rcond)
        for halving in range(HALVINGS):
            trial: Vector = z + step / 2**halving
            if np.linalg.norm(self.evaluated(trial)[0]) < PROGRESS * np.linalg.norm(residual):
                return trial
        return None

    def _polished(self, z: Vector, free: Vector) -> Vector:
        """A closed configuration to rounding.

        Where equations repeat others, a residual of 1e-12 may be 1e-6 away from closure, and there
        the repeated equations still look independent. Steps that leave them out go all the way.
        """
        for _ in range(POLISHING):
            residual, J, _ = self.evaluated(z)
            z = z + _step(J, residual, free, REPEATED)
        return z

    def continued(self, z: Vector, goal: Mapping[int, float]) -> Vector:
        """The closed configuration that z becomes while actuated entries go to their goal."""
        index = list(goal)
        start, end = z[index], np.array(list(goal.values()))
        done, step = 0.0, 1.0
        while done < 1:
            part = min(done + step, 1.0)
            trial = z.copy()
            trial[index] = end if part == 1 else start + part * (end - start)
            try:
                reached = self.closed(trial, self.passive)
                self._check_branch(z, trial, reached)
            except RobotError as error:
                if part == 1:
                    at_goal = error
                step /= 2
                if step < 1 / 2**HALVINGS:
                    raise at_goal from error
            else:
                z, done = reached, part
        return z

    def _check_branch(self, z: Vector, trial: Vector, reached: Vector) -> None:
        """Raises RobotError where passive entries jumped much farther than actuated ones moved."""
        if self._distance(reached - z) > 2 * self._distance(trial - z) + SPREAD:
            residual, _, _ = self.evaluated(trial)
            name, _ = self._widest(residual)
            raise RobotError(
                f"robot {self.mechanism.name!r}: the loop of {name!r} leaves its branch on the way"
            )

    def rank(self) -> int:
        """Rank of the Jacobian at generic closed configurations near the reference."""
        if not self.entries:
            return 0
        reference = self.closed(self.reference, np.ones(len(self.z), dtype=bool))
        found = [self._rank_at(z) for z in self._random(reference)]
        return max([rank for rank, is_sure in found if is_sure] or [rank for rank, _ in found])

    def _random(self, reference: Vector) -> Iterator[Vector]:
        """A closed configuration and others around it; nearer to it where none is far out."""
        yield reference
        free = np.ones(len(reference), dtype=bool)
        random = np.random.default_rng(0)
        for _ in range(SAMPLES):
            offset = self._scaled(random.uniform(-SPREAD, SPREAD, len(reference)))
            for halving in range(HALVINGS):
                try:
                    yield self.closed(reference + offset / 2**halving, free)
                except RobotError:
                    continue
                break

    def _rank_at(self, z: Vector) -> tuple[int, bool]:
        """The rank, and whether no singular value is between zero and not zero."""
        _, J, _ = self.evaluated(z)
        # Lengths in parts of the mechanism's size, so that metres and radians compare.
        J = J * self._scaled(np.ones(len(z)))
        lengths = np.linalg.norm(J, axis=1, keepdims=True)
        values = np.linalg.svd(J / np.where(lengths > 0, lengths, 1), compute_uv=False)
        parts = values / max(values[0], RANK)
        return int(np.sum(parts > RANK)), not np.any((parts > RANK) & (parts < REPEATED))

    def _scaled(self, z: Vector) -> Vector:
        return np.where(self.is_length, self.size, 1.0) * z

    def _distance(self, difference: Vector) -> float:
        return float(np.max(np.abs(difference) / self._scaled(np.ones(len(difference)))))

    def _float(self, expression: sp.Expr) -> float:
        return float(self.terms.value(expression))

    def _open(self, residual: Vector, facing: Vector) -> str:
        name, left = self._widest(residual)
        why = f"{left:.3g} m is left" if left > CLOSED else "it closes with a frame turned over"
        if left <= CLOSED:
            name = self._turned_over(facing)
        return f"robot {self.mechanism.name!r}: the loop of {name!r} does not close: {why}"

    def _widest(self, residual: Vector) -> tuple[str, float]:
        """The loop with the largest residual."""
        size = np.where(np.isnan(residual), np.inf, np.abs(residual))
        owners = [loop.name for loop in self.equations for _ in loop.residual]
        k = int(np.argmax(size))
        return owners[k], float(size[k])

    def _turned_over(self, facing: Vector) -> str:
        owners = [loop.name for loop in self.equations for _ in loop.facing]
        return owners[int(np.argmin(facing))]


def _largest(residual: Vector) -> float:
    return float(np.max(np.abs(residual), initial=0.0))


def _step(J: Vector, residual: Vector, free: Vector, rcond: float) -> Vector:
    """The shortest step of the free entries that closes the linearised loops best."""
    step = np.zeros(len(free))
    step[free] = np.linalg.lstsq(J[:, free], -residual, rcond=rcond)[0]
    return step


def _shift(placement: Placement) -> sp.Matrix:
    return placement_matrix(placement)[:3, 3]


# --- counts ---


def virtual_joints(mechanism: Mechanism, terms: Terms) -> list[tuple[Joint, ...]]:
    """The runs of joints that are only the coordinates of a free body, in order.

    Such a run is three sliders and then three turning joints that reach every pose, or two sliders
    and a turning joint that reach every pose of a plane; none of them is actuated, and the bodies
    between carry nothing: no closure, strut, tool or joint but the next.
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
    """A joint and the next ones, of one freedom each, or nothing where bodies between branch."""
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
    held = {frame.body for closer in mechanism.closers for frame in (closer.a, closer.b)}
    between = {joint.link for joint in run[:-1]}
    actuated = {c.moves for c in mechanism.coordinates}
    if (
        [joint.kind for joint in run] != expected
        or between & (held | {mechanism.tool_body})
        or actuated & {joint.name for joint in run}
    ):
        return False
    sliding, turning = (axes := _axes(terms, run))[:sliders], axes[sliders:]
    spans = _rank(sliding) == sliders and _rank(turning) == len(turning)
    return spans and (len(run) == SPATIAL or holds(turning[0], turning, sliding))


def _axes(terms: Terms, run: Sequence[Joint]) -> list[sp.Matrix]:
    """Axes of a run of joints at zero, in numbers."""
    R, axes = sp.eye(3), []
    for joint in run:
        R = R * placement_matrix(joint.before)[:3, :3]
        axes.append(R[:, 2].applyfunc(terms.value))
        R = R * placement_matrix(joint.after)[:3, :3]
    return axes


def _rank(axes: Sequence[sp.Matrix]) -> int:
    stacked = np.array([[float(x) for x in axis] for axis in axes])
    return int(np.linalg.matrix_rank(stacked, tol=RANK))


class _Counts:
    """Bodies, joints and freedoms of a mechanism."""

    def __init__(self, mechanism: Mechanism, terms: Terms) -> None:
        self.mechanism, self.terms = mechanism, terms
        self.planar, _ = linkages(mechanism, terms)
        self.in_plane = {name for linkage in self.planar for name in linkage.closers}
        self.order = PLANAR if self._is_one_plane() else SPATIAL
        orders = [self._order_of(closer) for closer in mechanism.closers]
        self.virtual: list[tuple[Joint, ...]] = []
        for run in virtual_joints(mechanism, terms):
            # Virtual joints add as many freedoms as one loop through the platform takes away.
            if len(run) in orders:
                orders.remove(len(run))
                self.virtual.append(run)
        self.loop_orders = tuple(orders)

    @property
    def bodies(self) -> int:
        moving = sum(joint.kind != "fixed" for joint in self.mechanism.joints)
        struts = sum(1 + strut.is_cylinder for strut in self.mechanism.struts)
        return 1 + moving + struts - sum(len(run) - 1 for run in self.virtual)

    @property
    def joints(self) -> int:
        struts = sum(2 + strut.is_cylinder for strut in self.mechanism.struts)
        return self._tree_joints() + len(self.mechanism.closures) + struts

    @property
    def freedoms(self) -> int:
        closers = sum(_freedom(closer, self.order) for closer in self.mechanism.closers)
        return self._tree_joints() + closers

    @property
    def loop_freedoms(self) -> int:
        closers = sum(_freedom(c, self._order_of(c)) for c in self.mechanism.closers)
        return self._tree_joints() + closers

    def _tree_joints(self) -> int:
        """Number of the tree's joints, of one freedom each, virtual ones left out."""
        moving = sum(joint.kind != "fixed" for joint in self.mechanism.joints)
        return moving - sum(map(len, self.virtual))

    def _order_of(self, closer: Closure | Strut) -> int:
        on_balls = isinstance(closer, Strut) and closer.ends == "ball"
        return PLANAR if closer.name in self.in_plane and not on_balls else SPATIAL

    def _is_one_plane(self) -> bool:
        """Whether all joints and closers move in parallel planes."""
        if len(self.in_plane) < len(self.mechanism.closers):
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
        n = turning[0] if turning else across(sliding)
        return n is not None and holds(n, turning, sliding)


def _turned(terms: Terms, placement: Placement) -> sp.Matrix:
    return placement_matrix(placement)[:3, :3].applyfunc(terms.value)


def _freedom(closer: Closure | Strut, order: int) -> int:
    """Freedoms of what closes a loop, in the plane or in space."""
    if isinstance(closer, Closure):
        return 1 if closer.kind == "ball" and order == PLANAR else FREEDOM[closer.kind]
    end = FREEDOM[closer.ends] if order == SPATIAL else 1
    return 2 * end + closer.is_cylinder
