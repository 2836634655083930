"""The maps between actuators, main chain and passive joints of a robot with loops."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import sympy as sp

from ..terms.role import Role, branch_label, side_of
from ..terms.symbolic_function import Result, SymbolicFunction, matrix_entries
from ..terms.tangents import Tangent, derivative_columns
from .agreement import allowed
from .hybrid import Hybrid
from .planar.reference import Joined
from .solution import Solution

Maker = Callable[[Hybrid], SymbolicFunction]


def chain(h: Hybrid) -> SymbolicFunction:
    """The main chain's joints from the actuators."""
    names = ", ".join(joint.name for joint in h.robot.moving)
    return h.function(
        "chain",
        "Joints of the main chain, angles between -pi and pi.",
        f"theta = ({names}), with every loop closed",
        ("q",),
        _vector("theta", h.chain, h.arguments["theta"].unit, "main chain"),
        role=Role("map", codomain="chain"),
    )


def chain_D_q(h: Hybrid) -> SymbolicFunction:
    """The derivatives of the main chain's joints."""
    return h.function(
        "chain_D_q",
        "Derivative of the main chain's joints by the actuated coordinates.",
        "chain_D_q[:, k] = d chain / d q_k",
        ("q",),
        _derivative(h, "theta_D_q", h.chain, h.forward, "q"),
        role=Role("map derivative", codomain="chain"),
    )


def passive(h: Hybrid) -> SymbolicFunction:
    """The passive joints from the actuators."""
    return h.function(
        "passive",
        "Passive joints that are not in the main chain, angles between -pi and pi.",
        f"passive = ({', '.join(h.mechanism.passive)}), with every loop closed",
        ("q",),
        _vector("passive", h.passive, "rad or m", "passive joints"),
        role=Role("map", codomain="passive"),
    )


def passive_D_q(h: Hybrid) -> SymbolicFunction:
    """The derivatives of the passive joints."""
    return h.function(
        "passive_D_q",
        "Derivative of the passive joints by the actuated coordinates.",
        "passive_D_q[:, k] = d passive / d q_k",
        ("q",),
        _derivative(h, "passive_D_q", h.passive, h.forward, "q"),
        role=Role("map derivative", codomain="passive"),
    )


def chain_rates(h: Hybrid) -> SymbolicFunction:
    """The main chain's rates from the actuators'."""
    rates = _along(h, h.forward, "q").of_each(h.chain)
    return h.function(
        "chain_rates",
        "Joint rates of the main chain.",
        "thetad = chain_D_q(q) qd",
        ("q", "qd"),
        _vector("thetad", rates, h.arguments["thetad"].unit, "rates of the main chain"),
        role=Role("map rate", codomain="chain"),
    )


def chain_accelerations(h: Hybrid) -> SymbolicFunction:
    """The main chain's accelerations from the actuators'."""
    values = _second(h, h.forward, "q", h.chain)
    unit = h.arguments["thetadd"].unit
    return h.function(
        "chain_accelerations",
        "Joint accelerations of the main chain.",
        "thetadd = chain_D_q(q) qdd + d/dt chain_D_q(q) qd",
        ("q", "qd", "qdd"),
        _vector("thetadd", values, unit, "accelerations of the main chain"),
        role=Role("map acceleration", codomain="chain"),
    )


def actuators(h: Hybrid) -> SymbolicFunction:
    """The actuators from the main chain."""
    return h.function(
        "actuators",
        "Actuated coordinates from the joints of the main chain.",
        "actuators(chain(q)) = q",
        ("theta",),
        _vector("q", h.actuators, h.arguments["q"].unit, "actuated coordinates"),
        role=Role("map", codomain="actuators"),
    )


def actuators_D_chain(h: Hybrid) -> SymbolicFunction:
    """The derivatives of the actuators."""
    return h.function(
        "actuators_D_chain",
        "Derivative of the actuated coordinates by the main chain's joints.",
        "actuators_D_chain[:, k] = d actuators / d theta_k",
        ("theta",),
        _derivative(h, "q_D_theta", h.actuators, h.backward, "theta"),
        role=Role("map derivative", codomain="actuators"),
    )


def actuator_rates(h: Hybrid) -> SymbolicFunction:
    """The actuators' rates from the main chain's."""
    rates = _along(h, h.backward, "theta").of_each(h.actuators)
    return h.function(
        "actuator_rates",
        "Rates of the actuated coordinates.",
        "qd = actuators_D_chain(theta) thetad",
        ("theta", "thetad"),
        _vector("qd", rates, h.arguments["qd"].unit, "actuator rates"),
        role=Role("map rate", codomain="actuators"),
    )


def actuator_accelerations(h: Hybrid) -> SymbolicFunction:
    """The actuators' accelerations from the main chain's."""
    values = _second(h, h.backward, "theta", h.actuators)
    return h.function(
        "actuator_accelerations",
        "Accelerations of the actuated coordinates.",
        "qdd = actuators_D_chain(theta) thetadd + d/dt actuators_D_chain(theta) thetad",
        ("theta", "thetad", "thetadd"),
        _vector("qdd", values, h.arguments["qdd"].unit, "actuator accelerations"),
        role=Role("map acceleration", codomain="actuators"),
    )


def margin(h: Hybrid) -> SymbolicFunction:
    """The margin of each loop: zero at its dead point."""
    return _margins(h, "margin", h.forward, "q")


def actuator_margin(h: Hybrid) -> SymbolicFunction:
    """The margins where the main chain is given."""
    return _margins(h, "actuator_margin", h.backward, "theta")


def configuration(h: Hybrid) -> SymbolicFunction:
    """All joints."""
    names = [variable.name for variable in h.variables]
    return h.function(
        "configuration",
        "All joints, swings and cylinder lengths, angles between -pi and pi.",
        f"z = ({', '.join(names)}), constraint(z) = 0",
        ("q",),
        _vector("z", h.named(h.forward, names), "rad or m", "full configuration"),
        role=Role("map", codomain="configuration"),
    )


def chain_all(h: Hybrid) -> SymbolicFunction:
    """The main chain's joints on every branch."""
    branches = [
        (h.named(solution, [joint.name for joint in h.robot.moving]), solution)
        for solution in h.forward_branches
    ]
    return _all(h, "chain_all", ("q", "chain"), "theta", h.arguments["theta"].unit, branches)


def actuators_all(h: Hybrid) -> SymbolicFunction:
    """The actuators on every branch."""
    branches = [(h.actuators_in(solution), solution) for solution in h.backward_branches]
    return _all(
        h,
        "actuators_all",
        ("theta", "actuators"),
        "q",
        h.arguments["q"].unit,
        branches,
        allowed if len(h.theta) > len(h.q) else _always,
    )


def _always(_: Sequence[Solution]) -> sp.Basic:
    return sp.true


def _all(
    h: Hybrid,
    name: str,
    between: tuple[str, str],
    result: str,
    unit: str,
    branches: Sequence[tuple[tuple[sp.Expr, ...], Solution]],
    condition: Callable[[Sequence[Solution]], sp.Basic] = _always,
) -> SymbolicFunction:
    """The function of all branches, each a slot; passive joints alone make no branch."""
    argument, codomain = between
    alike: dict[tuple[sp.Expr, ...], list[Solution]] = {}
    for values, solution in branches:
        alike.setdefault(values, []).append(solution)
    steps = dict.fromkeys(
        step.joints for _, s in branches for step in s.steps if step.margin is not None
    )
    rows = [_margins_of(solutions, list(steps)) for solutions in alike.values()]
    labels = _labels(h, list(alike.values()))
    count, width = len(alike), len(branches[0][0])
    values = sum(
        (
            h.while_closed(_where(h, row, condition(solutions)), *solutions)
            for row, solutions in alike.items()
        ),
        (),
    )
    return h.function(
        name,
        "All branches of the loops' solution, NaN where a branch does not close.",
        f"branches: {'; '.join(labels)}",
        (argument,),
        Result(result, values, (count, width), unit, "one branch a row"),
        Result("margin", sum(rows, ()), (count, len(rows[0])), "1", "margins of each branch"),
        role=Role("branches", codomain=codomain, labels=labels),
    )


def _where(h: Hybrid, row: tuple[sp.Expr, ...], condition: sp.Basic) -> tuple[sp.Expr, ...]:
    """The values of a slot, NaN where a condition does not hold."""
    if condition == sp.true:
        return row
    gate = h.where(condition)
    return tuple(h.terms.let(value + gate) for value in row)


def _margins_of(solutions: Sequence[Solution], steps: Sequence[Joined]) -> tuple[sp.Expr, ...]:
    """The margins of a slot, 1 for a step that its branch does not have.

    Where several branches of passive joints have the same values, those of the first that closes.
    """
    rows = []
    for solution in solutions:
        of = {step.joints: step.margin for step in solution.steps if step.margin is not None}
        row = tuple(of.get(joints, sp.S.One) for joints in steps) or (sp.S.One,)
        if row not in rows:
            rows.append(row)
    *others, last = rows
    for row in reversed(others):
        closes = sp.And(*(sp.Ge(margin, 0) for margin in row))
        last = tuple(
            one if one == other else sp.Piecewise((one, closes), (other, True))
            for one, other in zip(row, last, strict=True)
        )
    return last


def _labels(h: Hybrid, slots: Sequence[Sequence[Solution]]) -> tuple[str, ...]:
    """Which side each step of a slot takes, by the names of the loops that it closes."""
    sides = [_sides(solutions) for solutions in slots]
    names = {step.joints: step.name(h.mechanism) for s in slots for step in s[0].steps}
    asked = [names[joints] for joints in dict.fromkeys(j for of in sides for j in of)]
    # A loop that two steps close in turn is not enough of a name.
    named = {
        joints: f"{name} at {joints[1].split('.')[0]}" if asked.count(name) > 1 else name
        for joints, name in names.items()
    }
    return tuple(branch_label([(named[j], side) for j, side in of.items()]) for of in sides)


def _sides(solutions: Sequence[Solution]) -> dict[Joined, str]:
    """The sides that all branches of a slot have in common, by the joints of the step."""
    taken = [
        {step.joints: step.branch or side_of(step.sign) for step in s.steps if step.is_choice}
        for s in solutions
    ]
    return {
        joints: side
        for joints, side in taken[0].items()
        if all(other.get(joints) == side for other in taken)
    }


def _along(h: Hybrid, solution: Solution, argument: str) -> Tangent:
    """Rates of everything at given rates of the coordinates."""
    names = (argument, f"{argument}d")
    given, rates = (h.arguments[name].symbols for name in names)
    return Tangent(h.terms, dict(zip(given, rates, strict=True)), solution.loops)


def _second(
    h: Hybrid, solution: Solution, argument: str, values: Sequence[sp.Expr]
) -> list[sp.Expr]:
    """Second time derivatives."""
    first = _along(h, solution, argument).of_each(values)
    given, rates, accelerations = (h.arguments[f"{argument}{d}"].symbols for d in ("", "d", "dd"))
    pairs = (*zip(given, rates, strict=True), *zip(rates, accelerations, strict=True))
    return Tangent(h.terms, dict(pairs), solution.loops).of_each(first)


def _derivative(
    h: Hybrid, name: str, values: Sequence[sp.Expr], solution: Solution, argument: str
) -> Result:
    symbols = h.arguments[argument].symbols
    columns = derivative_columns(h.terms, values, symbols, solution.loops)
    shape = len(values), len(symbols)
    return Result(name, matrix_entries(columns), shape, "1, m, 1/m", "derivative")


def _margins(h: Hybrid, name: str, solution: Solution, argument: str) -> SymbolicFunction:
    values = [value for _, value in solution.margins]
    function = h.function(
        name,
        "Margin of each step of the loops' solution, zero at its dead point.",
        "sin^2 of the transmission angle: 0 at a dead point, below 0 out of reach",
        (argument,),
        _vector("margin", values, "1", "margins"),
        role=Role("margin"),
    )
    return replace(function, steps=tuple(names for names, _ in solution.margins))


def _vector(name: str, values: Sequence[sp.Expr], unit: str, meaning: str) -> Result:
    return Result(name, tuple(values), (len(values),), unit, meaning)


def makers(h: Hybrid) -> dict[str, Maker]:
    """The maps that a robot has in closed form, in the order in which they are written."""
    found: dict[str, Maker] = {}
    if not h.forward.open:
        found |= _FORWARD
        if not h.mechanism.passive:
            found = {name: maker for name, maker in found.items() if "passive" not in name}
        if h.forward.margins:
            found |= {"margin": margin}
        if h.mechanism.closers:
            found |= {"chain_all": chain_all}
    members = {c.moves for c in h.mechanism.coordinates}
    if members.isdisjoint(h.backward.open):
        found |= _BACKWARD
        if h.backward.margins:
            found |= {"actuator_margin": actuator_margin}
        if h.mechanism.closers:
            found |= {"actuators_all": actuators_all}
    return found


_FORWARD: Mapping[str, Maker] = {
    "chain": chain,
    "chain_D_q": chain_D_q,
    "chain_rates": chain_rates,
    "chain_accelerations": chain_accelerations,
    "passive": passive,
    "passive_D_q": passive_D_q,
    "configuration": configuration,
}
_BACKWARD: Mapping[str, Maker] = {
    "actuators": actuators,
    "actuators_D_chain": actuators_D_chain,
    "actuator_rates": actuator_rates,
    "actuator_accelerations": actuator_accelerations,
}
