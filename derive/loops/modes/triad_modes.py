"""All assembly modes of a planar platform on three legs: the function ``modes``."""

import math
from dataclasses import dataclass

from ...terms.role import Role
from ...terms.symbolic_function import Argument, NativeSolverFunction, Result, Tables
from ..solve.solved_loops import SolvedLoops
from .triad import Triad

SLOTS, CHAIN = 6, 3
OPERATIONS = 12_000
"""Approximate number of operations of ``modes``. The polynomial roots need 6,000 operations, and
each of the six assembly modes needs 1,000 operations."""
CALLS = (
    "assembly_polynomial",
    "assembly_position",
    "assembly_mirror",
)


@dataclass(frozen=True)
class TriadTables(Tables):
    """The size of the platform (meter), which scales tolerances of lengths."""

    size: float


def modes(h: SolvedLoops, triad: Triad) -> NativeSolverFunction:
    """Return the function ``modes`` of a platform on three planar legs."""
    if h.mechanism.closures:
        size = float(f"{h.numbers.size:.3g}")
        return written_modes(h.arguments["q"], size, "legs")
    return written_modes(h.arguments["q"], _size(h, triad))


def written_modes(q: Argument, size: float, legs: str = "rods") -> NativeSolverFunction:
    """Return the function ``modes`` of a planar platform, from its size and its leg residuals.

    Args:
        q: The actuated coordinates.
        size: The size of the platform (meter), which scales tolerances of lengths.
        legs: Name of the function that returns the leg residuals.
    """
    return NativeSolverFunction(
        "modes",
        f"Every assembly mode of the platform, up to {SLOTS}, sorted by phi.",
        "|b_i(theta[k]) - a_i(q)| = l_i if theta[k] is finite"
        if legs == "rods"
        else f"{legs}(theta[k], q) = 0 if theta[k] is finite",
        (q,),
        (
            Result("theta", (), (SLOTS, CHAIN), "m, rad", "main-chain joints, one mode per row"),
            Result(
                "margin",
                (),
                (SLOTS,),
                "1",
                "|det J_x| over the product of its row norms: 0 if the platform is singular and "
                "two modes coincide",
            ),
            Result("unsure", (), (1,), "1", "0 if certainly no mode is missing"),
        ),
        "triad",
        TriadTables(size),
        (*CALLS, legs, f"{legs}_D_chain"),
        SLOTS,
        OPERATIONS,
        role=Role("modes", "actuators", "chain"),
    )


def _size(h: SolvedLoops, triad: Triad) -> float:
    """Return the largest rod length or distance between platform pins (meter)."""
    pins = [[float(h.terms.value(x)) for x in point] for point in triad.b]
    sizes = [math.dist(one, other) for one in pins for other in pins]
    sizes += [float(h.terms.value(length)) for length in triad.L if h.terms.is_constant(length)]
    return float(f"{max(sizes):.3g}") or 1.0
