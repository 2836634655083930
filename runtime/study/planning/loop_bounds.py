"""How far loops move the bodies of a robot at most, for certain, on a way of its actuators.

The loops are equations c(z) = 0 in all joints z, trigonometric polynomials in angles and
polynomials in slides. With the actuators at the middle q0 of a way, the other joints at x0, a left
inverse B of dc/dx and H a bound of all second derivatives of c, Taylor's formula gives, for a step
w of all joints that starts with d of the actuators,

    |x - x0| <= |B dc/dq d| + |B| w^T H w / 2

Where a box of x fulfils this strictly, the joints cannot leave it: they would have to pass its
border, where the formula does not hold. As far as B dc/dx stays regular in the box, the solution is
continuous there and has one branch. Rounding is not bounded: it is a part in 10^13.

Source:
    L. V. Kantorovich, Functional analysis and applied mathematics, 1948, for bounds by second
    derivatives; R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to interval analysis, 2009.
"""

from __future__ import annotations

import string
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputValueError

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_TURN = 2 * np.pi
_ANGLES, _LENGTHS = 5, 3
"""Places that determine a polynomial of degree 2 in sine and cosine of an angle, or in a way."""
_LARGEST = 300_000
"""Places at most that determine an equation."""
_SAMPLES = 200
"""Postures that show which joints an equation has, and how far frames are from their axes."""
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
_TURNED = 1e-3
"""Sine of half an angle from which a distance from an axis is read off."""


@dataclass(frozen=True, eq=False)
class LoopBounds:
    """Bounds of the motion of a robot with loops.

    Attributes:
        robot: The robot.
        given: (g,) places among all joints z of those that actuators move directly.
        gears: (g, n) their ways for a unit of each actuator.
        chain: (k,) places of the joints of the main chain.
        turns: (z,) whether a joint turns.
        widest: (z,) ways up to which the bounds hold [m]; inf for joints that turn.
        curvature: (equations, z, z) bounds of second derivatives of the equations.
        offsets: (k,) distance of the origin of each frame of the chain from its joint's axis [m].
    """

    robot: Any
    given: NDArray[np.intp]
    gears: FloatArray
    chain: NDArray[np.intp]
    turns: BoolArray
    widest: FloatArray
    curvature: FloatArray
    offsets: FloatArray

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
        D = self.robot.constraint_D_z(z[1])
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
        # The joints follow continuously: B dc/dx differs from one by less than one in the box.
        drift = weights @ np.einsum("ijk,k->ij", self.curvature[:, rest], w)
        if not (drift @ w[rest] < w[rest]).all():
            return None
        steps = z[[0, 2]] - z[1]
        steps[:, self.turns] -= _TURN * np.round(steps[:, self.turns] / _TURN)
        inside = (np.abs(steps) <= w + _CLOSED).all()
        within = (np.abs(z[1]) + w <= self.widest).all()
        return w if inside and within else None

    def frames(self, a: FloatArray, b: FloatArray, points: FloatArray) -> FloatArray:
        """How far the origins of the frames of the chain move from the middle of a way, at most.

        Args:
            a: (n,) actuated coordinates at the start of the straight way [rad or m].
            b: (n,) at its end.
            points: (k + 1, 3) origins in the middle: of the frame after each joint, and the tool.

        Returns:
            (k + 1,) distances [m]; inf where there is no bound.
        """
        w = self.joints(a, b)
        if w is None:
            return np.full(len(points), np.inf)
        step, turns = w[self.chain], self.turns[self.chain]
        apart = np.linalg.norm(points[:, None] - points[None, :-1], axis=-1)
        moved = np.zeros(len(points))
        for k in range(len(points)):
            # From the tip to the base: a joint's lever grows by what the joints beyond it move.
            for j in range(min(k, len(step) - 1), -1, -1):
                lever = apart[k, j] + self.offsets[j] + moved[k] if turns[j] else 1.0
                moved[k] += step[j] * lever
        return moved

    def _bent(self, w: FloatArray) -> FloatArray:
        """(equations,) bounds of w^T H w."""
        return np.asarray((self.curvature @ w) @ w)


def loop_bounds(robot: Any, lower: FloatArray, upper: FloatArray) -> LoopBounds:
    """Bounds of the motion of a robot with loops.

    Args:
        robot: The robot.
        lower: (n,) least coordinates [rad or m].
        upper: (n,) largest coordinates.

    Raises:
        InputValueError: The robot is a platform, its loops close at no sample, or their equations
            are no polynomials of degree 2 in few joints.
    """
    if robot.kind == "platform":
        raise InputValueError(
            f"{robot.name}: a platform's legs are not links of its main chain, so nothing would "
            "keep them apart from obstacles"
        )
    names = [variable.name for variable in robot.configuration_variables]
    chain = np.array([names.index(own.name) for own in robot.chain_joints])
    turns = np.array([variable.unit == "rad" for variable in robot.configuration_variables])
    rng = np.random.default_rng(0)
    q = np.vstack([robot.reference.q, rng.uniform(lower, upper, (_SAMPLES, robot.n))])
    z = robot.configuration(q)
    closed = np.isfinite(z).all(-1)
    if not closed.any():
        raise InputValueError(f"{robot.name}: the loops close at none of {len(q)} samples")
    widest = np.where(turns, np.inf, _ROOM * np.abs(z[closed]).max(0))
    widest = np.where(widest == 0, 1.0, widest)
    given, gears = _given(robot, names, chain, q[closed])
    curvature = _curvature(robot, turns, widest)
    offsets = _offsets(robot, q[closed], z[closed][:, chain], turns[chain])
    return LoopBounds(robot, given, gears, chain, turns, widest, curvature, offsets)


def _given(
    robot: Any, names: list[str], chain: NDArray[np.intp], q: FloatArray
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


def _curvature(robot: Any, turns: BoolArray, widest: FloatArray) -> FloatArray:
    """(equations, z, z) bounds of all second derivatives of the loops' equations."""
    rng, n = np.random.default_rng(1), len(turns)
    scale = np.where(turns, np.pi, widest)
    random = rng.uniform(-1, 1, (_SAMPLES, n)) * scale
    present = (robot.constraint_D_z(random) != 0).any(0)
    values = robot.constraint(random)
    bounds = np.zeros((len(present), n, n))
    for row, own in enumerate(present):
        joints = np.flatnonzero(own)
        C = _coefficients(robot, row, joints, turns, scale)
        fitted = _evaluated(C, random[:, joints] / scale[joints], turns[joints])
        if not np.abs(fitted - values[:, row]).max() <= _FITS * max(
            np.abs(values[:, row]).max(), 1
        ):
            raise InputValueError(
                f"{robot.name}: equation {row} of its loops is no polynomial of degree 2 in its "
                "joints, so their motion has no bound"
            )
        for first, j in enumerate(joints):
            for second, k in enumerate(joints[: first + 1]):
                bounds[row, j, k] = bounds[row, k, j] = _derivative(
                    np.abs(C), (first, second), turns[joints], scale[joints]
                )
    return bounds


def _coefficients(
    robot: Any, row: int, joints: NDArray[np.intp], turns: BoolArray, scale: FloatArray
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
    C = robot.constraint(z.reshape(-1, len(turns)))[:, row].reshape(shape).astype(complex)
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


def _offsets(robot: Any, q: FloatArray, theta: FloatArray, turns: BoolArray) -> FloatArray:
    """(k,) distances of the frames' origins from the axes of their joints [m].

    A point at the distance rho from an axis moves by 2 rho sin(angle / 2). A joint that hardly
    turns in all samples counts for nothing.
    """
    poses = robot.link_poses(q)
    before = np.concatenate([np.broadcast_to(np.eye(4), (len(q), 1, 4, 4)), poses[:, :-1]], axis=1)
    p = np.linalg.solve(before, poses)[..., :3, 3]
    sines = np.abs(np.sin((theta - theta[0]) / 2))
    k, every = sines.argmax(0), np.arange(theta.shape[1])
    moved, sine = np.linalg.norm(p[k, every] - p[0], axis=-1), sines[k, every]
    return np.where(turns & (sine > _TURNED), moved / (2 * np.maximum(sine, _TURNED)), 0.0)
