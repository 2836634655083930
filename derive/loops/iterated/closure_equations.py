"""Closure equations of loops without a closed form, and start values for Newton's method.

A strut with pin or ball ends keeps two points at a constant distance. The loop of a strut therefore
has a single equation: the distance between the strut's end points equals the strut length. The
closure equations are c(w) = 0. The loop variables w are the entries of the configuration z except
the swing angles of struts. The two end points of each strut determine its swing angle. The loop
variables w consist of actuated variables a and unknown variables u. The derivatives c_a and c_u of
c with respect to a and u give the differential equation c_u du = -c_a da.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ...chain.kinematics import coordinates
from ...model.mechanism import Mechanism
from ...model.tolerances import REPEATED_EQUATION
from ...terms.casadi_graph import lower
from ...terms.role import Role
from ...terms.symbolic_function import Argument, Result, SymbolicFunction
from ..model.constraints import (
    configuration_names,
    constraints,
    derivative_rows,
    rates_of,
)
from ..model.gradient import UNIT, gradient
from ..solve.solved_loops import SolvedLoops

FloatArray = NDArray[np.float64]
RESIDUAL = "closure"
"""Name of the function that returns the residuals of the closure equations and their derivative."""


@dataclass(frozen=True)
class Start:
    """Numerical values at the reference configuration, from which the iteration starts.

    Attributes:
        q: (n,) actuated coordinates (radian or meter).
        w: (n_w,) variables of the closure equations.
        tangent: (n_u, n) derivative of the unknown variables with respect to the actuated
            coordinates.
        determinant: Determinant of c_u, the derivative of the closure equations with respect to the
            unknown variables. If c_u is not square, the absolute product of the diagonal entries of
            R in c_u = Q R replaces the determinant.
        is_regular: Whether c_u, the derivative of the closure equations with respect to the unknown
            variables, has full rank.
    """

    q: FloatArray
    w: FloatArray
    tangent: FloatArray
    determinant: float
    is_regular: bool


@dataclass(frozen=True, eq=False)
class LoopClosure:
    """The closure equations c(w) = 0 of one mechanism.

    Attributes:
        hybrid: The robot.
        names: Names of the loop variables w.
        is_length: Mask of the loop variables that are lengths.
        w: Symbols of the loop variables w.
        entries: Residuals of the closure equations, which are zero if the loops are closed.
        units: Unit of each closure equation, m or 1.
        size: Length of the longest translation or rod (meter), by which lengths in the equations
            are divided.
        functions: Functions of w that the iteration calls, keyed by name. The dictionary is empty
            if there are fewer equations than unknown variables.
        inputs: Name of the coordinates that drive the input variables: ``q`` for actuators,
            ``theta`` for main-chain joints.
        ratios: Change of each input variable per unit of its coordinate.
        given: Indices of the input variables in w.
        unknown: Indices of the unknown variables in w.
    """

    hybrid: SolvedLoops
    names: tuple[str, ...]
    is_length: tuple[bool, ...]
    w: tuple[sp.Symbol, ...]
    entries: tuple[sp.Expr, ...]
    units: tuple[str, ...]
    size: float
    functions: Mapping[str, SymbolicFunction]
    inputs: str
    ratios: tuple[float, ...]
    given: list[int]
    unknown: list[int]

    @property
    def is_determined(self) -> bool:
        """Whether there are at least as many equations as unknown variables."""
        return len(self.units) >= len(self.unknown)

    @cached_property
    def start(self) -> Start:
        """The reference configuration, rounded to the same numbers on every machine."""
        at = self.hybrid.at_reference
        w = np.array([at[name] for name in self.names])
        kernel = lower([self.functions[RESIDUAL]], "reference")[0]
        J = np.array(kernel(w)[1]).reshape(len(self.units), len(w))
        ratios = np.array(self.ratios)
        J_u, J_a = J[:, self.unknown], J[:, self.given] * ratios
        Q, R = np.linalg.qr(J_u)
        size = np.prod(np.diag(R))
        square = J_u.shape[0] == J_u.shape[1]
        determinant = np.linalg.det(J_u) if square else abs(size)
        tangent = np.linalg.lstsq(R, -Q.T @ J_a, rcond=None)[0]
        q = w[self.given] / ratios
        # Lengths are divided by the mechanism size, so that lengths and angles are comparable.
        scales = np.where(self.is_length, self.size, 1.0)[self.unknown]
        values = np.linalg.svd(J_u * scales, compute_uv=False)
        is_regular = bool(np.all(values > REPEATED_EQUATION * max(values, default=0.0)))
        digits = float(f"{determinant:.6g}")
        return Start(_rounded(q), _rounded(w), _rounded(tangent), digits, is_regular)

    @cached_property
    def of_chain(self) -> "LoopClosure | None":
        """The closure equations with the main-chain joints instead of the actuators as inputs.

        ``of_chain`` is None if the main-chain joints do not determine the other variables, or if
        the reference is a dead point.
        """
        given, unknown = _split(self.names, [joint.name for joint in self.hybrid.robot.moving])
        ratios = (1.0,) * len(given)
        found = replace(self, inputs="theta", ratios=ratios, given=given, unknown=unknown)
        return found if found.is_determined and found.start.is_regular else None


def loop_closure(hybrid: SolvedLoops) -> LoopClosure:
    """Return the closure equations of a mechanism, with the actuated coordinates as inputs.

    The pin ends of struts are replaced by ball ends, so the swing angles of struts are not
    variables of the equations.
    """
    mechanism, terms = on_balls(hybrid.mechanism), hybrid.terms
    variables = configuration_names(mechanism)
    names = tuple(variable.name for variable in variables)
    is_length = tuple(variable.unit == "m" for variable in variables)
    w = coordinates("_w", len(variables))
    driven = hybrid.mechanism.coordinates
    given, unknown = _split(names, [c.moves for c in driven])
    size, is_open = float(f"{hybrid.numbers.size:.3g}"), hybrid.least_squares_closure is not None
    equations = constraints(mechanism, terms, w, may_stay_open=is_open)
    entries = tuple(entry for loop in equations for entry in loop.residual)
    units = tuple(unit for loop in equations for unit in loop.units)
    if is_open:
        lengths = [is_length[k] for k in unknown]
        entries = gradient(equations, terms, [w[k] for k in unknown], lengths, size)
        units = (UNIT,) * len(entries)
    functions = _functions(hybrid, entries, w) if len(entries) >= len(unknown) else {}
    ratios = tuple(float(terms.value(c.ratio)) for c in driven)
    return LoopClosure(
        *(hybrid, names, is_length, w, entries, units, size, functions),
        *("q", ratios, given, unknown),
    )


def _split(names: Sequence[str], moved: Sequence[str]) -> tuple[list[int], list[int]]:
    given = [names.index(name) for name in moved]
    return given, [k for k in range(len(names)) if k not in given]


def _functions(
    hybrid: SolvedLoops, entries: tuple[sp.Expr, ...], w: tuple[sp.Symbol, ...]
) -> dict[str, SymbolicFunction]:
    wd, unit, meaning = (
        coordinates("_wd", len(w)),
        "(rad or m)",
        "configuration without the swing angles",
    )
    of_w = Argument("w", w, (len(w),), unit, f"{meaning} of struts")
    of_wd = Argument("wd", wd, (len(w),), f"{unit}/s", f"rates of the {meaning} of struts")
    shape, role = (len(entries), len(w)), Role("closure", "configuration")
    slopes = derivative_rows(entries, hybrid.terms, w)
    rates = rates_of(slopes, hybrid.terms, w, wd)
    residual = Result("residual", entries, shape[:1], "m or 1", "residuals")
    found = (
        SymbolicFunction(
            RESIDUAL,
            "Reduced closure equations, zero if the loops are closed, and their derivative.",
            "|b - a| - l of each strut; the equations of constraint(z) for other loops",
            (of_w,),
            (residual, _matrix("residual_D_w", slopes, shape, "1, m, 1/m", "their derivative")),
            hybrid.terms,
            role=role,
        ),
        SymbolicFunction(
            "closure_D_w_dot",
            "Time derivative of the derivative of the reduced closure equations.",
            "closure_D_w(w) wdd + closure_D_w_dot(w, wd) wd = 0",
            (of_w, of_wd),
            (
                _matrix(
                    *("residual_D_w_dot", rates, shape, "1/s, m/s, 1/(m s)"),
                    "rate of the derivative",
                ),
            ),
            hybrid.terms,
            role=role,
        ),
    )
    return {function.name: function for function in found}


def _matrix(
    name: str, rows: Sequence[Sequence[sp.Expr]], shape: tuple[int, int], unit: str, meaning: str
) -> Result:
    return Result(name, tuple(entry for row in rows for entry in row), shape, unit, meaning)


def on_balls(mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with ball joints at all strut ends.

    Struts with ball joints at both ends have no swing angles.
    """
    swings = set(mechanism.swings)
    return replace(
        mechanism,
        struts=tuple(replace(strut, ends="ball") for strut in mechanism.struts),
        reference=tuple((n, v) for n, v in mechanism.reference if n not in swings),
    )


def _rounded(values: FloatArray) -> FloatArray:
    """Round values to 12 decimal places.

    Values that differ from zero only by rounding errors become exact zeros.
    """
    return np.asarray(np.round(values, 12) + 0.0)
