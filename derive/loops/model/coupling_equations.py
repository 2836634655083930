"""Equations of couplings between joints: joint - sum(ratio * leader) - offset = 0.

A coupling, such as a gear pair, is a closure equation that is linear in the configuration.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from chasles.contract import keeps_full_turns

from ...model.coupling import Coupling
from ...model.mechanism import Mechanism, Strut
from ...model.robot import Joint
from ...terms.terms import Terms


@dataclass(frozen=True)
class CouplingEquation:
    """The equation of one coupling between joint or cylinder coordinates.

    Attributes:
        coupling: The coupling.
        residual: Coordinate of the coupled joint minus the value that the coupling computes from
            the leader joints.
        units: Unit of the residual: m for a length, 1 for an angle.
    """

    coupling: Coupling
    residual: tuple[sp.Expr]
    units: tuple[str]

    @property
    def name(self) -> str:
        """Name of the coupled joint."""
        return self.coupling.joint

    @property
    def kind(self) -> str:
        """The text ``coupling``."""
        return "coupling"

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints and cylinders in the coupling equation."""
        return self.coupling.joint, *(name for name, _ in self.coupling.ratios)


def coupling_equations(
    mechanism: Mechanism, terms: Terms, values: Mapping[str, sp.Expr]
) -> tuple[CouplingEquation, ...]:
    """Return the equations of all couplings in the order of the description.

    Args:
        mechanism: The description.
        terms: Receives the terms.
        values: Symbolic values of joints and cylinders by name (radian or meter).
    """
    return tuple(
        CouplingEquation(c, (terms.let(residual_of(c, values)),), (unit_of(mechanism, c),))
        for c in mechanism.couplings
    )


def residual_of(coupling: Coupling, values: Mapping[str, sp.Expr]) -> sp.Expr:
    """Return the joint value minus the value that the coupling computes from the leader joints."""
    leaders = (ratio * values[name] for name, ratio in coupling.ratios)
    return sp.Add(values[coupling.joint], -coupling.offset, *(-part for part in leaders))


def chord(terms: Terms, angle: sp.Expr) -> sp.Expr:
    """Return 2 sin(angle / 2), which is 0 at full turns and approximates a small angle."""
    return 2 * terms.let(sp.sin(terms.let(angle / 2)))


def unit_of(mechanism: Mechanism, coupling: Coupling) -> str:
    """Return the unit of a coupling equation: m for a prismatic joint or cylinder, otherwise 1."""
    return "m" if is_length(mechanism.members[coupling.joint]) else "1"


def is_length(member: Joint | Strut) -> bool:
    """Whether the coordinate of a joint or cylinder is a length."""
    return isinstance(member, Strut) or member.kind == "prismatic"


def joint_couplings(mechanism: Mechanism, names: Sequence[str]) -> tuple[tuple[float, ...], ...]:
    """Return the factors of the joints in the coupling equations, with one row per coupling.

    Each coupling keeps one sum constant: the sum of all joint values times the factors in the
    coupling's row.

    Args:
        mechanism: The description.
        names: Names of the joints and cylinders, in the order of the columns.
    """
    return tuple(
        tuple(
            float(name == coupling.joint) - float(dict(coupling.ratios).get(name, 0))
            for name in names
        )
        for coupling in mechanism.couplings
    )


def turning_coordinates(mechanism: Mechanism, terms: Terms) -> list[bool]:
    """Return, for each coordinate, whether its full turn turns all coupled joints by full turns."""
    names = [*mechanism.members]
    rows = joint_couplings(mechanism, names)
    is_angle = [not is_length(member) for member in mechanism.members.values()]
    return [
        c.unit == "rad"
        and abs(float(terms.value(c.ratio))) == 1
        and keeps_full_turns(names.index(c.moves), rows, is_angle)
        for c in mechanism.coordinates
    ]


@dataclass(frozen=True)
class NumericCouplings:
    """The equations of the couplings in double precision: residual = rows @ values - offsets.

    Attributes:
        mechanism: The description.
        names: Names of all joints and cylinders, in the order of the columns.
    """

    mechanism: Mechanism
    names: tuple[str, ...]

    @cached_property
    def rows(self) -> NDArray[np.float64]:
        """The factors of the joints in the couplings, shape (couplings, names)."""
        return np.reshape(joint_couplings(self.mechanism, self.names), (-1, len(self.names)))

    @cached_property
    def offsets(self) -> NDArray[np.float64]:
        """The offsets of the couplings (radian or meter)."""
        return np.array([float(coupling.offset) for coupling in self.mechanism.couplings])

    @cached_property
    def is_turn(self) -> tuple[bool, ...]:
        """For each coupling equation, whether the equation compares angles."""
        return tuple(unit_of(self.mechanism, c) == "1" for c in self.mechanism.couplings)

    def errors(self, values: Mapping[str, Any]) -> NDArray[np.float64]:
        """Return the residuals of all couplings, shape (..., couplings).

        Each entry of ``values`` is a number or an array of shape (...).
        """
        if not self.mechanism.couplings:
            return np.zeros(0)
        stacked = np.stack(np.broadcast_arrays(*(values[name] for name in self.names)), axis=-1)
        found: NDArray[np.float64] = stacked @ self.rows.T - self.offsets
        return found
