"""Converts the solution steps of an inverse kinematics task to printed symbols.

Each solution step solves an equation, whose coefficients are converted to printed symbols. Long
coefficients get the names A, B and C with the number of the step. The type of an equation
determines how the equation and its solution are printed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from ...inverse.steps.work import InverseStep, NamedVector
from ...inverse.structure.lines import Lines
from ...inverse.subproblems.equations import (
    AngleEquation,
    Direction,
    JointEquation,
    LengthEquation,
    LineAndPlane,
    LineAndSphere,
    Linear,
)
from ...inverse.subproblems.found import FoundLength, FoundTurn
from ...inverse.subproblems.turns import NO_TURN
from ...inverse.tasks.task import Solved
from ...model.robot import SerialRobot
from ...terms.symbolic_function import Argument
from ..setting.notation import Notation
from ..setting.sharing import Definition
from ..setting.widths import LINE, width
from .inverse_symbols import InverseSymbols
from .inverse_terms import SHORT, InverseTerms
from .parallel_sums import merged, parallel_pairs

DIRECT = 0.6 * LINE
"""Maximum total width (pt) of the two coefficients that are printed inside an atan2."""
Equation = AngleEquation | LengthEquation | JointEquation


@dataclass(frozen=True)
class PrintedInverseStep:
    """One solution step of an inverse kinematics task, with its printed symbols.

    Attributes:
        step: The original solution step.
        number: Number of the step in the LaTeX article.
        definitions: Definitions of the named terms and coefficients in the solution step, each of
            which depends only on earlier definitions.
        unknown: The coordinate or sum of coordinates that the step determines.
        name: Symbol of the unknown coordinate or of the unknown sum of coordinates.
        sense: The rotation angle of the step is ``sense`` (1 or -1) times ``name``.
        equation: The equation that the step solves, in printed symbols.
        solution: Terms whose sum is the unknown, or () if a quartic determines several unknowns.
    """

    step: InverseStep
    number: int
    definitions: tuple[Definition, ...]
    unknown: sp.Expr
    name: sp.Symbol
    sense: int
    equation: Equation
    solution: tuple[sp.Expr, ...]


@dataclass(frozen=True)
class PrintedVector:
    """A vector in the solution steps.

    Attributes:
        vector: The original vector, before its conversion to printed symbols.
        letter: LaTeX letter of the vector.
        shown: Printed components of the vector, or () if the vector depends on solution steps.
    """

    vector: NamedVector
    letter: str
    shown: tuple[sp.Expr, ...] = ()


@dataclass(frozen=True)
class PrintedTask:
    """An inverse kinematics task, with the symbols that the LaTeX article prints.

    Attributes:
        solved: The task.
        inputs: Pairs of a task input and its printed symbols.
        signs: The printed symbols of the branch signs (1 or -1) that select a solution.
        vectors: The vectors in the solution steps.
        definitions: Vector components that do not depend on any solution step.
        steps: The printed solution steps of the task.
        rest: Coordinates that follow from an angle sum, and their values.
        free: Coordinates that the task does not determine and that are therefore set to 0.
        locked: Coordinates that the loops keep constant.
        symbols: The printed symbols, keyed by the original symbols of inputs and signs.
    """

    solved: Solved
    inputs: tuple[tuple[Argument, tuple[sp.Symbol, ...]], ...]
    signs: tuple[sp.Symbol, ...]
    vectors: tuple[PrintedVector, ...]
    definitions: tuple[Definition, ...]
    steps: tuple[PrintedInverseStep, ...]
    rest: tuple[Definition, ...]
    free: tuple[sp.Symbol, ...]
    locked: tuple[sp.Symbol, ...]
    symbols: Mapping[sp.Symbol, sp.Symbol]


def printed_task(
    robot: SerialRobot,
    notation: Notation,
    lines: Lines,
    solved: Solved,
    first: int,
    actuators: Mapping[str, sp.Symbol],
) -> PrintedTask:
    """Convert the solution steps of an inverse kinematics task to printed symbols.

    Args:
        robot: The chain.
        notation: Notation with the robot's short symbols, to which the function adds the symbols of
            the task.
        lines: The axes of the chain.
        solved: The task.
        first: Number of the first printed solution step.
        actuators: Printed symbols of the actuated coordinates that solution steps may determine,
            keyed by coordinate name.
    """
    return _Writer(robot, notation, lines, solved, actuators).printed(first)


class _Writer:
    def __init__(
        self,
        robot: SerialRobot,
        notation: Notation,
        lines: Lines,
        solved: Solved,
        actuators: Mapping[str, sp.Symbol],
    ) -> None:
        self.robot, self.notation, self.solved = robot, notation, solved
        self.work, self.axes = solved.work, lines.axes
        self.symbols = InverseSymbols(robot, notation, lines, solved, actuators)
        self.terms = InverseTerms(solved.work.terms, self.symbols)
        self.slid: frozenset[int] = frozenset()
        signs = dict(zip(self.work.signs, self.symbols.signs, strict=True))
        self.shown = self.symbols.inputs | signs
        self.terms.known |= self.shown
        self._seed_turns()

    def printed(self, first: int) -> PrintedTask:
        """Return the task with the symbols that the LaTeX article prints.

        The solution steps are numbered from ``first``.
        """
        wanted = [self._equation(step) for step in self.work.steps]
        entries = [entry for equation in wanted for entry in equation.coefficients]
        self._merge(entries)
        vectors = tuple(map(self._vector, self.work.vectors))
        of_vectors = tuple(self.terms.taken())
        self.terms.uses = self.terms.counted(entries)
        numbered = enumerate(zip(self.work.steps, wanted, strict=True), first)
        steps = tuple(self._step(step, equation, number) for number, (step, equation) in numbered)
        rest = tuple(self._rest(steps))
        inputs = self.symbols.inputs
        arguments = tuple(
            (argument, tuple(inputs[s] for s in argument.symbols if s in inputs))
            for argument in self.solved.function.inputs
        )
        return PrintedTask(
            self.solved,
            arguments,
            self.symbols.signs,
            vectors,
            of_vectors,
            steps,
            rest,
            self._free(),
            self._still(),
            self.shown,
        )

    def _seed_turns(self) -> None:
        for step in self.work.steps:
            if isinstance(step.found, FoundTurn):
                self.terms.seed(step.found.turn, self.symbols.angle(step.joints))
        for joint, turn in self.work.turns.items():
            self.terms.seed(turn, self.symbols.value_of(joint))

    def _merge(self, entries: Sequence[sp.Expr]) -> None:
        pairs = list(parallel_pairs(self.work, self.axes))
        known = self.terms.known
        for pair in pairs:
            angle = self.symbols.angle(pair.names)
            # The symbols for the cosine and sine of an angle sum, such as c_{23}, are defined when
            # they first occur.
            known[pair.total.c], known[pair.total.s] = sp.cos(angle), sp.sin(angle)
        terms = self.work.terms
        needed = terms.needed(entries)
        self.terms.changed |= merged(terms.definitions, needed, pairs, known.__contains__)

    def _vector(self, vector: NamedVector) -> PrintedVector:
        letter = self.symbols.letters.free(vector.letters)
        shown = []
        for axis, component in zip("xyz", vector.vector, strict=True):
            sign, term = component.as_coeff_Mul()
            if self.terms.is_open(term):
                name = self.symbols.component(letter, axis)
                self.terms.preferred.setdefault(term, sign * name)
            if not vector.after:
                self.terms.settle_below(component)
                shown.append(self.terms.value(component))
        return PrintedVector(vector, letter, tuple(shown))

    def _equation(self, step: InverseStep) -> Equation:
        equation = step.found.equation
        if isinstance(equation, JointEquation):
            return equation
        return equation if self.symbols.sense(step.joints) == 1 else equation.mirrored

    def _step(self, step: InverseStep, equation: Equation, number: int) -> PrintedInverseStep:
        sense = self.symbols.sense(step.joints, self.slid)
        unknown = sense * self.symbols.angle(step.joints, self.slid)
        name = unknown if unknown.is_Symbol else self.symbols.sum(number)
        shown = self._shown(equation, number)
        solution: tuple[sp.Expr, ...] = ()
        if not isinstance(shown, JointEquation):
            sign = step.found.sign
            solution = shown.solution(sp.Integer(1) if sign is None else self.shown[sign] * sense)
            if self._is_upright(equation, shown):
                solution = solution[1:]
        if isinstance(step.found, FoundLength):
            self._slide(step, step.found, sense * unknown)
        definitions = tuple(self.terms.taken())
        return PrintedInverseStep(step, number, definitions, unknown, name, sense, shown, solution)

    def _is_upright(self, equation: Equation, shown: Equation) -> bool:
        if not isinstance(shown, Linear) or shown.b != 0 or shown.d == 0:
            return False
        a, terms = equation.coefficients[0], self.work.terms
        return terms.is_constant(a) and bool(terms.value(a) > 0)

    def _slide(self, step: InverseStep, found: FoundLength, value: sp.Expr) -> None:
        sign, term = found.length.as_coeff_Mul()
        if self.terms.is_open(term):
            self.terms.known[term] = sign * value
        if step.joints[0] not in self.symbols.actuators:
            self.slid |= {self.symbols.axis(step.joints[0], self.slid).joint}

    def _shown(self, equation: Equation, number: int) -> Equation:
        entries = equation.coefficients
        shown = []
        for entry in entries:
            self.terms.settle_below(entry)
            shown.append(self.terms.value(entry))
        if not isinstance(equation, JointEquation) and not self._fits(equation, shown):
            letters = "BC" if isinstance(equation, LineAndSphere) else "ABC"
            shown = [
                self._coefficient(entry, letter, number)
                for entry, letter in zip(entries, letters, strict=False)
            ]
        return equation.with_coefficients(shown)

    def _fits(self, equation: Equation, values: Sequence[sp.Expr]) -> bool:
        if isinstance(equation, LineAndPlane):
            return True
        wide = sum(width(self.terms.printer.tex(value)) for value in values)
        return isinstance(equation, Direction) and wide < DIRECT

    def _coefficient(self, entry: sp.Expr, letter: str, number: int) -> sp.Expr:
        value = self.terms.value(entry)
        if not value.is_Add and width(self.terms.printer.tex(value)) < SHORT:
            return value
        name = self.symbols.coefficient(letter, number)
        sign, term = entry.as_coeff_Mul()
        if term in self.terms.inlined and self.terms.inlined[term].is_Add:
            del self.terms.inlined[term]
            self.terms.known[term] = sign * name
        self.terms.define(name, value)
        return name

    def _rest(self, steps: Sequence[PrintedInverseStep]) -> list[Definition]:
        found = []
        for remainder in self.work.remainders:
            step = next(step for step in steps if step.step.joints == remainder.joints)
            last = self.symbols.value_of(self.symbols.axis(remainder.last).joint)
            (last,) = last.free_symbols
            factor = step.unknown.coeff(last)
            found.append((last, sp.expand(factor * (step.name - step.unknown)) + last))
        return found

    def _free(self) -> tuple[sp.Symbol, ...]:
        if self.symbols.actuators:
            return ()
        done = {name for step in self.work.steps if len(step.joints) == 1 for name in step.joints}
        done |= {remainder.last for remainder in self.work.remainders} | {*self.solved.given}
        turns = self.work.turns
        return tuple(
            q
            for k, (joint, q) in enumerate(zip(self.robot.moving, self.notation.q, strict=True))
            if joint.name not in done
            and turns.get(k, NO_TURN) == NO_TURN
            and k not in self.work.locked
        )

    def _still(self) -> tuple[sp.Symbol, ...]:
        return tuple(self.notation.q[k] for k in sorted(self.work.locked))
