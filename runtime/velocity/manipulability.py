"""Manipulability: Yoshikawa's measure, conditioning, and velocity and force ellipsoids.

Linear rates and the rates of prismatic joints [m/s] are divided by the characteristic length L. The
Jacobian J at the tip becomes dimensionless, and so do its singular values:

    J' = D J U,   D = diag(1/L, 1/L, 1/L, 1, 1, 1),   U = diag(1 revolute, L prismatic).

Source:
    Yoshikawa, Manipulability of robotic mechanisms, 1985; section 5 for forces.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import BoolArray, FloatArray
from ..call.capabilities import needs
from ..call.threads import call_in_parts
from ..errors import InputValueError
from ..tolerances import INFINITE_CONDITION, RANK
from . import _rates
from .characteristic_length import LengthMethods

Part = Literal["all", "linear", "angular"]

PART: Mapping[Part, slice] = {"all": slice(0, 6), "linear": slice(0, 3), "angular": slice(3, 6)}
COST = 20_000
"""Floating-point operations per row: a singular value decomposition, and the joint rates."""


@dataclass(frozen=True, slots=True)
class Manipulability:
    """Dimensionless measures of the distance from singularities.

    Attributes:
        measure: (...,) Yoshikawa's w, the product of the singular values: sqrt(det J' J'^T), or
            sqrt(det J'^T J') with fewer joints than components.
        min_singular_value: (...,) the smallest singular value: the ratio of tool rate to joint rate
            in the worst direction.
        condition: (...,) ratio of largest to smallest singular value, inf at a singularity.
        singular_values: (..., r) the largest first, with r the degrees of freedom of the tool.
    """

    measure: FloatArray
    min_singular_value: FloatArray
    condition: FloatArray
    singular_values: FloatArray


@dataclass(frozen=True, slots=True)
class Ellipsoid:
    """Ellipsoid of the tool velocities or forces for joint rates or torques of unit norm.

    Attributes:
        axes: (..., k, r) principal axes as columns, unit vectors in base axes. For "all"
            components, the principal axes are twists (v / length, omega) or wrenches.
        lengths: (..., r) semi-axes, the longest first.
    """

    axes: FloatArray
    lengths: FloatArray


class Metric(NamedTuple):
    """Scale factors and rank of the dimensionless Jacobian row[:, None] * J * unit."""

    unit: FloatArray
    row: FloatArray
    rank: int
    length: float


class ManipulabilityMethods(LengthMethods):
    """Robot methods for manipulability."""

    @needs("jacobian_mixed")
    def manipulability(
        self, q: ArrayLike, *, components: Part = "all", characteristic_length: float | None = None
    ) -> Manipulability:
        """Return Yoshikawa's measure, the singular values and the condition number of the Jacobian.

        The Jacobian is dimensionless: the linear velocity of the tip and the rates of prismatic
        joints are divided by the characteristic length. Directions in which the tool can never
        move, such as out of the plane of a planar arm, are excluded.

        Args:
            q: (..., n) coordinates [rad or m].
            components: The twist components: "all", "linear" or "angular".
            characteristic_length: The length [m], by default `robot.characteristic_length`. A
                length of 1 leaves the Jacobian unscaled, in meters and radians.

        Returns:
            `measure`, `min_singular_value` and `condition`, each (...,), and `singular_values (...,
            r)` of the r possible directions, in decreasing order. All are NaN if q is not finite or
            a loop is open.

        Raises:
            ShapeError: If the shape of q is not (..., n).
            InputValueError: If `components` is unknown or the length is not positive.
        """
        metric = self._metric("manipulability", components, characteristic_length)
        _, values, sound = _decomposed(self.jacobian_mixed(q), metric, components)
        largest, least = values[..., 0], values[..., -1]
        condition = np.full_like(largest, np.inf)
        np.divide(largest, least, out=condition, where=least > INFINITE_CONDITION * largest)
        values = np.where(sound[..., None], values, np.nan)
        return Manipulability(
            measure=values.prod(-1)[()],
            min_singular_value=values[..., -1][()],
            condition=np.where(sound, condition, np.nan)[()],
            singular_values=values,
        )

    @needs("hessian_mixed")
    def manipulability_gradient(
        self, q: ArrayLike, *, components: Part = "all", characteristic_length: float | None = None
    ) -> FloatArray:
        """Return the gradient (..., n) of Yoshikawa's measure with respect to q [1/rad or 1/m].

        The measure is `robot.manipulability(q).measure`. At a singularity, the measure is not
        differentiable (like |x| at 0), and the result is a one-sided gradient. The gradient is NaN
        if q is not finite or the loops do not close. Arguments: see `manipulability`.
        """
        metric = self._metric("manipulability_gradient", components, characteristic_length)
        J, H = self.jacobian_mixed(q), self.hessian_mixed(q)
        return gradient_of(J, H, metric)

    @needs("jacobian_mixed")
    def velocity_ellipsoid(
        self, q: ArrayLike, *, components: Part = "all", characteristic_length: float | None = None
    ) -> Ellipsoid:
        """Return the ellipsoid of the tip's twists, in base axes, for joint rates of unit norm.

        Args:
            q: (..., n) coordinates [rad or m].
            components: "linear" for v (semi-axes in m/rad), "angular" for omega (dimensionless), or
                "all" for the vector (v / characteristic length, omega) (dimensionless).
            characteristic_length: The length [m] that divides v for "all" components, and the rates
                of prismatic joints; by default `robot.characteristic_length`.

        Returns:
            Unit vectors `axes (..., k, r)` as columns, and semi-axes `lengths (..., r)`. k is 6 for
            "all" components, otherwise 3. r is the number of directions in which the tool can move.
            Both arrays are NaN if q is not finite or the loops do not close.

        Raises:
            InputError: If the shape of q, `components` or the length is invalid.
        """
        metric = self._metric("velocity_ellipsoid", components, characteristic_length)
        return self._ellipsoid(q, metric, components)

    @needs("jacobian_mixed")
    def force_ellipsoid(
        self, q: ArrayLike, *, components: Part = "all", characteristic_length: float | None = None
    ) -> Ellipsoid:
        """Return the ellipsoid of forces and torques at the tip, for joint torques of unit norm.

        The axes of `velocity_ellipsoid` are also the axes of the force ellipsoid. The semi-axes of
        the force ellipsoid are the reciprocals of those of `velocity_ellipsoid`, or inf at a
        singularity. "linear" components are forces without a torque, with semi-axes in 1/m (N per N
        m). "angular" components are torques without a force. For "all", the components are (force *
        characteristic length, torque). The force of a prismatic joint, multiplied by the
        characteristic length, counts as a torque. Arguments, result and errors are as for
        `velocity_ellipsoid`.
        """
        metric = self._metric("force_ellipsoid", components, characteristic_length)
        velocity = self._ellipsoid(q, metric, components)
        lengths = np.full_like(velocity.lengths, np.inf)
        np.divide(1.0, velocity.lengths, out=lengths, where=velocity.lengths != 0)
        return Ellipsoid(velocity.axes[..., ::-1], lengths[..., ::-1])

    def _ellipsoid(self, q: ArrayLike, metric: Metric, components: Part) -> Ellipsoid:
        axes, lengths, sound = _decomposed(self.jacobian_mixed(q), metric, components)
        size = metric.length if components == "linear" else 1.0
        return Ellipsoid(
            np.where(sound[..., None, None], axes, np.nan),
            np.where(sound[..., None], lengths * size, np.nan),
        )

    def _metric(
        self, method: str, components: Part, length: float | None, fixed: tuple[int, ...] = ()
    ) -> Metric:
        if components not in get_args(Part):
            raise InputValueError(
                f'{self.name}.{method}: components must be "all", "linear" or "angular", got '
                f"{components!r}"
            )
        return metric_of(self, components, self._checked_length(method, length), fixed)

    def _limits(self, method: str, name: str, given: ArrayLike | None) -> FloatArray:
        if given is None:
            return np.full(self.n, np.inf)
        limits = np.asarray(given)
        if not limits.ndim:
            limits = np.full(self.n, limits)
        limits = self._reals(method, name, limits, (self.n,))
        if not (limits >= 0).all():
            raise InputValueError(f"{self.name}.{method}: expected {name} >= 0, got {given!r}")
        return np.array(limits)


@functools.lru_cache(maxsize=256)
def metric_of(
    robot: LengthMethods, components: Part, length: float, fixed: tuple[int, ...] = ()
) -> Metric:
    """Return the Jacobian's scale factors, and its rank without the columns of fixed joints."""
    unit = np.array([1.0 if c.kind == "revolute" else length for c in robot.coordinates])
    row = np.zeros(6)
    row[PART[components]] = np.repeat([1 / length, 1.0], 3)[PART[components]]
    for array in (unit, row):
        array.flags.writeable = False
    scaled = row[:, None] * robot._samples * unit
    scaled[..., list(fixed)] = 0
    values = np.linalg.svd(scaled, compute_uv=False)
    rank = int((values > RANK * values.max()).sum(-1).max()) if values.any() else 1
    return Metric(unit, row, rank, length)


def gradient_of(J: FloatArray, H: FloatArray, metric: Metric) -> FloatArray:
    """Return the gradient (..., n) of the product of the singular values of J (..., 6, n)."""
    operands = J, H, metric.unit, metric.row, np.asarray(metric.rank)
    gradient: FloatArray = call_in_parts(_rates.gradient, operands, (2, 3, 1, 1, 0), COST)[1]
    return gradient


def _decomposed(
    J: FloatArray, metric: Metric, components: Part
) -> tuple[FloatArray, FloatArray, BoolArray]:
    part = PART[components]

    def decompose(J: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
        scaled = metric.row[part, None] * J[..., part, :] * metric.unit
        sound = np.asarray(np.isfinite(scaled).all((-2, -1)))
        finite = np.where(sound[..., None, None], scaled, 0.0)
        axes, values, _ = np.linalg.svd(finite, full_matrices=False)
        return axes[..., : metric.rank], values[..., : metric.rank], sound

    found: tuple[FloatArray, FloatArray, BoolArray] = call_in_parts(decompose, [J], [2], COST)
    return found
