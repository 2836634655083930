"""Generates the C tables for the limits of passive joints and cylinders in loops."""

import math
from collections.abc import Iterator

from chasles.contract import LimitedVariable

from ...derivation import Derivation
from ...loops.model.coupling_equations import is_length
from ...model.mechanism import Mechanism
from .windings import nearest_slots

PASSIVE = "chasles_passive.h"


def limited_variables(derivation: Derivation) -> tuple[LimitedVariable, ...]:
    """Return the passive joints and cylinders of a mechanism that have limits.

    A full turn of a joint without a coupling does not change the configuration. An uncoupled
    revolute joint is included only if it has two limits that are less than a full turn apart.
    """
    mechanism, hybrid = derivation.robot, derivation.hybrid
    functions = {f.name for f in (*derivation.functions, *derivation.written)}
    if not isinstance(mechanism, Mechanism) or hybrid is None or "configuration" not in functions:
        return ()
    moved = {c.moves for c in mechanism.coordinates}
    found = []
    for k, variable in enumerate(hybrid.variables):
        member = mechanism.members.get(variable.name)
        if member is None or variable.name in moved:
            continue
        lower, upper = (None if limit is None else float(limit) for limit in member.limits)
        turns = not is_length(member) and variable.name not in mechanism.coupled
        is_narrow = lower is not None and upper is not None and upper - lower < math.tau
        if is_narrow or (not turns and (lower, upper) != (None, None)):
            found.append(LimitedVariable(k, lower, upper, turns))
    return tuple(found)


def limited_names(derivation: Derivation) -> tuple[str, ...]:
    """Return the names of the passive joints and cylinders that have limits."""
    assert derivation.hybrid is not None
    names = [variable.name for variable in derivation.hybrid.variables]
    return tuple(names[v.index] for v in limited_variables(derivation))


def passive_tables(derivation: Derivation) -> Iterator[str]:
    """Yield C code: tables of passive joint limits, and the function chasles_nearest_slots."""
    variables, name = limited_variables(derivation), derivation.robot.name
    assert derivation.hybrid is not None
    size, m = len(derivation.hybrid.variables), len(variables)
    n = len(derivation.robot.coordinates)
    index = ", ".join(str(v.index) for v in variables)
    turns = ", ".join("CHASLES_FULL_TURN" if v.turns else "0" for v in variables)
    yield from (
        f'#include "{PASSIVE}"',
        "",
        f"static const int {name}_limited[{m}] = {{{index}}};",
        f"static const double {name}_limited_turn[{m}] = {{{turns}}};",
        f"static int {name}_passive_inside(const chasles_moves *moves, const double *q)",
        "{",
        f"  double z[{size}];",
        f"  {name}_configuration(q, z);",
        f"  return chasles_passive_inside(moves, {n}, {m}, {name}_limited,",
        f"      {name}_limited_turn, z);",
        "}",
        f"static const chasles_passive {name}_passive_limits = {{{m}, {name}_passive_inside}};",
        "",
        *nearest_slots(name, "passive", "passive_limits"),
    )
