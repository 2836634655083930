"""Loops without a closed-form solution: Newton's iteration on the generated constraints.

The configuration z holds the actuated coordinates and the unknowns u; the constraint c(z) is zero
where the loops close. From the reference configuration the actuated coordinates go to their values
along a straight line, and u follows:

    c_u du = -c_a da          a step along the tangent
    c_u du = -c               Newton's iteration back onto it, least squares where redundant

A step is halved where the iteration does not contract, so that u stays on its branch. The
continuation fails where c_u loses rank, at a singularity of type 2.

Source:
    Allgower and Georg, Introduction to Numerical Continuation Methods, 2003, ch. 2; Deuflhard,
    Newton Methods for Nonlinear Problems, 2011, 2.1 (the test of contraction).
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..call._call import Function
from ..call.capabilities import needs
from ..call.guard import describe
from ..contract.facts import Argument, Coordinate, Manifest
from ..errors import InputTypeError, OutOfReachError, ShapeError
from ..tolerances import (
    CLOSED,
    CONTRACTION,
    POLISHED,
    SETTLED_STEP,
    SHORTEST_STRIDE,
    STRIDE,
)

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_ITERATIONS = 8
_STEPS = 2000

Compute = Callable[[FloatArray], FloatArray]
"""From q (N, n) to a result (N, ...)."""


class Continuation(NamedTuple):
    """Configurations that were followed from the reference.

    Attributes:
        z: (..., n_z) configurations, NaN where the continuation did not converge.
        valid: (...,) whether it converged, to a residual of 1e-12.
        residual: (...,) largest entry of the constraint [m, rad].
    """

    z: FloatArray
    valid: BoolArray
    residual: FloatArray

    @property
    def n_failed(self) -> int:
        """The number of poses that were not reached."""
        return int(np.size(self.valid) - np.count_nonzero(self.valid))


class LoopContinuation:
    """The constraints of a robot and the reference configuration of their continuation."""

    def __init__(self, manifest: Manifest, functions: Mapping[str, Function[Any]]) -> None:
        """Stores the constraints of a robot whose loops are solved by iteration.

        Args:
            manifest: With reference and actuated_in_z.
            functions: Its functions; the constraint and its derivative among them.
        """
        loops = manifest.loops
        assert loops.reference
        constraint = manifest.with_role("constraint", "configuration")
        derivative = manifest.with_role("constraint derivative", "configuration")
        assert constraint
        assert derivative
        self.constraint, self.constraint_D_z = (
            functions[constraint.name],
            functions[derivative.name],
        )
        self.n_z = len(loops.configuration)
        self.actuated = np.array([item.index for item in loops.actuated_in_z])
        self.ratio = np.array([item.ratio for item in loops.actuated_in_z])
        self.unknown = np.setdiff1d(np.arange(self.n_z), self.actuated)
        self.q, self.z = np.array(loops.reference.q), np.array(loops.reference.z)

    def follow(self, q: FloatArray) -> Continuation:
        """The configurations (N, n_z) at actuated coordinates (N, n)."""
        n = len(q)
        z = np.tile(self.z, (n, 1))
        z[:, self.actuated] = self.q * self.ratio
        done, part = np.zeros(n), np.ones(n)
        way = (q - self.q) * self.ratio
        going = np.asarray(np.isfinite(q).all(-1))
        if n:
            # The passive part of the reference is an approximation.
            start, begun = self._corrected(z[:1], np.ones(1, bool))
            z[:] = start
            going &= begun[0]
        for _ in range(_STEPS):
            rows = np.flatnonzero(going & (done < 1))
            if not len(rows):
                break
            tangent = -self.solved(z[rows], self._actuated_columns(z[rows]) @ way[rows, :, None])
            fastest = np.abs(tangent).max((-2, -1), initial=0.0)
            with np.errstate(divide="ignore"):
                step = np.minimum(np.minimum(part[rows], 1 - done[rows]), STRIDE / fastest)
            start = z[rows]
            start[:, self.unknown] += step[:, None] * tangent[..., 0]
            start[:, self.actuated] = self.q * self.ratio + (done[rows] + step)[:, None] * way[rows]
            end, converged = self._corrected(start, np.asarray(np.isfinite(start).all(-1)))
            z[rows[converged]] = end[converged]
            done[rows[converged]] += step[converged]
            # A rest of the way that is rounding counts as done.
            done[done > 1 - SHORTEST_STRIDE**2] = 1
            part[rows] = np.where(converged, 2 * step, step / 2)
            # The last step may be shorter than the shortest stride.
            going[rows] = (part[rows] >= SHORTEST_STRIDE) | (done[rows] == 1)
        residual = self.residual(z)
        valid = going & (done == 1) & (residual <= CLOSED)
        z[~valid] = np.nan
        return Continuation(z, valid, residual)

    def residual(self, z: FloatArray) -> FloatArray:
        """Largest entry of the constraint."""
        return np.asarray(np.abs(self.constraint(z)).max(-1, initial=0.0))

    def z_D_q(self, z: FloatArray) -> FloatArray:
        """(N, n_z, n) derivative of the configuration by the actuated coordinates."""
        result = np.zeros((len(z), self.n_z, len(self.actuated)))
        result[:, self.actuated] = np.diag(self.ratio)
        by_actuated = -self.solved(z, self._actuated_columns(z))
        result[:, self.unknown] = by_actuated * self.ratio
        return result

    def solved(self, z: FloatArray, right: FloatArray) -> FloatArray:
        """Least squares c_u x = right; NaN where z is not finite."""
        J = self.constraint_D_z(z)[..., self.unknown]
        sound = np.isfinite(J).all((-2, -1)) & np.isfinite(right).all((-2, -1))
        x = np.full((len(z), J.shape[-1], right.shape[-1]), np.nan)
        x[sound] = _least_squares(J[sound], right[sound])
        return x

    def _actuated_columns(self, z: FloatArray) -> FloatArray:
        return np.asarray(self.constraint_D_z(z)[..., self.actuated])

    def _corrected(self, z: FloatArray, going: BoolArray) -> tuple[FloatArray, BoolArray]:
        """Newton's iteration on the unknowns, and whether it converged."""
        z, going = z.copy(), going.copy()
        last, converged = np.full(len(z), np.inf), np.zeros(len(z), bool)
        for _ in range(_ITERATIONS):
            rows = np.flatnonzero(going & ~converged)
            if not len(rows):
                break
            c = self.constraint(z[rows])
            change = self.solved(z[rows], c[..., None])[..., 0]
            size = np.abs(change).max(-1, initial=0.0)
            z[rows[:, None], self.unknown] -= change
            error = np.abs(c).max(-1, initial=0.0)
            converged[rows] = (error <= POLISHED) | (size <= SETTLED_STEP)
            # A comparison that is false for NaN, which does not contract.
            going[rows] = converged[rows] | (size <= CONTRACTION * last[rows])
            last[rows] = size
        return z, going & converged


def _least_squares(J: FloatArray, right: FloatArray) -> FloatArray:
    if J.shape[-2] != J.shape[-1]:
        Q, R = np.linalg.qr(J)
        J, right = R, np.swapaxes(Q, -1, -2) @ right
    try:
        return np.asarray(np.linalg.solve(J, right))
    except np.linalg.LinAlgError:
        # A matrix of the batch is singular.
        return np.asarray(np.linalg.pinv(J) @ right)


class IteratedFunction:
    """A function of actuated coordinates, computed by Newton's iteration.

    It is called in the same way as generated functions: leading dimensions broadcast, `out=` takes
    the array to write into, a single pose without a configuration raises, and a batch holds NaN.
    `threads=` is accepted without effect.
    """

    def __init__(
        self,
        label: str,
        coordinates: Sequence[Coordinate],
        output: Argument,
        compute: Compute,
        reduced: tuple[Any, ...],
    ) -> None:
        """Stores the definition of the function.

        Args:
            label: Robot and function.
            coordinates: The elements of q.
            output: Name, shape, unit and meaning of the result.
            compute: From q (N, n) to the result (N, *shape), NaN where there is none.
            reduced: The value of `__reduce__`.
        """
        unit = " or ".join(dict.fromkeys(c.unit for c in coordinates))
        q = Argument("q", (len(coordinates),), unit, "actuated coordinates")
        self.inputs, self.outputs = (q,), (output,)
        self.__qualname__, self.__name__ = label, label.rpartition(".")[2]
        self._coordinates, self._compute, self._reduced = coordinates, compute, reduced
        kind = inspect.Parameter
        self.__signature__ = inspect.Signature(
            [
                kind("q", kind.POSITIONAL_OR_KEYWORD),
                kind("out", kind.KEYWORD_ONLY, default=None),
                kind("threads", kind.KEYWORD_ONLY, default=1),
            ]
        )
        shape = ", ".join(["...", *map(str, output.shape)])
        self.__doc__ = f"""{output.meaning}, by Newton's iteration on the generated constraints.

The solution is followed from the reference configuration along the straight line in q.

Args:
    q: (..., {len(coordinates)}) [{unit}] actuated coordinates
    out: The array to write into; float64, of the shape of the result.
    threads: Without effect.

Returns:
    {output.name}: ({shape}) [{output.unit}] {output.meaning}

Raises:
    OutOfReachError: A single pose is not reached; in a batch, and in out, it is NaN.
"""

    def __call__(
        self, q: ArrayLike, *, out: FloatArray | None = None, threads: int | str | None = 1
    ) -> FloatArray:
        """Computes the function; see its own help."""
        del threads
        given = _read(self.__qualname__, self.inputs[0], q)
        batch = given.shape[:-1]
        found = self._compute(given.reshape(-1, given.shape[-1]))
        result = found.reshape(*batch, *self.outputs[0].shape)
        if out is not None:
            self._check_out(out, result.shape)
            out[...] = result
            result = out
        if not batch and np.isfinite(given).all() and not np.isfinite(found).all():
            raise OutOfReachError(
                f"{self.__qualname__}: Newton's iteration does not lead from the reference "
                f"configuration to {describe(self._coordinates, given)}: the loops do not close "
                "there, or a singularity is on the way"
            )
        return result

    def __repr__(self) -> str:
        """In the form of a generated function."""
        return f"<chasles function {self.__qualname__}{self.__signature__}, iterated>"

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickles in the form of a generated function."""
        return self._reduced

    def _check_out(self, out: FloatArray, shape: tuple[int, ...]) -> None:
        label, name = self.__qualname__, self.outputs[0].name
        if not isinstance(out, np.ndarray) or out.dtype != np.float64 or not out.flags.writeable:
            raise InputTypeError(f"{label}: out for {name} must be a writable float64 array")
        if out.shape != shape:
            raise ShapeError(
                f"{label}: out for {name} must have shape {shape}, got shape {out.shape}"
            )


class NewtonMethods:
    """The methods of a robot whose loops have no closed-form solution."""

    name: str
    n: int
    functions: Mapping[str, Function[Any]]
    _loops: LoopContinuation
    _is_iterated: bool

    @needs("constraint", "constraint_D_z", when=lambda robot: robot._is_iterated)
    def follow(self, q: ArrayLike) -> Continuation:
        """Configurations at actuated coordinates, by Newton's iteration on the constraints.

        Args:
            q: (..., n) actuated coordinates [rad or m].

        Returns:
            `z (..., n_z)`, `valid (...,)` and `residual (...,)`, and `n_failed`, the number of
            poses that were not reached from the reference configuration along the straight line in
            q. They raise no error.
        """
        given = _read(f"{self.name}.follow", self.functions["configuration"].inputs[0], q)
        z, valid, residual = self._loops.follow(given.reshape(-1, self.n))
        batch = given.shape[:-1]
        return Continuation(z.reshape(*batch, -1), valid.reshape(batch), residual.reshape(batch))


def _read(label: str, argument: Any, value: ArrayLike) -> FloatArray:
    try:
        array = np.asarray(value)
    except (TypeError, ValueError) as error:
        raise InputTypeError(
            f"{label}: {argument.name} cannot be read as an array of numbers: {error}"
        ) from error
    if array.dtype.kind not in "iuf":
        raise InputTypeError(
            f"{label}: {argument.name} must hold real numbers, got dtype {array.dtype}"
        )
    (size,) = argument.shape
    if array.shape[-1:] != argument.shape:
        raise ShapeError(
            f"{label}: {argument.name} must end in {size} values (shape (..., {size})), got shape "
            f"{array.shape}"
        )
    return array.astype(np.float64)


def functions(
    manifest: Manifest,
    generated: Mapping[str, Function[Any]],
    reduced: Callable[[str], tuple[Any, ...]],
) -> tuple[LoopContinuation, dict[str, Any]]:
    """The functions of actuated coordinates of a robot without a closed-form solution.

    Args:
        manifest: The robot's manifest.
        generated: Its generated functions.
        reduced: From a function's name to the value of its `__reduce__`.

    Returns:
        Its loops; and `configuration`, `chain`, `passive` with their derivatives by q, and each
        function of actuated coordinates that a generated function of the chain stands for.
    """
    info = manifest.loops
    loops = LoopContinuation(manifest, generated)
    names = [variable.name for variable in info.configuration]
    chain = [names.index(joint.name) for joint in info.chain]
    passive = [names.index(joint.name) for joint in info.passive]
    n = len(manifest.coordinates)

    def picked(rows: Sequence[int]) -> Compute:
        return lambda q: loops.follow(q).z[:, rows]

    def slopes(rows: Sequence[int]) -> Compute:
        return lambda q: loops.z_D_q(loops.follow(q).z)[:, rows]

    def after_chain(function: Function[Any]) -> Compute:
        return lambda q: function(loops.follow(q).z[:, chain])

    def by_q(jacobian: Function[Any]) -> Compute:
        def product(q: FloatArray) -> FloatArray:
            z = loops.follow(q).z
            return np.asarray(jacobian(z[:, chain]) @ loops.z_D_q(z)[:, chain])

        return product

    offered: dict[str, tuple[Argument, Compute]] = {}
    groups = [
        (
            "configuration",
            "z",
            list(range(len(names))),
            "Configuration, all variables of the loops",
        ),
        ("chain", "theta", chain, "Joints of the main chain"),
        ("passive", "passive", passive, "Passive joints"),
    ]
    for name, symbol, rows, meaning in groups:
        if rows:
            value = Argument(symbol, (len(rows),), "rad or m", meaning)
            slope = Argument("D", (len(rows), n), "1, m or 1/m", f"{meaning}: derivative by q")
            offered[name] = value, picked(rows)
            offered[f"{name}_D_q"] = slope, slopes(rows)
    for of_chain in manifest.functions:
        if not of_chain.of_actuators:
            continue
        function = generated[of_chain.name]
        value = _described(function)
        offered[of_chain.of_actuators] = (
            (replace(value, shape=(6, n)), by_q(function))
            if of_chain.role == "jacobian"
            else (value, after_chain(function))
        )
    return loops, {
        name: IteratedFunction(
            f"{manifest.name}.{name}", manifest.coordinates, output, compute, reduced(name)
        )
        for name, (output, compute) in offered.items()
    }


def _described(function: Function[Any]) -> Argument:
    (output,) = function.outputs
    summary = (function.__doc__ or "").partition("\n")[0].rstrip(".")
    return Argument(output.name, output.shape, output.unit, summary)
