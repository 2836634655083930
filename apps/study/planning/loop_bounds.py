"""How far loops move the bodies of a robot at most, for certain, on a way of its actuators.

The loops are equations c(z) = 0 in all joints z, trigonometric polynomials in angles and
polynomials in slides. With the actuators at the middle q0 of a way, the other joints at x0, a left
inverse B of dc/dx and H a bound of all second derivatives of c, Taylor's formula gives, for a step
w of all joints that starts with d of the actuators,

    |x - x0| <= |B dc/dq d| + |B| w^T H w / 2

Where a box of x fulfils this strictly, the joints cannot leave it: they would have to pass its
border, where the formula does not hold. The box is the limit, from below, of an iteration of the
right-hand side F, which is convex and grows with w: its steps obey d' >= F'(w) d > 0 and vanish, so
that no eigenvalue of F' exceeds 1, and those of |B| H w, by which B dc/dx differs from 1 in the box
at most, are below 1 by the margin that the box is wider. So B dc/dx is regular there, the solution
is continuous and has one branch. Rounding is not bounded: it is a part in 10^13.

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
"""Places that determine a polynomial of degree 2 in sine and cosine of an angle, or in a way."""
_LARGEST = 300_000
"""Places at most that determine an equation."""
_SAMPLES = 200
"""Postures that show which joints an equation has, and how far frames are from their axes."""
_ATTEMPTS = 30
"""Times that so many postures are drawn, where loops close at few of them."""
_FEWEST = 5
"""Postures with closed loops, below which they say nothing of the others."""
_ROOM = 2.0
"""Ways of slides that are bounded, in parts of those in the samples."""
_FITS = 1e-9
"""Error of an equation's polynomial, in parts of its largest value, that is rounding."""
_ROUNDS = 30
"""Steps towards the box of the joints."""
_WIDER = 1 + 1e-6
"""Factor by which the box is wider than its limit, so that it holds strictly."""
_ROUNDING = 1e-12
"""Half of the least width of the box [rad or m], in which joints at rest stay up to rounding."""
_CONDITION = 1e10
"""Condition of the equations from which the joints do not follow from the actuators."""
_CLOSED = 1e-9
"""Error up to which loops are closed [rad or m], with which the ends of a way are in the box."""


@dataclass(frozen=True, eq=False)
class LoopBounds:
    """Bounds of the motion of a robot with loops.

    Attributes:
        robot: The robot.
        given: (g,) places among all joints z of those that actuators move directly.
        gears: (g, n) their ways for a unit of each actuator.
        turns: (z,) whether a joint turns.
        widest: (z,) ways up to which the bounds hold [m]; inf for joints that turn.
        curvature: (equations, z, z) bounds of second derivatives of the equations.
        lengths: (equations, 1 + z) of an equation that sets the length of a strut, this length at 0
            and its growth with the joints; zeros of all other equations. Such an equation, d - l
            with the distance d of the strut's ends, is bounded as d^2 - l^2.
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
        """How far each joint is from its place in the middle of a straight way, at most.

        Args:
            a: (n,) actuated coordinates at the start of the way [rad or m].
            b: (n,) at its end.

        Returns:
            (z,) bounds [rad or m]; None where there are none: close to a dead point, or where the
            loops are open.
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
        """(equations,) the factors of derivatives of closed loops where equations are squared."""
        return np.where(self.lengths.any(1), 2 * _affine(self.lengths, z), 1.0)

    def _bent(self, w: FloatArray) -> FloatArray:
        """(equations,) bounds of w^T H w."""
        return np.asarray((self.curvature @ w) @ w)


def loop_bounds(robot: Robot, lower: FloatArray, upper: FloatArray) -> LoopBounds:
    """Bounds of the motion of a robot with loops.

    Args:
        robot: The robot.
        lower: (n,) least coordinates [rad or m].
        upper: (n,) largest coordinates.

    Raises:
        InputValueError: The loops close at hardly any posture, or their equations are no
            polynomials of degree 2 in few joints.
    """
    names = [variable.name for variable in robot.configuration_variables]
    chain = np.array([names.index(own.name) for own in robot.chain_joints])
    turns = np.array([variable.unit == "rad" for variable in robot.configuration_variables])
    q, z = closed_postures(robot, lower, upper)
    widest = np.where(turns, np.inf, _ROOM * np.abs(z).max(0))
    widest = np.where(widest == 0, 1.0, widest)
    given, gears = _given(robot, names, chain, q)
    lengths, curvature = _curvature(robot, turns, widest)
    return LoopBounds(robot, given, gears, turns, widest, curvature, lengths)


def closed_postures(
    robot: Robot, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Random postures (m, n) at which the loops close, and their configurations (m, n_z).

    Raises:
        InputValueError: The loops close at hardly any.
    """
    rng = np.random.default_rng(0)
    q, z = [], []
    for attempt in range(_ATTEMPTS):
        drawn = rng.uniform(lower, upper, (_SAMPLES, robot.n))
        if attempt == 0:
            drawn[0] = skeleton(robot).posture
        places = robot.configuration(drawn) if robot.loops else drawn
        closed = np.isfinite(places).all(-1)
        q.append(drawn[closed])
        z.append(places[closed])
        if sum(map(len, q)) >= _SAMPLES // 2:
            break
    found = sum(map(len, q))
    if found < _FEWEST:
        raise InputValueError(
            f"{robot.name}: the loops close at {found} of {_ATTEMPTS * _SAMPLES} random postures, "
            "too few to bound their motion"
        )
    return np.concatenate(q), np.concatenate(z)


def _given(
    robot: Robot, names: list[str], chain: NDArray[np.intp], q: FloatArray
) -> tuple[NDArray[np.intp], FloatArray]:
    """The joints that actuators move directly, and by how much: themselves, or through gears."""
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
        raise InputValueError(f"{robot.name}: an actuator moves no joint in proportion")
    return np.array([place for place, _ in own]), gears


def _distances(bones: Skeleton, z: FloatArray) -> FloatArray:
    """(struts, m) distances between the ends of rods and cylinders at configurations (m, z) [m]."""
    T = bones.poses_from_configuration(z)
    spans = [body.span for body in bones.bodies if body.span and not body.span.from_end]
    ends = [
        [T[:, k, :3, :3] @ np.array(end) + T[:, k, :3, 3] for k, end in pairs]
        for pairs in (zip(span.bodies, span.ends, strict=True) for span in spans)
    ]
    return np.array([np.linalg.norm(b - a, axis=-1) for a, b in ends])


def _affine(coefficients: FloatArray, z: FloatArray) -> FloatArray:
    """Values at z (..., z) of coefficients (..., 1 + z)."""
    return np.asarray(coefficients[..., 0] + (coefficients[..., 1:] * z).sum(-1))


def _length(distances: FloatArray, values: FloatArray, z: FloatArray) -> FloatArray:
    """(1 + z,) the length that an equation sets a strut, zeros where it sets none.

    Such an equation is the distance of the strut's ends less its length, which is constant or grows
    with the stroke.
    """
    basis = np.column_stack([np.ones(len(z)), z])
    for distance in distances:
        own = distance - values
        found = np.linalg.lstsq(basis, own, rcond=None)[0]
        if np.abs(basis @ found - own).max() <= _FITS * distance.max():
            return np.asarray(found)
    return np.zeros(basis.shape[1])


def _curvature(robot: Robot, turns: BoolArray, widest: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The lengths of struts, and (equations, z, z) bounds of second derivatives of equations."""
    rng, n = np.random.default_rng(1), len(turns)
    scale = np.where(turns, np.pi, widest)
    random = rng.uniform(-1, 1, (_SAMPLES, n)) * scale
    present = (robot.constraint_D_z(random) != 0).any(0)
    values, distances = robot.constraint(random), _distances(skeleton(robot), random)
    lengths = np.array([_length(distances, column, random) for column in values.T])
    bounds = np.zeros((len(present), n, n))
    for row, own in enumerate(present):
        equation = _equation(robot, row, lengths[row])
        joints = np.flatnonzero(own)
        C = _coefficients(robot, row, equation, joints, turns, scale)
        fitted = _evaluated(C, random[:, joints] / scale[joints], turns[joints])
        here = equation(random)
        if not np.abs(fitted - here).max() <= _FITS * max(np.abs(here).max(), 1):
            raise InputValueError(
                f"{robot.name}: equation {row} of its loops is no polynomial of degree 2 in its "
                "joints, so their motion has no bound"
            )
        for first, j in enumerate(joints):
            for second, k in enumerate(joints[: first + 1]):
                bounds[row, j, k] = bounds[row, k, j] = _derivative(
                    np.abs(C), (first, second), turns[joints], scale[joints]
                )
    return lengths, bounds


def _equation(robot: Robot, row: int, length: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """An equation of the loops; with the length l of a strut, d^2 - l^2 from d - l."""

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
    """The coefficients of an equation: of e^(i m angle), m = 0, 1, 2, -2, -1, and of powers."""
    shape = tuple(_ANGLES if turns[j] else _LENGTHS for j in joints)
    if np.prod(shape, dtype=float) > _LARGEST:
        raise InputValueError(
            f"{robot.name}: equation {row} of its loops has {len(joints)} joints, too many to bound"
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
    """The orders m of e^(i m angle) as they follow each other, or the powers."""
    return np.array([0.0, 1.0, 2.0, -2.0, -1.0]) if turns else np.arange(3.0)


def _evaluated(C: NDArray[np.complex128], at: FloatArray, turns: BoolArray) -> FloatArray:
    """(m,) values of a polynomial at joints (m, k), in parts of half a turn or of their scale."""
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
    """A bound of a second derivative of a polynomial with coefficients of these sizes."""
    for axis in range(sizes.ndim):
        order = by.count(axis)
        m = np.abs(_orders(bool(turns[axis])))
        powers = (np.ones(len(m)), m, m * (m - 1))
        factors = m**order if turns[axis] else powers[order] / scale[axis] ** order
        # The first axis is the next one: those before it are summed up.
        sizes = np.tensordot(factors, sizes, (0, 0))
    return float(sizes)
