"""Maps between actuators, main chain and passive joints of a robot with loops."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import sympy as sp

from ...chain.coordinates import LoopRates, SolvedRates
from ...terms.role import Role, branch_label, side_of
from ...terms.symbolic_function import Result, SymbolicFunction, matrix_entries
from ..planar.reference import Joined
from ..solve.agreement import allowed
from ..solve.solution import Solution
from ..solve.solved_loops import SolvedLoops, backward_branches, forward_branches, named

Maker = Callable[[SolvedLoops], SymbolicFunction]
WRAPPED = ", angles between -pi and pi"


@dataclass(frozen=True)
class Joints:
    """All joint values as functions of the actuated coordinates or of the main-chain joints.

    Attributes:
        hybrid: The robot.
        coordinates: Name of the independent coordinates: ``q`` for the actuators, or ``theta`` for
            the main-chain joints.
        named: Function that returns the values of the joints, swing angles and cylinders with the
            given names.
        rates: The time derivatives of joints, swing angles and cylinders.
        passive: Names of the passive joints.
        interval: Text about the interval of the joint angles, or "" if this interval is unbounded.
        finished: Function that completes a symbolic function, so that its results are NaN if the
            loops do not close.
    """

    hybrid: SolvedLoops
    coordinates: str
    named: Callable[[Iterable[str]], tuple[sp.Expr, ...]]
    rates: LoopRates
    passive: tuple[str, ...]
    interval: str
    finished: Callable[[SymbolicFunction], SymbolicFunction]

    def symbols(self, order: int) -> tuple[sp.Symbol, ...]:
        """Return the symbols of the coordinates, or of their first or second time derivatives."""
        return self.hybrid.arguments[f"{self.coordinates}{'d' * order}"].symbols

    def function(
        self, name: str, summary: str, identity: str, order: int, result: Result, role: Role
    ) -> SymbolicFunction:
        """Build a function of the coordinates and their derivatives."""
        inputs = tuple(f"{self.coordinates}{'d' * k}" for k in range(order + 1))
        made = self.hybrid.function(name, summary, identity, inputs, result, role=role)
        return self.finished(made)


def from_actuators(h: SolvedLoops) -> Joints:
    """Return all joints as closed-form functions of the actuated coordinates."""
    return _in_closed_form(h, "q", h.forward)


def from_chain(h: SolvedLoops) -> Joints:
    """Return all joints as closed-form functions of the main-chain joints."""
    return _in_closed_form(h, "theta", h.backward)


def _in_closed_form(h: SolvedLoops, coordinates: str, solution: Solution) -> Joints:
    rates = SolvedRates(h.terms, solution.loops, h.arguments[coordinates].symbols)
    values, finished = partial(named, h, solution), h.of_closed_loops
    return Joints(h, coordinates, values, rates, h.mechanism.passive, WRAPPED, finished)


@dataclass(frozen=True)
class Map:
    """A generated function that returns joint values, with the texts for its documentation.

    Attributes:
        name: Name of the generated function and of the group of joints that it computes.
        symbol: Symbol of the vector of joint values.
        names: Function that returns the names of the computed joints.
        noun: Noun for the computed joints in the documentation of the generated function.
        meaning: Meaning of the vector of joint values, for the documentation of the generated
            function.
        summary: Summary line of the generated function, in which the placeholder ``{interval}``
            stands for the angle interval.
        identity: Equation that the joint values satisfy, in which the placeholder ``{names}``
            stands for the joint names.
        moving: Two texts for the functions of joint rates and joint accelerations: the summary
            line, and the meaning of the result. In both texts, the placeholder ``{}`` stands for
            "rates" or "accelerations".
    """

    name: str
    symbol: str
    names: Callable[[Joints], Iterable[str]]
    noun: str
    meaning: str
    summary: str
    identity: str
    moving: tuple[str, str] = ("", "")

    def values(self, of: Joints) -> tuple[sp.Expr, ...]:
        """Return the joint values, which ``ACTUATORS`` divides by the ratios of the coordinates."""
        values = of.named(self.names(of))
        return of.hybrid.driven(values) if self is ACTUATORS else values

    def function(self, of: Joints) -> SymbolicFunction:
        """Build the function that maps coordinates to joint values."""
        summary = self.summary.format(interval=of.interval)
        identity = self.identity.format(names=", ".join(self.names(of)))
        result = self._result(of, 0, self.values(of), self.meaning)
        return of.function(self.name, summary, identity, 0, result, Role("map", codomain=self.name))

    def derivative(self, of: Joints) -> SymbolicFunction:
        """Build the derivative of the joint values with respect to the coordinates."""
        values, q = self.values(of), of.coordinates
        columns = [unit.of_each(values) for unit in of.rates.units()]
        shape = len(values), len(columns)
        return of.function(
            self._derivative_name(of),
            f"Derivative of the {self.noun} with respect to the {_DOMAINS[q].noun}.",
            f"{self._derivative_name(of)}[:, k] = d {self.name} / d {q}_k",
            0,
            Result(
                f"{self.symbol}_D_{q}", matrix_entries(columns), shape, "1, m, 1/m", "derivative"
            ),
            Role("map derivative", codomain=self.name),
        )

    def rates(self, of: Joints) -> SymbolicFunction:
        """Build the function that maps coordinate rates to joint rates."""
        q, slope = of.coordinates, self._derivative_name(of)
        rates = of.rates.along(of.symbols(1)).of_each(self.values(of))
        return self._time_derivative(of, 1, "rate", rates, f"{slope}({q}) {q}d")

    def accelerations(self, of: Joints) -> SymbolicFunction:
        """Build the function that maps coordinate accelerations to joint accelerations."""
        q, slope = of.coordinates, self._derivative_name(of)
        first = of.rates.along(of.symbols(1)).of_each(self.values(of))
        second = of.rates.twice(of.symbols(1), of.symbols(2)).of_each(first)
        identity = f"{slope}({q}) {q}dd + d/dt {slope}({q}) {q}d"
        return self._time_derivative(of, 2, "acceleration", second, identity)

    def _time_derivative(
        self, of: Joints, order: int, kind: str, values: Sequence[sp.Expr], product: str
    ) -> SymbolicFunction:
        summary, meaning = (words.format(f"{kind}s") for words in self.moving)
        return of.function(
            f"{self.name.removesuffix('s')}_{kind}s",
            summary[0].upper() + summary[1:],
            f"{self.symbol}{'d' * order} = {product}",
            order,
            self._result(of, order, values, meaning),
            Role(f"map {kind}", codomain=self.name),
        )

    def _derivative_name(self, of: Joints) -> str:
        return f"{self.name}_D_{'chain' if of.coordinates == 'theta' else of.coordinates}"

    def _result(self, of: Joints, order: int, values: Sequence[sp.Expr], meaning: str) -> Result:
        name = f"{self.symbol}{'d' * order}"
        is_domain = self.symbol in _DOMAINS
        unit = of.hybrid.arguments[name].unit if is_domain else "rad or m"
        return _vector(name, values, unit, meaning)


CHAIN = Map(
    "chain",
    "theta",
    lambda of: [joint.name for joint in of.hybrid.robot.moving],
    "main-chain joints",
    "main chain",
    "Joints of the main chain{interval}.",
    "theta = ({names}), with every loop closed",
    ("joint {} of the main chain.", "{} of the main chain"),
)
PASSIVE = Map(
    "passive",
    "passive",
    lambda of: of.passive,
    "passive joints",
    "passive joints",
    "Passive joints that are not in the main chain{interval}.",
    "passive = ({names}), with every loop closed",
)
CONFIGURATION = Map(
    "configuration",
    "z",
    lambda of: [variable.name for variable in of.hybrid.variables],
    "full configuration",
    "full configuration",
    "All joints, swing angles and cylinder lengths{interval}.",
    "z = ({names}), constraint(z) = 0",
)
ACTUATORS = Map(
    "actuators",
    "q",
    lambda of: [c.moves for c in of.hybrid.mechanism.coordinates],
    "actuated coordinates",
    "actuated coordinates",
    "Actuated coordinates from the joints of the main chain.",
    "actuators(chain(q)) = q",
    ("{} of the actuated coordinates.", "actuator {}"),
)
_DOMAINS = {"q": ACTUATORS, "theta": CHAIN}
"""The map that computes each joint vector, keyed by the name of the vector."""


def margin(h: SolvedLoops) -> SymbolicFunction:
    """Build the function ``margin``, whose entries are zero at dead points of the loops."""
    return _margins(h, "margin", h.forward, "q")


def actuator_margin(h: SolvedLoops) -> SymbolicFunction:
    """Build the margin function for the map from the main chain to the actuators."""
    return _margins(h, "actuator_margin", h.backward, "theta")


def chain_all(h: SolvedLoops) -> SymbolicFunction:
    """Build the function that returns the main-chain joints of every branch."""
    branches = [
        (named(h, solution, [joint.name for joint in h.robot.moving]), solution)
        for solution in forward_branches(h)
    ]
    return _all(h, "chain_all", ("q", "chain"), "theta", h.arguments["theta"].unit, branches)


def actuators_all(h: SolvedLoops) -> SymbolicFunction:
    """Build the function that returns the actuator values of every branch."""
    branches = [(h.actuators_in(solution), solution) for solution in backward_branches(h)]
    return _all(
        h,
        "actuators_all",
        ("theta", "actuators"),
        "q",
        h.arguments["q"].unit,
        branches,
        allowed if len(h.theta) > h.freedoms else _always,
    )


def _always(_: Sequence[Solution]) -> sp.Basic:
    return sp.true


def _all(
    h: SolvedLoops,
    name: str,
    between: tuple[str, str],
    result: str,
    unit: str,
    branches: Sequence[tuple[tuple[sp.Expr, ...], Solution]],
    condition: Callable[[Sequence[Solution]], sp.Basic] = _always,
) -> SymbolicFunction:
    """Build one function that computes all branches of the loop solution.

    Branches that differ only in passive joints are merged.
    """
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
        "All branches of the loops' solution, NaN if a branch does not close.",
        f"branches: {'; '.join(labels)}",
        (argument,),
        Result(result, values, (count, width), unit, "one branch per row"),
        Result("margin", sum(rows, ()), (count, len(rows[0])), "1", "margins of each branch"),
        role=Role("branches", codomain=codomain, labels=labels),
    )


def _where(h: SolvedLoops, row: tuple[sp.Expr, ...], condition: sp.Basic) -> tuple[sp.Expr, ...]:
    """Return the joint values of one branch, which become NaN if a condition fails."""
    if condition == sp.true:
        return row
    gate = h.where(condition)
    return tuple(h.terms.let(value + gate) for value in row)


def _margins_of(solutions: Sequence[Solution], steps: Sequence[Joined]) -> tuple[sp.Expr, ...]:
    """Return the margins of one branch of the loop solution.

    If several solutions share the branch, the margins of the first solution with closed loops are
    returned.

    A solution step that does not occur in a branch has the margin 1 in this branch.
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


def _labels(h: SolvedLoops, slots: Sequence[Sequence[Solution]]) -> tuple[str, ...]:
    """Return the label of each branch, which names the loops and their chosen solutions."""
    sides = [_sides(solutions) for solutions in slots]
    names = {step.joints: step.name(h.mechanism) for s in slots for step in s[0].steps}
    requested = [names[joints] for joints in dict.fromkeys(j for of in sides for j in of)]
    # If two solution steps close the same loop, a joint name is added to the name of the loop.
    named = {
        joints: f"{name} at {joints[1].split('.')[0]}" if requested.count(name) > 1 else name
        for joints, name in names.items()
    }
    return tuple(branch_label([(named[j], side) for j, side in of.items()]) for of in sides)


def _sides(solutions: Sequence[Solution]) -> dict[Joined, str]:
    taken = [
        {step.joints: step.branch or side_of(step.sign) for step in s.steps if step.is_choice}
        for s in solutions
    ]
    return {
        joints: side
        for joints, side in taken[0].items()
        if all(other.get(joints) == side for other in taken)
    }


def _margins(h: SolvedLoops, name: str, solution: Solution, argument: str) -> SymbolicFunction:
    values = [value for _, value in solution.margins]
    function = h.function(
        name,
        "Margin of each step of the loops' solution, zero at the dead point of the step.",
        "sin^2 of the transmission angle: 0 at a dead point, negative out of reach",
        (argument,),
        _vector("margin", values, "1", "margins"),
        role=Role("margin"),
    )
    return replace(function, steps=tuple(names for names, _ in solution.margins))


def _vector(name: str, values: Sequence[sp.Expr], unit: str, meaning: str) -> Result:
    return Result(name, tuple(values), (len(values),), unit, meaning)


def forward_makers(of: Joints) -> dict[str, Maker]:
    """Return the builders of all maps from actuators to joints, keyed by function name."""
    found = {
        "chain": CHAIN.function,
        "chain_D_q": CHAIN.derivative,
        "chain_rates": CHAIN.rates,
        "chain_accelerations": CHAIN.accelerations,
    }
    if of.passive:
        found |= {"passive": PASSIVE.function, "passive_D_q": PASSIVE.derivative}
    return _makers(found | {"configuration": CONFIGURATION.function}, of)


def backward_makers(of: Joints) -> dict[str, Maker]:
    """Return the builders of maps from the main chain to actuators, keyed by function name."""
    found = {
        "actuators": ACTUATORS.function,
        "actuators_D_chain": ACTUATORS.derivative,
        "actuator_rates": ACTUATORS.rates,
        "actuator_accelerations": ACTUATORS.accelerations,
    }
    return _makers(found, of)


def _makers(
    builders: Mapping[str, Callable[[Joints], SymbolicFunction]], of: Joints
) -> dict[str, Maker]:
    return {name: partial(_made, build, of) for name, build in builders.items()}


def _made(
    build: Callable[[Joints], SymbolicFunction], of: Joints, _: SolvedLoops
) -> SymbolicFunction:
    return build(of)


def makers(h: SolvedLoops) -> dict[str, Maker]:
    """Return the builders of all closed-form maps, by function name."""
    found: dict[str, Maker] = {}
    if not h.forward.open:
        found |= forward_makers(from_actuators(h))
        if h.forward.margins:
            found |= {"margin": margin}
        if h.mechanism.is_constrained:
            found |= {"chain_all": chain_all}
    members = {c.moves for c in h.mechanism.coordinates}
    if members.isdisjoint(h.backward.open):
        found |= backward_makers(from_chain(h))
        if h.backward.margins:
            found |= {"actuator_margin": actuator_margin}
        # The inverse kinematics of an as-built robot calls actuators_all, even if the robot has no
        # loops.
        if h.mechanism.is_constrained or h.mechanism.nominal is not None:
            found |= {"actuators_all": actuators_all}
    return found
