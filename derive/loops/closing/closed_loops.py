"""Numerical loop closure of a mechanism: Newton's method on its constraints."""

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ...chain.kinematics import coordinates
from ...chain.poe import placement_matrix
from ...model.errors import DescriptionError, InputValueError, LoopError
from ...model.mechanism import Mechanism
from ...model.robot import Placement
from ...model.tolerances import (
    CLOSED_LOOP,
    NEIGHBOURHOOD,
    REPEATED_EQUATION,
    SAMPLED_RANGE,
    WORTHWHILE_STEP,
    ZERO_SINGULAR_VALUE,
)
from ...terms.casadi_graph import lower
from ...terms.symbolic_function import Argument, Result, SymbolicFunction
from ...terms.terms import Terms
from ..model.constraints import configuration_names, constraints, derivative_rows, swing_angles
from ..model.gradient import gradient

Vector = NDArray[np.float64]
ITERATIONS = 60
POLISHING = 2
HALVINGS = 12
SAMPLES = 6
"""Number of random configurations at which the rank is computed."""


def closed_configuration(
    mechanism: Mechanism, q: Sequence[float] | None = None
) -> dict[str, float]:
    """Returns the full configuration z, by name, at which all loops close.

    Newton's method solves the constraints at the reference with the actuated coordinates fixed. If
    ``q`` is given, the solution is continued along the straight line from the reference to q, on
    the reference's branch.

    Args:
        mechanism: The description.
        q: Actuated coordinates in the order of ``mechanism.actuated`` (radian or metre), where None
            keeps the reference.

    Returns:
        Value of each entry of z (radian or metre); residuals are below ``CLOSED_LOOP``.

    Raises:
        LoopError: The loops do not close. The message names the loop with the largest
            residual.
    """
    loops = ClosedLoops(mechanism)
    z = loops.closed(loops.reference, loops.passive)
    if q is not None:
        z = loops.continued(z, loops.actuated_at(q))
    return dict(zip(loops.names, map(float, z), strict=True))


def longest_length(mechanism: Mechanism, terms: Terms) -> float:
    """Returns the longest translation or rod of a mechanism (metre), or 1 if all are zero."""
    placements = [p for joint in mechanism.joints for p in (joint.before, joint.after)]
    placements += [frame.placement for c in mechanism.closers for frame in (c.a, c.b)]
    lengths = [abs(float(terms.value(strut.length))) for strut in mechanism.struts]
    for placement in placements:
        shift = [float(terms.value(x)) for x in _shift(placement)]
        lengths.append(float(np.linalg.norm(shift)))
    return max(lengths, default=0.0) or 1.0


def swings_at(mechanism: Mechanism, at: Mapping[str, float]) -> dict[str, float]:
    """Returns the swing angles of pin-ended struts at a configuration.

    Args:
        mechanism: The description.
        at: Values of joints and cylinders (radian or metre), by name.

    Returns:
        The direction angle (radian) of each strut, by swing angle name.
    """
    names = mechanism.swings
    if not names:
        return {}
    terms = Terms({p.symbol: p.value for p in mechanism.parameters})
    symbols = coordinates("_w", len(at))
    angles = swing_angles(mechanism, terms, dict(zip(at, symbols, strict=True)))
    entries = tuple(angles[name] for name in names)
    argument = Argument("w", symbols, (len(at),), "m, rad", "joints and cylinders")
    result = Result("swing", entries, (len(names),), "rad", "swings")
    function = SymbolicFunction("swings", "Swings.", "", (argument,), (result,), terms)
    found = np.array(lower([function], "at")[0](list(at.values()))).ravel()
    return dict(zip(names, map(float, found), strict=True))


class ClosedLoops:
    """The constraints of one mechanism in double precision.

    Attributes:
        mechanism: The description.
        terms: The named terms that occur in the constraints.
        names: Names of the entries of z.
        is_length: Mask of the entries that are lengths.
        z: Symbols of the entries.
        equations: The constraints, loop by loop.
        entries: The residuals of all loops, or the gradient of their sum of squares for
            least-squares closure.
        passive: Mask of the entries that are not actuated.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        near: Mapping[str, float] | None = None,
        *,
        in_least_squares: bool = False,
    ) -> None:
        """Derives the constraints and their Jacobian.

        Args:
            mechanism: The description.
            near: Values near the reference that replace the described values of z.
            in_least_squares: Whether overconstrained loops close only in the least-squares sense.
        """
        self.mechanism, self._near = mechanism, near or {}
        self.terms = Terms({p.symbol: p.value for p in mechanism.parameters})
        variables = configuration_names(mechanism)
        self.names = [variable.name for variable in variables]
        self.is_length = np.array([variable.unit == "m" for variable in variables])
        self.z = coordinates("_z", len(variables))
        self.equations = constraints(mechanism, self.terms, self.z, may_stay_open=in_least_squares)
        self.entries = [entry for loop in self.equations for entry in loop.residual]
        self._owners = [loop.name for loop in self.equations for _ in loop.residual]
        actuated = {c.moves for c in mechanism.coordinates}
        self.passive = np.array([name not in actuated for name in self.names])
        if in_least_squares:
            unknown = [symbol for k, symbol in enumerate(self.z) if self.passive[k]]
            lengths = [bool(x) for x in self.is_length[self.passive]]
            found = gradient(self.equations, self.terms, unknown, lengths, self.size)
            self.entries = list(found)
            self._owners = [", ".join(loop.name for loop in self.equations)] * len(found)
        function = self._function()
        self._kernel = lower([function], mechanism.name)[0]

    def _function(self) -> SymbolicFunction:
        rows = derivative_rows(self.entries, self.terms, self.z)
        facing = tuple(entry for loop in self.equations for entry in loop.facing)
        count, size = len(self.entries), len(self.z)
        z = Argument("z", self.z, (size,), "m, rad", "full configuration")
        outputs = (
            Result("residual", tuple(self.entries), (count,), "m, 1", "differences"),
            Result("J", tuple(e for row in rows for e in row), (count, size), "", "by z"),
            Result("facing", facing, (len(facing),), "1", "above zero"),
        )
        return SymbolicFunction("loops", "Loops.", "", (z,), outputs, self.terms)

    @cached_property
    def reference(self) -> Vector:
        """The reference configuration of the description, with gear ratios applied.

        The default of a swing angle is the direction of its strut at the reference. From a distant
        start, Newton's method may end in a local minimum in which a loop is open.
        """
        given = dict(self.mechanism.reference)
        for c in self.mechanism.coordinates:
            if c.name in given:
                given[c.moves] = given[c.name] * c.ratio
        described = {name: self._float(given.get(name, sp.S.Zero)) for name in self.names}
        described |= self._near
        missing = set(self.mechanism.swings) - set(given) - set(self._near)
        if missing:
            swings = set(self.mechanism.swings)
            at = {name: value for name, value in described.items() if name not in swings}
            along = swings_at(self.mechanism, at)
            described |= {name: along[name] for name in missing}
        return np.array([described[name] for name in self.names])

    @cached_property
    def size(self) -> float:
        """The longest translation or rod of the mechanism (metre), or 1 if all are zero."""
        return longest_length(self.mechanism, self.terms)

    def actuated_at(self, q: Sequence[float]) -> Mapping[int, float]:
        """Returns the entries of z that the actuated coordinates determine, by index."""
        coordinates = self.mechanism.coordinates
        if len(q) != len(coordinates):
            raise InputValueError(
                f"robot {self.mechanism.name!r}: {len(q)} coordinates, expected {len(coordinates)}"
            )
        return {
            self.names.index(c.moves): float(value) * self._float(c.ratio)
            for c, value in zip(coordinates, q, strict=True)
        }

    def evaluated(self, z: Vector) -> tuple[Vector, Vector, Vector]:
        """Returns residuals, Jacobian (equations, len(z)) and the terms that detect flips, at z."""
        residual, J, facing = (np.asarray(value).ravel() for value in self._kernel(z))
        return residual, J.reshape(len(self.entries), len(self.z)), facing

    def closed(self, z: Vector, free: Vector) -> Vector:
        """Closes the loops by Newton's method from z; only the ``free`` entries change.

        Raises:
            LoopError: The iteration does not converge.
        """
        z = z.copy()
        for _ in range(ITERATIONS):
            if _largest(self.evaluated(z)[0]) <= CLOSED_LOOP:
                z = self._polished(z, free)
                break
            nearer = self._nearer(z, free, REPEATED_EQUATION)
            if nearer is None:
                nearer = self._nearer(z, free, ZERO_SINGULAR_VALUE)
            if nearer is None:
                break
            z = nearer
        residual, _, facing = self.evaluated(z)
        if not _largest(residual) <= CLOSED_LOOP or not np.all(facing > 0):
            raise self._open(residual, facing)
        return z

    def _nearer(self, z: Vector, free: Vector, rcond: float) -> Vector | None:
        """Returns z after a Newton step with a smaller residual, or None after many halvings."""
        residual, J, _ = self.evaluated(z)
        if not np.all(np.isfinite(residual)) or not np.all(np.isfinite(J)):
            return None
        step = _step(J, residual, free, rcond)
        for halving in range(HALVINGS):
            trial: Vector = z + step / 2**halving
            if np.linalg.norm(self.evaluated(trial)[0]) < WORTHWHILE_STEP * np.linalg.norm(
                residual
            ):
                return trial
        return None

    def _polished(self, z: Vector, free: Vector) -> Vector:
        """Refines a closed configuration up to rounding error.

        With redundant equations, z may be wrong by 1e-6 at a residual of 1e-12. At such a z, the
        redundant equations look independent, so the refinement drops these equations.
        """
        for _ in range(POLISHING):
            residual, J, _ = self.evaluated(z)
            z = z + _step(J, residual, free, REPEATED_EQUATION)
        return z

    def continued(self, z: Vector, goal: Mapping[int, float]) -> Vector:
        """Continues the closed configuration from z to the goal of the actuated entries."""
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
            except DescriptionError as error:
                if part == 1:
                    at_goal = error
                step /= 2
                if step < 1 / 2**HALVINGS:
                    raise at_goal from error
            else:
                z, done = reached, part
        return z

    def _check_branch(self, z: Vector, trial: Vector, reached: Vector) -> None:
        """Raises DescriptionError if passive entries moved much farther than actuated ones."""
        if self._distance(reached - z) > 2 * self._distance(trial - z) + SAMPLED_RANGE:
            residual, _, _ = self.evaluated(trial)
            name, _ = self._widest(residual)
            raise DescriptionError(
                f"robot {self.mechanism.name!r}: the loop of {name!r} changes its branch on the way"
            )

    def rank(self) -> int:
        """Returns the rank of the Jacobian at generic closed configurations near the reference."""
        return self._rank_at(self.generic[0])[0] if self.entries else 0

    @cached_property
    def generic(self) -> tuple[Vector, ...]:
        """Closed configurations near the reference with a full-rank Jacobian.

        Other assembly modes may have more or fewer degrees of freedom, so only the neighborhood of
        the reference is sampled.

        Raises:
            LoopError: The loops do not close from the reference.
        """
        reference = self.closed(self.reference, np.ones(len(self.z), dtype=bool))
        if not self.entries:
            return (reference,)
        far = [(*self._rank_at(z), z) for z in self._random(reference, SAMPLED_RANGE)]
        near = [(*self._rank_at(z), z) for z in self._random(reference, NEIGHBOURHOOD)]
        ranked = [(rank, z) for rank, is_sure, z in (*far, *near) if is_sure]
        ranked = ranked or [(rank, z) for rank, _, z in far]
        around = near[1:] if all(is_sure for _, is_sure, _ in near[1:]) else []
        highest = max(rank for rank, *_ in around or ranked)
        return tuple(z for rank, z in ranked if rank == highest)

    def _random(self, reference: Vector, reach: float) -> Iterator[Vector]:
        """Yields a closed configuration, then random closed configurations near it."""
        yield reference
        free = np.ones(len(reference), dtype=bool)
        random = np.random.default_rng(0)
        for _ in range(SAMPLES):
            offset = self._scaled(random.uniform(-reach, reach, len(reference)))
            for halving in range(HALVINGS):
                try:
                    yield self.closed(reference + offset / 2**halving, free)
                except DescriptionError:
                    continue
                break

    def _rank_at(self, z: Vector) -> tuple[int, bool]:
        """Returns the rank, and whether each singular value is clearly zero or clearly nonzero."""
        _, J, _ = self.evaluated(z)
        # Lengths are relative to the mechanism size, so that they can be compared with angles.
        J = J * self._scaled(np.ones(len(z)))
        lengths = np.linalg.norm(J, axis=1, keepdims=True)
        values = np.linalg.svd(J / np.where(lengths > 0, lengths, 1), compute_uv=False)
        parts = values / max(values[0], ZERO_SINGULAR_VALUE)
        return int(np.sum(parts > ZERO_SINGULAR_VALUE)), not np.any(
            (parts > ZERO_SINGULAR_VALUE) & (parts < REPEATED_EQUATION)
        )

    def _scaled(self, z: Vector) -> Vector:
        return np.where(self.is_length, self.size, 1.0) * z

    def _distance(self, difference: Vector) -> float:
        return float(np.max(np.abs(difference) / self._scaled(np.ones(len(difference)))))

    def _float(self, expression: sp.Expr) -> float:
        return float(self.terms.value(expression))

    def _open(self, residual: Vector, facing: Vector) -> LoopError:
        name, left = self._widest(residual)
        why = (
            f"{1000 * left:.3g} mm remain"
            if left > CLOSED_LOOP
            else "it closes only with a flipped frame"
        )
        if left <= CLOSED_LOOP:
            name = self._turned_over(facing)
        text = f"robot {self.mechanism.name!r}: the loop of {name!r} does not close: {why}"
        return LoopError(text, gap=left)

    def _widest(self, residual: Vector) -> tuple[str, float]:
        """Returns the loop with the largest residual, and that residual."""
        size = np.where(np.isnan(residual), np.inf, np.abs(residual))
        k = int(np.argmax(size))
        return self._owners[k], float(size[k])

    def _turned_over(self, facing: Vector) -> str:
        owners = [loop.name for loop in self.equations for _ in loop.facing]
        return owners[int(np.argmin(facing))]


def _largest(residual: Vector) -> float:
    return float(np.max(np.abs(residual), initial=0.0))


def _step(J: Vector, residual: Vector, free: Vector, rcond: float) -> Vector:
    """Returns the shortest least-squares step of the free entries."""
    step = np.zeros(len(free))
    step[free] = np.linalg.lstsq(J[:, free], -residual, rcond=rcond)[0]
    return step


def _shift(placement: Placement) -> sp.Matrix:
    return placement_matrix(placement)[:3, 3]
