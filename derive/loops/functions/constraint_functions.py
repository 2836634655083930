"""Symbolic functions for the closure equations of the loops and for their derivatives."""

from collections.abc import Mapping

from ...terms.role import Role
from ...terms.symbolic_function import Result, SymbolicFunction
from ..closing.loop_model import LoopModel
from ..model.constraints import ClosureEquations, constraints, jacobian, jacobian_dot
from .maps import Maker


def equations(h: LoopModel) -> tuple[ClosureEquations, ...]:
    """Return the independent scalar loop equations as functions of the joint variables z."""
    z, is_open = h.arguments["z"].symbols, h.least_squares_closure is not None
    return h.terms.memoize(
        ("loop equations", h),
        lambda: constraints(h.mechanism, h.terms, z, may_stay_open=is_open),
    )


def constraint(h: LoopModel) -> SymbolicFunction:
    """Build the function for the residuals of all loops."""
    entries = [entry for loop in equations(h) for entry in loop.residual]
    names = ", ".join(f"{loop.name} ({len(loop.residual)})" for loop in equations(h))
    return h.function(
        "constraint",
        "Residuals of the loop closure equations, zero if the loops are closed.",
        f"independent scalar equations of each loop: {names}",
        ("z",),
        Result("residual", tuple(entries), (len(entries),), "m or 1", "residuals"),
        role=Role("constraint"),
    )


def constraint_D_z(h: LoopModel) -> SymbolicFunction:
    """Build the function for the constraint Jacobian."""
    rows = jacobian(equations(h), h.terms, h.arguments["z"].symbols)
    return h.function(
        "constraint_D_z",
        "Derivative of the closure equations with respect to the full configuration.",
        "constraint_D_z(z) zd = 0 for every motion that keeps the loops closed",
        ("z",),
        _matrix("residual_D_z", rows, "1, m, 1/m", "constraint Jacobian"),
        role=Role("constraint derivative"),
    )


def constraint_D_z_dot(h: LoopModel) -> SymbolicFunction:
    """Build the function for the time derivative of the constraint Jacobian."""
    z, zd = (h.arguments[name].symbols for name in ("z", "zd"))
    rows = jacobian_dot(equations(h), h.terms, z, zd)
    return h.function(
        "constraint_D_z_dot",
        "Time derivative of the constraint Jacobian.",
        "constraint_D_z(z) zdd + constraint_D_z_dot(z, zd) zd = 0",
        ("z", "zd"),
        _matrix("residual_D_z_dot", rows, "1/s, m/s, 1/(m s)", "rate of the constraint Jacobian"),
        role=Role("constraint rate"),
    )


def makers(h: LoopModel) -> dict[str, Maker]:
    """Return the builders of the constraint functions, keyed by function name."""
    return dict(_EQUATIONS) if h.mechanism.is_constrained else {}


def _matrix(name: str, rows: tuple[tuple[object, ...], ...], unit: str, meaning: str) -> Result:
    entries = tuple(entry for row in rows for entry in row)
    return Result(name, entries, (len(rows), len(rows[0])), unit, meaning)


_EQUATIONS: Mapping[str, Maker] = {
    "constraint": constraint,
    "constraint_D_z": constraint_D_z,
    "constraint_D_z_dot": constraint_D_z_dot,
}
