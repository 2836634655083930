"""The least equations of loops without a closed form, and the numbers where their iteration starts.

A strut holds two points at its length, whether pins or balls hold its ends: one equation for its
loop, |b - a| = l, and its swing follows from the points. So the equations c(w) = 0 hold the
variables w alone, which are the configuration z without the swings of struts. With the actuated
variables a and the unknown ones u, c_u du = -c_a da.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...chain.kinematics import coordinates
from ...model.mechanism import Mechanism
from ...terms.casadi_graph import lower
from ...terms.role import Role
from ...terms.symbolic_function import Argument, Result, SymbolicFunction, matrix_entries
from ...terms.tangents import derivative_columns
from ..closing import ClosedLoops
from ..constraints import (
    LoopEquations,
    configuration_names,
    constraints,
    jacobian,
    jacobian_dot,
    swing_angles,
)
from ..hybrid import Hybrid

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Start:
    """The reference configuration of the iteration, in numbers.

    Attributes:
        q: (n,) actuated coordinates (radian or metre).
        w: (n_w,) variables of the equations.
        tangent: (n_u, n) derivative of the unknown variables by the actuated coordinates.
        determinant: Of c_u, its sign included; the product of R's diagonal where c_u is not square.
    """

    q: FloatArray
    w: FloatArray
    tangent: FloatArray
    determinant: float


class LoopClosure:
    """The equations c(w) = 0 of one mechanism over the terms of its derivation."""

    def __init__(self, hybrid: Hybrid) -> None:
        """Names the variables.

        Args:
            hybrid: The robot.
        """
        self.hybrid = hybrid
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
        moved = [c.moves for c in hybrid.mechanism.coordinates]
        self.actuated = [self.names.index(name) for name in moved]
        self.unknown = [k for k, name in enumerate(self.names) if name not in moved]

    @cached_property
    def equations(self) -> tuple[LoopEquations, ...]:
        """The equations of each loop."""
        return constraints(self.mechanism, self.hybrid.terms, self.w)

    @cached_property
    def units(self) -> list[str]:
        """The unit of each equation, m or 1."""
        return [unit for loop in self.equations for unit in loop.units]

    @property
    def is_determined(self) -> bool:
        """Whether there are equations enough for the unknown variables."""
        return len(self.units) >= len(self.unknown)

    @cached_property
    def size(self) -> float:
        """The longest translation or rod (metre), which compares lengths with angles."""
        return float(f"{ClosedLoops(self.hybrid.mechanism).size:.3g}")

    @cached_property
    def ratios(self) -> list[float]:
        """Advance of the actuated variables per unit of the coordinates."""
        terms = self.hybrid.terms
        return [float(terms.value(c.ratio)) for c in self.hybrid.mechanism.coordinates]

    @cached_property
    def functions(self) -> Mapping[str, SymbolicFunction]:
        """The functions of w that the iteration calls, by name."""
        found = [self._closure(), self._closure_dot()]
        if self.hybrid.mechanism.swings:
            found.append(self._swings())
        return {function.name: function for function in found}

    @cached_property
    def start(self) -> Start:
        """The reference in numbers, rounded to digits that agree on every machine."""
        at = self.hybrid.at_reference
        w = np.array([at[name] for name in self.names])
        kernel = lower([self.functions["closure"]], "reference")[0]
        J = np.array(kernel(w)[1]).reshape(len(self.units), len(w))
        ratios = np.array(self.ratios)
        J_u, J_a = J[:, self.unknown], J[:, self.actuated] * ratios
        Q, R = np.linalg.qr(J_u)
        size = np.prod(np.diag(R))
        square = J_u.shape[0] == J_u.shape[1]
        determinant = np.linalg.det(J_u) if square else abs(size)
        tangent = np.linalg.lstsq(R, -Q.T @ J_a, rcond=None)[0]
        q = w[self.actuated] / ratios
        return Start(_rounded(q), _rounded(w), _rounded(tangent), float(f"{determinant:.6g}"))

    def _closure(self) -> SymbolicFunction:
        entries = tuple(entry for loop in self.equations for entry in loop.residual)
        rows = jacobian(self.equations, self.hybrid.terms, self.w)
        count = len(entries)
        return self._function(
            "closure",
            "Least equations of the loops, zero where the loops are closed, and their derivative.",
            "|b - a| - l of each strut; the equations of constraint(z) for other loops",
            ("w",),
            Result("residual", entries, (count,), "m or 1", "residuals"),
            Result(
                "residual_D_w",
                tuple(entry for row in rows for entry in row),
                (count, len(self.w)),
                "1, m, 1/m",
                "their derivative",
            ),
        )

    def _closure_dot(self) -> SymbolicFunction:
        symbols = (self.arguments[name].symbols for name in ("w", "wd"))
        rows = jacobian_dot(self.equations, self.hybrid.terms, *symbols)
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

    def _swings(self) -> SymbolicFunction:
        terms = self.hybrid.terms
        values = dict(zip(self.names, self.w, strict=True))
        angles = swing_angles(self.hybrid.mechanism, terms, values)
        entries = tuple(angles[name] for name in self.hybrid.mechanism.swings)
        columns = derivative_columns(terms, entries, self.w)
        return self._function(
            "swings",
            "Swings of struts on pins, between -pi and pi, and their derivative.",
            f"swing = ({', '.join(self.hybrid.mechanism.swings)})",
            ("w",),
            Result("swing", entries, (len(entries),), "rad", "swings"),
            Result(
                "swing_D_w",
                matrix_entries(columns),
                (len(entries), len(self.w)),
                "1, 1/m",
                "their derivative",
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
    """The mechanism with its struts on balls, whose swings are no variables."""
    swings = set(mechanism.swings)
    return replace(
        mechanism,
        struts=tuple(replace(strut, ends="ball") for strut in mechanism.struts),
        reference=tuple((n, v) for n, v in mechanism.reference if n not in swings),
    )


def _rounded(values: FloatArray) -> FloatArray:
    """To 12 decimals, so that rounding of numbers that are 0 is left out too."""
    return np.asarray(np.round(values, 12) + 0.0)
