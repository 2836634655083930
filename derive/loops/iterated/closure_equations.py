"""Reduced closure equations of loops without a closed form, and start values for Newton's method.

A strut keeps two points at a constant distance, whether its ends are pins or balls. The loop of a
strut has one equation, |b - a| = l, and the swing angle of the strut follows from the points. The
equations c(w) = 0 therefore contain only the variables w: the configuration z without strut swing
angles. For actuated variables a and unknown variables u, c_u du = -c_a da.
"""

from collections.abc import Mapping
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
    LoopEquations,
    configuration_names,
    constraints,
    derivative_rows,
    rates_of,
)
from ..model.gradient import UNIT, gradient
from ..solve.solved_loops import SolvedLoops

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Start:
    """The reference configuration of the iteration, as numerical values.

    Attributes:
        q: (n,) actuated coordinates (radian or metre).
        w: (n_w,) variables of the equations.
        tangent: (n_u, n) derivative of the unknown variables with respect to the actuated
            coordinates.
        determinant: Signed determinant of c_u, the derivative of the equations with respect to the
            unknown variables. If c_u is not square, the product of R's diagonal in its QR
            decomposition.
        is_regular: Whether c_u has full rank, so that the reference is not at a dead point.
    """

    q: FloatArray
    w: FloatArray
    tangent: FloatArray
    determinant: float
    is_regular: bool


class LoopClosure:
    """The equations c(w) = 0 of one mechanism, over the terms of its derivation.

    Attributes:
        hybrid: The robot.
        mechanism: The robot with ball-ended struts, so that swing angles are not variables.
        names: Names of the variables.
        is_length: Mask of the variables that are lengths.
        arguments: The arguments w and wd.
        w: Symbols of the variables.
        of_actuators: The same equations with the actuated coordinates as inputs, or None if the
            equations already use the actuated coordinates as inputs.
        ratios: Change of each input variable per unit change of the coordinate that drives it.
        given: Indices of the input variables.
        unknown: Indices of the unknown variables.
    """

    def __init__(self, hybrid: SolvedLoops, of_actuators: "LoopClosure | None" = None) -> None:
        """Names the variables.

        Args:
            hybrid: The robot.
            of_actuators: The same equations with the actuated coordinates as inputs, if the
                main-chain joints are the inputs here.
        """
        self.hybrid, self.of_actuators = hybrid, of_actuators
        self.mechanism = on_balls(hybrid.mechanism)
        variables = configuration_names(self.mechanism)
        self.names = [variable.name for variable in variables]
        self.is_length = [variable.unit == "m" for variable in variables]
        self.arguments = {
            name: Argument(name, symbols, (len(symbols),), f"(rad or m){of_time}", meaning)
            for name, of_time, meaning in (
                ("w", "", "configuration without the swings of struts"),
                ("wd", "/s", "rates of the configuration without the swings of struts"),
            )
            for symbols in (coordinates(f"_{name}", len(variables)),)
        }
        self.w = self.arguments["w"].symbols
        driven = hybrid.mechanism.coordinates
        moved = [c.moves for c in driven]
        self._follows = [k for k, name in enumerate(self.names) if name not in moved]
        ratios = [float(hybrid.terms.value(c.ratio)) for c in driven]
        if of_actuators is not None:
            moved = [joint.name for joint in hybrid.robot.moving]
            ratios = [1.0] * len(moved)
        self.ratios = ratios
        self.given = [self.names.index(name) for name in moved]
        self.unknown = [k for k in range(len(self.names)) if k not in self.given]

    @cached_property
    def equations(self) -> tuple[LoopEquations, ...]:
        """The equations of each loop."""
        if self.of_actuators is not None:
            return self.of_actuators.equations
        is_open = self.hybrid.residual_gaps is not None
        return constraints(self.mechanism, self.hybrid.terms, self.w, may_stay_open=is_open)

    @cached_property
    def entries(self) -> tuple[sp.Expr, ...]:
        """Terms that are zero if the loops are closed, or as nearly closed as possible."""
        if self.of_actuators is not None:
            return self.of_actuators.entries
        if self.hybrid.residual_gaps is None:
            return tuple(entry for loop in self.equations for entry in loop.residual)
        following = [self.w[k] for k in self._follows]
        lengths = [self.is_length[k] for k in self._follows]
        return gradient(self.equations, self.hybrid.terms, following, lengths, self.size)

    @cached_property
    def units(self) -> list[str]:
        """The unit of each entry, m or 1."""
        if self.hybrid.residual_gaps is not None:
            return [UNIT for _ in self.entries]
        return [unit for loop in self.equations for unit in loop.units]

    @cached_property
    def slopes(self) -> tuple[tuple[sp.Expr, ...], ...]:
        """Derivative of the entries with respect to the variables, by rows."""
        return derivative_rows(self.entries, self.hybrid.terms, self.w)

    @property
    def is_determined(self) -> bool:
        """Whether there are at least as many equations as unknown variables."""
        return len(self.units) >= len(self.unknown)

    @cached_property
    def size(self) -> float:
        """The longest translation or rod (metre), used to scale lengths against angles."""
        return float(f"{self.hybrid.numbers.size:.3g}")

    @cached_property
    def residual(self) -> SymbolicFunction:
        """The function of w that returns the entries and the derivative of the entries."""
        return self._closure() if self.of_actuators is None else self.of_actuators.residual

    @cached_property
    def functions(self) -> Mapping[str, SymbolicFunction]:
        """The functions of w that the iteration calls, by name."""
        if self.of_actuators is not None:
            return self.of_actuators.functions
        found = [self.residual, self._closure_dot()]
        return {function.name: function for function in found}

    @cached_property
    def start(self) -> Start:
        """The numerical reference configuration, rounded to be equal on every machine."""
        at = self.hybrid.at_reference
        w = np.array([at[name] for name in self.names])
        kernel = lower([self.residual], "reference")[0]
        J = np.array(kernel(w)[1]).reshape(len(self.units), len(w))
        ratios = np.array(self.ratios)
        J_u, J_a = J[:, self.unknown], J[:, self.given] * ratios
        Q, R = np.linalg.qr(J_u)
        size = np.prod(np.diag(R))
        square = J_u.shape[0] == J_u.shape[1]
        determinant = np.linalg.det(J_u) if square else abs(size)
        tangent = np.linalg.lstsq(R, -Q.T @ J_a, rcond=None)[0]
        q = w[self.given] / ratios
        values = np.linalg.svd(J_u * self._scales[self.unknown], compute_uv=False)
        is_regular = bool(np.all(values > REPEATED_EQUATION * max(values, default=0.0)))
        digits = float(f"{determinant:.6g}")
        return Start(_rounded(q), _rounded(w), _rounded(tangent), digits, is_regular)

    @property
    def _scales(self) -> FloatArray:
        """Scale (metre, or 1) that makes each variable comparable with an angle."""
        return np.where(self.is_length, self.size, 1.0)

    @cached_property
    def of_chain(self) -> "LoopClosure | None":
        """The same loop equations with the main-chain joints as inputs.

        The result is None if these joints do not determine the other variables, or if the reference
        is a dead point of these equations.
        """
        found = LoopClosure(self.hybrid, self)
        return found if found.is_determined and found.start.is_regular else None

    def _closure(self) -> SymbolicFunction:
        count = len(self.entries)
        return self._function(
            "closure",
            "Reduced closure equations, zero where the loops are closed, and their derivative.",
            "|b - a| - l of each strut; the equations of constraint(z) for other loops",
            ("w",),
            Result("residual", self.entries, (count,), "m or 1", "residuals"),
            Result(
                "residual_D_w",
                tuple(entry for row in self.slopes for entry in row),
                (count, len(self.w)),
                "1, m, 1/m",
                "their derivative",
            ),
        )

    def _closure_dot(self) -> SymbolicFunction:
        symbols = (self.arguments[name].symbols for name in ("w", "wd"))
        rows = rates_of(self.slopes, self.hybrid.terms, *symbols)
        return self._function(
            "closure_D_w_dot",
            "Time derivative of the derivative of the loops' least equations.",
            "closure_D_w(w) wdd + closure_D_w_dot(w, wd) wd = 0",
            ("w", "wd"),
            Result(
                "residual_D_w_dot",
                tuple(entry for row in rows for entry in row),
                (len(rows), len(self.w)),
                "1/s, m/s, 1/(m s)",
                "rate of the derivative",
            ),
        )

    def _function(
        self, name: str, summary: str, identity: str, inputs: tuple[str, ...], *outputs: Result
    ) -> SymbolicFunction:
        arguments = tuple(self.arguments[argument] for argument in inputs)
        role = Role("closure", "configuration")
        return SymbolicFunction(
            name, summary, identity, arguments, outputs, self.hybrid.terms, role=role
        )


def on_balls(mechanism: Mechanism) -> Mechanism:
    """Returns the mechanism with ball-ended struts, whose swing angles are not variables."""
    swings = set(mechanism.swings)
    return replace(
        mechanism,
        struts=tuple(replace(strut, ends="ball") for strut in mechanism.struts),
        reference=tuple((n, v) for n, v in mechanism.reference if n not in swings),
    )


def _rounded(values: FloatArray) -> FloatArray:
    """Rounds to 12 decimal places, which also removes rounding noise from zeros."""
    return np.asarray(np.round(values, 12) + 0.0)
