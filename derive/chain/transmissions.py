"""The laws of drives that do not run true, in both directions.

A calibration finds gains and waves of drives beside the geometry. All other functions take the true
coordinates q; these two convert between q and the values m that the controller shows, so that

    T = fk(joints_from_motors(m))    and    m = motors_from_joints(q), q one of ik(T).

The way back is Newton's iteration from m = q / gain, whose steps square the error.
"""

import sympy as sp

from ..model.mechanism import Described
from ..model.robot import Transmission
from ..terms.symbolic_function import Argument, Result, SymbolicFunction
from ..terms.terms import Terms
from .kinematics import coordinates

TRANSMISSIONS = ("joints_from_motors", "motors_from_joints")
"""The functions of robots with transmissions."""
_STEPS = 3


def transmissions(robot: Described, terms: Terms, q: Argument) -> dict[str, SymbolicFunction]:
    """Both functions by name; none where all drives run true.

    Args:
        robot: The description.
        terms: Receives the named terms.
        q: The true coordinates.
    """
    if not robot.transmissions:
        return {}
    given = {law.of: law for law in robot.transmissions}
    laws = [given.get(c.name, Transmission(c.name)) for c in robot.coordinates]
    shown = coordinates("m", len(laws))
    m = Argument("m", shown, q.shape, q.unit, "coordinates as the controller shows them")
    true = [_value(terms, law, s) for law, s in zip(laws, shown, strict=True)]
    back = [_inverted(terms, law, s) for law, s in zip(laws, q.symbols, strict=True)]
    return {
        TRANSMISSIONS[0]: _made(
            TRANSMISSIONS[0],
            "True coordinates from those that the controller shows.",
            "q = gain m + waves(m)",
            m,
            Result("q", tuple(true), q.shape, q.unit, q.meaning),
            terms,
        ),
        TRANSMISSIONS[1]: _made(
            TRANSMISSIONS[1],
            "Coordinates as the controller takes them, from the true ones.",
            "joints_from_motors(motors_from_joints(q)) = q",
            q,
            Result("m", tuple(back), q.shape, q.unit, m.meaning),
            terms,
        ),
    }


def _value(terms: Terms, law: Transmission, m: sp.Expr) -> sp.Expr:
    """The named true value at m."""
    sin1, cos1, sin2, cos2 = law.waves
    if not any(law.waves):
        return terms.let(law.gain * m)
    c, s = terms.cos_sin(m)
    double = 2 * sin2 * s * c + cos2 * (c**2 - s**2)
    return terms.let(law.gain * m + sin1 * s + cos1 * c + double)


def _rate(terms: Terms, law: Transmission, m: sp.Expr) -> sp.Expr:
    """The named derivative of the true value by m."""
    sin1, cos1, sin2, cos2 = law.waves
    c, s = terms.cos_sin(m)
    double = 2 * sin2 * (c**2 - s**2) - 4 * cos2 * s * c
    return terms.let(law.gain + sin1 * c - cos1 * s + double)


def _inverted(terms: Terms, law: Transmission, q: sp.Expr) -> sp.Expr:
    """The named m of a true value."""
    m = terms.let(q / law.gain)
    for _ in range(_STEPS if any(law.waves) else 0):
        m = terms.let(m - (_value(terms, law, m) - q) / _rate(terms, law, m))
    return m


def _made(
    name: str, summary: str, identity: str, argument: Argument, result: Result, terms: Terms
) -> SymbolicFunction:
    return SymbolicFunction(name, summary, identity, (argument,), (result,), terms)
