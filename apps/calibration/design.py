"""Select the configurations that determine the parameters best.

B_i is the derivative of the measurements at configuration i with respect to the parameters. Each
row of B_i is divided by the standard deviation of its measurement. The covariance of the parameters
is the inverse of A = sum B_i^T B_i. A D-optimal design maximizes det(A), and therefore also the
observability index O1 = det(A)^(1/2k) / sqrt(count). Here, k is the number of parameters, and count
is the number of configurations. The search adds configurations one by one. The search then replaces
selected configurations by candidates until no replacement increases the determinant of A.

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

from ..study.arguments import finite
from ..study.results import StudyResult
from .fitting.problem import in_one_thread, problem_at
from .measurements.tool_measurements import SMALL, Measurements, Poses, Positions, Start
from .parameters import GEOMETRY

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_PRIOR = 1e-6
"""Prior weight that keeps A invertible while few configurations are selected."""
_PASSES = 20
"""Maximum number of passes over the selected configurations."""
_GAIN = 1e-9
"""The search exchanges a configuration only if log det(A) increases by at least this value."""
_NEXT = 10


@dataclass(frozen=True, eq=False)
class Design(StudyResult):
    """Selected configurations and the expected accuracy of the parameters.

    Attributes:
        indices: Indices of the selected configurations in the array of candidates.
        q: (count, n) coordinates [rad or m].
        names: Names of the identifiable parameters and unknowns.
        std: Standard deviation of each parameter and unknown [m, rad, 1].
        observability: The observability index O1, with variables in units of 1 mm and 1 mrad.
        tool_error: Root mean square of the tool position errors over all candidates [m]. These
            errors result from measurement noise.
        tool_error_with_more: Expected tool error with ten additional configurations [m].
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
    """Select the candidate configurations that determine the parameters of a robot best.

    Args:
        robot: A robot with parametric functions, as returned by `chasles.load(name,
            parametric=True)`.
        candidates: (M, n) actuated coordinates [rad or m]. Candidates beyond the limits or with NaN
            are ignored.
        count: Number of configurations to select, an int.
        targets: (m, 3) positions of the measured targets in the tool frame [m], or None if poses
            are measured.
        sigma: Standard deviation of each measured position coordinate [m]. For poses, sigma is a
            tuple (position [m], orientation [rad]). None means 1e-3 for each.
        vary: Names of parameters or parameter groups; only these parameters may differ from their
            nominal values. The argument `vary` of `identify` lists the groups and explains the
            default "geometry".
        is_allowed: Function that takes the candidates (M, n) and returns booleans (M,), for example
            False for a collision. None allows all candidates within the limits.

    Returns:
        A `Design`. `indices` (count,) are the indices of the selected configurations in
        `candidates`. `q` (count, n) contains their coordinates [rad or m]. `names` and `std`
        contain the names and the expected standard deviations of the identifiable parameters and
        unknowns [m, rad, 1]. `tool_error` is the expected root mean square tool position error [m].
        `tool_error_with_more` is the same error with up to ten further configurations.

    Raises:
        MissingFunctionError: The robot has no parametric functions.
        InputTypeError: `robot` is not a `Robot`, or `candidates` or `targets` contains values that
            are not real numbers.
        TypeError: `count` is not an int.
        ShapeError: `candidates` is not (M, n), or `targets` is not (m, 3).
        ValueError: `is_allowed` does not return (M,) booleans.
        InputValueError: Fewer than `count` candidates are allowed, or `count` configurations have
            too few measured values for the variables. A name is not a parameter or a group. `sigma`
            is a number for poses, or a tuple for positions. A number in `targets` is not finite.
    """
    check_type("optimal_design: robot", robot, Robot)
    at = real_array("optimal_design", "candidates", candidates)
    if at.shape[1:] != (robot.n,):
        raise ShapeError(f"optimal_design: candidates: expected (M, {robot.n}), got {at.shape}")
    free = ((at >= robot.lower) & (at <= robot.upper)).all(-1)
    if is_allowed is not None:
        free &= np.asarray(is_allowed(at), dtype=bool)
    index = np.flatnonzero(free)
    if len(index) < count:
        raise InputValueError(
            f"optimal_design: {len(index)} of {len(at)} candidates are within limits and "
            f"allowed; expected at least {count}"
        )
    B, tool, names = _derivatives(robot, at[index], targets, sigma, vary)
    if count * B.shape[1] <= len(names):
        raise InputValueError(
            f"optimal_design: {count} configurations have {count * B.shape[1]} measured values for "
            f"{len(names)} variables; select more configurations"
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
    """Return (measurement derivatives (M, r, k), tool position derivatives (M, 3, k), names)."""
    measurements: Measurements
    if targets is None:
        pair = (SMALL, SMALL) if sigma is None else sigma
        if not isinstance(pair, tuple):
            raise InputValueError(
                "optimal_design: poses need two standard deviations, (meters, radians)"
            )
        measurements, unknowns = Poses(robot.fk(q), pair), np.zeros(0)
    else:
        points = np.atleast_2d(finite("optimal_design: targets", targets))
        if points.shape[1:] != (3,):
            raise ShapeError(f"optimal_design: targets: expected (m, 3), got {points.shape}")
        one = SMALL if sigma is None else sigma
        if isinstance(one, tuple):
            raise InputValueError("optimal_design: positions need one standard deviation (meters)")
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
    """Search for the configurations that maximize det(A)."""

    def __init__(self, B: FloatArray) -> None:
        self.B = B
        total_information = np.einsum("mrk,mrl->kl", B, B)
        self.prior = _PRIOR * np.diag(np.diag(total_information)) / len(B)

    def information(self, chosen: NDArray[np.intp]) -> FloatArray:
        """Return the information matrix A of the selected configurations, without the prior."""
        B = self.B[chosen].reshape(-1, self.B.shape[-1])
        return np.asarray(B.T @ B)

    def best(self, count: int) -> NDArray[np.intp]:
        """Return the best configurations found by adding and exchanging configurations."""
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
        """Add the best candidates to the selected configurations."""
        for _ in range(more):
            chosen = np.append(chosen, np.argmax(self._gains(chosen)))
        return chosen

    def _gains(self, chosen: NDArray[np.intp]) -> FloatArray:
        """Return the increase (M,) of log det(A) that each candidate would cause.

        The increase is -inf for candidates that are already selected.
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
