"""The motion of a chain's joints as functions of the coordinates of its robot."""

from collections.abc import Sequence
from typing import Protocol

import sympy as sp

from ..model.robot import Robot
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

    def __init__(self, robot: Robot, terms: Terms, q: Sequence[sp.Symbol]) -> None:
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


class ThroughLoops:
    """The motion of joints that depend on the coordinates through closed loops."""

    def __init__(
        self,
        terms: Terms,
        values: Sequence[sp.Expr],
        loops: dict[sp.Symbol, LoopRate],
        q: Sequence[sp.Symbol],
    ) -> None:
        """Stores the values and the rates of their solved angles.

        Args:
            terms: Names of all terms.
            values: Values of all moving joints (radian or metre).
            loops: Rates of the solved angles in the values; the caller may add angles.
            q: The coordinates.
        """
        self.terms, self.values, self.loops, self.q = terms, tuple(values), loops, tuple(q)
        self._units = [Tangent(terms, {symbol: sp.Integer(1)}, loops) for symbol in self.q]
        self._D_q: list[list[sp.Expr]] | None = None

    def D_q(self) -> Matrix:
        """The derivatives from the loops' equations (implicit function theorem)."""
        if self._D_q is None:
            self._D_q = [[unit.of(value) for unit in self._units] for value in self.values]
        return self._D_q

    def D_q_dot(self, qd: Sequence[sp.Symbol]) -> Matrix:
        """The entries of ``D_q``, differentiated along the motion."""
        along = Tangent(self.terms, dict(zip(self.q, qd, strict=True)), self.loops)
        return [along.of_each(row) for row in self.D_q()]

    def D_q_q(self) -> Sequence[Matrix]:
        """Second derivatives, one matrix a coordinate."""
        return [[unit.of_each(row) for row in self.D_q()] for unit in self._units]

    def speeds(self, qd: Sequence[sp.Symbol]) -> list[sp.Expr]:
        """Rates at given rates of the coordinates, without ``D_q``."""
        return self._along(qd).of_each(self.values)

    def accelerations(self, qd: Sequence[sp.Symbol], qdd: Sequence[sp.Symbol]) -> list[sp.Expr]:
        """Second time derivatives at rates qd and accelerations qdd."""
        rates = dict(zip(self.q, qd, strict=True)) | dict(zip(qd, qdd, strict=True))
        return Tangent(self.terms, rates, self.loops).of_each(self.speeds(qd))

    def _along(self, qd: Sequence[sp.Symbol]) -> Tangent:
        return Tangent(self.terms, dict(zip(self.q, qd, strict=True)), self.loops)
