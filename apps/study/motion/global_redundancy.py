"""Global redundancy resolution, which optimizes the redundancy parameters over the whole curve.

The method is dynamic programming over the self-motion of the robot. At knots on the curve, the
inverse kinematics is computed for a grid of redundancy parameters. Every sequence of configurations
within the joint limits has a cost, the integral of squared joint rates. The search finds the
sequence of configurations with the smallest cost, and continues with finer grids around this
sequence. A cubic spline interpolates the redundancy parameters between the knots. If the
configurations at the knots are at a joint limit, a cubic spline may exceed the limit between the
knots. The last search attempt therefore uses a monotone interpolation.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.spatial import cKDTree

from chasles import InputValueError, JointPath, OutOfReachError, Robot, ShapeError
from chasles.arrays import real_array
from chasles.contract import check_type
from chasles.fixed import values_at

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

_TRIES = (
    (17, 1.0, 0.02, CubicSpline),
    (33, 1.0, 0.01, CubicSpline),
    (49, 1.5, 0.004, CubicSpline),
    (65, 2.0, 0.001, CubicSpline),
    (65, 4.0, 0.001, CubicSpline),
    (129, 1.0, 0.0001, PchipInterpolator),
)
"""Settings of each search attempt: number of knots, relative grid resolution, margin and
interpolation. The margin is the minimum distance of the knot configurations from the joint limits,
relative to the joint range.

If an attempt finds no sequence of configurations, or if the joints leave their limits between the
knots, the search continues with the next attempt. A monotone interpolation stays between the knot
values, but its second derivatives jump at the knots.
"""
_CELLS = {1: 96, 2: 18, 3: 8}
"""Number of grid values per redundancy parameter, keyed by the number of redundancy parameters."""
_MAX_GRID = 6000
"""Maximum number of combinations of redundancy parameter values per knot."""
_FINEST = 1e-3
"""Step of the finest grid, relative to the range of the redundancy parameter."""
_GAIN = 1e-3
"""If a repeated search decreases the cost by less than this fraction, the grid step is halved."""
_STEP = 1.0
"""Maximum distance of the configurations at successive knots [rad or `unit_length`]."""
_RANDOM = 1024
"""Number of random configurations that estimate the range of a joint in a loop."""


@dataclass(frozen=True)
class ParameterCurve:
    """Redundancy parameters as functions of the position on a curve.

    Attributes:
        names: Names of the redundancy parameters.
        spline: Function from positions (m,) on the curve to redundancy parameters (m, p). The first
            derivatives of this function are continuous. If a redundancy parameter stays at a limit
            for a part of the motion, the second derivatives of `spline` are discontinuous.
        q_start: (n,) coordinates of the robot at the start of the curve [rad or m].
    """

    names: tuple[str, ...]
    spline: Callable[..., FloatArray]
    q_start: FloatArray

    def at(self, s: FloatArray) -> dict[str, FloatArray]:
        """Return the values (m,) of each redundancy parameter at positions s (m,) on the curve."""
        return dict(zip(self.names, self.spline(s).T.copy(), strict=True))


def resolve_redundancy(
    robot: Robot, T: ArrayLike, q_seed: ArrayLike, *, limits: Any = "robot"
) -> JointPath:
    """Return coordinates for a path of tool poses with the least joint motion.

    The joint motion is the integral of the squared joint rates over the path, plus the squared
    joint displacement from `q_seed` to the start. Displacements of prismatic joints are divided by
    `robot.unit_length`. Dynamic programming finds the best sequence on a grid of the redundancy
    parameters, and finer grids refine this sequence. The result is a local minimum near the best
    sequence on the grid. The computation takes a fraction of a second for one redundancy parameter,
    and up to some seconds for two.

    Args:
        robot: A robot with redundancy parameters (`robot.redundancy`).
        T: (m, 4, 4) closely spaced tool poses in the base frame, with positions in [m].
        q_seed: (n,) actuated coordinates before the path, from which the robot moves to its start
            [rad or m].
        limits: "robot" for the coordinate limits of the robot, None for no limits, or (n, 2) lower
            and upper limits of the coordinates [rad or m].

    Returns:
        (m, n) coordinates of the robot at the m tool poses [rad or m].

    Raises:
        InputValueError: The robot has no redundancy parameters, or `T` is empty.
        OutOfReachError: No continuous motion within the limits reaches all poses.
    """
    check_type("resolve_redundancy: robot", robot, Robot)
    label = f"{robot.name}.resolve_redundancy"
    poses, seed = real_array(label, "T", T), real_array(label, "q_seed", q_seed)
    if not len(poses):
        raise InputValueError(f"{label}: expected at least one pose")
    bounds = _bounds(robot, label, limits)
    _, path = parameter_curve(robot, np.arange(float(len(poses))), poses, seed, bounds)
    return path


def parameter_curve(
    robot: Robot, s: FloatArray, T: FloatArray, q_seed: FloatArray, bounds: FloatArray
) -> tuple[ParameterCurve, JointPath]:
    """Return redundancy parameters along a curve of poses, and the resulting joint path.

    Args:
        robot: A robot with redundancy parameters.
        s: (m,) positions on the curve in ascending order, starting at 0.
        T: (m, 4, 4) closely spaced tool poses at the positions s.
        q_seed: (n,) coordinates before the motion.
        bounds: (n, 2) lower and upper limits of the coordinates [rad or m].
    """
    if not robot.redundancy:
        raise InputValueError(f"{robot.name}: the robot has no redundancy parameters")
    failure = ""
    for count, resolution, margin, interpolation in _TRIES:
        knots = np.unique(np.rint(np.linspace(0, len(s) - 1, count)).astype(np.intp))
        search = _Search(robot, T[knots], q_seed, bounds + margin * _inwards(bounds))
        try:
            parameters, q_start = search.best(resolution)
        except _Blocked as blocked:
            place = _part(s, int(knots[blocked.knot]))
            failure = (
                f"no value of {search.listed} reaches the pose at {place} by a continuous motion "
                "within the limits"
            )
            continue
        curve = ParameterCurve(search.names, _through(interpolation, s[knots], parameters), q_start)
        path = robot.ik_path(T, q_start, fixed=curve.at(s))
        end = _first_outside(path, bounds)
        if end == len(s):
            return curve, path
        failure = f"the motion within the limits ends at {_part(s, end)}"
    raise OutOfReachError(f"{robot.name}: {failure}")


class _Blocked(Exception):
    """Error if no configuration within the limits at a knot is near one at the previous knot."""

    def __init__(self, knot: int) -> None:
        super().__init__(knot)
        self.knot = knot


@dataclass(frozen=True)
class _States:
    """Configurations (k, n) that reach a pose, and their redundancy parameters (k, p)."""

    q: FloatArray
    parameters: FloatArray


@dataclass(frozen=True)
class _Search:
    """The search for the best sequence of configurations at K knots.

    Attributes:
        robot: The robot.
        T: (K, 4, 4) tool poses at the knots.
        q_seed: (n,) coordinates before the motion.
        bounds: (n, 2) limits of the coordinates.
    """

    robot: Robot
    T: FloatArray
    q_seed: FloatArray
    bounds: FloatArray

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the redundancy parameters."""
        return tuple(item.name for item in self.robot.redundancy)

    @property
    def listed(self) -> str:
        """Names of the redundancy parameters as one text, for an error message."""
        return " and ".join(self.names)

    def best(self, resolution: float) -> tuple[FloatArray, FloatArray]:
        """Return (redundancy parameters (K, p), first configuration (n,)) of the best sequence."""
        start, low, high = self._ranges()
        ends = zip(start, low, high, strict=True)
        most = int(_MAX_GRID ** (1 / len(low)))
        cells = min(max(2, round(resolution * _CELLS.get(len(low), 4))), most)
        axes = [np.append(np.linspace(a, b, cells), c) for c, a, b in ends]
        grid = np.array(list(itertools.product(*axes)))
        chosen, cost = self._sequence(np.repeat(grid[None], len(self.T), 0))
        step = (high - low) / (cells - 1)
        around = np.array(list(itertools.product((0.0, -1.0, 1.0), repeat=len(low))))
        while (step > _FINEST * (high - low)).any():
            near = np.clip(chosen.parameters[:, None] + around * step, low, high)
            chosen, least = self._sequence(near)
            step = step if least < cost * (1 - _GAIN) else step / 2
            cost = least
        return chosen.parameters, chosen.q[0]

    def _ranges(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return (redundancy parameters at `q_seed`, lower bounds, upper bounds), each (p,)."""
        robot, ends = self.robot, []
        limits = dict(zip(robot.coordinate_names, self.bounds.tolist(), strict=True))
        for item in robot.redundancy:
            (start,) = values_at(robot, item.name, self.q_seed[None])
            low, high = limits.get(item.name) or self._reached(item.name)
            half = np.pi if item.unit == "rad" else 2 * robot.unit_length
            center = np.clip(start, low, high)
            ends.append((center, max(low, center - half), min(high, center + half)))
        start, low, high = np.array(ends).T
        return start, low, high

    def _reached(self, name: str) -> tuple[float, float]:
        """Return the smallest and the largest value of a joint at random coordinates.

        For an angle that is not a joint position, the function returns -inf and inf.
        """
        if name not in self.robot.joint_names:
            return -np.inf, np.inf
        theta = self.robot.chain(self.robot.random_q(_RANDOM, rng=0))
        values = theta[:, self.robot.joint_names.index(name)]
        return float(np.nanmin(values)), float(np.nanmax(values))

    def _sequence(self, parameters: FloatArray) -> tuple[_States, float]:
        """Return (cheapest sequence, cost) for c candidate parameters (K, c, p) at each knot."""
        states = self._states(parameters)
        features = [self._features(state.q) for state in states]
        weight = max(len(states) - 1, 1)
        cost = ((self._features(self.q_seed[None]) - features[0]) ** 2).sum(1)
        backward = []
        for knot, (before, after) in enumerate(itertools.pairwise(features)):
            steps, cost = _predecessors(cost, before, after, weight)
            backward.append(steps)
            if not np.isfinite(cost).any():
                raise _Blocked(knot + 1)
        index = [int(cost.argmin())]
        for step in reversed(backward):
            index.append(int(step[index[-1]]))
        chosen = list(zip(states, reversed(index), strict=True))
        q = np.array([state.q[k] for state, k in chosen])
        return _States(q, np.array([state.parameters[k] for state, k in chosen])), cost.min()

    def _states(self, parameters: FloatArray) -> list[_States]:
        """Return all inverse kinematics solutions within the limits, for each knot of the path."""
        count = parameters.shape[1]
        values = parameters.reshape(-1, parameters.shape[2])
        fixed = dict(zip(self.names, values.T.copy(), strict=True))
        solutions = self.robot.ik(np.repeat(self.T, count, 0), fixed=fixed)
        inside = solutions.within_limits(self.bounds)
        valid = inside.valid.reshape(len(self.T), count, -1)
        q = inside.q.reshape(*valid.shape, -1)
        found = []
        for knot, mask in enumerate(valid):
            if not mask.any():
                raise _Blocked(knot)
            found.append(_States(q[knot][mask], parameters[knot][np.nonzero(mask)[0]]))
        return found

    def _features(self, q: FloatArray) -> FloatArray:
        """Return a vector (f,) for each of k configurations (k, n).

        The squared distance between the vectors of two configurations is the cost of the motion
        between the configurations.

        In these vectors, the cosine and sine represent a revolute coordinate without limits.
        """
        units = np.array([
            self.robot.unit_length if coordinate.unit == "m" else 1.0
            for coordinate in self.robot.coordinates
        ])  # fmt: skip
        angles = np.array([coordinate.unit == "rad" for coordinate in self.robot.coordinates])
        turns = angles & ~np.isfinite(self.bounds).any(1)
        return np.hstack([(q / units)[:, ~turns], np.cos(q[:, turns]), np.sin(q[:, turns])])


def _predecessors(
    cost: FloatArray, before: FloatArray, after: FloatArray, weight: int
) -> tuple[IntArray, FloatArray]:
    """Return the cheapest predecessor (l,) of each vector in `after` (l, f), and the cost (l,)."""
    reached = np.flatnonzero(np.isfinite(cost))
    height = np.sqrt((cost[reached] - cost[reached].min()) / weight)
    tree = cKDTree(np.column_stack([before[reached], height]))
    _, nearest = tree.query(np.pad(after, ((0, 0), (0, 1))))
    steps = reached[nearest]
    squares = ((before[steps] - after) ** 2).sum(1)
    least = cost[steps] + np.where(squares <= _STEP**2, weight * squares, np.inf)
    far = np.flatnonzero(np.isinf(least))
    near = cKDTree(before[reached]).query_ball_point(after[far], _STEP)
    for k, candidates in zip(far, near, strict=True):
        if candidates:
            index = reached[candidates]
            total = cost[index] + weight * ((before[index] - after[k]) ** 2).sum(1)
            steps[k], least[k] = index[total.argmin()], total.min()
    return steps, least


def _bounds(robot: Robot, label: str, limits: Any) -> FloatArray:
    if limits is None:
        return np.tile([-np.inf, np.inf], (robot.n, 1))
    expected = f'{label}: limits must be "robot", None or an array ({robot.n}, 2)'
    if isinstance(limits, str):
        if limits != "robot":
            raise InputValueError(f"{expected}, got {limits!r}")
        return np.asarray(robot.limits, dtype=np.float64)
    found = np.asarray(real_array(label, "limits", limits))
    if found.shape != (robot.n, 2):
        raise ShapeError(f"{expected}, got shape {found.shape}")
    return found


def _inwards(bounds: FloatArray) -> FloatArray:
    """Return shifts (n, 2) that move each limit inward by the full coordinate range.

    The shift of a lower limit is positive. The shift of an upper limit is negative.

    The shifts are 0 for a coordinate with an infinite limit.
    """
    size = np.diff(bounds, axis=1)
    return np.asarray(np.where(np.isfinite(size), size, 0.0) * [1.0, -1.0])


def _first_outside(path: JointPath, bounds: FloatArray) -> int:
    """Return the index of the first configuration outside the limits, or `len(path.q)`."""
    outside = ((path.q < bounds[:, 0]) | (path.q > bounds[:, 1])).any(1)
    return int(np.argmax(outside)) if outside.any() else len(path.q)


def _through(
    interpolation: Callable[..., Any], s: FloatArray, parameters: FloatArray
) -> Callable[..., FloatArray]:
    """Return a function of s that interpolates the redundancy parameters at the knots."""
    if len(s) == 1:
        return lambda at, order=0: np.tile(parameters * float(order == 0), (len(at), 1))
    spline: Callable[..., FloatArray] = interpolation(s, parameters)
    return spline


def _part(s: FloatArray, index: int) -> str:
    return f"{s[index] / (s[-1] or 1.0):.0%} of the path"
