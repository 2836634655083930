"""The motion of a chain's joints as functions of the coordinates of its robot."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import sympy as sp

from ..model.robot import SerialRobot
from ..terms.tangents import LoopRate, Tangent
from ..terms.terms import Terms

Matrix = Sequence[Sequence[sp.Expr]]
"""Rows by moving joints, columns by coordinates."""


class Motion(Protocol):
    """Values of the moving joints of a chain and their derivatives.

    Attributes:
        values: Values of all moving joints (radian or metre).
    """

    values: tuple[sp.Expr, ...]

    def D_q(self) -> Matrix:
        """The values' derivatives by the coordinates."""
        ...

    def D_q_dot(self, qd: Sequence[sp.Symbol]) -> Matrix | None:
        """Time derivative of ``D_q``; None where it is constant."""
        ...

    def D_q_q(self) -> Sequence[Matrix] | None:
        """Derivatives of ``D_q`` by each coordinate; None where it is constant."""
        ...

    def speeds(self, qd: Sequence[sp.Symbol]) -> list[sp.Expr]:
        """Rates of the values."""
        ...

    def accelerations(self, qd: Sequence[sp.Symbol], qdd: Sequence[sp.Symbol]) -> list[sp.Expr]:
        """Second time derivatives of the values."""
        ...


class InProportion:
    """The motion of a serial robot: each joint has a coordinate or follows another joint."""

    def __init__(self, robot: SerialRobot, terms: Terms, q: Sequence[sp.Symbol]) -> None:
        """Takes the values from the robot's coordinates and mimic laws."""
        self.terms = terms
        self.values = robot.joint_values(q)
        self._D_q = robot.joint_values_D_q()

    def D_q(self) -> Matrix:
        """The constant derivative: 1, -1 or a multiplier for each coordinate."""
        return [list(self._D_q.row(j)) for j in range(self._D_q.rows)]

    def D_q_dot(self, qd: Sequence[sp.Symbol]) -> None:
        """None: ``D_q`` is constant."""

    def D_q_q(self) -> None:
        """None: ``D_q`` is constant."""

    def speeds(self, qd: Sequence[sp.Symbol]) -> list[sp.Expr]:
        """``D_q qd``."""
        return [self.terms.let(entry) for entry in self._D_q * sp.Matrix(qd)]

    def accelerations(
        self,
        qd: Sequence[sp.Symbol],  # noqa: ARG002
        qdd: Sequence[sp.Symbol],
    ) -> list[sp.Expr]:
        """``D_q qdd``."""
        return self.speeds(qdd)


class LoopRates(Protocol):
    """The rates of all terms through closed loops, by the rates of the coordinates."""

    def units(self) -> Sequence[Tangent]:
        """The rates where one coordinate moves by one unit per second, for each coordinate."""
        ...

    def along(self, qd: Sequence[sp.Symbol]) -> Tangent:
        """The rates at rates qd of the coordinates."""
        ...

    def twice(self, qd: Sequence[sp.Symbol], qdd: Sequence[sp.Symbol]) -> Tangent:
        """The rates of terms of coordinates and their rates, at accelerations qdd."""
        ...


@dataclass(frozen=True)
class SolvedRates:
    """The rates through loops that are solved in closed form.

    Attributes:
        terms: Names of all terms.
        loops: Rates of the solved angles; the caller may add angles.
        q: The coordinates.
    """

    terms: Terms
    loops: dict[sp.Symbol, LoopRate]
    q: tuple[sp.Symbol, ...]

    def units(self) -> list[Tangent]:
        """The rates where one coordinate moves, for each coordinate."""
        return [self._of({symbol: sp.Integer(1)}) for symbol in self.q]

    def along(self, qd: Sequence[sp.Symbol]) -> Tangent:
        """The rates at rates qd of the coordinates."""
        return self._of(dict(zip(self.q, qd, strict=True)))

    def twice(self, qd: Sequence[sp.Symbol], qdd: Sequence[sp.Symbol]) -> Tangent:
        """The rates of terms of coordinates and their rates, at accelerations qdd."""
        pairs = (*zip(self.q, qd, strict=True), *zip(qd, qdd, strict=True))
        return self._of(dict(pairs))

    def _of(self, rates: dict[sp.Symbol, sp.Expr]) -> Tangent:
        return Tangent(self.terms, rates, self.loops)


class ThroughLoops:
    """The motion of joints that depend on the coordinates through closed loops."""

    def __init__(self, values: Sequence[sp.Expr], rates: LoopRates) -> None:
        """Stores the values and the rates through the loops.

        Args:
            values: Values of all moving joints (radian or metre).
            rates: The rates of the terms in the values.
        """
        self.values, self._rates = tuple(values), rates
        self._units = rates.units()
        self._D_q: list[list[sp.Expr]] | None = None

    def D_q(self) -> Matrix:
        """The derivatives from the loops' equations (implicit function theorem)."""
        if self._D_q is None:
            self._D_q = [[unit.of(value) for unit in self._units] for value in self.values]
        return self._D_q

    def D_q_dot(self, qd: Sequence[sp.Symbol]) -> Matrix:
        """The entries of ``D_q``, differentiated along the motion."""
        along = self._rates.along(qd)
        return [along.of_each(row) for row in self.D_q()]

    def D_q_q(self) -> Sequence[Matrix]:
        """Second derivatives, one matrix a coordinate."""
        return [[unit.of_each(row) for row in self.D_q()] for unit in self._units]

    def speeds(self, qd: Sequence[sp.Symbol]) -> list[sp.Expr]:
        """Rates at given rates of the coordinates, without ``D_q``."""
        return self._rates.along(qd).of_each(self.values)

    def accelerations(self, qd: Sequence[sp.Symbol], qdd: Sequence[sp.Symbol]) -> list[sp.Expr]:
        """Second time derivatives at rates qd and accelerations qdd."""
        return self._rates.twice(qd, qdd).of_each(self.speeds(qd))
