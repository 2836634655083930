"""Closes the loops of a mechanism numerically by Newton's method.

Each strut contributes one equation, for the distance between its ends. The equations omit the swing
angles of struts, because a swing angle would only add one variable and one equation.
"""

from collections.abc import Iterator, Mapping
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...model.errors import DescriptionError, LoopError
from ...model.mechanism import Mechanism
from ...model.tolerances import (
    CLOSED_LOOP,
    DIFFERENCE_STEP,
    NEIGHBOURHOOD,
    REPEATED_EQUATION,
    SAMPLED_RANGE,
    WORTHWHILE_STEP,
    ZERO_SINGULAR_VALUE,
)
from ..model.constraints import configuration_names
from ..model.numeric_mechanism import NumericMechanism
from ..model.numeric_rows import NumericRows

Vector = NDArray[np.float64]
Evaluated = tuple[Vector, Vector, Vector]
"""Three arrays: the residuals, the Jacobian of the residuals, and the cosines between the axes of
the two end frames of each closure. If a cosine is negative, the two corresponding axes of a closure
point in opposite directions."""
ITERATIONS = 60
POLISHING = 2
HALVINGS = 12
SAMPLES = 6
"""Number of random configurations at which the rank of the constraint Jacobian is computed."""


class ClosedLoops:
    """The closure equations of one mechanism in double precision.

    Attributes:
        mechanism: The description.
        bodies: Numerical model of the bodies and frames.
        names: Names of the variables w, which are joints and cylinders.
        is_length: Mask of the variables with the unit of a length.
        passive: Mask of the passive variables.
        size: Length of the longest translation or rod (meter), or 1 if all lengths are zero.
        reference: Values of the variables w at the reference configuration, with gear ratios
            applied.
        in_least_squares: Whether the loops close only in the least-squares sense.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        near: Mapping[str, float] | None = None,
        *,
        in_least_squares: bool = False,
    ) -> None:
        """Prepare the closure equations.

        Args:
            mechanism: The description.
            near: Joint and cylinder values, by name, that replace the reference values.
            in_least_squares: Whether the loops close only in the least-squares sense.
        """
        self.mechanism, self.in_least_squares = mechanism, in_least_squares
        self.bodies = NumericMechanism(mechanism)
        self._rows = NumericRows(self.bodies)
        self.names, self.size = self._rows.names, self.bodies.size
        self.is_length = np.array([self.bodies.is_length(name) for name in self.names], bool)
        self.passive = np.array([name in self.bodies.unknown for name in self.names], bool)
        described = self.bodies.values | dict(near or {})
        self.reference = np.array([described[name] for name in self.names])

    def configuration(self, w: Vector) -> dict[str, float]:
        """Return the full configuration z by name, including the swing angles of struts."""
        found = dict(zip(self.names, map(float, w), strict=True))
        found |= self.bodies.swings(found)
        return {v.name: found[v.name] for v in configuration_names(self.mechanism)}

    def evaluated(self, w: Vector) -> Evaluated:
        """Return residuals, Jacobian and cosines of the closure equations at the variables w.

        The Jacobian has one row per equation.
        """
        if not self.in_least_squares:
            return self._rows.at(w)
        steps = DIFFERENCE_STEP * np.eye(len(w))
        g = np.array([[self._gradient(w + step) for step in (h, -h)] for h in steps])
        return self._gradient(w), (g[:, 0] - g[:, 1]).T / (2 * DIFFERENCE_STEP), self._rows.at(w)[2]

    def _gradient(self, w: Vector) -> Vector:
        """Return the gradient of half the sum of squared closure errors (``model.gradient``)."""
        c, J, _ = self._rows.at(w)
        size = float(f"{self.size:.3g}")
        weights = np.where(self._rows.is_turn, size, 1.0)
        found: Vector = (J[:, self.passive] * weights[:, None] ** 2).T @ c
        return found / np.where(self.is_length[self.passive], 1.0, size)

    def closed(self, w: Vector, free: Vector) -> Vector:
        """Close the loops by Newton's method, changing only the ``free`` variables.

        Raises:
            LoopError: Newton's method does not converge, or the loops close only with a flipped
                frame.
        """
        here = self.evaluated(w)
        for _ in range(ITERATIONS):
            if _largest(here[0]) <= CLOSED_LOOP:
                w, here = self._polished(w, here, free)
                break
            nearer = self._nearer(w, here, free, REPEATED_EQUATION)
            nearer = nearer or self._nearer(w, here, free, ZERO_SINGULAR_VALUE)
            if nearer is None:
                break
            w, here = nearer
        residual, _, facing = here
        if not _largest(residual) <= CLOSED_LOOP or not np.all(facing > 0):
            raise self._open(residual, facing)
        return w

    def _nearer(
        self, w: Vector, here: Evaluated, free: Vector, rcond: float
    ) -> tuple[Vector, Evaluated] | None:
        """Take a Newton step that reduces the residual, or return None if no step does."""
        residual, J, _ = here
        if not np.all(np.isfinite(residual)) or not np.all(np.isfinite(J)):
            return None
        step = _step(J, residual, free, rcond)
        for halving in range(HALVINGS):
            trial: Vector = w + step / 2**halving
            there = self.evaluated(trial)
            if np.linalg.norm(there[0]) < WORTHWHILE_STEP * np.linalg.norm(residual):
                return trial, there
        return None

    def _polished(self, w: Vector, here: Evaluated, free: Vector) -> tuple[Vector, Evaluated]:
        """Refine a closed configuration until only rounding errors remain.

        With redundant equations, the variables w may have an error of 1e-6 although the residual is
        1e-12. At inexact variables w, redundant equations appear to be independent. The Newton
        steps therefore ignore small singular values of the Jacobian.
        """
        for _ in range(POLISHING):
            w = w + _step(here[1], here[0], free, REPEATED_EQUATION)
            here = self.evaluated(w)
        return w, here

    def rank(self) -> int:
        """Return the rank of the constraint Jacobian near the reference."""
        return self._rank_at(self.generic[0])[0] if self._rows.owners else 0

    @cached_property
    def generic(self) -> tuple[Vector, ...]:
        """Closed configurations near the reference at which the Jacobian has its highest rank.

        Only configurations near the reference are sampled, because other assembly modes may have
        other degrees of freedom.

        Raises:
            LoopError: The loops do not close at the reference.
        """
        reference = self.closed(self.reference, np.ones(len(self.names), dtype=bool))
        if not self._rows.owners:
            return (reference,)
        far = [(*self._rank_at(w), w) for w in self._random(reference, SAMPLED_RANGE)]
        near = [(*self._rank_at(w), w) for w in self._random(reference, NEIGHBOURHOOD)]
        ranked = [(rank, w) for rank, is_certain, w in (*far, *near) if is_certain]
        ranked = ranked or [(rank, w) for rank, _, w in far]
        around = near[1:] if all(is_certain for _, is_certain, _ in near[1:]) else []
        highest = max(rank for rank, *_ in around or ranked)
        return tuple(w for rank, w in ranked if rank == highest)

    def _random(self, reference: Vector, reach: float) -> Iterator[Vector]:
        """Yield a closed configuration and then random closed configurations near it."""
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

    def _rank_at(self, w: Vector) -> tuple[int, bool]:
        """Return the rank of the Jacobian at configuration w, and whether the rank is certain."""
        values = np.linalg.svd(self.unit_rows(w), compute_uv=False)
        parts = values / max(values[0], ZERO_SINGULAR_VALUE)
        return int(np.sum(parts > ZERO_SINGULAR_VALUE)), not np.any(
            (parts > ZERO_SINGULAR_VALUE) & (parts < REPEATED_EQUATION)
        )

    def unit_rows(self, w: Vector) -> Vector:
        """Return the Jacobian with its rows scaled to length 1.

        Before the scaling, lengths are divided by the size of the mechanism. A Jacobian row that
        contains only rounding errors is not scaled to length 1.
        """
        J = self.evaluated(w)[1] * self._scaled(np.ones(len(w)))
        norms = np.linalg.norm(J, axis=1, keepdims=True)
        least = ZERO_SINGULAR_VALUE * np.max(norms, initial=0.0)
        found: Vector = J / np.where(norms > least, norms, 1.0)
        return found

    def _scaled(self, w: Vector) -> Vector:
        return np.where(self.is_length, self.size, 1.0) * w

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
        return LoopError(text, closure_error=left)

    def _widest(self, residual: Vector) -> tuple[str, float]:
        """Return the name of the loop with the largest residual, and the size of this residual."""
        size = np.where(np.isnan(residual), np.inf, np.abs(residual))
        k = int(np.argmax(size))
        owners = self._rows.owners
        if self.in_least_squares:
            return ", ".join(dict.fromkeys(owners)), float(size[k])
        return owners[k], float(size[k])

    def _turned_over(self, facing: Vector) -> str:
        return self._rows.facing_owners[int(np.argmin(facing))]


def _largest(residual: Vector) -> float:
    return float(np.max(np.abs(residual), initial=0.0))


def _step(J: Vector, residual: Vector, free: Vector, rcond: float) -> Vector:
    """Return the minimum-norm least-squares Newton step of the free variables."""
    step = np.zeros(len(free))
    step[free] = np.linalg.lstsq(J[:, free], -residual, rcond=rcond)[0]
    return step
