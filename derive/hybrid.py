"""The functions of a robot with loops: its chain in actuated coordinates, and the maps between."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from itertools import islice, product

import sympy as sp

from .chain import Group, groups
from .collapse import collapsed
from .constraints import configuration_names
from .coordinates import ThroughLoops
from .forward import Forward
from .function import Argument, Result, SymbolicFunction, matrix_entries
from .kinematics import FUNCTIONS as OF_CHAIN
from .kinematics import Kinematics, arguments_of, common_unit, coordinates
from .mechanism import Mechanism, Strut
from .motion import Tangent
from .robot import Joint
from .scope import Scope
from .solution import (
    Loops,
    Solution,
    from_actuators,
    from_chain,
    joint_angle,
    sorted_loops,
)

MAPS = (
    "chain",
    "chain_D_q",
    "chain_rates",
    "chain_accelerations",
    "passive",
    "passive_D_q",
    "configuration",
    "margin",
    "chain_all",
    "actuators",
    "actuators_D_chain",
    "actuator_rates",
    "actuator_accelerations",
    "actuator_margin",
    "actuators_all",
)
"""The maps between actuators and chain, in the order in which they are derived and written."""
MOST_BRANCHES = 16
ONE = sp.Integer(1)


class Hybrid:
    """The functions of one mechanism, made when they are asked for."""

    def __init__(self, mechanism: Mechanism) -> None:
        """Sorts the loops and names the coordinates."""
        self.mechanism = mechanism
        self.robot = mechanism.main_chain
        self.scope = Scope({p.symbol: p.value for p in mechanism.parameters})
        self.loops: Loops = sorted_loops(mechanism, self.scope)
        moving = self.robot.moving
        self.arguments = arguments_of([c.unit for c in mechanism.coordinates])
        unit = common_unit(joint.unit for joint in moving)
        for name, of_time, meaning in (
            ("theta", "", "joints of the main chain"),
            ("thetad", "/s", "joint rates of the main chain"),
            ("thetadd", "/s^2", "joint accelerations of the main chain"),
        ):
            symbols = coordinates(name, len(moving))
            self.arguments[name] = Argument(
                name, symbols, (len(moving),), f"{unit}{of_time}", meaning
            )
        self.q, self.theta = self.arguments["q"].symbols, self.arguments["theta"].symbols

    # --- the solutions ---

    @cached_property
    def forward(self) -> Solution:
        """All joints from the actuators."""
        return from_actuators(self.loops, self.scope, self.q)

    @cached_property
    def backward(self) -> Solution:
        """All joints from the main chain."""
        closed = {}
        if not self.forward.open:
            of = self.forward.reference.of
            closed = {name: of(value) for name, value in self.forward.values.items()}
        return from_chain(self.loops, self.scope, self.theta, closed)

    @cached_property
    def missing(self) -> frozenset[str]:
        """The functions that have no closed form here."""
        lacking: set[str] = set()
        if self.forward.open:
            lacking.update(OF_CHAIN, MAPS[: MAPS.index("actuators")])
        if any(c.moves in self.backward.open for c in self.mechanism.coordinates):
            lacking.update(MAPS[MAPS.index("actuators") :])
        if not self.forward.margins:
            lacking.update(("margin", "chain_all"))
        if not self.backward.margins:
            lacking.add("actuator_margin")
        if not any(step.sign for step in self.backward.steps):
            lacking.add("actuators_all")
        return frozenset(lacking)

    @property
    def offered(self) -> tuple[str, ...]:
        """The functions that there are, in order."""
        return tuple(name for name in (*OF_CHAIN, *MAPS) if name not in self.missing)

    # --- the chain in actuated coordinates ---

    @cached_property
    def groups(self) -> tuple[Group, ...]:
        """The main chain with joint values from the actuators."""
        values = [joint.direction * self.forward.values[joint.name] for joint in self.robot.moving]
        return groups(self.robot, self.scope, values)

    @cached_property
    def kinematics(self) -> Kinematics:
        """The functions of the tool."""
        values = [joint.direction * self.forward.values[joint.name] for joint in self.robot.moving]
        shorter, translations = collapsed(
            self.scope, self.groups, self.forward.relations, len(values)
        )
        kept = [s.joint for group in shorter for s in group.stations if s.joint is not None]
        kept += [slide.joint for group in shorter for s in group.stations for slide in s.slides]
        everything = [*values, *translations]
        used = sorted(kept)
        motion = ThroughLoops(self.scope, [everything[k] for k in used], self.forward.loops, self.q)
        links = Forward(self.scope, self.groups)
        return Kinematics(self.robot, self.scope, shorter, motion, self.arguments, links)

    def function(self, name: str) -> SymbolicFunction:
        """The function of that name, one of :attr:`offered`."""
        if name in OF_CHAIN:
            return self.kinematics.function(name)
        return _MAKERS[name](self)

    # --- the maps ---

    def _named(self, solution: Solution, names: Iterable[str]) -> tuple[sp.Expr, ...]:
        """Joint values between -pi and pi."""
        mechanism = self.mechanism
        joints: dict[str, Joint | Strut] = {j.name: j for j in mechanism.joints}
        found = []
        for name in names:
            value = solution.values[name]
            is_angle = not isinstance(mechanism.members.get(name), Strut) and not (
                name in joints and joints[name].kind == "prismatic"
            )
            if is_angle:
                value = joint_angle(self.scope, solution, value, joints.get(name))
            found.append(self.scope.let(value))
        return tuple(found)

    @cached_property
    def _chain(self) -> tuple[sp.Expr, ...]:
        return self._named(self.forward, [joint.name for joint in self.robot.moving])

    @cached_property
    def _passive(self) -> tuple[sp.Expr, ...]:
        return self._named(self.forward, self.mechanism.passive)

    @cached_property
    def _actuators(self) -> tuple[sp.Expr, ...]:
        members = [c.moves for c in self.mechanism.coordinates]
        values = self._named(self.backward, members)
        return tuple(
            self.scope.let(value / c.ratio)
            for value, c in zip(values, self.mechanism.coordinates, strict=True)
        )

    def chain(self) -> SymbolicFunction:
        """The main chain's joints from the actuators."""
        names = ", ".join(joint.name for joint in self.robot.moving)
        return self._function(
            "chain",
            "Joints of the main chain, angles between -pi and pi.",
            f"theta = ({names}), with every loop closed",
            ("q",),
            self._vector("theta", self._chain, self.arguments["theta"].unit, "main chain"),
        )

    def chain_D_q(self) -> SymbolicFunction:
        """Their derivatives."""
        return self._function(
            "chain_D_q",
            "Derivative of the main chain's joints by the actuated coordinates.",
            "chain_D_q[:, k] = d chain / d q_k",
            ("q",),
            self._derivative("theta_D_q", self._chain, self.forward, "q"),
        )

    def passive(self) -> SymbolicFunction:
        """The passive joints from the actuators."""
        return self._function(
            "passive",
            "Passive joints that are not in the main chain, angles between -pi and pi.",
            f"passive = ({', '.join(self.mechanism.passive)}), with every loop closed",
            ("q",),
            self._vector("passive", self._passive, "rad or m", "passive joints"),
        )

    def passive_D_q(self) -> SymbolicFunction:
        """Their derivatives."""
        return self._function(
            "passive_D_q",
            "Derivative of the passive joints by the actuated coordinates.",
            "passive_D_q[:, k] = d passive / d q_k",
            ("q",),
            self._derivative("passive_D_q", self._passive, self.forward, "q"),
        )

    def chain_rates(self) -> SymbolicFunction:
        """The main chain's rates from the actuators'."""
        rates = self._along(self.forward, "q").of_each(self._chain)
        return self._function(
            "chain_rates",
            "Joint rates of the main chain.",
            "thetad = chain_D_q(q) qd",
            ("q", "qd"),
            self._vector("thetad", rates, self.arguments["thetad"].unit, "rates of the main chain"),
        )

    def chain_accelerations(self) -> SymbolicFunction:
        """The main chain's accelerations from the actuators'."""
        values = self._second(self.forward, "q", self._chain)
        unit = self.arguments["thetadd"].unit
        return self._function(
            "chain_accelerations",
            "Joint accelerations of the main chain.",
            "thetadd = chain_D_q(q) qdd + d/dt chain_D_q(q) qd",
            ("q", "qd", "qdd"),
            self._vector("thetadd", values, unit, "accelerations of the main chain"),
        )

    def actuators(self) -> SymbolicFunction:
        """The actuators from the main chain."""
        return self._function(
            "actuators",
            "Actuated coordinates from the joints of the main chain.",
            "actuators(chain(q)) = q",
            ("theta",),
            self._vector("q", self._actuators, self.arguments["q"].unit, "actuated coordinates"),
        )

    def actuators_D_chain(self) -> SymbolicFunction:
        """Their derivatives."""
        return self._function(
            "actuators_D_chain",
            "Derivative of the actuated coordinates by the main chain's joints.",
            "actuators_D_chain[:, k] = d actuators / d theta_k",
            ("theta",),
            self._derivative("q_D_theta", self._actuators, self.backward, "theta"),
        )

    def actuator_rates(self) -> SymbolicFunction:
        """The actuators' rates from the main chain's."""
        rates = self._along(self.backward, "theta").of_each(self._actuators)
        return self._function(
            "actuator_rates",
            "Rates of the actuated coordinates.",
            "qd = actuators_D_chain(theta) thetad",
            ("theta", "thetad"),
            self._vector("qd", rates, self.arguments["qd"].unit, "actuator rates"),
        )

    def actuator_accelerations(self) -> SymbolicFunction:
        """The actuators' accelerations from the main chain's."""
        values = self._second(self.backward, "theta", self._actuators)
        return self._function(
            "actuator_accelerations",
            "Accelerations of the actuated coordinates.",
            "qdd = actuators_D_chain(theta) thetadd + d/dt actuators_D_chain(theta) thetad",
            ("theta", "thetad", "thetadd"),
            self._vector("qdd", values, self.arguments["qdd"].unit, "actuator accelerations"),
        )

    def margin(self) -> SymbolicFunction:
        """How far each loop is from its dead point."""
        return self._margins("margin", self.forward, "q")

    def actuator_margin(self) -> SymbolicFunction:
        """The same where the main chain is given."""
        return self._margins("actuator_margin", self.backward, "theta")

    def configuration(self) -> SymbolicFunction:
        """All joints."""
        names = [variable.name for variable in configuration_names(self.mechanism)]
        return self._function(
            "configuration",
            "All joints, swings and cylinder lengths, angles between -pi and pi.",
            f"z = ({', '.join(names)}), constraint(z) = 0",
            ("q",),
            self._vector("z", self._named(self.forward, names), "rad or m", "full configuration"),
        )

    def chain_all(self) -> SymbolicFunction:
        """The main chain on every branch."""
        branches = [
            (self._named(solution, [joint.name for joint in self.robot.moving]), solution)
            for solution in self._branches(self.forward, from_actuators, self.q)
        ]
        return self._all("chain_all", "q", "theta", self.arguments["theta"].unit, branches)

    def actuators_all(self) -> SymbolicFunction:
        """The actuators on every branch."""
        members = [c.moves for c in self.mechanism.coordinates]
        branches = []
        for solution in self._branches(self.backward, self._from_chain, self.theta):
            values = self._named(solution, members)
            ratios = [c.ratio for c in self.mechanism.coordinates]
            q = tuple(self.scope.let(v / r) for v, r in zip(values, ratios, strict=True))
            branches.append((q, solution))
        return self._all("actuators_all", "theta", "q", self.arguments["q"].unit, branches)

    # --- how they are made ---

    def _from_chain(
        self, loops: Loops, scope: Scope, theta: Sequence[sp.Symbol], signs: Iterator[int]
    ) -> Solution:
        return from_chain(loops, scope, theta, {}, signs)

    def _branches(
        self,
        at_reference: Solution,
        solve: Callable[..., Solution],
        symbols: Sequence[sp.Symbol],
    ) -> list[Solution]:
        """Solutions with every combination of signs, that of the reference first."""
        signs = [step.sign for step in at_reference.steps if step.sign]
        combinations = [
            [own * flip for own, flip in zip(signs, flips, strict=True)]
            for flips in product((1, -1), repeat=len(signs))
        ]
        return [
            solve(self.loops, self.scope, symbols, iter(chosen))
            for chosen in islice(combinations, MOST_BRANCHES)
        ]

    def _all(
        self,
        name: str,
        argument: str,
        result: str,
        unit: str,
        branches: Sequence[tuple[tuple[sp.Expr, ...], Solution]],
    ) -> SymbolicFunction:
        count = len(branches)
        margins = [margin for _, solution in branches for _, margin in solution.margins]
        steps = len(branches[0][1].margins)
        values = tuple(value for row, _ in branches for value in row)
        width = len(branches[0][0])
        names = "; ".join(
            ", ".join(step.branch for step in solution.steps if step.branch)
            for _, solution in branches
        )
        return self._function(
            name,
            "Every branch of the loops' solution, NaN where it does not close.",
            f"branches: {names}",
            (argument,),
            Result(result, values, (count, width), unit, "one branch a row"),
            Result("margin", tuple(margins), (count, steps), "1", "margins of each branch"),
        )

    def _along(self, solution: Solution, argument: str) -> Tangent:
        """Rates of everything at given rates of the coordinates."""
        names = (argument, f"{argument}d")
        given, rates = (self.arguments[name].symbols for name in names)
        return Tangent(self.scope, dict(zip(given, rates, strict=True)), solution.loops)

    def _second(
        self, solution: Solution, argument: str, values: Sequence[sp.Expr]
    ) -> list[sp.Expr]:
        """Second time derivatives."""
        first = self._along(solution, argument).of_each(values)
        given, rates, accelerations = (
            self.arguments[f"{argument}{d}"].symbols for d in ("", "d", "dd")
        )
        pairs = (*zip(given, rates, strict=True), *zip(rates, accelerations, strict=True))
        return Tangent(self.scope, dict(pairs), solution.loops).of_each(first)

    def _derivative(
        self, name: str, values: Sequence[sp.Expr], solution: Solution, argument: str
    ) -> Result:
        symbols = self.arguments[argument].symbols
        columns = [
            Tangent(self.scope, {symbol: ONE}, solution.loops).of_each(values) for symbol in symbols
        ]
        shape = len(values), len(symbols)
        return Result(name, matrix_entries(columns), shape, "1, m, 1/m", "derivative")

    def _margins(self, name: str, solution: Solution, argument: str) -> SymbolicFunction:
        loops = ", ".join(names for names, _ in solution.margins)
        return self._function(
            name,
            "How far each step of the loops' solution is from its dead point.",
            f"sin^2 of the transmission angle, below 0 out of reach, of: {loops}",
            (argument,),
            self._vector("margin", [value for _, value in solution.margins], "1", "margins"),
        )

    def _vector(self, name: str, values: Sequence[sp.Expr], unit: str, meaning: str) -> Result:
        return Result(name, tuple(values), (len(values),), unit, meaning)

    def _function(
        self, name: str, summary: str, identity: str, inputs: tuple[str, ...], *outputs: Result
    ) -> SymbolicFunction:
        arguments = tuple(self.arguments[argument] for argument in inputs)
        return SymbolicFunction(name, summary, identity, arguments, outputs, self.scope)


_MAKERS: Mapping[str, Callable[[Hybrid], SymbolicFunction]] = {
    name: getattr(Hybrid, name) for name in MAPS
}
