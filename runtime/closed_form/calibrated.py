"""The inverse of calibrated arms: solutions of a nominal arm nearby, refined on the true arm.

The axes of a real arm do not quite meet, and closed forms need axes that do. Off singularities a
nominal answer is some millimetres away from a true one, and Newton's iteration leads there. Near
singularities the true answer may be anywhere, and the iteration starts from several
configurations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..call._call import Function
from ..contract.facts import Manifest
from ..errors import InputTypeError
from ..screws import exp_rotation
from ..se3 import projected
from ..tolerances import AROUND, NUDGE, SOLVED
from .polish import polish
from .solutions import Solutions, solutions_of

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.intp]

_POSES_AROUND = 40
"""Poses nearby that are tried last."""


class PolishedSolutions(Solutions):
    """Solutions of a calibrated arm, iterated from the solutions of a nominal arm nearby.

    Attributes:
        nominal_residual: (..., k) the residual of the nominal arm at the start of each slot.
        lost: (...,) number of branches on which the nominal arm reaches the pose and the true arm
            does not, or on which the iteration fails.
    """

    nominal_residual: FloatArray
    lost: IntArray

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickles the facts of its class, the tuple and the two further fields."""
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
    """The inverse of a calibrated arm: the inverse of a nominal arm, then Newton's iteration.

    It is called in the same way as the generated function, and returns PolishedSolutions.
    """

    def __init__(
        self,
        nominal: Function[Any],
        fk_jacobian_mixed: Function[tuple[FloatArray, FloatArray]],
        solutions: type[Any],
        reduced: tuple[Any, ...],
        fixed: tuple[int, ...],
        near: float,
    ) -> None:
        """Stores the functions it rests on.

        Args:
            nominal: The generated inverse of the nominal arm.
            fk_jacobian_mixed: The function ``fk_jacobian_mixed`` of the true arm.
            solutions: The class of the result.
            reduced: The value of `__reduce__`.
            fixed: Indices of the coordinates that are given beside the pose and keep their values.
            near: Residual [m, rad] of the nominal arm up to which the true one might reach the
                pose.
        """
        self.nominal, self.fk_jacobian_mixed = nominal, fk_jacobian_mixed
        self.solutions, self._reduced = solutions, reduced
        self.inputs, self.outputs = nominal.inputs, nominal.outputs
        self._fixed, self._near = fixed, near
        self.operations, self.__signature__ = nominal.operations, nominal.__signature__
        self.__name__, self.__qualname__ = nominal.__name__, nominal.__qualname__
        self.__doc__ = f"""{nominal.__doc__}
Newton's iteration leads from the inverse of a nominal arm nearby to that of the true arm:
`residual` belongs to the true arm, `nominal_residual` to the nominal arm at the start of the
iteration; `lost` counts the branches on which the iteration failed.
"""

    def __call__(
        self,
        *inputs: ArrayLike,
        out: tuple[FloatArray | None, ...] | None = None,
        threads: int | Literal["all"] | None = 1,
        **named_inputs: ArrayLike,
    ) -> PolishedSolutions:
        """Computes the inverse; see its own help."""
        began = self.nominal(*inputs, out=out, threads=threads, **named_inputs)
        if not isinstance(began.q, np.ndarray):
            raise InputTypeError(
                f"{self.__qualname__}: iterates on NumPy arrays, got {type(began.q).__name__}; "
                "map it over the blocks"
            )
        slots = began.valid.shape
        T, *given = (
            np.asarray(value, np.float64)
            for value in self.__signature__.bind(*inputs, **named_inputs).args
        )
        T = projected(self.__qualname__, T)
        T = np.broadcast_to(T[..., None, :, :], (*slots, 4, 4))
        given = [np.broadcast_to(value[..., None], slots) for value in given]
        nominal_residual = began.residual.copy()
        q, residual = self._polished(T, tuple(given), began)
        # In place, so that arrays given as out hold it too.
        began.q[...], began.residual[...] = q, residual
        found: PolishedSolutions = self.solutions.judged(*began[:3])
        found.nominal_residual = nominal_residual
        found.lost = np.asarray(began.valid & ~found.valid).sum(-1)
        return found

    def _polished(
        self, T: FloatArray, given: tuple[FloatArray, ...], began: Solutions
    ) -> tuple[FloatArray, FloatArray]:
        """Refines nominal answers on the true arm: q (..., k, n) and residual (..., k).

        Where the iteration fails, it starts again from another configuration.
        """
        q, residual = polish(self, T, began.q, self._fixed)
        near = began.residual < self._near
        for start, is_last in self._starts(T, given, began):
            failed = ~(residual <= SOLVED)
            missed = failed.all(-1, keepdims=True) & near.any(-1, keepdims=True)
            failed &= missed if is_last else missed | near
            # The starts for poses at which all slots failed come last.
            if not failed.any():
                break
            slot = np.nonzero(failed)[-1]
            again = polish(self, T[failed], start(failed, slot), self._fixed)
            better = again.residual < residual[failed]
            q[failed] = np.where(better[:, None], again.q, q[failed])
            residual[failed] = np.minimum(again.residual, residual[failed])
        return q, residual

    def _starts(
        self, T: FloatArray, given: tuple[FloatArray, ...], began: Solutions
    ) -> Iterator[tuple[Callable[[BoolArray, IntArray], FloatArray], bool]]:
        """Further starts (N, n) for the slots (..., k) that failed.

        Each comes with a flag: whether it is meant only for poses at which all slots failed.

        A least-squares answer is singular, and no step leads off it: so the iteration starts beside
        it. Slots whose branches meet there differ in one sign: slots with an even number of signs
        are nudged to one side, those with an odd number to the other.

        Near a singularity a small difference between the arms is a large difference between their
        joints. So the nominal inverse is evaluated at the pose that should lead to the wanted one,
        given the error seen so far; and last at poses around it.
        """
        nudge = np.where(self.solutions.wraps, NUDGE, 0.0)
        nudge[list(self._fixed)] = 0.0

        def beside(side: int, failed: BoolArray, slot: IntArray) -> FloatArray:
            parity = np.array([1 - 2 * (int(k).bit_count() % 2) for k in range(failed.shape[-1])])
            return np.asarray(began.q[failed] + side * parity[slot, None] * nudge)

        def corrected(rounds: int, failed: BoolArray, slot: IntArray) -> FloatArray:
            q, wanted = began.q[failed], T[failed]
            target, more = wanted, [value[failed] for value in given]
            for _ in range(rounds):
                here, _ = self.fk_jacobian_mixed(q)
                target = wanted @ np.linalg.inv(here) @ target
                q = self.nominal(target, *more).q[np.arange(len(q)), slot]
            return q

        def around(seed: int, failed: BoolArray, slot: IntArray) -> FloatArray:
            shift = np.random.default_rng(seed).normal(size=(2, 3)) * AROUND
            target = T[failed]
            target[:, :3, :3] = target[:, :3, :3] @ exp_rotation(shift[1])
            target[:, :3, 3] += shift[0]
            found = self.nominal(target, *(value[failed] for value in given))
            return np.asarray(found.q[np.arange(len(slot)), slot])

        yield partial(beside, 1), False
        yield partial(beside, -1), False
        for rounds in range(1, 5):
            yield partial(corrected, rounds), False
        for seed in range(_POSES_AROUND):
            yield partial(around, seed), True

    def __repr__(self) -> str:
        """In the form of a generated function."""
        return f"<chasles function {self.__qualname__}{self.__signature__}, polished>"

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickles in the form of a generated function."""
        return self._reduced


def functions(
    manifest: Manifest,
    generated: Mapping[str, Function[Any]],
    reduced: Callable[[str], tuple[Any, ...]],
) -> dict[str, Any]:
    """The inverse of a calibrated arm, in place of the generated one.

    Args:
        manifest: The robot's manifest.
        generated: Its generated functions.
        reduced: From a function's name to the value of its `__reduce__`.

    Returns:
        The inverse of a pose, by name; inverses of tasks with fewer freedoms stay as they are.
    """
    info = manifest.with_role("inverse", "pose")
    jacobian = manifest.with_role("pose and jacobian", "actuators")
    if info is None or jacobian is None:
        return {}
    kind = solutions_of(manifest.coordinates, manifest.wraps, info.labels, PolishedSolutions)
    inverse = PolishedInverse(
        generated[info.name],
        generated[jacobian.name],
        kind,
        reduced(info.name),
        info.given,
        manifest.tolerances.nominal,
    )
    return {info.name: inverse}
