"""Select the configurations that determine the parameters best.

Let B_i be the derivative of the measurements at configuration i with respect to the parameters.
Each row of the derivative B_i is divided by the standard deviation of the measured value. The
covariance of the identified parameters is the inverse of the information matrix A = sum B_i^T B_i.
A D-optimal design maximizes the determinant of the information matrix A. For k parameters and
`count` configurations, a D-optimal design also maximizes the observability index O1 = det(A)^(1/2k)
/ sqrt(count). The search for a D-optimal design first adds configurations one by one. The search
then replaces selected configurations by candidates until no replacement increases the determinant
of A.

Source:
    V. V. Fedorov, Theory of Optimal Experiments, 1972, for the exchange of configurations; J. H.
    Borm, C. H. Menq, Determination of optimal measurement configurations for robot calibration
    based on observability measure, International Journal of Robotics Research 10 (1991), for O1.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, Robot, ShapeError
from chasles.arrays import real_array
from chasles.contract import check_type, requires
from chasles.summaries import short_repr

from ..study.arguments import above_0, finite, integer_at_least
from ..study.results import StudyResult
from .fitting.problem import in_one_thread, problem_at
from .measurements.tool_measurements import SMALL, Measurements, Poses, Positions, Start
from .parameters import GEOMETRY

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_PRIOR = 1e-6
"""Weight of a prior that keeps the information matrix A invertible while few configurations are
selected."""
_PASSES = 20
"""Maximum number of passes of the exchange search over the selected configurations."""
_GAIN = 1e-9
"""The search exchanges a configuration only if log det(A) of the information matrix A increases by
more than this value."""
_NEXT = 10


@dataclass(frozen=True, eq=False)
class Design(StudyResult):
    """Selected configurations and the expected accuracy of a calibration with them.

    Attributes:
        indices: (count,) row indices of the selected configurations in the candidates.
        q: (count, n) coordinates of the selected configurations [rad or m].
        names: Names of the identifiable parameters and unknowns.
        std: Standard deviation of each parameter and unknown [m, rad, 1].
        observability: The observability index O1, with parameters in units of 1 mm and 1 mrad.
        tool_error: Root mean square tool position error that measurement noise causes, over all
            candidates [m].
        tool_error_with_more: `tool_error` with up to ten further configurations [m].
    """

    indices: NDArray[np.intp]
    q: FloatArray
    names: tuple[str, ...]
    std: FloatArray
    observability: float
    tool_error: float
    tool_error_with_more: float

    __repr__ = short_repr

    def plot(self, ax: Any = None) -> Any:
        """Plot the largest standard deviations of parameters on a logarithmic axis.

        Args:
            ax: matplotlib axes, or None for a new figure 8 cm wide.

        Returns:
            The axes.
        """
        with requires("chasles[calibration]"):
            from .report.plots import plot_deviations  # noqa: PLC0415

        return plot_deviations(self, ax)


@in_one_thread
def optimal_design(
    robot: Robot,
    candidates: ArrayLike,
    count: int,
    *,
    targets: ArrayLike | None = None,
    sigma: float | tuple[float, float] | None = None,
    vary: str | Collection[str] = GEOMETRY,
    is_allowed: Callable[[FloatArray], ArrayLike] | None = None,
) -> Design:
    """Select the configurations whose measurements determine the parameters of a robot best.

    Args:
        robot: A robot with parametric functions, as returned by `chasles.load(name,
            parametric=True)`.
        candidates: (M, n) actuated coordinates of the possible configurations [rad or m]. Rows
            beyond the limits or with NaN are ignored.
        count: Number of configurations to select, an int.
        targets: (m, 3) positions in the tool frame of the targets to measure [m]. None means that
            tool poses are measured.
        sigma: Standard deviation of each measured position coordinate [m]. If `targets` is None,
            `sigma` is a tuple (position [m], orientation [rad]). None means 1e-3 for each value.
        vary: One or several names of parameters or parameter groups, as in `identify`. All other
            parameters keep their nominal values.
        is_allowed: Function that takes `candidates` (M, n) and returns booleans (M,), such as False
            for a collision. If `is_allowed` is None, all candidates within the limits are allowed.

    Returns:
        A `Design`. `indices` (count,) are the indices of the selected configurations in
        `candidates`. `q` (count, n) contains the coordinates of the selected configurations [rad or
        m]. `names` and `std` contain the names and expected standard deviations of the identifiable
        parameters and unknowns [m, rad, 1]. `tool_error` is the expected root mean square tool
        position error of the calibrated robot [m]. `tool_error_with_more` is the expected tool
        position error with up to ten further configurations [m].

    Raises:
        MissingFunctionError: The robot has no parametric functions.
        InputTypeError: `robot` is not a `Robot`, or `candidates` or `targets` contains values that
            are not real numbers.
        ShapeError: `candidates` is not (M, n), `targets` is not (m, 3), or the result of
            `is_allowed` is not (M,).
        InputValueError: `count` is not an integer of at least 1. Fewer than `count` candidates are
            allowed, or `count` configurations have too few measured values to identify all
            parameters. `vary` names an unknown parameter or group. `sigma` is a number although
            `targets` is None, or a tuple although `targets` is an array, or contains a number that
            is not above 0. `targets` contains a number that is not finite.
    """
    check_type("optimal_design: robot", robot, Robot)
    count = integer_at_least("optimal_design: count", count, 1)
    at = real_array("optimal_design", "candidates", candidates)
    if at.shape[1:] != (robot.n,):
        raise ShapeError(
            f"optimal_design: candidates: expected shape (M, {robot.n}), got {at.shape}"
        )
    free = ((at >= robot.lower) & (at <= robot.upper)).all(-1)
    if is_allowed is not None:
        allowed = np.asarray(is_allowed(at), dtype=bool)
        if allowed.shape != free.shape:
            raise ShapeError(
                f"optimal_design: is_allowed: expected {len(at)} booleans, got {allowed.shape}"
            )
        free &= allowed
    index = np.flatnonzero(free)
    if len(index) < count:
        raise InputValueError(
            f"optimal_design: expected at least {count} allowed candidates within limits, got "
            f"{len(index)} of {len(at)}"
        )
    B, tool, names = _derivatives(robot, at[index], targets, sigma, vary)
    if count * B.shape[1] <= len(names):
        raise InputValueError(
            f"optimal_design: select more configurations; {count} configurations have "
            f"{count * B.shape[1]} measured values for {len(names)} variables"
        )
    search = _Exchange(B)
    chosen = search.best(count)
    more = search.extended(chosen, min(_NEXT, len(index) - count))
    A = search.information(chosen)
    covariance = np.asarray(np.linalg.inv(A))
    return Design(
        index[chosen],
        at[index[chosen]],
        names,
        SMALL * np.sqrt(np.diag(covariance)),
        float(np.exp(np.linalg.slogdet(A)[1] / (2 * len(names))) / np.sqrt(count)),
        _tool_error(tool, covariance),
        _tool_error(tool, np.asarray(np.linalg.inv(search.information(more)))),
    )


def _derivatives(
    robot: Robot,
    q: FloatArray,
    targets: ArrayLike | None,
    sigma: float | tuple[float, float] | None,
    vary: str | Collection[str],
) -> tuple[FloatArray, FloatArray, tuple[str, ...]]:
    """Return derivatives of measurements (M, r, k) and tool positions (M, 3, k), and names.

    Each of the M candidates has r measured values. The derivatives are with respect to k variables,
    whose names are also returned.
    """
    measurements: Measurements
    if targets is None:
        pair = (SMALL, SMALL) if sigma is None else sigma
        if not isinstance(pair, tuple):
            raise InputValueError(
                "optimal_design: poses need two standard deviations, (meters, radians)"
            )
        position, angle = (above_0("optimal_design: sigma", value) for value in pair)
        measurements, unknowns = Poses(robot.fk(q), (position, angle)), np.zeros(0)
    else:
        points = np.atleast_2d(finite("optimal_design: targets", targets))
        if points.shape[1:] != (3,):
            raise ShapeError(f"optimal_design: targets: expected (m, 3), got {points.shape}")
        one = SMALL if sigma is None else sigma
        if isinstance(one, tuple):
            raise InputValueError("optimal_design: positions need one standard deviation (meters)")
        one = above_0("optimal_design: sigma", one)
        measurements, unknowns = Positions(np.zeros((len(q), *points.shape)), one), points.ravel()
    problem = problem_at(robot, q, Start(np.eye(4), unknowns, measurements, 0.0), vary)
    B = problem.derivative(problem.x0) * SMALL
    tool = robot.identification_jacobian(q, problem.start_geometry)[:, :3, problem.sought] * SMALL
    targets = np.zeros((len(q), 3, len(problem.open_unknowns)))
    return (
        B.reshape(len(q), -1, B.shape[-1]),
        np.concatenate([tool, targets], -1),
        problem.names,
    )


class _Exchange:
    """Search for the configurations that maximize the determinant of the information matrix A."""

    def __init__(self, B: FloatArray) -> None:
        self.B = B
        total_information = np.einsum("mrk,mrl->kl", B, B)
        self.prior = _PRIOR * np.diag(np.diag(total_information)) / len(B)

    def information(self, chosen: NDArray[np.intp]) -> FloatArray:
        """Return the information matrix A of the selected configurations, without the prior."""
        B = self.B[chosen].reshape(-1, self.B.shape[-1])
        return np.asarray(B.T @ B)

    def best(self, count: int) -> NDArray[np.intp]:
        """Return indices of `count` candidates, found by adding and exchanging candidates."""
        chosen = list(self.extended(np.zeros(0, dtype=np.intp), count))
        for _ in range(_PASSES):
            exchanged = False
            for k in range(count):
                others = np.array([c for i, c in enumerate(chosen) if i != k], dtype=np.intp)
                gains = self._gains(others)
                found = int(np.argmax(gains))
                if gains[found] > gains[chosen[k]] + _GAIN:
                    chosen[k], exchanged = found, True
            if not exchanged:
                break
        return np.array(chosen, dtype=np.intp)

    def extended(self, chosen: NDArray[np.intp], more: int) -> NDArray[np.intp]:
        """Add `more` candidates to the selected configurations, the best candidate in each step."""
        for _ in range(more):
            chosen = np.append(chosen, np.argmax(self._gains(chosen)))
        return chosen

    def _gains(self, chosen: NDArray[np.intp]) -> FloatArray:
        """Return the increase (M,) of log det(A) that adding each of the M candidates would cause.

        The increase of log det(A) is -inf for candidates that are already selected.
        """
        C = np.linalg.inv(self.information(chosen) + self.prior)
        r = self.B.shape[1]
        inner = np.eye(r) + (self.B @ C) @ self.B.swapaxes(-1, -2)
        gains = np.linalg.slogdet(inner)[1]
        gains[chosen] = -np.inf
        return np.asarray(gains)


def _tool_error(tool: FloatArray, covariance: FloatArray) -> float:
    squares = np.einsum("mik,kl,mil->m", tool, covariance, tool)
    return float(np.sqrt(squares.mean()))
