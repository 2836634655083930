"""Finds all complex poses of a platform on six rods.

The coordinates of the rods in all configurations span an affine space. The search selects rods with
generic complex coordinates from this affine space. A generic platform has forty complex poses. The
module ``generic_platform`` lists the poses of one generic platform. A special platform may be flat
or have shared rod ends. If the rod lengths of a special platform are generic, some of the forty
tracked paths lead to all poses of this platform. The other paths diverge to infinity. By Sard's
theorem, almost all values of a smooth function are regular. Therefore, a platform with generic rod
lengths has no singular pose. Singular end poses are not used as start poses.

Source:
    Sommese and Wampler 2005, The Numerical Solution of Systems of Polynomials, ch. 2 and 7
    (parameters).
"""

from itertools import pairwise

import mpmath
import numpy as np

from ...model.tolerances import (
    EVALUATION_DIGITS,
    PATH_NEAR,
    PATH_ON,
    POSE_AT_INFINITY,
    POSES_ARE_ONE,
    RODS_SPAN,
    SHORTEST_PATH_STEP,
    SINGULAR_POSE,
)
from .generic_platform import POSES, RODS
from .soma import SOMA, Array, SixRods, finite, quadrics, residuals

FIRST_STEP = 0.05
MAX_STEPS = 3000
MAX_POSES = len(POSES)
LOOPS_WITHOUT_A_NEW_POSE = 3
"""The search ends after this number of consecutive closed paths without a new pose."""
REFINEMENTS = 3
GENERIC_DIGITS = 12
"""Number of decimal places to which the generic rod coordinates are rounded."""


def generic(count: int, phase: int) -> Array:
    """Return pseudo-random complex numbers on the unit circle, with `phase` as the seed."""
    k = np.arange(1, count + 1) + 100 * phase
    return np.asarray(np.exp(2j * np.pi * ((k * np.sqrt(2)) % 1 + (k * k * np.sqrt(3)) % 1)))


class RodFamily:
    """The affine space spanned by a platform's rods in all configurations.

    The start poses for path tracking are the complex poses that fit generic complex rods from this
    affine space.
    """

    def __init__(self, a: Array, b: Array, lengths: Array) -> None:
        """Compute the affine space that the rods span at n configurations.

        Args:
            a: (n, 6, 3) rod ends on the actuated side at n configurations, divided by the platform
                size.
            b: (6, 3) rod ends on the platform, divided by the platform size.
            lengths: (n, 6) rod lengths at n configurations, divided by the platform size.
        """
        self.a, self.b = a[0].astype(np.complex128), b
        squares = (a**2).sum(-1) + (b**2).sum(-1) - lengths**2
        samples = np.concatenate([a.reshape(len(a), -1), squares], 1)
        self.middle = samples.mean(0)
        _, sizes, directions = np.linalg.svd(samples - self.middle)
        self.directions = directions[: int((sizes > RODS_SPAN * sizes[0]).sum())]
        self.moves = bool(np.ptp(a, axis=0).max() > RODS_SPAN)

    def member(self, phase: int) -> SixRods:
        """Return six rods of the affine space with generic complex coordinates."""
        # The singular vectors of a subspace are not unique, but the projector on the subspace is
        # unique.
        away = self.directions.T @ (self.directions @ generic(len(self.middle), phase))
        # Rounding removes the last digits, which differ between machines.
        found = np.round(self.middle + away, GENERIC_DIGITS)
        a = found[:18].reshape(6, 3) if self.moves else self.a
        return SixRods(a, self.b, found[18:])


def starts(family: RodFamily) -> tuple[SixRods, Array]:
    """Return generic rods of a family, and all complex poses (n, 8) that fit these rods.

    The poses are computed in high precision, rounded and sorted.
    """
    own = family.member(1)
    halfway = SixRods(RODS.a, family.b, 2 * generic(6, 2))
    x, arrived = followed(RODS, halfway, POSES)
    x, arrived = followed(halfway, own, x[arrived])
    known = _regular(own, x[arrived])
    fruitless = 0
    for phase in range(3, 100, 2):
        if len(known) == MAX_POSES or fruitless == LOOPS_WITHOUT_A_NEW_POSE:
            break
        more = _around(family, own, known, phase)
        fruitless = 0 if len(more) > len(known) else fruitless + 1
        known = more
    return own, _exact(own, known)


def _around(family: RodFamily, own: SixRods, known: Array, phase: int) -> Array:
    """Return the known poses, and poses found by moving the rods along a closed path."""
    stations = [own, family.member(phase), family.member(phase + 1), own]
    x = known
    for start, end in pairwise(stations):
        if not len(x):
            return known
        x, arrived = followed(start, end, x)
        x = x[arrived]
    return _regular(own, np.concatenate([known, x]))


def _regular(rods: SixRods, x: Array) -> Array:
    """Return the finite and nonsingular poses without duplicates."""
    x = x[(finite(x) > POSE_AT_INFINITY) & (condition(rods, x) < SINGULAR_POSE)]
    apart = 1 - np.abs(x.conj() @ x.T) > POSES_ARE_ONE
    kept = [k for k in range(len(x)) if apart[k, :k].all()]
    return x[kept]


def _exact(rods: SixRods, x: Array) -> Array:
    """Refine the poses in high precision and sort them."""
    # Arithmetic in double precision would round differently on different machines.
    scale = generic(SOMA, 0)
    x = x / (x @ scale)[:, None]
    J = np.empty((len(x), SOMA, SOMA), np.complex128)
    J[:, :-1] = 2 * np.einsum("kij,nj->nki", quadrics(rods), x)
    J[:, -1] = scale
    with mpmath.workdps(EVALUATION_DIGITS):
        number = np.frompyfunc(mpmath.mpc, 1, 1)
        exact = SixRods(*(number(part.astype(complex)) for part in (rods.a, rods.b, rods.c)))
        fine, weights = number(x), number(scale)
        for _ in range(REFINEMENTS):
            values = residuals(exact, fine)
            sums = fine @ weights - 1
            right = np.concatenate([values, sums[:, None]], 1).astype(complex)
            fine = fine - number(np.linalg.solve(J, right[..., None])[..., 0])
        sizes = [mpmath.sqrt(sum(abs(entry) ** 2 for entry in row)) for row in fine]
        rounded = np.array(
            [
                [complex(entry / size) for entry in row]
                for row, size in zip(fine, sizes, strict=True)
            ],
            complex,
        )
    rounded = rounded.reshape(-1, SOMA)
    return np.asarray(rounded[np.lexsort((rounded[:, 0].imag, rounded[:, 0].real))])


def followed(start: SixRods, end: SixRods, x: Array) -> tuple[Array, Array]:
    """Track poses while the rods change from start to end.

    The rods ``start`` and ``end`` may differ either in the ends on the actuated side or in the ends
    on the platform, but not in both. The coefficients of the rod equations change linearly with the
    path parameter t from 0 to 1. A Runge-Kutta step and two Newton steps update each pose. If the
    coefficients of the rod equations at the start and at the end are generic complex numbers, all
    paths are regular. If the final rods are not generic, a path may end at a singularity or at
    infinity.

    Args:
        start: Rods whose poses are known.
        end: The rods at the end of the paths (t = 1).
        x: (n, 8) poses of the platform that fit the rods ``start``.

    Returns:
        (n, 8) poses of unit norm, and (n,) flags for the paths that reached the end.
    """
    H, change = quadrics(start), quadrics(end) - quadrics(start)
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    t, h = np.zeros(len(x)), np.full(len(x), FIRST_STEP)
    going = np.ones(len(x), bool)
    for _ in range(MAX_STEPS):
        rows = np.flatnonzero(going & (t < 1))
        if not len(rows):
            break
        step = np.minimum(h[rows], 1 - t[rows])
        y, first, second = _stepped(H, change, x[rows], t[rows], step)
        holds = (first < PATH_NEAR) & (second < PATH_ON)
        factor = np.clip(0.8 * (PATH_NEAR / np.maximum(first, PATH_ON**2)) ** 0.2, 0.25, 2.0)
        done = rows[holds]
        x[done] = y[holds]
        t[done] = np.where(step == 1 - t[rows], 1.0, t[rows] + step)[holds]
        h[rows] = step * np.where(holds, factor, np.minimum(factor, 0.5))
        going[rows] = h[rows] > SHORTEST_PATH_STEP
    return x, np.asarray(t == 1)


def _stepped(H: Array, change: Array, x: Array, t: Array, h: Array) -> tuple[Array, Array, Array]:
    """Return the poses after a tracking step, and the norms of both Newton corrections."""

    def slope(part: float, y: Array) -> Array:
        _, J = _linear(H, change, t + part * h, y, x)
        return _solved(J, -np.einsum("kij,ni,nj->nk", change, y, y))

    H_t = h[:, None]
    k1 = slope(0.0, x)
    k2 = slope(0.5, x + H_t / 2 * k1)
    k3 = slope(0.5, x + H_t / 2 * k2)
    k4 = slope(1.0, x + H_t * k3)
    y = x + H_t / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    lengths = []
    for _ in range(2):
        Hy, J = _linear(H, change, t + h, y, x)
        correction = _solved(J, -np.einsum("nki,ni->nk", Hy, y))
        y = y + correction
        lengths.append(np.linalg.norm(correction, axis=1))
    return y / np.linalg.norm(y, axis=1, keepdims=True), lengths[0], lengths[1]


def _linear(H: Array, change: Array, t: Array, y: Array, of: Array) -> tuple[Array, Array]:
    """Return the products H(t) y of the quadric matrices and the poses y, and the Jacobian."""
    Hy = np.einsum("kij,nj->nki", H, y) + t[:, None, None] * np.einsum("kij,nj->nki", change, y)
    J = np.empty((len(y), SOMA, SOMA), np.complex128)
    J[:, :-1] = 2 * Hy
    J[:, -1] = of.conj()
    return Hy, J


def _solved(J: Array, right: Array) -> Array:
    padded = np.concatenate([right, np.zeros((len(right), 1))], 1)[..., None]
    try:
        return np.asarray(np.linalg.solve(J, padded)[..., 0])
    except np.linalg.LinAlgError:
        # Some poses, such as poses at infinity, have an exactly singular Jacobian.
        return np.asarray((np.linalg.pinv(J) @ padded)[..., 0])


def condition(rods: SixRods, x: Array) -> Array:
    """Return the condition numbers (n,) of the Jacobian at poses of unit norm."""
    _, J = _linear(quadrics(rods), np.zeros((7, SOMA, SOMA)), np.zeros(len(x)), x, x)
    return np.asarray(np.linalg.cond(J))
