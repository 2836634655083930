"""The functions that hold a robot's loops to account: constraints of the full configuration."""

from collections.abc import Mapping
from typing import NamedTuple

import sympy as sp

from .constraints import LoopEquations, constraints, jacobian, jacobian_dot
from .function import Argument, Result
from .hybrid import Hybrid
from .kinematics import coordinates
from .maps import Maker, SymbolicFunction


class Equations(NamedTuple):
    """The loops' equations over the symbols of z and of its rates."""

    loops: tuple[LoopEquations, ...]
    z: Argument
    zd: Argument


def equations(h: Hybrid) -> Equations:
    """The independent scalar equations of all loops."""
    count = len(h.variables)
    z, zd = (coordinates(name, count) for name in ("_z", "_zd"))
    return Equations(
        constraints(h.mechanism, h.scope, z),
        Argument("z", z, (count,), "rad or m", "full configuration"),
        Argument("zd", zd, (count,), "rad/s or m/s", "rates of the full configuration"),
    )


def constraint(h: Hybrid) -> SymbolicFunction:
    """The residuals."""
    found = h.equations
    entries = [entry for loop in found.loops for entry in loop.residual]
    names = ", ".join(f"{loop.name} ({len(loop.residual)})" for loop in found.loops)
    return SymbolicFunction(
        "constraint",
        "What the full configuration leaves open in the loops, zero where they are closed.",
        f"equations of: {names}; constraint(configuration(q)) = 0",
        (found.z,),
        (Result("residual", tuple(entries), (len(entries),), "m or 1", "residuals"),),
        h.scope,
    )
