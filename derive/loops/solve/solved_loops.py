"""Closed-form solutions of the loops of a mechanism, and the reference with closed loops."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace

import numpy as np
import sympy as sp

from ...model.errors import DescriptionError
from ...model.mechanism import Coordinate, Strut
from ...model.tolerances import CLOSED_LOOP
from ...terms.symbolic_function import SymbolicFunction
from ..closing.actuation import check_actuation, overactuated_start
from ..closing.closed_loops import ClosedLoops, Vector
from ..closing.loop_model import LoopModel
from ..closing.open_loops import diagnose_open_loop
from ..planar.loop_step import HALF, LoopStep
from .solution import (
    Loops,
    Solution,
    every_solution,
    from_actuators,
    from_chain,
    joint_angle,
    sorted_loops,
)

MAX_BRANCHES = 128
"""Maximum number of branches that ``chain_all`` or ``actuators_all`` returns."""


@dataclass(frozen=True, eq=False)
class SolvedLoops(LoopModel):
    """A mechanism whose loops close at the reference, with their closed-form solutions.

    Attributes:
        loops: The loops, sorted into planar linkages and spatial loops.
        forward: The solution for all joints as functions of the actuators.
        backward: The solution for all joints as functions of the main-chain joints. This solution
            may be empty if the loops have no closed form or do not close exactly.
        numbers: The loop constraints, evaluated in double precision near the reference.
        at_reference: Values of the mechanism variables z at the reference configuration with closed
            loops, keyed by name.
        q_at_reference: The actuated coordinates (n,) at the reference (radian or meter).
        spare: Number of redundant actuators. A robot with redundant actuators has the function
            ``fk`` only if its loops close in the least-squares sense.
        missing: Messages about branches that a function omits, keyed by the name of the function.
    """

    loops: Loops
    forward: Solution
    backward: Solution
    numbers: ClosedLoops
    at_reference: Mapping[str, float]
    q_at_reference: Vector
    spare: int = 0
    missing: dict[str, str] = field(default_factory=dict)

    @property
    def is_overdetermined(self) -> bool:
        """Whether the values of redundant actuators can contradict each other.

        If the values of redundant actuators can contradict each other, the robot has no function
        ``fk``.
        """
        return bool(self.spare) and self.least_squares_closure is None

    @property
    def has_closed_form(self) -> bool:
        """Whether the actuators and the main chain each determine all joints in closed form."""
        return not (self.forward.open or self.backward.open)

    @property
    def freedoms(self) -> int:
        """Number of degrees of freedom."""
        return len(self.q) - (self.spare if self.is_overdetermined else 0)

    @property
    def may_have_inverse(self) -> bool:
        """Whether an IK function is possible, in closed form or refined from a nominal robot.

        If loops that close exactly have no closed form, an IK function is possible only with a
        nominal robot.
        """
        is_open = self.least_squares_closure is not None and not self.spare
        is_built = is_open or self.mechanism.nominal is not None
        return is_built or self.chain_is_known

    @property
    def chain_is_known(self) -> bool:
        """Whether the loops determine the main-chain joints in closed form."""
        return all(joint.name in self.forward.values for joint in self.robot.moving)

    def of_closed_loops(self, function: SymbolicFunction) -> SymbolicFunction:
        """Return a copy of the function whose results are NaN if the loops do not close."""
        is_of_actuators = function.role.domain == "actuators"
        solution = self.forward if is_of_actuators else self.backward
        results = tuple(
            replace(result, entries=self.while_closed(result.entries, solution))
            for result in function.outputs
        )
        return replace(function, outputs=results)

    def while_closed(self, entries: Sequence[sp.Expr], *solutions: Solution) -> tuple[sp.Expr, ...]:
        """Make expressions NaN if the loops do not close.

        The square root in the solution of a loop is NaN if the loop does not close.
        ``while_closed`` adds a term to each expression without this square root. The added term is
        0 for closed loops and NaN otherwise. For example, the pose of a chain does not contain the
        square root from a brace between two links of the chain.

        Args:
            entries: The entries.
            solutions: The solutions on which the expressions depend. The expressions are not NaN if
                all loops of at least one solution close.
        """
        unguarded = [
            [self._unguarded_steps(entry, solution) for solution in solutions] for entry in entries
        ]
        requested = [all(steps) for steps in unguarded]
        if not any(requested):
            return tuple(entries)
        # All entries for which ``requested`` is true share one added term that is NaN if the loops
        # do not close. A separate term for each entry would cost one square root per entry.
        conditions = []
        for k, solution in enumerate(solutions):
            indices = {
                i
                for row, is_asked in zip(unguarded, requested, strict=True)
                if is_asked
                for i in row[k]
            }
            squares = [self._under_root(solution.steps[i]) for i in sorted(indices)]
            conditions.append(sp.And(*(sp.Ge(square, 0) for square in squares)))
        gate = self.where(sp.Or(*conditions))
        return tuple(
            self.terms.let(entry + gate) if is_asked else entry
            for entry, is_asked in zip(entries, requested, strict=True)
        )

    def _unguarded_steps(self, entry: sp.Expr, solution: Solution) -> list[int]:
        """Return indices of the solution steps whose square root does not occur in `entry`."""
        if self.terms.is_constant(entry):
            return []
        behind = self._behind(entry)
        return [
            i
            for i, step in enumerate(solution.steps)
            if step.margin is not None
            # If the square root in a loop step is constant, the loop closes at all configurations,
            # because the loop closes at the reference.
            and not self.terms.is_constant(step.root)
            and not step.root.free_symbols <= behind
        ]

    def _under_root(self, step: LoopStep) -> sp.Expr:
        """Return the radicand of the square root in a step.

        The radicand has the same sign as the margin of the step.

        If the step does not have exactly one square root with a variable radicand, the function
        returns the margin of the step.
        """
        (root,) = step.root.free_symbols
        powers = self.terms.definitions[root].atoms(sp.Pow)
        bases = [p.base for p in powers if p.exp == HALF and p.base.free_symbols]
        return bases[0] if len(bases) == 1 else step.margin

    def _behind(self, entry: sp.Expr) -> frozenset[sp.Symbol]:
        """Return all symbols on which an expression depends, directly or through other terms."""
        definitions = self.terms.definitions
        known: dict[sp.Symbol, set[sp.Symbol]] = self.terms.memoize("symbols behind terms", dict)
        for symbol in self.terms.needed(entry.free_symbols - known.keys()):
            if symbol not in known:
                own = definitions[symbol].free_symbols
                known[symbol] = own.union(*(known.get(s, ()) for s in own))
        own = entry.free_symbols
        return frozenset(own.union(*(known.get(s, ()) for s in own)))

    def where(self, condition: sp.Basic) -> sp.Expr:
        """Return 0 if a condition holds, otherwise NaN."""
        # The radicand is piecewise constant (0 or -1), so that the derivative of the root is
        # defined at 0.
        square = self.terms.let(sp.Piecewise((0, condition), (-1, True)))
        return self.terms.let(sp.sqrt(square))

    def actuators_in(self, solution: Solution) -> tuple[sp.Expr, ...]:
        """Return the values of the actuated coordinates in a solution."""
        return self.driven(named(self, solution, [c.moves for c in self.mechanism.coordinates]))

    def driven(
        self, values: Sequence[sp.Expr], coordinates: Sequence[Coordinate] | None = None
    ) -> tuple[sp.Expr, ...]:
        """Convert the values of actuated joints to actuated coordinates."""
        chosen = self.mechanism.coordinates if coordinates is None else coordinates
        return tuple(
            self.terms.let(value / c.ratio) for value, c in zip(values, chosen, strict=True)
        )


def solved_loops(model: LoopModel) -> SolvedLoops:
    """Solve the loops of a mechanism and close them at the reference.

    Raises:
        LoopError: The loops do not close at the reference. The message states the closure error and
            the remedies.
        DescriptionError: An actuator is missing, or actuators depend on each other.
    """
    complete = sorted_loops(model.mechanism)
    # Loops that close only in the least-squares sense have no closed form.
    solvable = complete if model.least_squares_closure is None else _without_steps(complete)
    try:
        forward = from_actuators(solvable, model.terms, model.q)
        described = {} if forward.open else _described(model, forward)
        numbers = _numbers(model, described)
        _ = numbers.generic
    except DescriptionError as error:
        raise diagnose_open_loop(model.mechanism, error) from error
    spare = check_actuation(numbers)
    is_overdetermined = spare > 0
    if is_overdetermined:
        forward = from_actuators(_without_steps(complete), model.terms, model.q)
        described, numbers = {}, _numbers(model, overactuated_start(model.mechanism))
    elif model.least_squares_closure is not None and model.least_squares_closure.actuators:
        spare, solvable = model.least_squares_closure.actuators, complete
    # With rounded reference values of redundant actuators, the loops do not close exactly.
    # Therefore, closing these loops may also change the actuator values.
    free = np.ones_like(numbers.passive) if is_overdetermined else numbers.passive
    at = described or _closed(model, numbers, free)
    value, coordinates = model.terms.value, model.mechanism.coordinates
    q = np.array([at[c.moves] / float(value(c.ratio)) for c in coordinates])
    backward = _backward(model, solvable, forward)
    found = {f.name: getattr(model, f.name) for f in fields(model)}
    return SolvedLoops(
        **found,
        loops=complete,
        forward=forward,
        backward=backward,
        numbers=numbers,
        at_reference=at,
        q_at_reference=q,
        spare=spare,
    )


def _without_steps(loops: Loops) -> Loops:
    """Return a copy of ``loops`` with empty fields ``planar`` and ``spatial``.

    Therefore, no loop of the returned copy is solved in closed form.
    """
    return replace(loops, planar=(), spatial=())


def _numbers(model: LoopModel, at: Mapping[str, float]) -> ClosedLoops:
    if model.least_squares_closure is not None:
        return ClosedLoops(model.mechanism, model.least_squares_closure.at, in_least_squares=True)
    return ClosedLoops(model.mechanism, at)


def _described(model: LoopModel, forward: Solution) -> dict[str, float]:
    """Return the closed-form values of all mechanism variables at the reference."""
    values = named(model, forward, [variable.name for variable in model.variables])
    of = forward.reference.of
    return {v.name: of(value) for v, value in zip(model.variables, values, strict=True)}


def _closed(model: LoopModel, numbers: ClosedLoops, free: Vector) -> dict[str, float]:
    """Close the loops by Newton's method and return the resulting reference configuration.

    Reference values below the precision of Newton's method become 0, because such values differ
    between processors.
    """
    try:
        w = numbers.closed(numbers.reference, free)
    except DescriptionError as error:
        raise diagnose_open_loop(model.mechanism, error) from error
    scales = {v.name: 1.0 if v.unit == "rad" else numbers.size for v in model.variables}
    at = numbers.configuration(w)
    return {name: x if abs(x) > CLOSED_LOOP * scales[name] else 0.0 for name, x in at.items()}


def _backward(model: LoopModel, loops: Loops, forward: Solution) -> Solution:
    """Return the solution that computes all joints from the main-chain joints.

    If no unique branch is found for loops that close exactly and in closed form, the function
    raises an error. For other loops without a unique branch, the returned solution is empty.
    """
    of, terms, theta = forward.reference.of, model.terms, model.theta
    closed = {} if forward.open else {name: of(x) for name, x in forward.values.items()}
    try:
        return from_chain(loops, terms, theta, closed=closed)
    except DescriptionError:
        if not forward.open and model.mechanism.closure == "exact":
            raise
    return from_chain(_without_steps(loops), terms, theta, closed=closed)


def named(model: LoopModel, solution: Solution, names: Iterable[str]) -> tuple[sp.Expr, ...]:
    """Return values of joints by name, with each solved angle wrapped into one full turn."""
    joints = {joint.name: joint for joint in model.mechanism.joints}
    found = []
    for name in names:
        value, joint = solution.values[name], joints.get(name)
        lengths = isinstance(model.mechanism.members.get(name), Strut)
        is_turn = not lengths and (joint is None or joint.kind != "prismatic")
        if is_turn and name not in solution.coupled:
            value = joint_angle(model.terms, solution, value, joint)
        found.append(model.terms.let(value))
    return tuple(found)


def forward_branches(h: SolvedLoops) -> list[Solution]:
    """Return the solutions for given actuator values on all closed-form branches."""
    given = [c.moves for c in h.mechanism.coordinates]
    return _complete(h, "chain_all", h.forward, given)


def backward_branches(h: SolvedLoops) -> list[Solution]:
    """Return the solutions for given main-chain joint values on all closed-form branches."""
    given = [joint.name for joint in h.robot.moving]
    return _complete(h, "actuators_all", h.backward, given)


def _complete(h: SolvedLoops, name: str, own: Solution, given: Sequence[str]) -> list[Solution]:
    """Return the branches that solve every joint that the reference branch solves."""
    found, is_all = every_solution(h.loops, own, given, MAX_BRANCHES)
    complete = [solution for solution in found if set(solution.open) <= set(own.open)]
    if not is_all:
        h.missing[name] = f"{name} has {len(complete)} of more than {MAX_BRANCHES} branches"
    elif len(complete) < len(found):
        left = len(found) - len(complete)
        h.missing[name] = f"{name} omits {left} branches without a closed form"
    return complete
