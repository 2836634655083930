"""Selects the elimination orders and the fixed joints of a general arm.

Many elimination orders are unsuitable if consecutive axes intersect or are parallel. An elimination
order is unsuitable if the determinant of its equation matrix M is zero for every suppressed angle.
An elimination order is also unsuitable if several solutions have the same suppressed angle.
Therefore, all elimination orders are rated at random configurations. For a suitable elimination
order, det M is a trigonometric polynomial of degree 8 in the suppressed angle, which is the angle
theta_3 of ``raghavan_roth``. The second smallest singular value of M at the solution and the
smallest singular value of A must be clearly positive.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ...model.robot import SerialRobot
from ...model.tolerances import (
    DETERMINANT_TAIL,
    POOR_SEPARATION,
    SEPARATE,
    SINGLE_SOLUTION,
)
from .line_quantities import Array
from .raghavan_roth import (
    JOINTS,
    EliminationOrder,
    LineEquations,
    elimination_orders,
    equations,
    forward,
    is_fit,
    moved,
    numbers,
    suppressed,
)

SAMPLES = 32
"""Number of suppressed angles at which the determinant of M is sampled."""
DEGREE = 8
"""Degree of the determinant of M as a trigonometric polynomial in the suppressed angle."""
CONFIGURATIONS = 12
"""Number of configurations at which an elimination order is rated."""
GIVEN_CONFIGURATIONS, AT_RIGHT_ANGLES = 8, 2
"""Number of configurations with random joint values, and number of cycles of four configurations in
which each fixed joint takes the four multiples of 90 degrees."""
KEPT, MAX_KEPT = 3, 4
"""Usual number and maximum number of elimination orders that are kept for an arm. If one
elimination order fails at a pose, the solver tries the next elimination order. An arm gets a fourth
elimination order only if this order works where the first three fail."""
PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37)
MAX_JOINTS = len(PRIMES)
"""Maximum number of joints of an arm, including fixed joints, that fit into the C tables."""


@dataclass(frozen=True)
class Rating:
    """Rating of one elimination order.

    Attributes:
        order: The elimination order.
        separations: For each configuration, the second smallest singular value of M divided by the
            largest. The value is NaN if det M is zero or has a degree above 8.
        pairs: For each configuration, the smallest singular value of the matrix A divided by the
            largest. The matrix A is the coefficient matrix of the equations for the angles of
            joints 1 and 2.
    """

    order: EliminationOrder
    separations: tuple[float, ...]
    pairs: tuple[float, ...]

    @property
    def least(self) -> tuple[float, ...]:
        """Minimum of the entries in ``separations`` and ``pairs`` per configuration, or NaN."""
        return tuple(map(float, np.minimum(self.separations, self.pairs)))

    @property
    def good_at(self) -> frozenset[int]:
        """Indices of the configurations at which the elimination order is suitable."""
        return frozenset(k for k, s in enumerate(self.least) if s > SINGLE_SOLUTION)

    @property
    def good(self) -> float:
        """Fraction of configurations at which the elimination order is suitable."""
        return len(self.good_at) / len(self.separations)

    @property
    def is_fit(self) -> bool:
        """Whether det M has degree 8 at some configuration."""
        return not all(np.isnan(self.separations))

    @property
    def key(self) -> tuple[float, float]:
        """Sort key: (fraction of suitable configurations, separation). Larger is better."""
        there = [self.least[k] for k in self.good_at]
        return self.good, float(np.median(there)) if there else 0.0


@dataclass(frozen=True)
class Choice:
    """The elimination orders and the fixed joints of an arm.

    Attributes:
        given: Indices of the fixed joints, in ascending order.
        ratings: The elimination orders with their ratings, best first.
    """

    given: tuple[int, ...]
    ratings: tuple[Rating, ...]

    @property
    def good(self) -> float:
        """Fraction of configurations at which at least one elimination order is suitable."""
        found = frozenset[int]().union(*(rating.good_at for rating in self.ratings))
        return len(found) / len(self.ratings[0].separations)

    @property
    def separation(self) -> float:
        """Singular value ratio that shows how well the best elimination order separates solutions.

        See ``Rating.key``.
        """
        return self.ratings[0].key[1]

    @property
    def orders(self) -> tuple[EliminationOrder, ...]:
        """The elimination orders, each of which lists the indices of six joints."""
        return tuple(rating.order for rating in self.ratings)


def choose(robot: SerialRobot) -> Choice | None:
    """Return the elimination orders of an arm, or None if no elimination order is suitable.

    If no set of fixed joints from ``sets_to_fix`` is suitable, every other set of fixed joints is
    tried. For example, two of the parallel joints must be fixed in an arm with five parallel
    joints. Every set of joints is also tried if a seven-joint arm is nearly singular after its
    prismatic joint is fixed.

    Args:
        robot: The description.
    """
    surplus = len(robot.moving) - JOINTS
    if not 0 <= surplus <= MAX_JOINTS - JOINTS:
        return None
    tried = sets_to_fix(robot)
    found = _best(robot, tried)
    is_poor = found is not None and found.separation < POOR_SEPARATION
    if found is None or (slides_of(robot) and is_poor and surplus == 1):
        unsuitable = tried if found is None else []
        every = combinations(range(len(robot.moving)), surplus)
        sets = [given for given in every if given not in unsuitable and is_fit(robot, given)]
        return _best(robot, sets) or found
    return found


def _best(robot: SerialRobot, sets: Sequence[tuple[int, ...]]) -> Choice | None:
    if not sets:
        return None
    constants, slides = numbers(robot), slides_of(robot)
    found = [choice for given in sets if (choice := choice_at(constants, given, slides))]
    return max(reversed(found), key=lambda c: (c.good, c.ratings[0].key), default=None)


def slides_of(robot: SerialRobot) -> frozenset[int]:
    """Return the indices of the prismatic joints."""
    return frozenset(k for k, joint in enumerate(robot.moving) if joint.kind == "prismatic")


def sets_to_fix(robot: SerialRobot) -> list[tuple[int, ...]]:
    """Return the sets of joints to try as fixed joints.

    Each set leaves six joints free.

    Prismatic joints and the revolute joints at the base (as in a torso) are fixed first. The last
    joint to fix may be any remaining revolute joint. If the arm has fewer than six revolute joints,
    some prismatic joints stay free.
    """
    slides = sorted(slides_of(robot))
    turns = [k for k in range(len(robot.moving)) if k not in slides]
    surplus = len(turns) - JOINTS
    if surplus < 0:
        sets = [(*given,) for given in combinations(slides, len(slides) + surplus)]
        return [given for given in sets if is_fit(robot, given)]
    lasts: list[tuple[int, ...]] = [(k,) for k in turns[surplus - 1 :]] if surplus else [()]
    first = turns[: max(surplus - 1, 0)]
    sets = [tuple(sorted((*slides, *first, *last))) for last in lasts]
    return [given for given in sets if is_fit(robot, given)]


def choice_at(
    constants: Sequence[Array],
    given: tuple[int, ...] = (),
    slides: frozenset[int] = frozenset(),
    apart: Sequence[float] = (),
) -> Choice | None:
    """Return the elimination orders for a set of fixed joints, or None if no order is suitable.

    Args:
        constants: The placements before, between and after the joints.
        given: Indices of the fixed joints, in ascending order.
        slides: Indices of the prismatic joints among all joints.
        apart: For each of the six joints, the typical or assumed difference (radian) between its
            values in two solutions of a pose, or () if unknown. If an arm is close to a known arm
            family, several solutions often have the same value of a joint. The elimination cannot
            separate solutions by a joint whose value they share.
    """
    choice = Choice(given, _ratings(constants, given, slides, apart))
    return choice if choice.ratings and choice.good > 0 else None


def without(constants: Sequence[Array], motions: Mapping[int, Array]) -> list[Array]:
    """Return the constant transformations between the free joints.

    Args:
        constants: The constant transforms (4, 4) before the first joint, between adjacent joints,
            and after the last joint.
        motions: The motion (4, 4) of each fixed joint.
    """
    left = [constants[0]]
    for k, E in enumerate(constants[1:]):
        if k in motions:
            left[-1] = left[-1] @ motions[k] @ E
        else:
            left.append(E)
    return left


def _ratings(
    constants: Sequence[Array],
    given: tuple[int, ...],
    slides: frozenset[int],
    apart: Sequence[float],
) -> tuple[Rating, ...]:
    """Return the ratings of the best elimination orders.

    If ``apart`` is not empty, the preferred elimination orders suppress a joint (the hidden
    variable) that has a clearly different value in each solution. The preferred elimination orders
    suppress different joints, because solutions may agree in one joint and differ in another.
    """

    def separates(rating: Rating) -> tuple[bool, bool]:
        joint = rating.order.joints[2]
        is_new = all(joint != other.order.joints[2] for other in kept)
        return not apart or apart[joint] > SEPARATE, not apart or is_new

    left = [rating for rating in _rated(constants, given, slides) if rating.is_fit]
    if not any(rating.good_at for rating in left):
        # The matrix A is singular for every elimination order if at least four axes each pass
        # through one of two common points. If joints 1 and 2 are parallel prismatic joints, A is
        # also singular, but such an arm lacks a degree of freedom.
        sliding = slides_left(slides, len(constants) - 1, given)
        left = [
            replace(rating, pairs=(1.0,) * len(rating.pairs))
            for rating in left
            if not sliding.issuperset(rating.order.joints[:2])
        ]
    kept: list[Rating] = []
    while left and len(kept) < MAX_KEPT:
        known = frozenset[int]().union(*(rating.good_at for rating in kept))
        best = max(left, key=lambda r: (separates(r), len(r.good_at - known), r.key))
        if len(kept) >= KEPT and best.good_at <= known:
            break
        kept.append(best)
        left = [rating for rating in left if _numbering(rating.order) != _numbering(best.order)]
    return tuple(kept)


def _numbering(order: EliminationOrder) -> tuple[tuple[int, ...], int]:
    return order.joints, order.sense


def _rated(
    constants: Sequence[Array], given: tuple[int, ...], slides: frozenset[int]
) -> list[Rating]:
    found: dict[tuple[tuple[int, ...], int], list[LineEquations]] = {}
    sliding = slides_left(slides, len(constants) - 1, given)
    numbered = {_numbering(order): order for order in elimination_orders(sliding)}
    configured = configurations(len(constants) - 1, given)
    size = length(constants)
    for angles in configured:
        values = [_value_at(angle, size, k in slides) for k, angle in enumerate(angles)]
        six = without(constants, {k: moved(values[k], k in slides) for k in given})
        scaled = _scaled([*six, forward(six, _solved(values, given), sliding)], length(six))
        for key, order in numbered.items():
            found.setdefault(key, []).append(equations(scaled[:-1], order, scaled[-1], sliding))
    stacked = {
        key: LineEquations(np.stack([e.left for e in each]), np.stack([e.right for e in each]))
        for key, each in found.items()
    }
    q = np.array([_solved(angles, given) for angles in configured])
    pairs = {key: _pairs(each) for key, each in stacked.items()}
    return [
        Rating(order, _separations(stacked[_numbering(order)], order, q), pairs[_numbering(order)])
        for order in elimination_orders(sliding)
    ]


def _value_at(angle: float, size: float, slides: bool) -> float:
    return angle / (2 * np.pi) * size if slides else angle


def _solved(values: Sequence[float], given: tuple[int, ...]) -> list[float]:
    return [value for k, value in enumerate(values) if k not in given]


def slides_left(slides: frozenset[int], joints: int, given: tuple[int, ...]) -> frozenset[int]:
    """Return the positions of the prismatic joints in the list of free joints."""
    left = [k for k in range(joints) if k not in given]
    return frozenset(place for place, k in enumerate(left) if k in slides)


def _scaled(poses: Sequence[Array], size: float) -> list[Array]:
    """Return poses whose positions are divided by the arm length ``size``."""
    return [np.vstack([np.hstack([T[:3, :3], T[:3, 3:] / size]), T[3:]]) for T in poses]


def length(constants: Sequence[Array]) -> float:
    """Return the sum of the distances between joint frames (meter), or 1 if the sum is 0."""
    return sum(float(np.linalg.norm(E[:3, 3])) for E in constants[1:]) or 1.0


def _pairs(found: LineEquations) -> tuple[float, ...]:
    """Return the smallest singular value of A divided by the largest, for each pose.

    The equations of the matrix A determine joints 1 and 2. A is singular if the axes of joints 1
    and 2 are parallel to a third axis. If A is singular, each solution of the other joints leads to
    two solutions of joints 1 and 2. If joints 1 and 2 are prismatic, the equations contain no
    square of a displacement.
    """
    A = found.left[..., 1:]
    parts, appear = np.zeros(len(A)), A.any((0, 1))
    if not appear.any():
        return tuple(parts.tolist())
    sizes = np.linalg.svd(A[..., appear], compute_uv=False)
    np.divide(sizes[:, -1], sizes[:, 0], out=parts, where=sizes[:, 0] > 0)
    return tuple(map(float, parts))


def _separations(found: LineEquations, order: EliminationOrder, q: Array) -> tuple[float, ...]:
    """Return the second smallest singular value of M divided by the largest, per configuration.

    The returned ratio is NaN if det M is zero or has a degree above 8.

    Args:
        found: The equation coefficients at C configurations, as two arrays with the shapes (C, 14,
            9) and (C, 3, 14, 9).
        order: The elimination order of the equations.
        q: Values (C, 6) of the six joints at the C configurations. Only the values of the
            suppressed joint are used.
    """
    M = suppressed(found, order.halved)
    turns = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    degrees = np.abs(np.fft.rfft(np.linalg.det(_at(turns, M[:, None]))))
    is_fit = degrees[:, DEGREE + 1 :].max(-1) < DETERMINANT_TAIL * degrees.max(-1)
    sizes = np.linalg.svd(_at(order.sense * q[:, order.joints[2]], M), compute_uv=False)
    parts = np.full(len(q), np.nan)
    np.divide(sizes[:, -2], sizes[:, 0], out=parts, where=is_fit)
    return tuple(map(float, parts))


def _at(angle: Array, M: Array) -> Array:
    c, s = np.cos(angle)[..., None, None], np.sin(angle)[..., None, None]
    return np.asarray(M[..., 0, :, :] + c * M[..., 1, :, :] + s * M[..., 2, :, :])


def configurations(joints: int, given: tuple[int, ...]) -> list[list[float]]:
    """Return quasi-random configurations from multiples of square roots of primes, modulo 1.

    In some configurations, the angles of the fixed joints are multiples of 90 degrees.
    """
    if not given:
        return [_spread(joints, k) for k in range(CONFIGURATIONS)]
    found = [_spread(joints, k) for k in range(GIVEN_CONFIGURATIONS + 4 * AT_RIGHT_ANGLES)]
    for k, q in enumerate(found[GIVEN_CONFIGURATIONS:]):
        for place, joint in enumerate(given):
            q[joint] = (k + place * (k // 4)) % 4 * np.pi / 2
    return found


def _spread(joints: int, k: int) -> list[float]:
    return [2 * np.pi * ((k + 1) * p**0.5 % 1) for p in PRIMES[:joints]]
