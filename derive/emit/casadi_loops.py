"""Builds differentiable CasADi functions for robots whose loops are solved by iteration."""

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from ..derivation import Derivation
from ..loops.iterated.closure_equations import RESIDUAL, LoopClosure
from ..loops.iterated.iteration import FIRST
from ..loops.parametric.parametric_loops import START, SYSTEM, ParametricLoops
from ..model.tolerances import FOUND_LOOP
from ..terms.casadi_graph import combined, lower
from ..terms.symbolic_function import SymbolicFunction, systems_of

STATIONS = 8
"""Number of points on the line from the reference coordinates to the given coordinates. At each
point of this line, the loops are solved by iteration from the solution at the previous point."""
OPTIONS = {
    "error_on_fail": False,
    "max_iter": 20,
    "abstol": 1e-16,
    "abstolStep": 1e-14,
}


def with_loops(derivation: Derivation, kept: Sequence[SymbolicFunction]) -> ca.Function:
    """Build the position functions of a robot whose loops are solved by iteration.

    ``casadi.rootfinder`` computes the loop variables w. CasADi differentiates the loop variables w
    with the implicit function theorem.

    Args:
        derivation: The robot.
        kept: The position functions of the robot in derivation order.

    Returns:
        A CasADi function.
    """
    arguments = {a.name: a.size for f in kept for a in f.inputs}
    inputs = {name: ca.MX.sym(name, size) for name, size in arguments.items()}
    solved: dict[str, ca.MX] = {}
    outputs: dict[str, ca.MX] = {}
    for f in kept:
        values = dict(inputs)
        for system in systems_of([f]):
            if system not in solved:
                solved[system] = (
                    _of_geometry(derivation.parametric_loops, inputs, outputs[START])
                    if system == SYSTEM
                    else _variables(derivation.closure, inputs["q"])
                )
            values["w"] = solved[system]
        for call in f.calls:
            if not call.system:
                (called,) = lower([derivation.function(call.entry)], "called")
                (array,) = call.outputs
                values[array.name] = called(*(values[name] for name in call.inputs))
        outputs[f.name] = combined([f], f.name)(*(values[a.name] for a in f.arguments))
    name = derivation.robot.name
    return ca.Function(
        name, list(inputs.values()), list(outputs.values()), list(inputs), list(outputs)
    )


def is_of_positions(function: SymbolicFunction) -> bool:
    """Return whether a function calls loop solvers only to compute positions."""
    return all(
        not call.system or (call.entry == FIRST and call.system in ("loops", SYSTEM))
        for call in function.calls
    )


def _variables(closure: LoopClosure | None, q: ca.MX) -> ca.MX:
    """Return the loop variables w at the coordinates q.

    The solver tracks the loop variables along a straight line from the reference coordinates to q.
    """
    assert closure is not None
    start, ratios = closure.start, np.array(closure.ratios)
    (residual,) = lower([closure.functions[RESIDUAL]], "of")
    symbols, none = ca.SX.sym("w", len(closure.names)), ca.SX.sym("none", 0)
    solver = _solver(symbols, none, residual(symbols)[0], closure.given, closure.unknown)
    u = ca.MX(start.w[closure.unknown])
    for k in range(1, STATIONS + 1):
        at = start.q + k / STATIONS * (q - start.q) if k < STATIONS else q
        u = solver(u, ratios * at)
    found = dict(zip(closure.unknown, ca.vertsplit(u), strict=True))
    found |= dict(zip(closure.given, ca.vertsplit(ratios * q), strict=True))
    w = ca.vertcat(*(found[k] for k in range(len(closure.names))))
    return _while_closed(w, residual(w)[0])


def _of_geometry(
    loops: ParametricLoops | None, inputs: Mapping[str, ca.MX], configuration: ca.MX
) -> ca.MX:
    """Return the loop variables w for the coordinates q and the geometric parameters p."""
    assert loops is not None
    q, p = inputs["q"], inputs["p"]
    names, n = [variable.name for variable in loops.hybrid.variables], len(loops.hybrid.q)
    (residual,) = lower([loops.inner["closure_p"]], "of")
    symbols, geometry = ca.SX.sym("w", loops.arguments["w"].size), ca.SX.sym("p", p.numel())
    unknown = range(n, symbols.numel())
    solver = _solver(symbols, geometry, residual(symbols, geometry)[0], range(n), unknown)
    start = ca.vertcat(*(configuration[names.index(variable.name)] for variable in loops.unknown))
    w = ca.vertcat(q, solver(start, ca.vertcat(q, p)))
    return _while_closed(w, residual(w, p)[0])


def _while_closed(w: ca.MX, residual: ca.MX) -> ca.MX:
    """Return the loop variables, or NaN if the loops do not close."""
    closed: ca.MX = w + ca.if_else(ca.norm_inf(residual) <= FOUND_LOOP, 0, np.nan)
    return closed


def _solver(
    w: ca.SX, p: ca.SX, residual: ca.SX, given: Sequence[int], unknown: Sequence[int]
) -> ca.Function:
    u, a = w[list(unknown)], w[list(given)]
    if residual.numel() > u.numel():
        # An overdetermined system is solved by least squares.
        residual = ca.mtimes(ca.jacobian(residual, u).T, residual)
    inputs, names = [u, ca.vertcat(a, p)], ["u", "a"]
    equations = ca.Function("equations", inputs, [residual], names, ["residual"])
    # CasADi generates C for the plugin "fast_newton", but not for the plugin "newton".
    return ca.rootfinder("loops", "fast_newton", equations, OPTIONS)
