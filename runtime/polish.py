"""Newton's iteration on forward kinematics: from an answer nearby to the exact one.

The inverse of a calibrated arm is that of a nominal arm, whose axes meet or are parallel as they
should be; the true arm is some millimetres off, and a few steps away:

    (J J^T + lambda^2 1) y = e,  dq = J^T y      e the twist from the tool to the pose

with J the Jacobian at the tip in base axes and lambda^2 = |e|^2, which damps the steps near a
singularity and vanishes with the error, so that convergence stays quadratic. Arms of fewer than six
joints take the same step from the other side, dq = (J^T J + lambda^2 1)^-1 J^T e.

Source:
    Nakamura and Hanafusa, Inverse kinematic solutions with singularity robustness, 1986; Sugihara,
    Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method, 2011 (damping by
    the squared error).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._call import Function
from .errors import InputError, ShapeError
from .manifest import Manifest
from .solutions import Solutions, solutions_of

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

_STEPS = 6
"""From an arm 5 mm off it takes three or four, doubling the digits each time."""
_POLISHED = 1e-14
"""Residual (metre, radian) at which there is nothing left to gain."""
_DAMPING = 1.0
"""lambda^2 by the squared error."""
_NUDGED_DAMPING = 0.01
"""The same for a start beside a singularity, where the error is large because it was put there."""
_LEAST_DAMPING = 1e-14
"""lambda^2 at the least: J J^T is known to 1e-16, and may be singular."""
_LONGEST_STEP = 0.3
"""Metres or radians that a coordinate may go in a step: further away is another branch."""
_NEAR = 0.05
"""Residual (metre, radian) of a nominal arm up to which the true one might reach the pose."""
_NUDGE = 0.1
"""Radians off a singularity: a stretched elbow bends by this where some millimetres are missing."""
_BLOCK = 4096
"""Rows that are iterated at a time: what is computed of them stays in the processor's cache."""


class HasJacobian(Protocol):
    """A robot with its pose and Jacobian in one call."""

    @property
    def fk_jacobian_mixed(self) -> Function[tuple[FloatArray, FloatArray]]:
        """From q (..., n) to T (..., 4, 4) and J (..., 6, n) at the tip in base axes."""


class Polished(NamedTuple):
    """Where the iteration came to.

    Attributes:
        q: (..., n) coordinates [rad or m]; NaN where a number given is not finite.
        residual: (...,) the larger of distance [m] and angle [rad] from the pose.
    """

    q: FloatArray
    residual: FloatArray


def polish(robot: HasJacobian, T: ArrayLike, q: ArrayLike) -> Polished:
    """Moves coordinates to where the tool is at a pose, in at most six steps.

    Nothing tells whether it came to the branch that it began on; none that begins some millimetres
    away from a solution, off singularities, leaves it. What comes nearest on the way is kept, so
    that the residual is never larger than it was: out of reach that is an answer near to the least
    one.

    Args:
        robot: The robot.
        T: (..., 4, 4) poses of the tool in the base frame; `T[..., None, :, :]` where each has k
            slots of q.
        q: (..., n) where to begin [rad or m]; leading dimensions broadcast.

    Returns:
        `q (..., n)` and `residual (...,)`.

    Raises:
        ShapeError: If a shape is wrong, or the leading dimensions do not broadcast.
    """
    return _polish(robot.fk_jacobian_mixed, T, q, (), _DAMPING)


def _polish(
    fk_jacobian: Function[tuple[FloatArray, FloatArray]],
    T: ArrayLike,
    q: ArrayLike,
    fixed: Sequence[int],
    damping: float,
) -> Polished:
    """As polish, but for coordinates that do not move."""
    poses, start = np.asarray(T, np.float64), np.asarray(q, np.float64)
    n = fk_jacobian.inputs[0].shape[0]
    if poses.shape[-2:] != (4, 4) or start.shape[-1:] != (n,):
        raise ShapeError(
            f"polish: expected poses (..., 4, 4) and coordinates (..., {n}), got shapes "
            f"{poses.shape} and {start.shape}"
        )
    try:
        batch = np.broadcast_shapes(poses.shape[:-2], start.shape[:-1])
    except ValueError:
        raise ShapeError(
            f"polish: leading dimensions do not broadcast: {poses.shape[:-2]} of T and "
            f"{start.shape[:-1]} of q"
        ) from None
    # Poses are looked up rather than repeated for every slot.
    of_pose = np.arange(poses[..., 0, 0].size).reshape(poses.shape[:-2])
    row = np.broadcast_to(of_pose, batch).reshape(-1)
    poses = poses.reshape(-1, 4, 4)
    found = np.array(np.broadcast_to(start, (*batch, n))).reshape(-1, n)
    residual = np.empty(len(found))
    for first in range(0, len(found), _BLOCK):
        block = slice(first, first + _BLOCK)
        residual[block] = _iterate(fk_jacobian, poses[row[block]], found[block], fixed, damping)
    return Polished(found.reshape(*batch, n), residual.reshape(batch)[()])


def _iterate(
    fk_jacobian: Function[tuple[FloatArray, FloatArray]],
    T: FloatArray,
    q: FloatArray,
    fixed: Sequence[int],
    damping: float,
) -> FloatArray:
    """Moves q (N, n) in place; the residuals (N,)."""
    least = np.full(len(q), np.inf)
    here, active = q.copy(), np.arange(len(q))
    for step in range(_STEPS + 1):
        pose, J = fk_jacobian(here)
        with np.errstate(invalid="ignore", over="ignore"):
            error, residual = _twist(pose, T)
        better = residual < least[active]
        least[active[better]], q[active[better]] = residual[better], here[better]
        going = (residual > _POLISHED) & np.isfinite(residual)
        if step == _STEPS or not going.any():
            break
        if not going.all():
            active, here, T, J = active[going], here[going], T[going], J[going]
            error = error[:, going]
        J[..., fixed] = 0.0
        here = here + _step(J, error, damping)
    # Nothing was compared with NaN.
    lost = np.isinf(least)
    q[lost], least[lost] = np.nan, np.nan
    return least


def _twist(here: FloatArray, there: FloatArray) -> tuple[FloatArray, FloatArray]:
    """From poses (N, 4, 4) to others: (6, N), linear first, in base axes; and its size (N,).

    The angle comes of sine and cosine both, for either alone loses half of the digits somewhere.
    """
    a, b = here.transpose(1, 2, 0), there.transpose(1, 2, 0)
    linear = b[:3, 3] - a[:3, 3]
    # Twice the sine times the axis: the columns crossed, as R_there R_here^T is their product.
    sine = np.stack(
        [
            sum(a[i, k] * b[j, k] - a[j, k] * b[i, k] for k in range(3))
            for i, j in ((1, 2), (2, 0), (0, 1))
        ]
    )
    trace = np.asarray(sum(a[i, k] * b[i, k] for i in range(3) for k in range(3)))
    size = np.sqrt((sine * sine).sum(0))
    angle = np.arctan2(size, trace - 1)
    angular = sine * np.where(size > 0, angle / np.where(size > 0, size, 1.0), 0.0)
    distance = np.sqrt((linear * linear).sum(0))
    return np.concatenate([linear, angular]), np.maximum(distance, angle)


def _step(J: FloatArray, error: FloatArray, damping: float) -> FloatArray:
    """The damped step (N, n) by J (N, 6, n) against errors (6, N)."""
    rows = np.ascontiguousarray(J.transpose(1, 2, 0))
    added = np.maximum(damping * (error * error).sum(0), _LEAST_DAMPING)
    wide = rows.shape[1] >= rows.shape[0]
    if not wide:
        error = np.einsum("ikN,iN->kN", rows, error)
        rows = rows.swapaxes(0, 1)
    step = _solved(_gram(rows, added), error)
    if wide:
        step = np.einsum("ikN,iN->kN", rows, step)
    step *= _LONGEST_STEP / np.maximum(np.abs(step).max(0), _LONGEST_STEP)
    return step.T


def _gram(rows: FloatArray, added: FloatArray) -> list[list[FloatArray]]:
    """The lower half of A A^T + added, for A (m, n, N)."""
    half = [[np.einsum("kN,kN->N", a, b) for b in rows[: i + 1]] for i, a in enumerate(rows)]
    for i, row in enumerate(half):
        row[i] += added
    return half


def _solved(A: list[list[FloatArray]], right: FloatArray) -> FloatArray:
    """A x = right for symmetric positive matrices given by their lower half, A = L D L^T.

    Each operation is one on all rows: LAPACK takes ten times as long for matrices this small.
    """
    m = len(A)
    scaled: list[list[FloatArray]] = []
    inverse: list[FloatArray] = []
    x = [np.array(value) for value in right]
    for i in range(m):
        row = A[i]
        for j in range(i):
            for k in range(j):
                row[j] -= row[k] * scaled[j][k]
        factors = [row[j] * inverse[j] for j in range(i)]
        for j in range(i):
            row[i] -= row[j] * factors[j]
            x[i] -= factors[j] * x[j]
        scaled.append(factors)
        inverse.append(1 / row[i])
    for i in reversed(range(m)):
        x[i] *= inverse[i]
        for j in range(i + 1, m):
            x[i] -= scaled[j][i] * x[j]
    return np.stack(x)


class PolishedSolutions(Solutions):
    """Solutions of a calibrated arm, which began as those of a nominal arm nearby.

    Attributes:
        nominal_residual: (..., k) the residual of the nominal arm where each slot began.
        lost: (...,) of how many branches the nominal arm reaches the pose and the true one does
            not, or is not led there by the iteration.
    """

    nominal_residual: FloatArray
    lost: IntArray

    def __reduce__(self) -> tuple[Any, ...]:
        """By what its class was made of, and what is not in the tuple."""
        return *super().__reduce__(), vars(self)

    def _derived(
        self, kind: type[Any], fields: tuple[Any, ...], order: IntArray | tuple[int, ...] | None
    ) -> Any:
        derived = kind(*fields)
        derived.lost, derived.nominal_residual = self.lost, self.nominal_residual
        if isinstance(order, tuple):
            derived.lost = self.lost[order]
            derived.nominal_residual = self.nominal_residual[order]
        elif order is not None:
            derived.nominal_residual = np.take_along_axis(self.nominal_residual, order, -1)
        return derived


class PolishedInverse:
    """The inverse of a calibrated arm: that of a nominal arm, then Newton's iteration.

    It is called as the generated function is, and returns PolishedSolutions.
    """

    def __init__(
        self,
        nominal: Function[Any],
        fk_jacobian_mixed: Function[tuple[FloatArray, FloatArray]],
        solutions: type[Any],
        reduced: tuple[Any, ...],
    ) -> None:
        """Names what it rests on.

        Args:
            nominal: The generated inverse of the nominal arm.
            fk_jacobian_mixed: Of the true arm.
            solutions: The class of the result.
            reduced: How to pickle it.
        """
        self.nominal, self.fk_jacobian_mixed = nominal, fk_jacobian_mixed
        self.solutions, self._reduced = solutions, reduced
        self.inputs, self.outputs = nominal.inputs, nominal.outputs
        # Coordinates that are given beside the pose keep their values.
        names = [f"q{i + 1}" for i in range(len(solutions.coordinates))]
        self._fixed = [names.index(item.name) for item in self.inputs if item.name in names]
        self.operations, self.__signature__ = nominal.operations, nominal.__signature__
        self.__name__, self.__qualname__ = nominal.__name__, nominal.__qualname__
        self.__doc__ = f"""{nominal.__doc__}
It is that of a nominal arm nearby, brought to the true one by Newton's iteration: `residual` is of
the true arm, `nominal_residual` of the nominal one where the iteration began; `lost` counts the
branches that it did not bring there.
"""

    def __call__(
        self,
        *inputs: ArrayLike,
        out: tuple[FloatArray | None, ...] | None = None,
        threads: int | Literal["all"] | None = 1,
        **named_inputs: ArrayLike,
    ) -> PolishedSolutions:
        """Computes it, see its own help."""
        began = self.nominal(*inputs, out=out, threads=threads, **named_inputs)
        if not isinstance(began.q, np.ndarray):
            raise InputError(
                f"{self.__qualname__}: iterates on NumPy arrays, got {type(began.q).__name__}; "
                "map it over the blocks"
            )
        T = np.asarray(self.__signature__.bind(*inputs, **named_inputs).args[0], np.float64)
        nominal_residual = began.residual.copy()
        q, residual = _polish(
            self.fk_jacobian_mixed, T[..., None, :, :], began.q, self._fixed, _DAMPING
        )
        self._try_again(T, began.q, nominal_residual, q, residual)
        # In place, so that what was given as out has it too.
        began.q[...], began.residual[...] = q, residual
        found: PolishedSolutions = self.solutions.judged(*began[:3])
        found.nominal_residual = nominal_residual
        found.lost = np.asarray(began.valid & ~found.valid).sum(-1)
        return found

    def _try_again(
        self,
        T: FloatArray,
        start: FloatArray,
        nominal_residual: FloatArray,
        q: FloatArray,
        residual: FloatArray,
    ) -> None:
        """Begins beside the singularity where the iteration failed; writes to q and residual.

        A least-squares answer is singular, and no step leads off it. Slots whose branches meet
        there differ in one sign: those of an even number of signs are nudged one way, those of an
        odd number the other, to come to different sides.
        """
        failed = ~(residual <= Solutions.TOLERANCE) & (nominal_residual < _NEAR)
        *pose, slot = np.nonzero(failed)
        odd = np.array([k.bit_count() % 2 for k in range(failed.shape[-1])])
        nudge = np.where(self.solutions.wraps, _NUDGE, 0.0) * (1 - 2 * odd[slot, None])
        nudge[:, self._fixed] = 0.0
        again = _polish(
            self.fk_jacobian_mixed,
            np.broadcast_to(T, (*failed.shape[:-1], 4, 4))[tuple(pose)],
            start[failed] + nudge,
            self._fixed,
            _NUDGED_DAMPING,
        )
        better = again.residual <= Solutions.TOLERANCE
        place = tuple(index[better] for index in (*pose, slot))
        q[place], residual[place] = again.q[better], again.residual[better]

    def __repr__(self) -> str:
        """As of a generated function."""
        return f"<chasles function {self.__qualname__}{self.__signature__}, polished>"

    def __reduce__(self) -> tuple[Any, ...]:
        """As of a generated function."""
        return self._reduced


def functions(
    manifest: Manifest,
    generated: Mapping[str, Function[Any]],
    reduced: Callable[[str], tuple[Any, ...]],
) -> dict[str, Any]:
    """What a calibrated arm offers in the place of the inverse that was generated.

    Args:
        manifest: The robot's manifest.
        generated: Its generated functions.
        reduced: For a function's name, how to pickle it.

    Returns:
        `ik`, which takes a pose; a task of fewer freedoms is left as it is.
    """
    if "ik" not in generated:
        return {}
    kind = solutions_of(manifest.coordinates, manifest.wraps, PolishedSolutions)
    jacobian = generated["fk_jacobian_mixed"]
    return {"ik": PolishedInverse(generated["ik"], jacobian, kind, reduced("ik"))}
