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
POSES = ("pose", "link poses")


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
        A function whose outputs are ``configuration``, ``chain``, ``fk`` and so on, and ``kept``.
    """
    arguments = {a.name: a.size for f in kept for a in f.inputs} | {"q": len(closure.given)}
    inputs = {name: ca.MX.sym(name, size) for name, size in arguments.items()}
    outputs = {
        f.name: whole([f], f.name)(*(inputs[argument.name] for argument in f.inputs)) for f in kept
    }
    joints = _joints(closure, inputs["q"])
    h = closure.hybrid
    for name, names in {
        "configuration": [variable.name for variable in h.variables],
        "chain": [joint.name for joint in h.robot.moving],
        "passive": [variable.name for variable in h.passive_in_loops],
    }.items():
        if names:
            outputs[name] = ca.vertcat(*(joints[n] for n in names))
    for f in kept:
        called = f.role.of_actuators
        if called and f.role.name in POSES:
            outputs[called] = whole([f], f.name)(outputs["chain"])
    name = derivation.robot.name
    return ca.Function(
        name, list(inputs.values()), list(outputs.values()), list(inputs), list(outputs)
    )


def _joints(closure: LoopClosure, q: ca.MX) -> dict[str, ca.MX]:
    """The value of each joint, swing and cylinder at coordinates."""
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
    w = w + ca.if_else(ca.norm_inf(residual) <= FOUND_LOOP, 0, np.nan)
    found = {name: w[k] for k, name in enumerate(closure.names)}
    swings = closure.hybrid.mechanism.swings
    if swings:
        angles = lower([closure.functions["swings"]], "at")[0](w)[0]
        found |= {name: angles[k] for k, name in enumerate(swings)}
    return found


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
