"""Describes factors of Jacobian minors by the axis arrangement at their zeros.

Relations are tested numerically. A relation describes a factor if it holds at all sampled zeros of
the factor but not at generic configurations.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ...model.robot import SerialRobot
from ..poe import product_of_exponentials
from .conditions import Condition, roots
from .views import seen_screws

FloatArray = NDArray[np.float64]
DRAWS = 4
"""Number of random values for the coordinates that the root search does not solve for."""
GRID = 181
"""Number of grid values of a coordinate for bracketing roots."""
HALVINGS = 60
HOLDS = 1e-6
"""Tolerance of a relation: sine of an angle, or distance relative to the arm length."""
SEED = 30


@dataclass(frozen=True)
class _Configuration:
    """Joint axes in the base frame; prismatic joints have no points."""

    directions: FloatArray
    points: FloatArray
    size: float

    def off_parallel(self, i: int, j: int) -> float:
        """Returns the sine of the angle between two axes."""
        return float(np.linalg.norm(np.cross(self.directions[i], self.directions[j])))

    def off_right_angle(self, i: int, j: int) -> float:
        """Returns the absolute cosine of the angle between two axes."""
        return abs(float(self.directions[i] @ self.directions[j]))

    def off_line(self, point: FloatArray, i: int) -> float:
        """Returns the distance of a point from an axis, relative to the size."""
        across = np.cross(point - self.points[i], self.directions[i])
        return float(np.linalg.norm(across)) / self.size

    def off_plane(self, point: FloatArray, i: int, other: FloatArray) -> float:
        """Returns the relative distance of a point from the plane of an axis and a direction."""
        normal = np.cross(self.directions[i], other)
        away = abs(float((point - self.points[i]) @ normal))
        return away / (self.size * max(float(np.linalg.norm(normal)), HOLDS))

    def meeting(self, axes: Sequence[int]) -> FloatArray | None:
        """Returns the intersection of axes, or None."""
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
WRIST = "the wrist's centre"
Relation = Callable[[_Configuration], float]
"""The deviation of a configuration from a relation of the axes, or 0 if the relation holds."""


def words(robot: SerialRobot, q: Sequence[sp.Symbol], condition: Condition) -> str:
    """Describes the axes at the zeros of factors of minors; empty if no relation matches.

    Args:
        robot: A serial robot.
        q: The coordinates.
        condition: Factors in the coordinates and parameters of the robot.
    """
    each = [_of_factor(robot, q, factor) for factor in condition]
    if all(each):
        return " and ".join(each)
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    screws, general = _in_general(robot, q)
    factors = [factor.xreplace(values) for factor in condition]
    found = [_configuration(screws, x) for x in roots(factors, q, DRAWS)]
    return _first_that_holds(_coincident(len(q)), found, general)


def _in_general(
    robot: SerialRobot, q: Sequence[sp.Symbol]
) -> tuple[FloatArray, list[_Configuration]]:
    """Returns numeric screws of a robot, and generic configurations."""
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    S, _ = product_of_exponentials(robot)
    S = S * sp.diag(*(joint.direction for joint in robot.moving))
    screws = np.array(S.xreplace(values).evalf(), float)
    sampled = np.random.default_rng(SEED).uniform(-3, 3, (DRAWS, len(q)))
    return screws, [_configuration(screws, x) for x in sampled]


def _first_that_holds(
    relations: Iterable[tuple[str, Relation]],
    found: Sequence[_Configuration],
    general: Sequence[_Configuration],
) -> str:
    """Returns the description of the first relation that holds only at singular configurations."""
    for text, relation in relations if found else ():
        if all(relation(p) <= HOLDS for p in found) and min(map(relation, general)) > HOLDS:
            return text
    return ""


def _coincident(count: int) -> Iterator[tuple[str, Relation]]:
    for i, j in combinations(range(count), 2):
        yield f"axes {i + 1} and {j + 1} coincide", partial(_off_axis, i, j)


def _off_axis(i: int, j: int, configuration: _Configuration) -> float:
    return max(configuration.off_parallel(i, j), configuration.off_line(configuration.points[j], i))


def _of_factor(robot: SerialRobot, q: Sequence[sp.Symbol], factor: sp.Expr) -> str:
    """Describes the axes at the zeros of a factor; an empty text if no relation matches."""
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    screws, general = _in_general(robot, q)
    rng = np.random.default_rng(SEED + 1)
    found = [_configuration(screws, x) for x in _roots(factor.xreplace(values), q, rng)]
    own = [k for k, symbol in enumerate(q) if factor.has(symbol)]
    return _first_that_holds(_relations(general[0], own), found, general)


def _configuration(S: FloatArray, q: FloatArray) -> _Configuration:
    screws = seen_screws(S, q, 0).T
    turns = np.linalg.norm(screws[:, 3:], axis=1) > HOLDS
    directions = np.where(turns[:, None], screws[:, 3:], screws[:, :3])
    points = np.where(turns[:, None], np.cross(screws[:, 3:], screws[:, :3]), 0.0)
    return _Configuration(directions, points, float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0)


def _roots(
    factor: sp.Expr, q: Sequence[sp.Symbol], rng: np.random.Generator
) -> Iterator[FloatArray]:
    """Yields zeros of a factor; the other coordinates have random values."""
    own = [k for k, symbol in enumerate(q) if factor.has(symbol)]
    function = sp.lambdify(list(q), factor, "numpy")
    for _ in range(DRAWS):
        at = rng.uniform(-3, 3, len(q))
        for k in own:
            grid = np.linspace(-np.pi - 0.01, np.pi + 0.02, GRID)
            table = np.broadcast_to(_along(function, at, k, grid), grid.shape)
            for i in np.flatnonzero(np.diff(np.signbit(table))):
                yield _halved(function, at, k, grid[i], grid[i + 1])


def _along(
    function: Callable[..., FloatArray], at: FloatArray, k: int, values: FloatArray
) -> FloatArray:
    return np.asarray(function(*at[:k], values, *at[k + 1 :]), float)


def _halved(
    function: Callable[..., FloatArray], at: FloatArray, k: int, low: float, high: float
) -> FloatArray:
    below = bool(_along(function, at, k, np.array(low)) < 0)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        if bool(_along(function, at, k, np.array(middle)) < 0) == below:
            low = middle
        else:
            high = middle
    return np.array([*at[:k], (low + high) / 2, *at[k + 1 :]])


def _relations(general: _Configuration, own: Sequence[int]) -> Iterator[tuple[str, Relation]]:
    """Yields the relations to test with their descriptions; joint numbers start at 1."""
    count = len(general.directions)
    if len(own) == 1 and 0 < own[0] < count - 1:
        i, j = own[0] - 1, own[0] + 1
        pair = f"axes {i + 1} and {j + 1}"
        yield f"{pair} coincide", partial(_off_axis, i, j)
        yield f"{pair} are parallel", lambda p: p.off_parallel(i, j)
        yield f"{pair} are at right angles", lambda p: p.off_right_angle(i, j)
    parallel = [k for k in range(count - 1) if general.off_parallel(k, k + 1) <= HOLDS]
    for k in parallel:
        if k + 1 in parallel:
            yield (
                f"axes {k + 1}, {k + 2} and {k + 3} lie in a plane; the arm is stretched or folded",
                _in_plane(k, partial(_point, k + 2)),
            )
    for axes in ([count - 3, count - 2, count - 1], [count - 2, count - 1]):
        if general.meeting(axes) is None:
            continue
        named = f"the point where axes {count - 1} and {count} meet"
        yield from _of_centre(axes, WRIST if len(axes) == WHOLE_WRIST else named, parallel)


def _point(k: int, configuration: _Configuration) -> FloatArray:
    return np.asarray(configuration.points[k])


def _in_plane(k: int, point: Callable[[_Configuration], FloatArray]) -> Relation:
    """Returns the relation "a point lies in the plane of two adjacent parallel axes"."""
    return lambda p: p.off_plane(point(p), k, p.points[k + 1] - p.points[k])


def _of_centre(
    axes: Sequence[int], named: str, parallel: Sequence[int]
) -> Iterator[tuple[str, Relation]]:
    """Yields relations of the intersection of the last axes."""

    def centre(p: _Configuration) -> FloatArray:
        found = p.meeting(axes)
        return p.points[axes[0]] if found is None else found

    yield f"{named} is on axis 1", lambda p: p.off_line(centre(p), 0)
    for k in parallel:
        yield (
            f"{named} is in the plane of axes {k + 1} and {k + 2}; the arm is stretched or folded",
            _in_plane(k, centre),
        )
    yield (
        f"{named} is in the plane of axis 1 and the direction of axis 2",
        lambda p: p.off_plane(centre(p), 0, p.directions[1]),
    )
