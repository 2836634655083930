"""Nominal mechanism of a built robot with loops.

The dimensions of a built robot differ slightly from its design. If the robot file names a design,
this design is the nominal mechanism. In a design, some lengths are equal or proportional, so the
loops have closed-form solutions. The lengths of an unknown design are probably round numbers, so
the built lengths are rounded to decimal grids, from coarse to fine. Axis directions are rounded to
multiples of 15 degrees. The nominal mechanism is the first rounded mechanism that has suitable
closed-form inverse kinematics. From solutions of the nominal mechanism, Newton's method must
converge to solutions of the built robot.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ..loops.functions.maps import CHAIN, from_actuators
from ..loops.functions.tool import tool_functions
from ..loops.iterated.closure_equations import LoopClosure
from ..loops.model.coupling_equations import turning_coordinates
from ..loops.solve.solved_loops import SolvedLoops
from ..model.mechanism import Frame, Mechanism
from ..model.robot import Placement, Rotation, Translation
from ..model.tolerances import MAX_REFINING_STEP, MEASURED_STRUCTURE, RECOVERED, SAMPLED_RANGE
from ..terms.branches import patterns
from ..terms.casadi_graph import lower
from ..terms.symbolic_function import SymbolicFunction
from .mechanisms.differences import apart
from .mechanisms.followed import Followed
from .nominal_convergence import twist_between
from .polished_inverse import TURN

FloatArray = NDArray[np.float64]
Posed = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""Type of a function that computes tool poses and Jacobians. For coordinates (N, n), the function
returns tool poses (N, 4, 4) and mixed Jacobians (N, 6, n)."""
GRIDS = tuple(sp.Rational(text) for text in ("0.01", "0.005", "0.001", "0.0005", "0.0001"))
"""Grid spacings (meter) to which lengths are rounded, the coarsest grid first."""
STEP_OF_ANGLES = sp.pi / 12

SAMPLES, MAX_DRAWN = 100, 600
"""Maximum number of test configurations, and number of random trials to find them.

In some mechanisms, the loops can close in only one of five random configurations.
"""
STEPS = 8
CONVERGED = 1e-12
"""Newton's method has converged if its last joint step is at most this value (radian or meter)."""


@dataclass(frozen=True)
class Nominal:
    """A nominal mechanism that approximates a robot as built.

    Attributes:
        mechanism: The design that the robot file names, or the built mechanism with rounded
            numbers.
        moved: Largest change (meter) of a length or position from the built robot to the nominal
            mechanism.
        turned: Largest change (radian) of an axis direction from the built robot to the nominal
            mechanism.
    """

    mechanism: Mechanism
    moved: float
    turned: float


def nominal_mechanisms(mechanism: Mechanism) -> Iterator[Nominal]:
    """Yield the stated nominal mechanism, or mechanisms with rounded numbers if none is stated.

    The mechanism with the fewest digits comes first. Mechanisms in which a rod length would be
    rounded to 0 are skipped.
    """
    if mechanism.nominal is not None:
        design = _in_numbers(mechanism.nominal)
        yield Nominal(design, *apart(_in_numbers(mechanism), design))
        return
    seen = {repr(mechanism)}
    for grid in GRIDS:
        rounding = _Rounding(mechanism, grid)
        if not rounding.keeps_rods:
            continue
        found = rounding.rounded()
        if rounding.moved + rounding.turned > 0 and repr(found) not in seen:
            seen.add(repr(found))
            yield Nominal(found, rounding.moved, rounding.turned)


Length = Callable[[sp.Expr], sp.Expr]
Turn = Callable[[Rotation], Rotation]


def _placed(placement: Placement, length: Length, turn: Turn) -> Placement:
    return tuple(
        replace(part, vector=tuple(map(length, part.vector)))
        if isinstance(part, Translation)
        else turn(part)
        for part in placement
    )


def _changed(m: Mechanism, length: Length, turn: Turn) -> Mechanism:

    def placed(placement: Placement) -> Placement:
        return _placed(placement, length, turn)

    def frame(of: Frame) -> Frame:
        return replace(of, placement=placed(of.placement))

    joints = (replace(j, before=placed(j.before), after=placed(j.after)) for j in m.joints)
    closures = (replace(c, a=frame(c.a), b=frame(c.b)) for c in m.closures)
    struts = (
        replace(
            strut,
            a=frame(strut.a),
            b=frame(strut.b),
            length=strut.length if strut.is_cylinder else length(strut.length),
        )
        for strut in m.struts
    )
    return replace(m, joints=tuple(joints), closures=tuple(closures), struts=tuple(struts))


def _in_numbers(mechanism: Mechanism) -> Mechanism:
    values = {p.symbol: p.value for p in mechanism.parameters}

    def number(value: sp.Expr) -> sp.Expr:
        return value.xreplace(values)

    def turn(part: Rotation) -> Rotation:
        return replace(part, angle=number(part.angle))

    changed = _changed(mechanism, number, turn)
    return replace(
        changed,
        struts=tuple(replace(strut, length=number(strut.length)) for strut in changed.struts),
        drives=tuple(replace(drive, ratio=number(drive.ratio)) for drive in mechanism.drives),
        base=_placed(mechanism.base, number, turn),
        tool=_placed(mechanism.tool, number, turn),
        parameters=(),
        nominal=None,
    )


class _Rounding:
    """Rounds a mechanism to a grid and records the largest changes."""

    def __init__(self, mechanism: Mechanism, grid: sp.Rational) -> None:
        self.mechanism, self.grid = mechanism, grid
        self.values = {p.symbol: p.value for p in mechanism.parameters}
        self.moved, self.turned = 0.0, 0.0

    @property
    def keeps_rods(self) -> bool:
        """Whether every rod length remains nonzero after rounding."""
        rods = (strut for strut in self.mechanism.struts if not strut.is_cylinder)
        return all(self._rounded(rod.length.xreplace(self.values)) != 0 for rod in rods)

    def rounded(self) -> Mechanism:
        return _changed(self.mechanism, self._length, self._turn)

    def _length(self, value: sp.Expr) -> sp.Expr:
        number = value.xreplace(self.values)
        rounded = self._rounded(number)
        self.moved = max(self.moved, abs(float(rounded - number)))
        return rounded

    def _rounded(self, number: sp.Expr) -> sp.Expr:
        """Return a rational number rounded to the grid, or an irrational number unchanged."""
        if not number.is_Rational:
            return number
        return sp.Rational(int(sp.floor(number / self.grid + sp.Rational(1, 2)))) * self.grid

    def _turn(self, part: Rotation) -> Rotation:
        number = part.angle.xreplace(self.values)
        part = replace(part, angle=number)
        steps = round(float(number / STEP_OF_ANGLES))
        off = abs(float(number - steps * STEP_OF_ANGLES))
        if not 0 < off <= MEASURED_STRUCTURE:
            return part
        self.turned = max(self.turned, off)
        return replace(part, angle=steps * STEP_OF_ANGLES)


@dataclass(frozen=True)
class ConvergenceResult:
    """Convergence of Newton's method from solutions of a nominal robot to the built robot.

    Attributes:
        share: Fraction (0 to 1) of random configurations that Newton's method recovers.
        deviation: Largest pose error of the nominal solutions from which Newton's method recovers a
            configuration, in radian or as a distance divided by the robot length.
    """

    share: float
    deviation: float


def convergence_of(
    hybrid: SolvedLoops,
    nominal: SymbolicFunction,
    length: float,
    given: tuple[int, ...] = (),
    closure: LoopClosure | None = None,
    *,
    is_position: bool = False,
) -> ConvergenceResult:
    """Refine inverse solutions of a nominal robot at random poses of the built robot.

    Args:
        hybrid: The built robot, with the solutions of its loops.
        nominal: The inverse kinematics function ``ik`` of the nominal robot.
        length: Length (meter) by which distances are divided to compare them with angles.
        given: Indices of the fixed joints, whose values are inputs of ``ik``.
        closure: Closure equations of the loops without a closed-form solution, or None if all loops
            have a closed-form solution.
        is_position: Whether orientation errors are ignored, because the task is a position task.
    """
    fk, theta = _numbers(hybrid, closure)
    (ik,) = lower([nominal], "nominal")
    fixed, turns = list(nominal.role.fixed), np.array(turns_of(hybrid))
    q = _configurations(hybrid)
    T, _ = fk(q)
    closed = np.flatnonzero(np.isfinite(T).all((-2, -1)))[:SAMPLES]
    q, T = q[closed], T[closed]
    if not len(q):
        return ConvergenceResult(0.0, np.inf)
    is_recovered, first = np.zeros(len(q), dtype=bool), np.full(len(q), np.inf)
    weights = np.array([1 / length] * 3 + [0.0 if is_position else 1.0] * 3)
    for signs in patterns(nominal) if nominal.signs else [None]:
        inputs = [T.reshape(len(T), 16).T, *(theta(q)[:, k][None] for k in given)]
        if signs is not None:
            inputs.append(np.repeat(np.array(signs, dtype=float)[:, None], len(T), 1))
        start, residual = (np.array(result).T for result in ik(*inputs)[:2])
        # The loops are solved by continuation from the reference configuration. Each joint rotates
        # in the shorter direction, because in the longer direction the continuation may reach a
        # dead point of a loop.
        start = hybrid.q_at_reference + _shorter(start - hybrid.q_at_reference, turns)
        # A design with few degrees of freedom cannot reach all poses of the built robot.
        missed = residual[:, 0] / max(length, 1.0)
        begin = np.fmax(_error(fk(start)[0], T, weights), missed)
        found = _newton(fk, T, start, weights, fixed)
        back = np.abs(_shorter(found - q, turns)).max(-1) < RECOVERED * max(length, 1.0)
        first = np.where(back, np.fmin(first, begin), first)
        is_recovered |= back
    deviation = float(np.max(first[is_recovered], initial=0.0))
    return ConvergenceResult(float(is_recovered.mean()), deviation)


def turns_of(hybrid: SolvedLoops) -> tuple[float, ...]:
    """Return the number of full turns per unit of each coordinate.

    The entry is 0 for a prismatic joint, and for a joint whose full turn does not turn all coupled
    joints by full turns.
    """
    wraps = turning_coordinates(hybrid.mechanism, hybrid.terms)
    return tuple(1 / TURN if is_turning else 0.0 for is_turning in wraps)


def _shorter(apart: FloatArray, turns: FloatArray) -> FloatArray:
    return np.asarray(apart - TURN * np.round(apart * turns))


def _configurations(hybrid: SolvedLoops) -> FloatArray:
    low, high = [], []
    for c, middle in zip(hybrid.mechanism.coordinates, hybrid.q_at_reference, strict=True):
        limits = zip(c.limits, (-SAMPLED_RANGE, SAMPLED_RANGE), strict=True)
        a, b = (middle + off if v is None else float(v) for v, off in limits)
        low.append(a)
        high.append(b)
    return np.random.default_rng(0).uniform(low, high, (MAX_DRAWN, len(low)))


def _numbers(
    hybrid: SolvedLoops, closure: LoopClosure | None
) -> tuple[Posed, Callable[[FloatArray], FloatArray]]:
    if closure is not None:
        followed = Followed(closure)
        return followed.posed, followed.theta
    pose = tool_functions(hybrid, ["fk_jacobian_mixed"])["fk_jacobian_mixed"]
    fk, theta = lower([pose, CHAIN.function(from_actuators(hybrid))], "true")

    def posed(q: FloatArray) -> tuple[FloatArray, FloatArray]:
        T, J = fk(q.T)
        return np.array(T).T.reshape(-1, 4, 4), np.array(J).T.reshape(-1, 6, q.shape[1])

    return posed, lambda q: np.array(theta(q.T)).T


def _newton(
    fk: Posed, T: FloatArray, q: FloatArray, weights: FloatArray, fixed: Sequence[int]
) -> FloatArray:
    q, moving = q.copy(), np.arange(len(q))
    for _ in range(STEPS):
        here, J = fk(q[moving])
        J[..., fixed] = 0.0
        sound = np.isfinite(here).all((-2, -1)) & np.isfinite(J).all((-2, -1))
        q[moving[~sound]] = np.nan
        moving = moving[sound]
        inverse = np.linalg.pinv(J[sound] * weights[:, None], rcond=RECOVERED)
        step = np.einsum("Nij,Nj->Ni", inverse, twist_between(here[sound], T[moving]) * weights)
        size = np.abs(step).max(-1, keepdims=True, initial=0.0)
        q[moving] += step * MAX_REFINING_STEP / np.maximum(size, MAX_REFINING_STEP)
        moving = moving[size[:, 0] > CONVERGED]
        if not len(moving):
            break
    return q


def _error(here: FloatArray, there: FloatArray, weights: FloatArray) -> FloatArray:
    return np.asarray(np.abs(twist_between(here, there) * weights).max(-1))
