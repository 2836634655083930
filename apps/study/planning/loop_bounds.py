"""Guaranteed bounds of passive joints while the actuators move along a straight segment.

Equations c(z) = 0 in all joint values z describe the loops. The loop equations are trigonometric
polynomials in angles, and polynomials in prismatic coordinates. Gear equations are linear in all
joint values. At the middle of a segment, the actuators have the values q0 and the passive joints
the values x0. The matrix B is a left inverse of dc/dx, and H bounds all second derivatives of c.
For a step w of all joints, with the actuator steps d, Taylor's formula gives

    |x - x0| <= |B dc/dq d| + |B| w^T H w / 2

If a box around x0 satisfies this inequality strictly, the passive joints x stay inside the box
during the whole actuator step d. If the joints reached the border of the box, Taylor's inequality
would be violated there. Let F be the right-hand side of the inequality as a function of the half
widths w of the box. The iteration w = F(w), started from below, converges to the box. The function
F is convex and increasing in w. Let e be a step of the iteration and e' the next step. Since F is
convex, e' >= F'(w) e > 0. The steps of the iteration converge to 0, so no eigenvalue of F' exceeds
1. The matrix |B| H w bounds the difference of B dc/dx from the identity in the box. The box is
slightly widened, so the eigenvalues of |B| H w are below 1. So B dc/dx is regular in the box.
Therefore, the solution for the passive joints is continuous and stays on one branch. The bounds do
not include rounding errors, which are about 1e-13.

Source:
    L. V. Kantorovich, Functional analysis and applied mathematics, 1948, for bounds by second
    derivatives; R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to interval analysis, 2009.
"""

from __future__ import annotations

import string
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot
from chasles.summaries import short_repr

from ...drawing.skeleton import Skeleton, skeleton

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_TURN = 2 * np.pi
_ANGLES, _LENGTHS = 5, 3
"""Numbers of interpolation nodes of a polynomial of degree 2, for a revolute joint and for a
prismatic joint."""
_LARGEST = 300_000
"""Maximum number of interpolation nodes for one equation."""
_SAMPLES = 200
"""Number of random configurations in one batch. The test that finds the joints in each equation
uses the same number of random joint values."""
_ATTEMPTS = 30
"""Maximum number of batches of random configurations that are tried if loops close at few
configurations."""
_FEWEST = 5
"""Minimum number of random configurations with closed loops."""
_ROOM = 2.0
"""Range of a prismatic joint in which the bounds hold, relative to the sampled range."""
_FITS = 1e-9
"""Maximum relative difference between a loop equation and the polynomial that is fitted to it. A
difference above this value is not a rounding error."""
_ROUNDS = 30
"""Maximum number of iterations that enlarge the box of joint values."""
_WIDER = 1 + 1e-6
"""Factor that enlarges the box of joint values, so that Taylor's inequality holds strictly."""
_ROUNDING = 1e-12
"""Minimum half width of the box of joint values [rad or m]. Even the value of a joint that does not
move has rounding errors."""
_CONDITION = 1e10
"""Maximum condition number of the derivative of the loop equations with respect to the passive
joints. If the condition number exceeds this value, the actuators do not determine the joints."""
_CLOSED = 1e-9
"""Maximum closure error of loops [rad or m] at the ends of a segment."""


@dataclass(frozen=True, eq=False)
class LoopBounds:
    """Bounds of the joint motion of a robot with loops.

    Attributes:
        robot: The robot.
        given: (g,) indices, in the vector z of all joint values, of the joints with constant gear
            ratios to the actuators.
        gears: (g, n) motion of each joint in `given` per unit of each actuator coordinate.
        turns: (z,) whether each joint is revolute.
        widest: (z,) largest absolute joint value for which the bounds hold [m], or inf for revolute
            joints.
        curvature: (equations, z, z) bounds of the second derivatives of the loop equations.
        lengths: (equations, 1 + z) strut lengths as linear functions of the joints. A row contains
            the strut length at joint values 0, followed by its derivatives with respect to the
            joint values. The row is 0 for an equation without a strut. For a strut of length l, the
            bounds hold for the equation d^2 - l^2 = 0, where d is the distance between its ends.
    """

    robot: Robot
    given: NDArray[np.intp]
    gears: FloatArray
    turns: BoolArray
    widest: FloatArray
    curvature: FloatArray
    lengths: FloatArray

    __repr__ = short_repr

    def joints(self, a: FloatArray, b: FloatArray) -> FloatArray | None:
        """Bound the deviation of each joint from its value at the middle of a segment.

        Args:
            a: (n,) actuated coordinates at the start of the segment [rad or m].
            b: (n,) actuated coordinates at the end of the segment [rad or m].

        Returns:
            (z,) bounds [rad or m], or None if loops are open or near a dead point.
        """
        z = self.robot.configuration(np.array([a, (a + b) / 2, b]))
        if not np.isfinite(z).all():
            return None
        D = self.robot.constraint_D_z(z[1]) * self._scale(z[1])[:, None]
        rest = np.setdiff1d(np.arange(len(z[1])), self.given)
        u, values, vh = np.linalg.svd(D[:, rest], full_matrices=False)
        if len(values) < len(rest) or not values[-1] * _CONDITION > values[0]:
            return None
        B = (vh.T / values) @ u.T
        w = np.zeros(len(z[1]))
        step = self.gears @ (b - a) / 2
        w[self.given] = np.abs(step)
        first = np.abs(B @ (D[:, self.given] @ step))
        weights = np.abs(B)
        for _ in range(_ROUNDS):
            w[rest] = _WIDER * (first + weights @ self._bent(w) / 2) + _ROUNDING
            if not (w < _TURN).all():
                return None
            if (first + weights @ self._bent(w) / 2 < w[rest]).all():
                break
        else:
            return None
        steps = z[[0, 2]] - z[1]
        steps[:, self.turns] -= _TURN * np.round(steps[:, self.turns] / _TURN)
        inside = (np.abs(steps) <= w + _CLOSED).all()
        within = (np.abs(z[1]) + w <= self.widest).all()
        return w if inside and within else None

    def _scale(self, z: FloatArray) -> FloatArray:
        """Return factors (equations,) that convert errors of strut equations d - l to d^2 - l^2.

        The factor of a strut equation is 2 l, the derivative of l^2 for the strut length l. The
        factors of all other equations are 1.
        """
        return np.where(self.lengths.any(1), 2 * _affine(self.lengths, z), 1.0)

    def _bent(self, w: FloatArray) -> FloatArray:
        """Return bounds (equations,) of the second-order terms w^T H w of the loop equations.

        H is the Hessian of a loop equation, and w contains the half widths of the box of joint
        values.
        """
        return np.asarray((self.curvature @ w) @ w)


def loop_bounds(robot: Robot, lower: FloatArray, upper: FloatArray) -> LoopBounds:
    """Return the bounds of the joint motion of a robot with kinematic loops.

    Args:
        robot: The robot.
        lower: (n,) smallest coordinates [rad or m].
        upper: (n,) largest coordinates [rad or m].

    Raises:
        InputValueError: The loops close at too few random configurations, or a loop equation
            contains too many joints or is not a polynomial of degree 2.
    """
    names = [variable.name for variable in robot.configuration_variables]
    chain = np.array([names.index(own.name) for own in robot.chain_joints])
    turns = np.array([variable.unit == "rad" for variable in robot.configuration_variables])
    q, z = closed_configurations(robot, lower, upper)
    widest = np.where(turns, np.inf, _ROOM * np.abs(z).max(0))
    widest = np.where(widest == 0, 1.0, widest)
    given, gears = _given(robot, names, chain, q)
    lengths, curvature = _curvature(robot, turns, widest)
    return LoopBounds(robot, given, gears, turns, widest, curvature, lengths)


def closed_configurations(
    robot: Robot, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return random coordinates (m, n) and configurations (m, n_z) at which the loops close.

    Raises:
        InputValueError: The loops of the robot close at too few random configurations.
    """
    rng = np.random.default_rng(0)
    q, z = [], []
    for attempt in range(_ATTEMPTS):
        sampled = rng.uniform(lower, upper, (_SAMPLES, robot.n))
        if attempt == 0:
            sampled[0] = skeleton(robot).q_drawn
        places = robot.configuration(sampled) if robot.loops else sampled
        closed = np.isfinite(places).all(-1)
        q.append(sampled[closed])
        z.append(places[closed])
        if sum(map(len, q)) >= _SAMPLES // 2:
            break
    found = sum(map(len, q))
    if found < _FEWEST:
        raise InputValueError(
            f"{robot.name}: the loops close at too few random configurations to bound their "
            f"motion: {found} of {_ATTEMPTS * _SAMPLES}"
        )
    return np.concatenate(q), np.concatenate(z)


def _given(
    robot: Robot, names: list[str], chain: NDArray[np.intp], q: FloatArray
) -> tuple[NDArray[np.intp], FloatArray]:
    """Return the indices of joints with constant gear ratios to actuators, and the ratios."""
    own = [
        (names.index(c.name), row)
        for c, row in zip(robot.coordinates, np.eye(robot.n), strict=True)
        if c.name in names
    ]
    geared = np.array([c.name not in names for c in robot.coordinates])
    rates = robot.chain_D_q(q)
    constant = np.abs(rates - rates[0]).max((0, 2)) <= _FITS * np.abs(rates[0]).max(1)
    own += [
        (int(k), rates[0, j])
        for j, k in enumerate(chain)
        if constant[j] and rates[0, j, geared].any()
    ]
    gears = np.array([row for _, row in own]).reshape(-1, robot.n)
    if np.linalg.matrix_rank(gears) < robot.n:
        raise InputValueError(f"{robot.name}: an actuator has no constant gear ratio to any joint")
    return np.array([place for place, _ in own]), gears


def _distances(bones: Skeleton, z: FloatArray) -> FloatArray:
    """Return the end-to-end distances (struts, m) [m] of the struts at configurations (m, z)."""
    T = bones.poses_from_configuration(z)
    spans = [body.span for body in bones.bodies if body.span and not body.span.from_end]
    ends = [
        [T[:, k, :3, :3] @ np.array(end) + T[:, k, :3, 3] for k, end in pairs]
        for pairs in (zip(span.bodies, span.ends, strict=True) for span in spans)
    ]
    return np.array([np.linalg.norm(b - a, axis=-1) for a, b in ends])


def _affine(coefficients: FloatArray, z: FloatArray) -> FloatArray:
    """Evaluate linear functions with coefficients (..., 1 + n) at variables z (..., n)."""
    return np.asarray(coefficients[..., 0] + (coefficients[..., 1:] * z).sum(-1))


def _length(distances: FloatArray, values: FloatArray, z: FloatArray) -> FloatArray:
    """Return the coefficients (1 + n,) of a strut length that is linear in the joint values z.

    If the loop equation contains no strut, all coefficients are 0.

    The length of a strut is constant, or a linear function of its stroke.
    """
    basis = np.column_stack([np.ones(len(z)), z])
    for distance in distances:
        own = distance - values
        found = np.linalg.lstsq(basis, own, rcond=None)[0]
        if np.abs(basis @ found - own).max() <= _FITS * distance.max():
            return np.asarray(found)
    return np.zeros(basis.shape[1])


def _is_linear(values: FloatArray, z: FloatArray) -> bool:
    """Return whether a loop equation (for example of a gear pair) is linear in joint values z."""
    basis = np.column_stack([np.ones(len(z)), z])
    found = np.linalg.lstsq(basis, values, rcond=None)[0]
    return bool(np.abs(basis @ found - values).max() <= _FITS * np.abs(values).max())


def _curvature(robot: Robot, turns: BoolArray, widest: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return coefficients of strut lengths, and bounds of second derivatives of the loop equations.

    Each strut length is a linear function of the joint values, whose coefficients are a row of the
    first returned array (equations, 1 + z).

    The second returned array (equations, z, z) contains the bounds of the second derivatives.
    """
    rng, n = np.random.default_rng(1), len(turns)
    scale = np.where(turns, np.pi, widest)
    random = rng.uniform(-1, 1, (_SAMPLES, n)) * scale
    present = (robot.constraint_D_z(random) != 0).any(0)
    values, distances = robot.constraint(random), _distances(skeleton(robot), random)
    lengths = np.array([_length(distances, column, random) for column in values.T])
    bounds = np.zeros((len(present), n, n))
    for row, own in enumerate(present):
        if _is_linear(values[:, row], random):
            continue
        equation = _equation(robot, row, lengths[row])
        joints = np.flatnonzero(own)
        C = _coefficients(robot, row, equation, joints, turns, scale)
        fitted = _evaluated(C, random[:, joints] / scale[joints], turns[joints])
        here = equation(random)
        if not np.abs(fitted - here).max() <= _FITS * max(np.abs(here).max(), 1):
            raise InputValueError(
                f"{robot.name}: the joint motion cannot be bounded: expected a polynomial of "
                f"degree 2 in the joints, got loop equation {row}"
            )
        for first, j in enumerate(joints):
            for second, k in enumerate(joints[: first + 1]):
                bounds[row, j, k] = bounds[row, k, j] = _derivative(
                    np.abs(C), (first, second), turns[joints], scale[joints]
                )
    return lengths, bounds


def _equation(robot: Robot, row: int, length: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Return a function that evaluates a loop equation.

    For a strut, the function returns d^2 - l^2 instead of d - l, with the end-to-end distance d and
    the strut length l.
    """

    def value(z: FloatArray) -> FloatArray:
        found = robot.constraint(z)[:, row]
        return np.asarray(found * (found + 2 * _affine(length, z)) if length.any() else found)

    return value


def _coefficients(
    robot: Robot,
    row: int,
    equation: Callable[[FloatArray], FloatArray],
    joints: NDArray[np.intp],
    turns: BoolArray,
    scale: FloatArray,
) -> NDArray[np.complex128]:
    """Return the polynomial coefficients of a loop equation, with one array axis per joint.

    The array axis of a revolute joint contains the coefficients of e^(i m angle) for m = 0, 1, 2,
    -2, -1. The array axis of a prismatic joint contains the coefficients of the powers 0, 1, 2 of
    the joint value.
    """
    shape = tuple(_ANGLES if turns[j] else _LENGTHS for j in joints)
    if np.prod(shape, dtype=float) > _LARGEST:
        raise InputValueError(
            f"{robot.name}: the joint motion cannot be bounded: too many joints in loop equation "
            f"{row}: {len(joints)}"
        )
    z = np.zeros((*shape, len(turns)))
    for axis, (j, count) in enumerate(zip(joints, shape, strict=True)):
        places = _TURN * np.arange(count) / count if turns[j] else scale[j] * np.array([-1, 0, 1])
        z[..., j] = places.reshape(-1, *[1] * (len(joints) - axis - 1))
    C = equation(z.reshape(-1, len(turns))).reshape(shape).astype(complex)
    powers = np.array([[0, 1, 0], [-0.5, 0, 0.5], [0.5, -1, 0.5]])
    for axis, j in enumerate(joints):
        if turns[j]:
            C = np.fft.fft(C, axis=axis) / _ANGLES
        else:
            C = np.moveaxis(np.tensordot(powers, C, (1, axis)), 0, axis)
    return np.asarray(C)


def _orders(turns: bool) -> FloatArray:
    """Return the Fourier orders for a revolute joint, or the exponents for a prismatic joint."""
    return np.array([0.0, 1.0, 2.0, -2.0, -1.0]) if turns else np.arange(3.0)


def _evaluated(C: NDArray[np.complex128], at: FloatArray, turns: BoolArray) -> FloatArray:
    """Return the values (m,) of a polynomial at joint values (m, k)."""
    letters = string.ascii_lowercase[: C.ndim]
    bases = [
        np.exp(1j * np.pi * x[:, None] * _orders(True)) if turn else x[:, None] ** _orders(False)
        for x, turn in zip(at.T, turns, strict=True)
    ]
    terms = ",".join("z" + letter for letter in letters)
    return np.asarray(np.einsum(f"{letters},{terms}->z", C, *bases, optimize=True).real)


def _derivative(
    sizes: FloatArray, by: tuple[int, int], turns: BoolArray, scale: FloatArray
) -> float:
    """Return a bound of a second derivative, from the magnitudes of polynomial coefficients."""
    for axis in range(sizes.ndim):
        order = by.count(axis)
        m = np.abs(_orders(bool(turns[axis])))
        powers = (np.ones(len(m)), m, m * (m - 1))
        factors = m**order if turns[axis] else powers[order] / scale[axis] ** order
        # The tensor product sums over the first axis of `sizes`. The array axis of the next joint
        # then becomes the first axis of `sizes`.
        sizes = np.tensordot(factors, sizes, (0, 0))
    return float(sizes)
