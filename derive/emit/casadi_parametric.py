"""The CasADi function ``fk_p`` through loops whose geometry is an input, with its derivatives."""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from ..loops.parametric.parametric_loops import START, ParametricLoops
from ..model.tolerances import FOUND_LOOP
from ..terms.casadi_graph import lower, whole
from ..terms.symbolic_function import SymbolicFunction
from .casadi_loops import OPTIONS


def with_geometry(
    loops: ParametricLoops, joined: ca.Function, kept: Sequence[SymbolicFunction]
) -> ca.Function:
    """The functions of positions of a robot with loops, and ``fk_p(q, p)``.

    The unknown variables are found by ``casadi.rootfinder`` from the posture of the nominal robot
    at q; CasADi differentiates the result by the implicit function theorem.

    Args:
        loops: The equations of the loops of any geometry.
        joined: The robot's functions of positions, those through its loops included.
        kept: Those in closed form.
    """
    p = ca.MX.sym("p", loops.arguments["p"].size)
    inputs = {name: ca.MX.sym(name, joined.numel_in(name)) for name in joined.name_in()}
    # Each has its own inputs alone: a call of all would make every output depend on all of them.
    if joined.is_a("SXFunction"):
        outputs = {f.name: whole([f], f.name)(*(inputs[a.name] for a in f.inputs)) for f in kept}
    else:
        results = joined.call(list(inputs.values()), True, False)
        outputs = dict(zip(joined.name_out(), results, strict=True))
    q = inputs["q"]
    names = [variable.name for variable in loops.hybrid.variables]
    posture = outputs[START]
    start = ca.vertcat(*(posture[names.index(variable.name)] for variable in loops.unknown))
    closed = _solver(loops)(start, ca.vertcat(q, p))
    w = ca.vertcat(q, closed)
    residual, _ = _lowered(loops, "closure_p")(w, p)
    # Where the loops do not close the iteration ends somewhere.
    w = w + ca.if_else(ca.norm_inf(residual) <= FOUND_LOOP, 0, np.nan)
    outputs["fk_p"] = whole([loops.inner["tool_p"]], "tool_p")(w, p)
    return ca.Function(
        joined.name(),
        [*inputs.values(), p],
        list(outputs.values()),
        [*inputs, "p"],
        list(outputs),
    )


def _solver(loops: ParametricLoops) -> ca.Function:
    """The unknown variables at coordinates and geometry, from a start."""
    n, count = loops.arguments["q"].size, loops.arguments["p"].size
    u, given = ca.SX.sym("u", len(loops.unknown)), ca.SX.sym("given", n + count)
    residual, _ = _lowered(loops, "closure_p")(ca.vertcat(given[:n], u), given[n:])
    equations = ca.Function("equations", [u, given], [residual], ["u", "given"], ["residual"])
    return ca.rootfinder("loops_p", "newton", equations, OPTIONS)


def _lowered(loops: ParametricLoops, name: str) -> ca.Function:
    return lower([loops.inner[name]], "of")[0]
