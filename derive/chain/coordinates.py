"""Joint motions of a chain as functions of the robot coordinates."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import sympy as sp

from ..model.robot import SerialRobot
from ..terms.tangents import LoopRate, Tangent
from ..terms.terms import Terms

Matrix = Sequence[Sequence[sp.Expr]]
"""Matrix with one row per moving joint and one column per coordinate."""


class Motion(Protocol):
    """Joint values of a chain and their derivatives.

    Attributes:
        values: Values of all moving joints (radian or meter).
    """

    values: tuple[sp.Expr, ...]

    def D_q(self) -> Matrix:
        """Return the derivatives of the joint values with respect to the coordinates."""
        ...

    def D_q_dot(self, qd: Sequence[sp.Symbol]) -> Matrix | None:
        """Return the time derivative of the matrix ``D_q``, or None if the matrix is constant."""
        ...

    def D_q_q(self) -> Sequence[Matrix] | None:
        """Return one derivative of ``D_q`` per coordinate, or None if ``D_q`` is constant."""
        ...

    def speeds(self, qd: Sequence[sp.Symbol]) -> list[sp.Expr]:
        """Return the time derivatives of the joint values."""
        ...

    def accelerations(self, qd: Sequence[sp.Symbol], qdd: Sequence[sp.Symbol]) -> list[sp.Expr]:
        """Return the second time derivatives of the joint values."""
        ...


class InProportion:
    """The motion of the joints of a serial robot.

    Each joint has its own coordinate, or a coupling determines the joint value.
    """

    def __init__(self, robot: SerialRobot, terms: Terms, q: Sequence[sp.Symbol]) -> None:
        self.terms = terms
        self.values = robot.joint_values(q)
        self._D_q = robot.joint_values_D_q()

    def D_q(self) -> Matrix:
        """Return the derivatives of the joint values with respect to the coordinates.

        The entries of the matrix D_q are constants: 1, -1 or coupling ratios.
        """
        return [list(self._D_q.row(j)) for j in range(self._D_q.rows)]

    def D_q_dot(self, qd: Sequence[sp.Symbol]) -> None:
        """Return None, because ``D_q`` is constant."""

    def D_q_q(self) -> None:
        """Return None, because ``D_q`` is constant."""

    def speeds(self, qd: Sequence[sp.Symbol]) -> list[sp.Expr]:
        """Return ``D_q qd``."""
        return [self.terms.let(entry) for entry in self._D_q * sp.Matrix(qd)]

    def accelerations(
        self,
        qd: Sequence[sp.Symbol],  # noqa: ARG002
        qdd: Sequence[sp.Symbol],
    ) -> list[sp.Expr]:
        """Return ``D_q qdd``."""
        return self.speeds(qdd)


class LoopRates(Protocol):
    """Rates (time derivatives) of the named terms that depend on the solved loop equations."""

    def units(self) -> Sequence[Tangent]:
        """Return the rates of all terms, once for unit velocity of each coordinate."""
        ...

    def along(self, qd: Sequence[sp.Symbol]) -> Tangent:
        """Return the rates of all terms at the coordinate velocities qd."""
        ...

    def twice(self, qd: Sequence[sp.Symbol], qdd: Sequence[sp.Symbol]) -> Tangent:
        """Return the time derivatives of the rates at the accelerations qdd."""
        ...


@dataclass(frozen=True)
class SolvedRates:
    """Rates of the named terms of a mechanism whose loops have a closed-form solution.

    Attributes:
        terms: Table of named terms.
        loops: Time derivatives of the solved loop angles, and of other angles that callers add,
            keyed by angle.
        q: The coordinates.
    """

    terms: Terms
    loops: dict[sp.Symbol, LoopRate]
    q: tuple[sp.Symbol, ...]

    def units(self) -> list[Tangent]:
        """Return the rates of all terms, once for unit velocity of each coordinate."""
        return [self._of({symbol: sp.Integer(1)}) for symbol in self.q]

    def along(self, qd: Sequence[sp.Symbol]) -> Tangent:
        """Return the rates of all terms at the coordinate velocities qd."""
        return self._of(dict(zip(self.q, qd, strict=True)))

    def twice(self, qd: Sequence[sp.Symbol], qdd: Sequence[sp.Symbol]) -> Tangent:
        """Return the time derivatives of the rates at the accelerations qdd."""
        pairs = (*zip(self.q, qd, strict=True), *zip(qd, qdd, strict=True))
        return self._of(dict(pairs))

    def _of(self, rates: dict[sp.Symbol, sp.Expr]) -> Tangent:
        return Tangent(self.terms, rates, self.loops)


class ThroughLoops:
    """Motion of the joints of a robot with loops."""

    def __init__(self, values: Sequence[sp.Expr], rates: LoopRates) -> None:
        self.values, self._rates = tuple(values), rates
        self._units = rates.units()
        self._D_q: list[list[sp.Expr]] | None = None

    def D_q(self) -> Matrix:
        """Return the derivatives of the joint values from the implicit function theorem."""
        if self._D_q is None:
            self._D_q = [[unit.of(value) for unit in self._units] for value in self.values]
        return self._D_q

    def D_q_dot(self, qd: Sequence[sp.Symbol]) -> Matrix:
        """Return the time derivative of the matrix ``D_q``."""
        along = self._rates.along(qd)
        return [along.of_each(row) for row in self.D_q()]

    def D_q_q(self) -> Sequence[Matrix]:
        """Return the second derivatives of the joint values, one matrix per coordinate."""
        return [[unit.of_each(row) for row in self.D_q()] for unit in self._units]

    def speeds(self, qd: Sequence[sp.Symbol]) -> list[sp.Expr]:
        """Compute the time derivatives of the joint values without using the matrix ``D_q``."""
        return self._rates.along(qd).of_each(self.values)

    def accelerations(self, qd: Sequence[sp.Symbol], qdd: Sequence[sp.Symbol]) -> list[sp.Expr]:
        """Return the joint accelerations at coordinate velocities qd and accelerations qdd."""
        return self._rates.twice(qd, qdd).of_each(self.speeds(qd))
