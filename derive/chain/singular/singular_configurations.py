"""Describes the arrangement of the joint axes where a factor of the Jacobian minors is 0.

Relations between joint axes, such as parallelism, are tested numerically. A relation between axes
describes a factor if it holds at all sampled zeros of the factor, but at none of the random
configurations.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations, pairwise

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ...model.robot import SerialRobot
from ..poe import product_of_exponentials
from .conditions import Condition, roots
from .views import seen_screws

FloatArray = NDArray[np.float64]
DRAWS = 4
"""Number of random configurations that represent the generic case."""
STARTS = 24
"""Number of random start configurations in the search for configurations at which a factor is zero.
"""
HOLDS = 1e-6
"""Tolerance of a relation between joint axes: sine of an angle, or distance as a fraction of the
arm length."""
SEED = 30


@dataclass(frozen=True)
class _Configuration:
    """Joint axes in the base frame.

    The axis of a prismatic joint has a direction, but no position.
    """

    directions: FloatArray
    points: FloatArray
    revolute: NDArray[np.bool_]
    size: float

    def off_parallel(self, i: int, j: int) -> float:
        """Return the sine of the angle between two axes."""
        return float(np.linalg.norm(np.cross(self.directions[i], self.directions[j])))

    def off_right_angle(self, i: int, j: int) -> float:
        """Return the absolute cosine of the angle between two axes."""
        return abs(float(self.directions[i] @ self.directions[j]))

    def off_line(self, point: FloatArray, i: int) -> float:
        """Return the distance of a point from an axis, divided by the size of the arm."""
        across = np.cross(point - self.points[i], self.directions[i])
        return float(np.linalg.norm(across)) / self.size

    def off_plane(self, point: FloatArray, i: int, other: FloatArray) -> float:
        """Return the distance of a point from a plane, divided by the size of the arm.

        The plane contains the axis of joint i and is parallel to the direction vector ``other``.
        """
        normal = np.cross(self.directions[i], other)
        away = abs(float((point - self.points[i]) @ normal))
        return away / (self.size * max(float(np.linalg.norm(normal)), HOLDS))

    def meeting(self, axes: Sequence[int]) -> FloatArray | None:
        """Return the intersection of axes, or None if the axes do not meet in one point."""
        M, b = np.zeros((3, 3)), np.zeros(3)
        for k in axes:
            h = self.directions[k]
            P = np.eye(3) - np.outer(h, h)
            M, b = M + P, b + P @ self.points[k]
        if np.linalg.cond(M) > 1 / HOLDS:
            return None
        point = np.asarray(np.linalg.solve(M, b))
        return point if max(self.off_line(point, k) for k in axes) <= HOLDS else None


WHOLE_WRIST = 3
"""Number of wrist axes that intersect in the wrist center."""
WRIST = "the wrist center"
STRETCHED = "; the arm is stretched or folded"
Relation = Callable[[_Configuration], float]
"""A function that measures by how much a configuration violates a relation between joint axes, with
0 if the relation holds."""


def words(robot: SerialRobot, q: Sequence[sp.Symbol], condition: Condition) -> str:
    """Describe the arrangement of the joint axes if all factors of a singularity condition are 0.

    The description is empty if no relation between joint axes matches the condition.

    Args:
        robot: A serial robot.
        q: The coordinates.
        condition: Factors of the Jacobian minors that are all 0 at the singularity.
    """
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    screws, general = _in_general(robot, q)
    factors = [factor.xreplace(values) for factor in condition]
    each = [_of_factor(screws, general, q, factor) for factor in factors]
    if all(each):
        return " and ".join(each)
    found = _configurations(screws, [*roots(factors, q, STARTS)])
    return _first_that_holds(_coincident(general[0]), found, general)


def _in_general(
    robot: SerialRobot, q: Sequence[sp.Symbol]
) -> tuple[FloatArray, list[_Configuration]]:
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    S, _ = product_of_exponentials(robot)
    S = S * sp.diag(*(joint.direction for joint in robot.moving))
    screws = np.array(S.xreplace(values).evalf(), float)
    sampled = np.random.default_rng(SEED).uniform(-3, 3, (DRAWS, len(q)))
    return screws, _configurations(screws, sampled)


def _first_that_holds(
    relations: Iterable[tuple[str, Relation]],
    found: Sequence[_Configuration],
    general: Sequence[_Configuration],
) -> str:
    """Return the description of the first relation that holds only in singular configurations."""
    for text, relation in relations if found else ():
        if all(relation(p) <= HOLDS for p in found) and min(map(relation, general)) > HOLDS:
            return text
    return ""


def _coincident(general: _Configuration) -> Iterator[tuple[str, Relation]]:
    for i, j in combinations(np.flatnonzero(general.revolute).tolist(), 2):
        yield f"axes {i + 1} and {j + 1} coincide", partial(_off_axis, i, j)


def _off_axis(i: int, j: int, configuration: _Configuration) -> float:
    return max(configuration.off_parallel(i, j), configuration.off_line(configuration.points[j], i))


def _of_factor(
    screws: FloatArray, general: Sequence[_Configuration], q: Sequence[sp.Symbol], factor: sp.Expr
) -> str:
    found = _configurations(screws, [*roots([factor], q, STARTS)])
    own = [k for k, symbol in enumerate(q) if factor.has(symbol)]
    return _first_that_holds(_relations(general[0], own), found, general)


def _configurations(S: FloatArray, q: Sequence[FloatArray] | FloatArray) -> list[_Configuration]:
    seen = seen_screws(S, np.reshape(q, (-1, S.shape[1])), 0)
    return [_configuration(screws) for screws in seen.swapaxes(1, 2)]


def _configuration(screws: FloatArray) -> _Configuration:
    turns = np.linalg.norm(screws[:, 3:], axis=1) > HOLDS
    directions = np.where(turns[:, None], screws[:, 3:], screws[:, :3])
    points = np.where(turns[:, None], np.cross(screws[:, 3:], screws[:, :3]), 0.0)
    extent = np.ptp(points[turns], axis=0) if turns.any() else np.zeros(3)
    return _Configuration(directions, points, turns, float(np.linalg.norm(extent)) or 1.0)


def _relations(general: _Configuration, own: Sequence[int]) -> Iterator[tuple[str, Relation]]:
    """Yield the relations between joint axes to test, with their descriptions."""
    count = len(general.directions)
    if len(own) == 1 and 0 < own[0] < count - 1:
        i, j = own[0] - 1, own[0] + 1
        pair = f"axes {i + 1} and {j + 1}"
        if general.revolute[[i, j]].all():
            yield f"{pair} coincide", partial(_off_axis, i, j)
        yield f"{pair} are parallel", lambda p: p.off_parallel(i, j)
        yield f"{pair} are perpendicular", lambda p: p.off_right_angle(i, j)
    lines = np.flatnonzero(general.revolute).tolist()
    parallel = [(i, j) for i, j in pairwise(lines) if general.off_parallel(i, j) <= HOLDS]
    for (i, j), (other, k) in pairwise(parallel):
        if j == other:
            ending = STRETCHED if _keep_distances(general, i, k) else ""
            yield (
                f"axes {i + 1}, {j + 1} and {k + 1} lie in a plane{ending}",
                _in_plane(i, j, partial(_point, k)),
            )
    for axes in ([count - 3, count - 2, count - 1], [count - 2, count - 1]):
        if not lines or axes[0] <= lines[0] or not general.revolute[axes].all():
            continue
        if general.meeting(axes) is None:
            continue
        named = f"the intersection of axes {count - 1} and {count}"
        named = WRIST if len(axes) == WHOLE_WRIST else named
        yield from _of_center(general, axes, named, parallel)


def _keep_distances(general: _Configuration, i: int, k: int) -> bool:
    sliding = (j for j in range(i, k) if not general.revolute[j])
    return all(general.off_parallel(i, j) <= HOLDS for j in sliding)


def _point(k: int, configuration: _Configuration) -> FloatArray:
    return np.asarray(configuration.points[k])


def _in_plane(i: int, j: int, point: Callable[[_Configuration], FloatArray]) -> Relation:
    return lambda p: p.off_plane(point(p), i, p.points[j] - p.points[i])


def _of_center(
    general: _Configuration, axes: Sequence[int], named: str, parallel: Sequence[tuple[int, int]]
) -> Iterator[tuple[str, Relation]]:

    def center(p: _Configuration) -> FloatArray:
        found = p.meeting(axes)
        return p.points[axes[0]] if found is None else found

    first = int(np.flatnonzero(general.revolute)[0])
    yield f"{named} is on axis {first + 1}", lambda p: p.off_line(center(p), first)
    for i, j in parallel:
        ending = STRETCHED if _keep_distances(general, i, axes[0]) else ""
        yield (
            f"{named} is in the plane of axes {i + 1} and {j + 1}{ending}",
            _in_plane(i, j, center),
        )
    yield (
        f"{named} is in the plane of axis {first + 1} and the direction of axis {first + 2}",
        lambda p: p.off_plane(center(p), first, p.directions[first + 1]),
    )
