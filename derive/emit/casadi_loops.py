"""CasADi functions through loops without a closed form: implicit functions with derivatives."""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from ..derivation import Derivation
from ..loops.iterated.closure_equations import LoopClosure
from ..model.tolerances import FOUND_LOOP
from ..terms.casadi_graph import lower, whole
from ..terms.symbolic_function import SymbolicFunction

STATIONS = 8
"""Points of the straight line from the reference, each the start of the next: so many bring every
robot within its limits to its branch."""
OPTIONS = {
    "error_on_fail": False,
    "max_iter": 20,
    "abstol": 1e-16,
    "abstolStep": 1e-14,
    "line_search": False,
}


def with_loops(
    derivation: Derivation, closure: LoopClosure, kept: Sequence[SymbolicFunction]
) -> ca.Function:
    """The functions of positions of a robot whose loops have no closed form.

    The joints at q are found by ``casadi.rootfinder``, along the straight line from the reference;
    CasADi differentiates the result by the implicit function theorem.

    Args:
        derivation: The robot.
        closure: The equations of its loops.
        kept: Its functions of positions.

    Returns:
        A function with an output for each function.
    """
    arguments = {a.name: a.size for f in kept for a in f.inputs}
    inputs = {name: ca.MX.sym(name, size) for name, size in arguments.items()}
    values = inputs | ({"w": _variables(closure, inputs["q"])} if _calling(kept) else {})
    outputs = {
        f.name: whole([f], f.name)(*(values[argument.name] for argument in f.arguments))
        for f in kept
    }
    name = derivation.robot.name
    return ca.Function(
        name, list(inputs.values()), list(outputs.values()), list(inputs), list(outputs)
    )


def _calling(kept: Sequence[SymbolicFunction]) -> bool:
    return any(function.calls for function in kept)


def _variables(closure: LoopClosure, q: ca.MX) -> ca.MX:
    """The variables w of the loops at coordinates."""
    start, ratios = closure.start, np.array(closure.ratios)
    solver = _solver(closure)
    u = ca.MX(start.w[closure.unknown])
    for k in range(1, STATIONS + 1):
        at = start.q + k / STATIONS * (q - start.q) if k < STATIONS else q
        u = solver(u, ratios * at)
    unknown = {k: u[i] for i, k in enumerate(closure.unknown)}
    actuated = {k: ratios[i] * q[i] for i, k in enumerate(closure.given)}
    values = unknown | actuated
    w = ca.vertcat(*(values[k] for k in range(len(closure.names))))
    residual = lower([closure.functions["closure"]], "left")[0](w)[0]
    # Where the loops do not close the iteration ends somewhere.
    closed: ca.MX = w + ca.if_else(ca.norm_inf(residual) <= FOUND_LOOP, 0, np.nan)
    return closed


def _solver(closure: LoopClosure) -> ca.Function:
    """The unknown variables at actuated ones, from a start.

    Where there are more equations than unknowns, the gradient of their sum of squares is zero.
    """
    u, a = ca.SX.sym("u", len(closure.unknown)), ca.SX.sym("a", len(closure.given))
    values = {k: u[i] for i, k in enumerate(closure.unknown)}
    values |= {k: a[i] for i, k in enumerate(closure.given)}
    w = ca.vertcat(*(values[k] for k in range(len(closure.names))))
    residual = lower([closure.functions["closure"]], "of")[0](w)[0]
    if residual.numel() > u.numel():
        residual = ca.mtimes(ca.jacobian(residual, u).T, residual)
    equations = ca.Function("equations", [u, a], [residual], ["u", "a"], ["residual"])
    return ca.rootfinder("loops", "newton", equations, OPTIONS)
