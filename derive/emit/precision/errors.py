"""Compares the results of robot functions in single and double precision."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...derivation import Derivation
from ...model.robot import SerialRobot
from ...model.tolerances import REGULAR, SOLVED_SINGLE
from ...program.programs import Programs
from ...terms.symbolic_function import Argument, Result, SymbolicFunction
from .evaluation import Array, evaluate
from .single import single

SAMPLES = 10_000
"""Number of random inputs at which a function is evaluated."""
SAFETY = 2.0
"""Factor by which the printed error bound exceeds the largest measured error, because math
libraries on other processors may be less accurate."""
NEAR_REFERENCE = 0.2
"""If the robot has loops, sampled coordinates differ from the reference by at most this distance
(radian or meter). For a coordinate whose range is below 1 rad or 1 m, the distance from the
reference is at most 0.2 times the range."""
SOLVED = 1e-9
"""Largest residual of a solution in double precision (meter or radian)."""
RATES = {"qd", "qdd", "thetad", "thetadd", "zd", "zdd"}
"""Names of inputs that are velocities or accelerations."""
ENTRIES = {"position": [3, 7, 11], "plane": [3, 7], "orientation": [0, 1, 2, 4, 5, 6, 8, 9, 10]}
"""Indices of the pose matrix entries that each kind of task constrains."""
ROWS = {"position": [0, 1, 2], "plane": [0, 1], "orientation": [3, 4, 5]}
"""Indices of the Jacobian rows that each kind of task constrains."""
_TURN = 2 * math.pi


@dataclass(frozen=True)
class Errors:
    """Errors of a function in single precision.

    Attributes:
        bounds: Error bound of each output, or None for an output without a measured error.
        solutions: Number of inverse kinematics solutions away from singularities that the function
            finds in double precision.
        missed: Number of inverse kinematics solutions away from singularities that the function
            misses in single precision.
    """

    bounds: tuple[float | None, ...]
    solutions: int = 0
    missed: int = 0


@dataclass(frozen=True)
class Measurement:
    """Random inputs for a robot's functions, and the numerical errors of the results."""

    derivation: Derivation
    programs: Programs

    def errors(self, function: SymbolicFunction) -> Errors:
        """Return the single-precision errors of a function."""
        inputs = self._inputs(function)
        if inputs is None:
            return Errors((None,) * len(function.outputs))
        exact = self._at(function.name, inputs)
        regular = self._is_regular(function, inputs)
        rounded = evaluate(single(self.programs.whole[function.name]), inputs, np.float32)
        if function.role.is_inverse:
            return self._inverse_errors(function, exact, rounded)
        finite = regular & np.all([np.isfinite(x).all(axis=1) for x in exact], axis=0)
        pairs = zip(exact, rounded, function.outputs, strict=True)
        bounds = [_bound(_apart(y, x, result)[finite]) for x, y, result in pairs]
        return Errors(tuple(bounds))

    def _at(self, name: str, inputs: Sequence[Array]) -> list[Array]:
        return evaluate(self.programs.whole[name], inputs, np.float64)

    @cached_property
    def _known(self) -> dict[str, Array]:
        q = self._coordinates()
        known = {"q": q} | self._near_reference()
        for argument, name in (("theta", "chain"), ("z", "configuration"), ("T", "fk")):
            if self._is_printed(name):
                (known[argument],) = self._at(name, [q])
        return known

    def _is_printed(self, name: str) -> bool:
        return any(f.name == name and not f.calls for f in self.derivation.functions)

    def _near_reference(self) -> dict[str, Array]:
        solved, rng = self.derivation.hybrid, np.random.default_rng(2)
        if solved is None:
            return {}
        names = {
            "theta": [joint.name for joint in solved.mechanism.main_chain.moving],
            "z": [variable.name for variable in solved.variables],
        }
        found = {}
        for argument, moved in names.items():
            reference = np.array([solved.at_reference[name] for name in moved])
            apart = rng.uniform(-NEAR_REFERENCE, NEAR_REFERENCE, (SAMPLES, len(reference)))
            found[argument] = reference + apart
        return found

    def _coordinates(self) -> Array:
        rng = np.random.default_rng(0)
        limits = [c.limits for c in self.derivation.robot.coordinates]
        low, high = (
            np.array([math.nan if x is None else float(x) for x in side])
            for side in zip(*limits, strict=True)
        )
        low = np.where(np.isnan(low), -math.pi, low)
        high = np.where(np.isnan(high), math.pi, high)
        solved = self.derivation.hybrid
        if solved is not None:
            reach = NEAR_REFERENCE * np.minimum(high - low, 1)
            low = np.maximum(low, solved.q_at_reference - reach)
            high = np.minimum(high, solved.q_at_reference + reach)
        return np.asarray(low + (high - low) * rng.random((SAMPLES, len(low))))

    def _inputs(self, function: SymbolicFunction) -> list[Array] | None:
        rng = np.random.default_rng(1)
        first, *others = function.inputs
        is_inverse = function.role.is_inverse
        found = [self._target(function) if is_inverse else self._known.get(first.name)]
        for k, argument in enumerate(others):
            if argument.name in RATES:
                found.append(rng.uniform(-1, 1, (SAMPLES, argument.size)))
            elif is_inverse:
                found.append(self._fixed(function, argument, k))
            else:
                found.append(self._known.get(argument.name))
        return None if any(item is None for item in found) else found  # type: ignore[return-value]

    def _target(self, function: SymbolicFunction) -> Array | None:
        T, components = self._known.get("T"), function.role.components
        if T is None or not set(components) <= ENTRIES.keys():
            return None
        return np.hstack([T[:, ENTRIES[part]] for part in components]) if components else T

    def _fixed(self, function: SymbolicFunction, argument: Argument, k: int) -> Array | None:
        q, robot = self._known["q"], self.derivation.robot
        if argument.name in self.programs.whole:
            return self._at(argument.name, [q])[0]
        if isinstance(robot, SerialRobot) and not robot.couplings:
            joint = function.role.fixed[k]
            return q[:, joint : joint + 1]
        return None

    def _is_regular(self, function: SymbolicFunction, inputs: Sequence[Array]) -> Array:
        if not self._is_printed(function.margin):
            return np.ones(len(inputs[0]), dtype=bool)
        (margin,) = self._at(function.margin, inputs[:1])
        return np.asarray(np.all(margin > REGULAR, axis=1))

    def _inverse_errors(
        self, function: SymbolicFunction, exact: Sequence[Array], rounded: Sequence[Array]
    ) -> Errors:
        """Compare the inverse kinematics solutions in single and double precision.

        Solutions near singularities are skipped.
        """
        n = function.outputs[0].shape[1]
        q, near = (x[0].reshape(-1, n).astype(float) for x in (exact, rounded))
        valid = exact[1].ravel() <= SOLVED
        regular = self._singular_values(function, q[valid])
        if regular is None:
            return Errors((None,) * len(function.outputs))
        valid[valid] = regular > REGULAR
        found = valid & (rounded[1].ravel() <= SOLVED_SINGLE)
        apart = [np.abs(x.ravel() - y.ravel()) for x, y in zip(exact[1:], rounded[1:], strict=True)]
        bounds = [_bound(_apart(near, q, function.outputs[0])[found])]
        bounds += [_bound(distances[found]) for distances in apart]
        return Errors(tuple(bounds), int(valid.sum()), int((valid & ~found).sum()))

    def _singular_values(self, function: SymbolicFunction, q: Array) -> Array | None:
        if not self._is_printed("jacobian_mixed"):
            return None
        J = self._at("jacobian_mixed", [q])[0].reshape(len(q), 6, -1)
        kept = [row for part in function.role.components for row in ROWS[part]] or list(range(6))
        fixed = {*function.role.fixed, *function.role.free}
        columns = [k for k in range(J.shape[2]) if k not in fixed]
        return np.asarray(np.linalg.svd(J[:, kept][:, :, columns], compute_uv=False)[:, -1])


def with_errors(function: SymbolicFunction, lines: Sequence[str], errors: Errors) -> list[str]:
    """Add the error bounds to the comment of a function."""
    count = len(function.outputs)
    return [*lines[:-count], *map(_with_error, lines[-count:], errors.bounds)]


def _with_error(line: str, bound: float | None) -> str:
    return f"{line}, error not measured" if bound is None else f"{line}, error {bound:.0e}"


def _apart(x: Array, y: Array, result: Result) -> Array:
    apart = x.astype(float) - y
    if "rad" in result.unit and "/" not in result.unit:
        apart -= _TURN * np.round(apart / _TURN)
    return np.asarray(np.abs(apart))


def _bound(errors: Array) -> float | None:
    if not errors.size:
        return None
    most = SAFETY * float(np.max(errors))
    if most == 0 or not math.isfinite(most):
        return most
    unit = 10.0 ** math.floor(math.log10(most))
    return float(f"{math.ceil(most / unit) * unit:.0e}")
