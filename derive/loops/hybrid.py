"""Shared results for a robot with loops: coordinates, solved loops and tool kinematics."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
import sympy as sp

from ..chain.coordinates import InProportion, SolvedRates, ThroughLoops
from ..chain.forward import Forward
from ..chain.groups import Group, groups
from ..chain.kinematics import Kinematics, arguments_of, common_unit, coordinates
from ..model.errors import DescriptionError
from ..model.mechanism import Mechanism, Strut
from ..model.tolerances import CLOSED_LOOP
from ..terms.role import OTHER, Role
from ..terms.symbolic_function import Argument, Result, SymbolicFunction
from ..terms.terms import Terms
from .closing.actuation import check_actuation
from .closing.closed_loops import ClosedLoops, Vector, longest_length
from .closing.gaps import not_closing
from .closing.mobility import Mobility, mobility_of
from .closing.residual_gaps import residual_gaps
from .closing.tilted_pins import closable
from .model.constraints import (
    ConfigurationVariable,
    LoopEquations,
    configuration_names,
    constraints,
)
from .planar.loop_step import HALF, LoopStep
from .solve.collapse import collapsed
from .solve.solution import (
    Loops,
    Solution,
    every_solution,
    from_actuators,
    from_chain,
    joint_angle,
    sorted_loops,
)

MAX_BRANCHES = 128
"""Maximum number of branches of a kinematic map: seven binary choices."""
_DOMAINS = {"q": "actuators", "theta": "chain", "z": "configuration"}


class Hybrid:
    """Shared intermediate results of one mechanism's functions, each computed on first use.

    Attributes:
        mechanism: The description.
        robot: The main chain as a serial robot.
        terms: Names of all terms.
        loops: The loops by kind.
        arguments: The arguments of all functions, by name.
        residual_gaps: The gaps of loops that close only in the least-squares sense; None if all
            loops close.
        missing: Number of branches that each all-branch function omits, keyed by function name.
    """

    def __init__(self, mechanism: Mechanism, terms: Terms | None = None) -> None:
        """Classifies the loops and names the coordinates.

        Args:
            mechanism: The description.
            terms: The terms of a different mechanism with the same parameters. By default, new
                terms are created.
        """
        self.missing: dict[str, str] = {}
        self._known_behind: dict[sp.Symbol, set[sp.Symbol]] = {}
        self.terms = terms or Terms({p.symbol: p.value for p in mechanism.parameters})
        mechanism = closable(mechanism, self.terms)
        self.residual_gaps = (
            residual_gaps(mechanism) if mechanism.closure == "least squares" else None
        )
        if self.residual_gaps is not None:
            text = f"closed in least squares: {self.residual_gaps}"
            mechanism = replace(mechanism, notes=(*mechanism.notes, text))
        self.mechanism = mechanism
        self.robot = mechanism.main_chain
        self.loops: Loops = sorted_loops(mechanism)
        moving = self.robot.moving
        self.arguments = arguments_of([c.unit for c in mechanism.coordinates], "actuator")
        unit = common_unit(joint.unit for joint in moving)
        for name, of_time, meaning in (
            ("theta", "", "joints of the main chain"),
            ("thetad", "/s", "joint rates of the main chain"),
            ("thetadd", "/s^2", "joint accelerations of the main chain"),
        ):
            # A parameter may be called theta4, but parameter names never start with an underscore.
            symbols = coordinates(f"_{name}", len(moving))
            self.arguments[name] = Argument(
                name, symbols, (len(moving),), f"{unit}{of_time}", meaning
            )
        for name, of_time in (("z", ""), ("zd", "/s")):
            symbols = coordinates(f"_{name}", len(self.variables))
            meaning = f"{'rates of the ' if of_time else ''}full configuration"
            self.arguments[name] = Argument(
                name, symbols, (len(symbols),), f"(rad or m){of_time}", meaning
            )
        self.q, self.theta = self.arguments["q"].symbols, self.arguments["theta"].symbols

    # --- the solutions ---

    @property
    def may_have_inverse(self) -> bool:
        """Whether the tool pose can have an inverse, exact or refined from a nominal robot.

        A robot designed with loops that have no closed form has no inverse.
        """
        is_built = self.residual_gaps is not None or self.mechanism.nominal is not None
        return is_built or self.chain_is_known

    @property
    def chain_is_known(self) -> bool:
        """Whether the loops determine the main-chain joints in closed form."""
        return all(joint.name in self.forward.values for joint in self.robot.moving)

    @property
    def _solvable(self) -> Loops:
        """The loops that may have a closed form; loops that cannot close are excluded."""
        if self.residual_gaps is None:
            return self.loops
        return replace(self.loops, planar=(), spatial=())

    @cached_property
    def forward(self) -> Solution:
        """All joints as functions of the actuators.

        Raises:
            LoopError: The loops do not close at the reference. The message states the gap
                and the remedies.
        """
        try:
            return from_actuators(self._solvable, self.terms, self.q)
        except DescriptionError as error:
            raise not_closing(self.mechanism, error) from error

    @cached_property
    def backward(self) -> Solution:
        """All joints as functions of the main-chain joints; empty if the branch is undetermined.

        An undetermined branch is an error, unless the loops have no closed form or describe an
        as-built robot.
        """
        try:
            return from_chain(self._solvable, self.terms, self.theta, closed=self.closed)
        except DescriptionError:
            if not self.forward.open and self.mechanism.closure == "exact":
                raise
        none = replace(self.loops, planar=(), spatial=())
        return from_chain(none, self.terms, self.theta, closed=self.closed)

    @cached_property
    def forward_branches(self) -> list[Solution]:
        """The solutions from the actuators on all closed-form branches."""
        given = [c.moves for c in self.mechanism.coordinates]
        return self._complete("chain_all", self.forward, given)

    @cached_property
    def backward_branches(self) -> list[Solution]:
        """The solutions from the main chain on all closed-form branches."""
        given = [joint.name for joint in self.robot.moving]
        return self._complete("actuators_all", self.backward, given)

    def _complete(self, name: str, own: Solution, given: Sequence[str]) -> list[Solution]:
        """Returns the branches that determine at least the joints of the reference branch."""
        found, is_all = every_solution(self.loops, own, given, MAX_BRANCHES)
        whole = [solution for solution in found if set(solution.open) <= set(own.open)]
        if not is_all:
            self.missing[name] = f"{name} has {len(whole)} of more than {MAX_BRANCHES} branches"
        elif len(whole) < len(found):
            left = len(found) - len(whole)
            self.missing[name] = f"{name} omits {left} branches without a closed form"
        return whole

    @cached_property
    def closed(self) -> dict[str, float]:
        """Joint values at the reference configuration; empty if the loops have no closed form."""
        of = self.forward.reference.of
        if self.forward.open:
            return {}
        return {name: of(value) for name, value in self.forward.values.items()}

    @cached_property
    def variables(self) -> tuple[ConfigurationVariable, ...]:
        """The entries of the full configuration z."""
        return configuration_names(self.mechanism)

    @cached_property
    def passive_in_loops(self) -> tuple[ConfigurationVariable, ...]:
        """The passive joints in z, without drives that are coupled to other joints."""
        found = {variable.name: variable for variable in self.variables}
        return tuple(found[name] for name in self.mechanism.passive if name in found)

    @cached_property
    def at_reference(self) -> dict[str, float]:
        """The value of every entry of z at the closed reference configuration."""
        if self.forward.open:
            return self._without_noise(
                dict(zip(self.in_numbers.names, map(float, self._closed), strict=True))
            )
        values = self.named(self.forward, [variable.name for variable in self.variables])
        of = self.forward.reference.of
        return {v.name: of(value) for v, value in zip(self.variables, values, strict=True)}

    def _without_noise(self, at: dict[str, float]) -> dict[str, float]:
        """Sets values below the iteration precision to 0, as they differ between processors."""
        size = longest_length(self.mechanism, self.terms)
        scales = {v.name: 1.0 if v.unit == "rad" else size for v in self.variables}
        return {
            name: value if abs(value) > CLOSED_LOOP * scales[name] else 0.0
            for name, value in at.items()
        }

    @cached_property
    def q_at_reference(self) -> Vector:
        """The actuated coordinates (n,) at the reference configuration (radian or metre)."""
        at, value = self.at_reference, self.terms.value
        return np.array([at[c.moves] / float(value(c.ratio)) for c in self.mechanism.coordinates])

    @cached_property
    def equations(self) -> tuple[LoopEquations, ...]:
        """The independent scalar equations of all loops, in z."""
        z, is_open = self.arguments["z"].symbols, self.residual_gaps is not None
        return constraints(self.mechanism, self.terms, z, may_stay_open=is_open)

    @cached_property
    def in_numbers(self) -> ClosedLoops:
        """The constraints in double precision, near the reference configuration."""
        if self.residual_gaps is not None:
            return ClosedLoops(self.mechanism, self.residual_gaps.at, in_least_squares=True)
        return ClosedLoops(self.mechanism, {} if self.forward.open else self.at_reference)

    @cached_property
    def _closed(self) -> Vector:
        """The reference configuration, closed by Newton's method if it has no closed form."""
        loops = self.in_numbers
        try:
            return loops.closed(loops.reference, loops.passive)
        except DescriptionError as error:
            raise not_closing(self.mechanism, error) from error

    @cached_property
    def mobility(self) -> Mobility:
        """The mechanism's freedoms, by counting and by rank."""
        return mobility_of(self._loops_that_close())

    def _loops_that_close(self) -> ClosedLoops:
        try:
            self.in_numbers.generic  # noqa: B018
        except DescriptionError as error:
            raise not_closing(self.mechanism, error) from error
        return self.in_numbers

    def check(self) -> None:
        """Rejects a mechanism with open loops or undetermined motion.

        Raises:
            DescriptionError: The loops do not close at the reference, some freedoms have no
                actuator, or some actuators depend on each other.
        """
        check_actuation(self._loops_that_close())
        self.at_reference  # noqa: B018

    # --- the chain in actuated coordinates ---

    @cached_property
    def groups(self) -> tuple[Group, ...]:
        """The main chain, its joint values expressed in the actuators."""
        return groups(self.robot, self.terms, self._joint_values)

    @cached_property
    def _joint_values(self) -> list[sp.Expr]:
        values = self.forward.values
        return [joint.direction * values[joint.name] for joint in self.robot.moving]

    @cached_property
    def kinematics(self) -> Kinematics:
        """The kinematics of the tool as functions of the actuators."""
        values = self._joint_values
        shorter, translations = collapsed(
            self.terms, self.groups, self.forward.relations, len(values)
        )
        everything = [*values, *translations]
        kept = [everything[k] for group in shorter for s in group.stations for k in s.joints]
        motion = ThroughLoops(kept, SolvedRates(self.terms, self.forward.loops, self.q))
        links = Forward(self.terms, self.groups)
        return Kinematics.of(self.robot, self.terms, shorter, motion, self.arguments, links)

    @cached_property
    def open_chain(self) -> Kinematics:
        """The kinematics of the tool as functions of the main-chain joints."""
        motion = InProportion(self.robot, self.terms, self.theta)
        found = groups(self.robot, self.terms, motion.values)
        arguments = {f"q{d}": self.arguments[f"theta{d}"] for d in ("", "d", "dd")}
        return Kinematics.of(self.robot, self.terms, found, motion, arguments)

    def tool_functions(self, names: Collection[str]) -> dict[str, SymbolicFunction]:
        """Returns the named tool functions, whose results are NaN if a loop does not close."""
        found = self.kinematics.functions(names)
        return {name: self.of_closed_loops(function) for name, function in found.items()}

    def of_closed_loops(self, function: SymbolicFunction) -> SymbolicFunction:
        """Returns a function of actuator or chain joints, NaN if a loop does not close."""
        is_of_actuators = function.role.domain == _DOMAINS["q"]
        solution = self.forward if is_of_actuators else self.backward
        results = tuple(
            replace(result, entries=self.while_closed(result.entries, solution))
            for result in function.outputs
        )
        return replace(function, outputs=results)

    def while_closed(self, entries: Sequence[sp.Expr], *solutions: Solution) -> tuple[sp.Expr, ...]:
        """Makes expressions that depend on the configuration NaN if the loops do not close.

        An expression that contains the square root of a solution step is NaN if the step has no
        solution. Other steps, such as those for a brace next to the chain, need an extra term that
        is 0 or NaN.

        Args:
            entries: The entries.
            solutions: The solutions on which these expressions depend. The loops of a single
                solution must close.
        """
        unguarded = [
            [self._unguarded_steps(entry, solution) for solution in solutions] for entry in entries
        ]
        asked = [all(steps) for steps in unguarded]
        if not any(asked):
            return tuple(entries)
        # All entries share one term, because an extra square root costs more than a comparison.
        conditions = []
        for k, solution in enumerate(solutions):
            indices = {
                i
                for row, is_asked in zip(unguarded, asked, strict=True)
                if is_asked
                for i in row[k]
            }
            squares = [self._under_root(solution.steps[i]) for i in sorted(indices)]
            conditions.append(sp.And(*(sp.Ge(square, 0) for square in squares)))
        gate = self.where(sp.Or(*conditions))
        return tuple(
            self.terms.let(entry + gate) if is_asked else entry
            for entry, is_asked in zip(entries, asked, strict=True)
        )

    def _unguarded_steps(self, entry: sp.Expr, solution: Solution) -> list[int]:
        """Returns the indices of the steps whose square roots are missing from an expression."""
        if self.terms.is_constant(entry):
            return []
        behind = self._behind(entry)
        return [
            i
            for i, step in enumerate(solution.steps)
            if step.margin is not None and not step.root.free_symbols <= behind
        ]

    def _under_root(self, step: LoopStep) -> sp.Expr:
        """Returns the radicand of a step, which has the margin's sign, or the margin itself."""
        (root,) = step.root.free_symbols
        powers = self.terms.definitions[root].atoms(sp.Pow)
        bases = [p.base for p in powers if p.exp == HALF and p.base.free_symbols]
        return bases[0] if len(bases) == 1 else step.margin

    def _behind(self, entry: sp.Expr) -> frozenset[sp.Symbol]:
        """Returns the symbols on which an entry depends."""
        definitions, known = self.terms.definitions, self._known_behind
        for symbol in self.terms.needed(entry.free_symbols - known.keys()):
            if symbol not in known:
                own = definitions[symbol].free_symbols
                known[symbol] = own.union(*(known.get(s, ()) for s in own))
        own = entry.free_symbols
        return frozenset(own.union(*(known.get(s, ()) for s in own)))

    def where(self, condition: sp.Basic) -> sp.Expr:
        """Returns an expression that is 0 if a condition holds, otherwise NaN."""
        # With constants in both cases, automatic differentiation does not divide by zero.
        square = self.terms.let(sp.Piecewise((0, condition), (-1, True)))
        return self.terms.let(sp.sqrt(square))

    def named(self, solution: Solution, names: Iterable[str]) -> tuple[sp.Expr, ...]:
        """Returns values of joints and coupled drives; joint angles lie between -pi and pi."""
        joints = {joint.name: joint for joint in self.mechanism.joints}
        found = []
        for name in names:
            follower = self.mechanism.followers.get(name)
            if follower is not None:
                found.append(self.terms.let(solution.values[follower.joint] / follower.ratio))
                continue
            value, joint = solution.values[name], joints.get(name)
            lengths = isinstance(self.mechanism.members.get(name), Strut)
            if not lengths and (joint is None or joint.kind != "prismatic"):
                value = joint_angle(self.terms, solution, value, joint)
            found.append(self.terms.let(value))
        return tuple(found)

    @cached_property
    def chain(self) -> tuple[sp.Expr, ...]:
        """The main-chain joints as functions of the actuators."""
        return self.named(self.forward, [joint.name for joint in self.robot.moving])

    def actuator(self, k: int) -> sp.Expr:
        """Returns one actuator as a function of the main-chain joints.

        Raises:
            DescriptionError: This actuator has no closed form.
        """
        coordinate = self.mechanism.coordinates[k]
        if coordinate.moves in self.backward.open:
            raise DescriptionError(f"{self.mechanism.name}: no closed form gives {coordinate.name}")
        (value,) = self.named(self.backward, [coordinate.moves])
        return self.terms.let(value / coordinate.ratio)

    def actuators_in(self, solution: Solution) -> tuple[sp.Expr, ...]:
        """Returns the actuated coordinates of a solution."""
        return self.driven(self.named(solution, [c.moves for c in self.mechanism.coordinates]))

    def driven(self, values: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
        """Returns the actuated coordinates, computed from the values of the actuated joints."""
        return tuple(
            self.terms.let(value / c.ratio)
            for value, c in zip(values, self.mechanism.coordinates, strict=True)
        )

    def function(
        self,
        name: str,
        summary: str,
        identity: str,
        inputs: tuple[str, ...],
        *outputs: Result,
        role: Role = OTHER,
    ) -> SymbolicFunction:
        """Builds a function of some arguments. The first argument determines the domain."""
        arguments = tuple(self.arguments[argument] for argument in inputs)
        text = replace(role, domain=_DOMAINS[inputs[0]])
        return SymbolicFunction(name, summary, identity, arguments, outputs, self.terms, role=text)
