"""Maps between actuators, main chain and passive joints of a robot with loops."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import sympy as sp

from ..chain.coordinates import LoopRates, SolvedRates
from ..terms.role import Role, branch_label, side_of
from ..terms.symbolic_function import Result, SymbolicFunction, matrix_entries
from .agreement import allowed
from .hybrid import Hybrid
from .planar.reference import Joined
from .solution import Solution

Maker = Callable[[Hybrid], SymbolicFunction]
WRAPPED = ", angles between -pi and pi"


@dataclass(frozen=True)
class Joints:
    """Values of joints, swings and cylinders as functions of some coordinates.

    Attributes:
        hybrid: The robot.
        coordinates: Name of the coordinates: ``q``, or ``theta`` for the main-chain joints.
        named: Returns the values of joints, swings and cylinders by name.
        rates: The rates of these values.
        passive: Names of the passive joints.
        interval: Text that states the interval of the angles and follows a comma; "" if the angles
            are unbounded.
        finished: Completes a function so that it returns NaN if the loops do not close.
    """

    hybrid: Hybrid
    coordinates: str
    named: Callable[[Iterable[str]], tuple[sp.Expr, ...]]
    rates: LoopRates
    passive: tuple[str, ...]
    interval: str
    finished: Callable[[SymbolicFunction], SymbolicFunction]

    @property
    def chain(self) -> tuple[sp.Expr, ...]:
        """The values of the main-chain joints."""
        return self.named(joint.name for joint in self.hybrid.robot.moving)

    @property
    def actuators(self) -> tuple[sp.Expr, ...]:
        """The actuated coordinates."""
        h = self.hybrid
        return h.driven(self.named(c.moves for c in h.mechanism.coordinates))

    @property
    def configuration(self) -> tuple[sp.Expr, ...]:
        """The full configuration z."""
        return self.named(variable.name for variable in self.hybrid.variables)

    def symbols(self, order: int) -> tuple[sp.Symbol, ...]:
        """Returns the coordinates, or their first or second time derivatives."""
        return self.hybrid.arguments[f"{self.coordinates}{'d' * order}"].symbols

    def function(
        self, name: str, summary: str, identity: str, order: int, result: Result, role: Role
    ) -> SymbolicFunction:
        """Builds a function of the coordinates and of time derivatives up to a given order."""
        inputs = tuple(f"{self.coordinates}{'d' * k}" for k in range(order + 1))
        made = self.hybrid.function(name, summary, identity, inputs, result, role=role)
        return self.finished(made)


def from_actuators(h: Hybrid) -> Joints:
    """Returns all joints in closed form as functions of the actuated coordinates."""
    return _in_closed_form(h, "q", h.forward)


def from_chain(h: Hybrid) -> Joints:
    """Returns all joints in closed form as functions of the main-chain joints."""
    return _in_closed_form(h, "theta", h.backward)


def _in_closed_form(h: Hybrid, coordinates: str, solution: Solution) -> Joints:
    rates = SolvedRates(h.terms, solution.loops, h.arguments[coordinates].symbols)
    named, finished = partial(h.named, solution), h.of_closed_loops
    return Joints(h, coordinates, named, rates, h.mechanism.passive, WRAPPED, finished)


def chain(of: Joints) -> SymbolicFunction:
    """Builds the map from the actuators to the main chain."""
    names = ", ".join(joint.name for joint in of.hybrid.robot.moving)
    return of.function(
        "chain",
        f"Joints of the main chain{of.interval}.",
        f"theta = ({names}), with every loop closed",
        0,
        _vector("theta", of.chain, of.hybrid.arguments["theta"].unit, "main chain"),
        Role("map", codomain="chain"),
    )


def chain_D_q(of: Joints) -> SymbolicFunction:
    """Builds the Jacobian of the map from actuators to main chain."""
    return of.function(
        "chain_D_q",
        "Derivative of the main-chain joints with respect to the actuated coordinates.",
        "chain_D_q[:, k] = d chain / d q_k",
        0,
        _derivative("theta_D_q", of.chain, of.rates),
        Role("map derivative", codomain="chain"),
    )


def passive(of: Joints) -> SymbolicFunction:
    """Builds the map from the actuators to the passive joints."""
    return of.function(
        "passive",
        f"Passive joints that are not in the main chain{of.interval}.",
        f"passive = ({', '.join(of.passive)}), with every loop closed",
        0,
        _vector("passive", of.named(of.passive), "rad or m", "passive joints"),
        Role("map", codomain="passive"),
    )


def passive_D_q(of: Joints) -> SymbolicFunction:
    """Builds the Jacobian of the map from actuators to passive joints."""
    return of.function(
        "passive_D_q",
        "Derivative of the passive joints with respect to the actuated coordinates.",
        "passive_D_q[:, k] = d passive / d q_k",
        0,
        _derivative("passive_D_q", of.named(of.passive), of.rates),
        Role("map derivative", codomain="passive"),
    )


def chain_rates(of: Joints) -> SymbolicFunction:
    """Builds the map from actuator rates to main-chain rates."""
    rates = of.rates.along(of.symbols(1)).of_each(of.chain)
    unit = of.hybrid.arguments["thetad"].unit
    return of.function(
        "chain_rates",
        "Joint rates of the main chain.",
        "thetad = chain_D_q(q) qd",
        1,
        _vector("thetad", rates, unit, "rates of the main chain"),
        Role("map rate", codomain="chain"),
    )


def chain_accelerations(of: Joints) -> SymbolicFunction:
    """Builds the map from actuator accelerations to main-chain accelerations."""
    unit = of.hybrid.arguments["thetadd"].unit
    return of.function(
        "chain_accelerations",
        "Joint accelerations of the main chain.",
        "thetadd = chain_D_q(q) qdd + d/dt chain_D_q(q) qd",
        2,
        _vector("thetadd", _second(of, of.chain), unit, "accelerations of the main chain"),
        Role("map acceleration", codomain="chain"),
    )


def actuators(of: Joints) -> SymbolicFunction:
    """Builds the map from the main chain to the actuators."""
    return of.function(
        "actuators",
        "Actuated coordinates from the joints of the main chain.",
        "actuators(chain(q)) = q",
        0,
        _vector("q", of.actuators, of.hybrid.arguments["q"].unit, "actuated coordinates"),
        Role("map", codomain="actuators"),
    )


def actuators_D_chain(of: Joints) -> SymbolicFunction:
    """Builds the Jacobian of the map from main chain to actuators."""
    return of.function(
        "actuators_D_chain",
        "Derivative of the actuated coordinates with respect to the main-chain joints.",
        "actuators_D_chain[:, k] = d actuators / d theta_k",
        0,
        _derivative("q_D_theta", of.actuators, of.rates),
        Role("map derivative", codomain="actuators"),
    )


def actuator_rates(of: Joints) -> SymbolicFunction:
    """Builds the map from main-chain rates to actuator rates."""
    rates = of.rates.along(of.symbols(1)).of_each(of.actuators)
    return of.function(
        "actuator_rates",
        "Rates of the actuated coordinates.",
        "qd = actuators_D_chain(theta) thetad",
        1,
        _vector("qd", rates, of.hybrid.arguments["qd"].unit, "actuator rates"),
        Role("map rate", codomain="actuators"),
    )


def actuator_accelerations(of: Joints) -> SymbolicFunction:
    """Builds the map from main-chain accelerations to actuator accelerations."""
    unit = of.hybrid.arguments["qdd"].unit
    return of.function(
        "actuator_accelerations",
        "Accelerations of the actuated coordinates.",
        "qdd = actuators_D_chain(theta) thetadd + d/dt actuators_D_chain(theta) thetad",
        2,
        _vector("qdd", _second(of, of.actuators), unit, "actuator accelerations"),
        Role("map acceleration", codomain="actuators"),
    )


def configuration(of: Joints) -> SymbolicFunction:
    """Builds the map from the actuators to the full configuration."""
    names = ", ".join(variable.name for variable in of.hybrid.variables)
    return of.function(
        "configuration",
        f"All joints, swings and cylinder lengths{of.interval}.",
        f"z = ({names}), constraint(z) = 0",
        0,
        _vector("z", of.configuration, "rad or m", "full configuration"),
        Role("map", codomain="configuration"),
    )


def configuration_D_q(of: Joints) -> SymbolicFunction:
    """Builds the Jacobian of the map from actuators to full configuration."""
    return of.function(
        "configuration_D_q",
        "Derivative of the full configuration with respect to the actuated coordinates.",
        "configuration_D_q[:, k] = d configuration / d q_k",
        0,
        _derivative("z_D_q", of.configuration, of.rates),
        Role("map derivative", codomain="configuration"),
    )


def margin(h: Hybrid) -> SymbolicFunction:
    """Builds the margin function, whose entries are zero at the dead points of the loops."""
    return _margins(h, "margin", h.forward, "q")


def actuator_margin(h: Hybrid) -> SymbolicFunction:
    """Builds the margin function of the map from the main chain to the actuators."""
    return _margins(h, "actuator_margin", h.backward, "theta")


def chain_all(h: Hybrid) -> SymbolicFunction:
    """Builds the function for the main-chain joints on every branch."""
    branches = [
        (h.named(solution, [joint.name for joint in h.robot.moving]), solution)
        for solution in h.forward_branches
    ]
    return _all(h, "chain_all", ("q", "chain"), "theta", h.arguments["theta"].unit, branches)


def actuators_all(h: Hybrid) -> SymbolicFunction:
    """Builds the function for the actuators on every branch."""
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
    """Builds the all-branch function. Branches that differ only in passive joints share a slot."""
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
        Result(result, values, (count, width), unit, "one branch per row"),
        Result("margin", sum(rows, ()), (count, len(rows[0])), "1", "margins of each branch"),
        role=Role("branches", codomain=codomain, labels=labels),
    )


def _where(h: Hybrid, row: tuple[sp.Expr, ...], condition: sp.Basic) -> tuple[sp.Expr, ...]:
    """Returns the values of one branch slot, which become NaN if a condition fails."""
    if condition == sp.true:
        return row
    gate = h.where(condition)
    return tuple(h.terms.let(value + gate) for value in row)


def _margins_of(solutions: Sequence[Solution], steps: Sequence[Joined]) -> tuple[sp.Expr, ...]:
    """Returns the margins of a branch slot; a step that the branch lacks has margin 1.

    If several branches of passive joints share the slot, the first branch that closes is used.
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
    """Returns the branch label of each slot, which contains the names of the loops."""
    sides = [_sides(solutions) for solutions in slots]
    names = {step.joints: step.name(h.mechanism) for s in slots for step in s[0].steps}
    asked = [names[joints] for joints in dict.fromkeys(j for of in sides for j in of)]
    # If two steps close the same loop, the loop's name needs a joint name as a suffix.
    named = {
        joints: f"{name} at {joints[1].split('.')[0]}" if asked.count(name) > 1 else name
        for joints, name in names.items()
    }
    return tuple(branch_label([(named[j], side) for j, side in of.items()]) for of in sides)


def _sides(solutions: Sequence[Solution]) -> dict[Joined, str]:
    """Returns the branch choices that all solutions of a slot share, keyed by joints."""
    taken = [
        {step.joints: step.branch or side_of(step.sign) for step in s.steps if step.is_choice}
        for s in solutions
    ]
    return {
        joints: side
        for joints, side in taken[0].items()
        if all(other.get(joints) == side for other in taken)
    }


def _second(of: Joints, values: Sequence[sp.Expr]) -> list[sp.Expr]:
    """Returns the second time derivatives of values."""
    rates, accelerations = of.symbols(1), of.symbols(2)
    first = of.rates.along(rates).of_each(values)
    return of.rates.twice(rates, accelerations).of_each(first)


def _derivative(name: str, values: Sequence[sp.Expr], rates: LoopRates) -> Result:
    columns = [unit.of_each(values) for unit in rates.units()]
    shape = len(values), len(columns)
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


def forward_makers(of: Joints) -> dict[str, Maker]:
    """Returns the builders of the maps from the actuators, in output order."""
    passive_maps = (passive, passive_D_q) if of.passive else ()
    rates = (chain_rates, chain_accelerations)
    return _makers((chain, chain_D_q, *rates, *passive_maps, configuration), of)


def backward_makers(of: Joints) -> dict[str, Maker]:
    """Returns the builders of the maps from the main chain, in output order."""
    rates = (actuator_rates, actuator_accelerations)
    return _makers((actuators, actuators_D_chain, *rates), of)


def _makers(maps: Iterable[Callable[[Joints], SymbolicFunction]], of: Joints) -> dict[str, Maker]:
    return {made.__name__: partial(_made, made, of) for made in maps}


def _made(made: Callable[[Joints], SymbolicFunction], of: Joints, _: Hybrid) -> SymbolicFunction:
    return made(of)


def makers(h: Hybrid) -> dict[str, Maker]:
    """Returns the builders of a robot's closed-form maps, in output order."""
    found: dict[str, Maker] = {}
    if not h.forward.open:
        found |= forward_makers(from_actuators(h))
        if h.forward.margins:
            found |= {"margin": margin}
        if h.mechanism.closers:
            found |= {"chain_all": chain_all}
    members = {c.moves for c in h.mechanism.coordinates}
    if members.isdisjoint(h.backward.open):
        found |= backward_makers(from_chain(h))
        if h.backward.margins:
            found |= {"actuator_margin": actuator_margin}
        if h.mechanism.closers:
            found |= {"actuators_all": actuators_all}
    return found
