"""Conversion between controller readings and true coordinates.

A calibration identifies drive gains, periodic drive errors and joint compliance together with the
geometry. Kinematic functions such as ``fk`` use the true coordinates q. The functions
``coordinates_from_readings`` and ``readings_from_coordinates`` relate the coordinates q to the
controller readings r:

    T = fk(coordinates_from_readings(r)),
    r = readings_from_coordinates(q), where q is one of ik(T).

Newton's method computes the reading of each drive. Newton's method starts at r = q / gain and
converges quadratically. Springs couple the drives, so the computation of the readings is repeated.
Each repetition computes the joint deflections from the readings of the previous repetition.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from ..model.errors import DescriptionError
from ..model.mechanism import Described
from ..model.placements import align_z, inverse, translation
from ..model.robot import Joint, Load, PointMass, SerialRobot, Springs, Transmission
from ..model.tolerances import MAX_SAG
from ..terms.symbolic_function import Argument, Result, SymbolicFunction
from ..terms.terms import Terms
from .gravity import gravity_torques, most_stiffness
from .kinematics import coordinates

TRANSMISSIONS = ("coordinates_from_readings", "readings_from_coordinates")
"""Names of the functions that exist only for robots with transmissions or springs."""
_STEPS = 3
_ROUNDS = 12


def transmissions(robot: Described, terms: Terms, q: Argument) -> dict[str, SymbolicFunction]:
    """Return ``coordinates_from_readings`` and ``readings_from_coordinates``, keyed by name.

    The dictionary is empty for a robot with ideal drives and rigid joints.

    Args:
        robot: The description.
        terms: Table of named terms.
        q: The true coordinates.

    Raises:
        DescriptionError: A joint is so compliant that the motor readings may not determine its
            coordinate.
    """
    springs = robot.springs if isinstance(robot, SerialRobot) else None
    if not robot.transmissions and springs is None:
        return {}
    given = {law.coordinate: law for law in robot.transmissions}
    laws = [given.get(c.name, Transmission(c.name)) for c in robot.coordinates]
    shown = coordinates("r", len(laws))
    r = Argument("r", shown, q.shape, q.unit, "readings of the controller")
    both = _Laws(terms, laws, _Sag.of(robot, springs) if isinstance(robot, SerialRobot) else None)
    return {
        TRANSMISSIONS[0]: _made(
            TRANSMISSIONS[0],
            "True coordinates from the readings of the controller.",
            f"q = gain r + waves(r){' + compliance tau(r)' if springs else ''}",
            r,
            Result("q", both.true(shown), q.shape, q.unit, q.meaning),
            terms,
        ),
        TRANSMISSIONS[1]: _made(
            TRANSMISSIONS[1],
            "Readings of the controller at true coordinates.",
            "coordinates_from_readings(readings_from_coordinates(q)) = q",
            q,
            Result("r", both.shown(q.symbols), q.shape, q.unit, r.meaning),
            terms,
        ),
    }


@dataclass(frozen=True)
class _Sag:
    springs: Springs
    chain: SerialRobot

    @classmethod
    def of(cls, robot: SerialRobot, springs: Springs | None) -> "_Sag | None":
        if springs is None:
            return None
        chain, load = _chain(robot, springs)
        stiffness = most_stiffness(chain, load)
        for row, most in zip(springs.rows, stiffness, strict=True):
            if abs(float(row.compliance)) * most > MAX_SAG:
                raise DescriptionError(
                    f"spring of {row.coordinate!r}: expected a compliance of at most "
                    f"{MAX_SAG / most:.3g}, got {float(row.compliance):.3g}; with a larger "
                    "compliance, the computation of the joint deflection may not converge"
                )
        return cls(springs, chain)

    def at(self, terms: Terms, r: Sequence[sp.Expr]) -> list[sp.Expr]:
        load = self.chain.load
        if load is None:
            return [sp.S.Zero for _ in r]
        torques = gravity_torques(self.chain, load, terms, r).values
        rows = zip(self.springs.rows, torques, strict=True)
        return [terms.let(row.compliance * torque) for row, torque in rows]


@dataclass(frozen=True)
class _Laws:
    terms: Terms
    laws: Sequence[Transmission]
    sag: _Sag | None

    def true(self, r: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
        driven = [_value(self.terms, law, s) for law, s in zip(self.laws, r, strict=True)]
        if self.sag is None:
            return tuple(driven)
        sags = self.sag.at(self.terms, r)
        return tuple(self.terms.let(a + b) for a, b in zip(driven, sags, strict=True))

    def shown(self, q: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
        r = self._driven_back(q)
        if self.sag is None:
            return r
        for _ in range(_ROUNDS):
            sags = self.sag.at(self.terms, r)
            r = self._driven_back([self.terms.let(a - b) for a, b in zip(q, sags, strict=True)])
        return r

    def _driven_back(self, q: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
        return tuple(_inverted(self.terms, law, s) for law, s in zip(self.laws, q, strict=True))


def _chain(robot: SerialRobot, springs: Springs) -> tuple[SerialRobot, Load]:
    joints, masses = [], []
    for row, joint in zip(springs.rows, robot.coordinates, strict=True):
        to_axis = translation(*row.point) + align_z(row.axis)
        joints.append(
            Joint(
                row.coordinate,
                joint.kind,
                to_axis,
                inverse(to_axis),
                row.coordinate,
                limits=joint.limits,
            )
        )
        masses.append(PointMass(row.coordinate, row.mass, row.center))
    load = Load(tuple(masses), springs.gravity)
    return SerialRobot(robot.name, tuple(joints), load=load), load


def _value(terms: Terms, law: Transmission, r: sp.Expr) -> sp.Expr:
    sin1, cos1, sin2, cos2 = law.waves
    if not any(law.waves):
        return terms.let(law.gain * r)
    c, s = terms.cos_sin(r)
    double = 2 * sin2 * s * c + cos2 * (c**2 - s**2)
    return terms.let(law.gain * r + sin1 * s + cos1 * c + double)


def _rate(terms: Terms, law: Transmission, r: sp.Expr) -> sp.Expr:
    sin1, cos1, sin2, cos2 = law.waves
    c, s = terms.cos_sin(r)
    double = 2 * sin2 * (c**2 - s**2) - 4 * cos2 * s * c
    return terms.let(law.gain + sin1 * c - cos1 * s + double)


def _inverted(terms: Terms, law: Transmission, q: sp.Expr) -> sp.Expr:
    r = terms.let(q / law.gain)
    for _ in range(_STEPS if any(law.waves) else 0):
        r = terms.let(r - (_value(terms, law, r) - q) / _rate(terms, law, r))
    return r


def _made(
    name: str, summary: str, identity: str, argument: Argument, result: Result, terms: Terms
) -> SymbolicFunction:
    return SymbolicFunction(name, summary, identity, (argument,), (result,), terms)
