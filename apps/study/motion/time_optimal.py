"""Time-optimal motion, in which a rate or an acceleration is at its limit at each moment.

The curve q(s) is sampled with its exact derivatives on a grid. Reachability analysis determines the
fastest profile s(t) on this grid. Between the grid nodes, the motion may exceed limits slightly, so
the limits are checked at ten samples between two nodes. Finally, the whole motion is slowed down
until it satisfies all limits.

Source:
    H. Pham, Q.-C. Pham, A new approach to time-optimal path parameterization based on reachability
    analysis, 2018 (the library toppra).
"""

from __future__ import annotations

import logging
import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError
from chasles.contract import check_type, requires

from ..arguments import above_0, finite, integer_at_least
from .limits import per_coordinate
from .motion import Motion
from .time_scaling import TimeScaling
from .trajectory import Trajectory

FloatArray = NDArray[np.float64]

_NODES = 400
"""Default number of grid nodes along the curve."""
_FEWEST = 10
"""Minimum number of grid nodes."""
_FINER = 10
"""Limits are checked at this number of samples between two grid nodes."""
_REFINEMENTS = 3
"""Maximum number of sampling passes that determine the time factor by which the motion is slowed
down. After the first pass, only intervals whose time factor may exceed the current maximum are
sampled."""
_ROUNDS = 4
"""Maximum number of successively refined grids."""
_CLOSEST = 1e-5
"""Minimum spacing of grid nodes, relative to the curve length. Between closer nodes, rounding
errors of rates would look like accelerations."""
_LOCAL = 1.01
"""If the limits require a time factor above this value at a sample, a node is added to the grid
interval that contains the sample."""
_HIDDEN = 1.0
"""Between two samples, the time factor is assumed to exceed the larger of the two sampled time
factors by at most this multiple of their difference."""
_BEFORE = 1e-9
"""Time from the last sample of an interval to the next node, relative to the duration of the
interval."""
_NONE = 1e9
"""Value that stands for an unlimited acceleration of the tool along its path."""
_MARGIN = 1e-5
"""Relative increase of the duration, as a margin for limits that are exceeded between the samples.
"""


def time_optimal(
    motion: Motion,
    *,
    rate_limits: ArrayLike,
    acceleration_limits: ArrayLike,
    tool_speed: float | None = None,
    nodes: int = _NODES,
) -> Motion:
    """Return the fastest motion from rest to rest along the curve of `motion` within the limits.

    Args:
        motion: A `Motion` on the curve. The time scaling of this `Motion` has no effect.
        rate_limits: Maximum rate of each coordinate (n,), or one number for all [rad/s or m/s].
        acceleration_limits: Maximum acceleration of each coordinate (n,), or one number for all
            [rad/s^2 or m/s^2]. The acceleration limits must be finite.
        tool_speed: Maximum speed of the tool origin [m/s], or None for no limit.
        nodes: Number of grid nodes along the curve.

    Returns:
        A `Motion` on the same curve with a new time scaling.

    Raises:
        InputValueError: A limit is not above 0, or an acceleration limit is infinite. The robot
            does not move on the curve, or no motion from rest to rest exists.
        OutOfReachError: The curve leaves the workspace, the inverse kinematics branch or the
            coordinate limits.
    """
    check_type("time_optimal: motion", motion, Motion)
    robot = motion.robot
    limits = [
        per_coordinate(name, v, robot.n)
        for name, v in (("rate_limits", rate_limits), ("acceleration_limits", acceleration_limits))
    ]
    if tool_speed is not None:
        above_0("time_optimal: tool_speed", tool_speed)
    integer_at_least("time_optimal: nodes", nodes, _FEWEST)
    finite("time_optimal: acceleration_limits", limits[1])
    s, best = _nodes(motion, nodes), math.inf
    for _ in range(_ROUNDS):
        tried = replace(motion, time_scaling=_fastest(motion, limits, tool_speed, s))
        factor, beyond = _stretch(tried, limits, tool_speed)
        if factor * tried.duration < best:
            best = factor * tried.duration
            found = replace(
                motion, time_scaling=tried.time_scaling.stretched(factor * (1 + _MARGIN))
            )
        if not len(beyond):
            break
        s = _with_nodes(s, beyond)
    return found


def _with_nodes(s: FloatArray, further: FloatArray) -> FloatArray:
    """Return the nodes s, plus the midpoint of each interval that contains a value of `further`.

    Very short intervals between nodes are not divided.
    """
    parts = np.unique(np.clip(np.searchsorted(s, further) - 1, 0, len(s) - 2))
    wide = np.diff(s)[parts] > _CLOSEST * s[-1]
    middles = (s[parts] + s[parts + 1]) / 2
    return np.sort(np.r_[s, middles[wide]])


def _fastest(
    motion: Motion, limits: list[FloatArray], tool_speed: float | None, s: FloatArray
) -> TimeScaling:
    """Return the fastest time scaling with constant acceleration between the grid nodes s."""
    with requires("chasles[study]"):
        import toppra  # noqa: PLC0415
        from toppra.algorithm import TOPPRA  # noqa: PLC0415
        from toppra.constraint import (  # noqa: PLC0415
            JointAccelerationConstraint,
            JointVelocityConstraint,
        )

    path = _on_grid(motion, s, tool_speed)
    rate, acceleration = limits
    if tool_speed is not None:
        rate = np.r_[rate, tool_speed]
        acceleration = np.r_[acceleration, _NONE]
    constraints = [
        JointVelocityConstraint(np.column_stack([-rate, rate])),
        JointAccelerationConstraint(np.column_stack([-acceleration, acceleration])),
    ]
    logging.getLogger("toppra").setLevel(logging.ERROR)
    toppra.algorithm.algorithm.logger.setLevel(logging.ERROR)
    _, sd, _ = TOPPRA(constraints, path, gridpoints=s).compute_parameterization(0, 0)
    if sd is None or not np.isfinite(sd).all():
        raise InputValueError("time_optimal: no motion from rest to rest stays within the limits")
    widths = 2 * np.diff(s) / (sd[1:] + sd[:-1])
    half = (sd[1:] - sd[:-1]) / (2 * widths)
    rows = np.column_stack([s[:-1], sd[:-1], half])
    return TimeScaling(np.r_[0, np.cumsum(widths)], rows, motion.curve.length)


def _nodes(motion: Motion, count: int) -> FloatArray:
    """Return the nodes of a grid.

    The grid is denser where the joint rates change most.
    """
    s = np.linspace(0, motion.curve.length, count + 1)
    _, by_s, by_ss = motion.on_curve(s)
    if not by_s.any():
        raise InputValueError("time_optimal: nothing moves on the curve")
    rate, change = (np.linalg.norm(values, axis=1) for values in (by_s, by_ss))
    dense = 1 / motion.curve.length + change / np.maximum(rate, np.finfo(float).tiny)
    share = np.r_[0, np.cumsum(np.diff(s) * (dense[1:] + dense[:-1]) / 2)]
    return np.asarray(np.interp(np.linspace(0, share[-1], count + 1), share, s))


def _on_grid(motion: Motion, s: FloatArray, tool_speed: float | None) -> Any:
    """Return the curve as a toppra path.

    If `tool_speed` is not None, the tool path length is an additional coordinate of the toppra
    path.
    """
    with requires("chasles[study]"):
        from toppra.interpolator import AbstractGeometricPath  # noqa: PLC0415

    orders = list(motion.on_curve(s))
    if tool_speed is not None:
        twist = motion.robot.twist_mixed(orders[0], orders[1])
        length = np.linalg.norm(twist[:, :3], axis=1)
        orders = [np.column_stack([x, y]) for x, y in zip(orders, (s, length, 0 * s), strict=True)]

    class OnGrid(AbstractGeometricPath):  # type: ignore[misc]
        dof = orders[0].shape[1]
        path_interval = s[[0, -1]]
        waypoints = (s, orders[0])

        def __call__(self, at: Any, order: int = 0) -> FloatArray:
            nearest = np.searchsorted((s[1:] + s[:-1]) / 2, np.asarray(at))
            return np.asarray(orders[order][nearest])

    return OnGrid()


def _stretch(
    motion: Motion, limits: list[FloatArray], tool_speed: float | None
) -> tuple[float, FloatArray]:
    """Return the time factor (at least 1) and additional grid nodes.

    If `motion` is slowed down by the time factor, it satisfies the limits.

    Close to a singularity, peaks may be narrower than the sample spacing. An interval is sampled
    again if its estimated maximum time factor exceeds the maximum found so far. The estimated
    maximum is the larger of the time factors at both ends of the interval, plus `_HIDDEN` times
    their difference.
    """
    begin, width = motion.time_scaling.breaks[:-1], np.diff(motion.time_scaling.breaks)
    most, beyond = 1.0, [np.empty(0)]
    for _ in range(_REFINEMENTS):
        # The acceleration jumps at a grid node, so the limits are also checked just before the
        # node.
        parts = np.linspace(0, 1 - _BEFORE, _FINER + 1)
        times = begin[:, None] + width[:, None] * parts
        used = _used(motion.at(times.ravel()), limits, tool_speed).reshape(times.shape)
        most = max(most, float(used.max()))
        beyond.append(times[used > _LOCAL])
        hidden = used[:, :-1] + _HIDDEN * np.abs(np.diff(used, axis=1)) > most
        hidden |= used[:, 1:] + _HIDDEN * np.abs(np.diff(used, axis=1)) > most
        begin, width = times[:, :-1][hidden], np.diff(times, axis=1)[hidden]
        if not len(begin):
            break
    return most, motion.time_scaling.at(np.concatenate(beyond))[0]


def _used(sampled: Trajectory, limits: list[FloatArray], tool_speed: float | None) -> FloatArray:
    """Return the time factor (m,) that the limits require at each sample."""
    rate = (np.abs(sampled.qd) / limits[0]).max(1)
    acceleration = np.sqrt((np.abs(sampled.qdd) / limits[1]).max(1))
    used = np.maximum(rate, acceleration)
    if tool_speed:
        used = np.maximum(used, np.linalg.norm(sampled.V[:, :3], axis=1) / tool_speed)
    return np.asarray(used)
