"""Converts the steps of a closed-form loop solution to printed symbols.

Each kind of solution step has equations in its own symbols (``StepEquations``). The same code
converts all kinds of steps to the symbols of the LaTeX article. Quantities with short values are
printed as these values, without a symbol.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import accumulate, islice
from string import Formatter

import sympy as sp

from ...loops.model.phasors import ONE, ZERO, cross, dot
from ...loops.planar.loop_step import (
    SPACE,
    AngleEquation,
    Cross,
    Dot,
    LoopStep,
    RateEquation,
    StepEquations,
    Weighted,
    components,
    length_of,
    letter_and_axis,
    quantity,
)
from ...loops.solve.solution import Solution, factors_of, reported
from ..setting.printed_terms import Definition, PrintedTerms
from ..setting.printer import FractionPrinter
from .members import Letters

Vector = tuple[sp.Expr, ...]
Sum = tuple[tuple[sp.Expr, Vector], ...]
"""Sum of rotated vectors, as pairs (rotation angle, vector)."""


@dataclass(frozen=True)
class PrintedAngle:
    """Cosine and sine of a solved angle, up to a common positive factor."""

    symbol: sp.Symbol
    cosine: sp.Expr
    sine: sp.Expr


@dataclass(frozen=True)
class PrintedRate:
    """A linear equation between joint rates, in printed symbols.

    Attributes:
        left: Unknown rates on the left-hand side, with their factors.
        right: Known rates on the right-hand side, with their factors.
        projected: LaTeX names of two vectors. The left-hand side of the rate equation is the dot
            product of the first vector and the derivative of the second vector. If the left-hand
            side is a sum of products, the tuple of vector names is empty.
    """

    left: Weighted
    right: Weighted
    projected: tuple[str, ...] = ()


@dataclass(frozen=True)
class PrintedLoopStep:
    """A step of the loop solution, in printed symbols.

    Attributes:
        step: The solution step before its conversion to printed symbols.
        number: Number of the solution step in the LaTeX article.
        unknown: Pairs (rotation angle, vector). The rotated vectors add up to the unknown side of
            the loop equation.
        given: Pairs (rotation angle, vector) on the known side of the loop equation.
        vectors: Definitions of the components and lengths of the known vectors.
        results: Definitions of intermediate results and displacements, each after the results on
            which it depends.
        angles: Cosine and sine of each angle that the step solves.
        margin: Margin of the solution step, or None if the step can always be solved.
        rates: Equations for the rates of the step's unknowns.
        positions: Components of each known vector that the equations mention by name.
        points: Components of each vector, for vectors whose components the results mention by name.
        remark: Sentence that states which root of its equation the solution step chooses.
        dead_point: Description of the configurations in which the step's margin is 0.
    """

    step: LoopStep
    number: int
    unknown: Sum = ()
    given: Sum = ()
    vectors: tuple[Definition, ...] = ()
    results: tuple[Definition, ...] = ()
    angles: tuple[PrintedAngle, ...] = ()
    margin: sp.Expr | None = None
    rates: tuple[PrintedRate, ...] = ()
    positions: Mapping[sp.Symbol, Vector] = field(default_factory=dict)
    points: Mapping[sp.Symbol, Vector] = field(default_factory=dict)
    remark: str = ""
    dead_point: str = ""


class VectorPrinter(FractionPrinter):
    """Prints expressions that may contain scalar products and vector products."""

    def _factor(self, factor: sp.Expr) -> str:
        if isinstance(factor, Cross | Dot):
            return f"({self.alone(factor)})"
        return super()._factor(factor)

    def alone(self, product: sp.Expr) -> str:
        """Print a product of two vectors, without brackets around the product."""
        sign = r"\times" if isinstance(product, Cross) else r"\cdot"
        return f" {sign} ".join(map(self.tex, product.args))

    def terms(self, expression: sp.Expr) -> list[str]:
        """Return the signed terms of a sum."""
        if isinstance(expression, Cross | Dot):
            return [self.alone(expression)]
        return super().terms(expression)


def printed_steps(
    terms: PrintedTerms,
    letters: Letters,
    solution: Solution,
    first: int,
    joints: Mapping[str, sp.Symbol],
) -> tuple[PrintedLoopStep, ...]:
    """Convert the solution steps to the symbols of the LaTeX article.

    Args:
        terms: Table of the robot's named terms, to which the function adds the symbols of the
            unknowns.
        letters: Unused letters for the unknowns.
        solution: Solution of the loops for known actuator positions or for known main-chain joints.
        first: Number of the first printed solution step.
        joints: Symbols of the joints.
    """
    values = {solution.values[name]: s for name, s in joints.items() if name in solution.values}
    for name in _leaders(solution):
        # The equations of coupled joints use an inverse tangent to wrap the leader joint's angle to
        # one turn. The LaTeX article prints the joint's symbol instead of the inverse tangent.
        wrapped = reported(solution, solution.values, name)
        if wrapped in terms.terms.definitions and wrapped != solution.values[name]:
            terms.call(wrapped, joints[name])
    numbers = accumulate((not step.continues for step in solution.steps), initial=first - 1)
    return tuple(
        _Writer(terms, letters, step, number, values).printed()
        for step, number in zip(solution.steps, islice(numbers, 1, None), strict=True)
    )


def _leaders(solution: Solution) -> Iterator[str]:
    """Yield the solved joints from which the couplings determine further joints."""
    for coupling in solution.mechanism.couplings:
        names = factors_of(coupling)
        if any(name in solution.coupled for name in names):
            yield from (name for name in names if name in solution.values)


def after(steps: Sequence[PrintedLoopStep], first: int = 1) -> int:
    """Return the number of the solution step that follows the given steps."""
    return max((step.number for step in steps), default=first - 1) + 1


class _Writer:
    """Converts a solution step to printed symbols."""

    def __init__(
        self,
        terms: PrintedTerms,
        letters: Letters,
        step: LoopStep,
        number: int,
        values: Mapping[sp.Expr, sp.Symbol],
    ) -> None:
        self.printed_terms, self.letters, self.step, self.number = terms, letters, step, number
        self.values = values
        self.equations: StepEquations = step.equations()
        self.shown: dict[sp.Basic, sp.Expr] = {}
        self.vectors: list[Definition] = []
        self.results: list[Definition] = []
        self.positions: dict[sp.Symbol, Vector] = {}
        self.found = {s for s in step.solved if s not in terms.known}

    def printed(self) -> PrintedLoopStep:
        equations = self.equations
        self._name_vectors()
        sought = {*self.found, *(t.as_coeff_Mul()[1] for t in equations.unknowns.values())}
        self._name_unknowns()
        for symbol, value in equations.results:
            self._add_result(symbol, value)
        unknown, given = self._sides(sought)
        return PrintedLoopStep(
            self.step,
            self.number,
            unknown,
            given,
            tuple(self.vectors),
            tuple(self.results),
            tuple(self._angle(e) for e in equations.angles if e.angle in self.found),
            None if equations.margin is None else self._put(equations.margin),
            tuple(self._rate(rate) for rate in equations.rates if self._is_new(rate)),
            self.positions,
            self._points(),
            self._in_words(self.step.remark),
            self._in_words(self.step.dead_point),
        )

    # --- names ---

    def _symbol(self, quantity_: sp.Symbol) -> sp.Symbol:
        letter, axis = letter_and_axis(quantity_)
        return self.letters.of_step(letter, self.number, axis)

    def _name_vectors(self) -> None:
        for letter, vector in self.equations.vectors.items():
            parts = [self.printed_terms.of(part) for part in vector]
            is_alone = sum(part != 0 for part in parts) == 1
            for symbol, part in zip(components(letter, SPACE[: len(parts)]), parts, strict=True):
                if part == 0 or _is_letter(part) or (part.is_Rational and is_alone):
                    self.shown[symbol] = part
                    continue
                self.shown[symbol] = self._symbol(symbol)
                delta = partial(self.letters.next, "delta")
                value, new = self.printed_terms.shortened(part, delta)
                self.vectors += [*new, (self.shown[symbol], value)]
            self._name_position(letter, len(parts))
        for letter in self.equations.lengths:
            self._name_length(letter)
        for symbol, term in self.equations.scalars.items():
            self.shown[symbol] = self.printed_terms.of(term)

    def _name_position(self, letter: str, size: int) -> None:
        whole = quantity(letter)
        if any(whole in value.free_symbols for _, value in self.equations.results):
            self.shown[whole] = self._symbol(whole)
            entries = components(letter, SPACE[:size])
            self.positions[self.shown[whole]] = tuple(self.shown[entry] for entry in entries)

    def _name_length(self, letter: str) -> None:
        vector = self._vector(letter)
        if ZERO in vector:
            self.shown[length_of(letter)] = sp.Add(*vector)
            return
        symbol = self._symbol(quantity(letter))
        self.vectors.append((symbol, sp.sqrt(dot(*[vector] * 2))))
        self.shown |= {length_of(letter): symbol, sp.Abs(length_of(letter)): symbol}

    def _vector(self, letter: str) -> tuple[sp.Expr, sp.Expr]:
        x, y = (self.shown[symbol] for symbol in components(letter))
        return x, y

    def _name_unknowns(self) -> None:
        terms = self.printed_terms
        for symbol, value in self.equations.unknowns.items():
            _, axis = letter_and_axis(symbol)
            joint = None if axis else self.values.get(value)
            self.shown[symbol] = joint or self._symbol(symbol)
            sign, term = value.as_coeff_Mul()
            if term in terms.terms.definitions and term not in terms.known:
                terms.call(term, sign * self.shown[symbol])
        for angle in self.step.solved:
            if angle in self.found:
                terms.call(angle, self.values.get(angle) or self.letters.next("angle"))
            self.shown[angle] = terms.known[angle]

    def _add_result(self, symbol: sp.Symbol, value: sp.Expr) -> None:
        shown = self._put(value)
        if symbol in self.equations.unknowns:
            self.results.append((self.shown[symbol], shown))
        elif _is_letter(shown) or shown.is_Rational:
            self.shown[symbol] = shown
        else:
            self.shown[symbol] = self._symbol(symbol)
            self.results.append((self.shown[symbol], shown))

    def _points(self) -> dict[sp.Symbol, Vector]:
        found: dict[sp.Symbol, Vector] = {}
        for symbol in self.equations.unknowns:
            letter, axis = letter_and_axis(symbol)
            if axis:
                whole = self._symbol(quantity(letter))
                found[whole] = (*found.get(whole, ()), self.shown[symbol])
        return found

    # --- equations ---

    def _put(self, value: sp.Expr) -> sp.Expr:
        if value.is_Mul and value.args[0].is_Rational and value.args[-1].is_Add:
            # SymPy would multiply the rational factor into the sum, so the product is not
            # evaluated.
            return sp.Mul(value.args[0], self._put(value.args[-1]), evaluate=False)
        return value.xreplace(self.shown)

    def _sides(self, sought: Iterable[sp.Symbol]) -> tuple[Sum, Sum]:
        unknown, given = [], []
        for angle, (re, im) in self.step.relation.terms.items():
            free = angle.free_symbols | re.free_symbols | im.free_symbols
            x, y = self.printed_terms.exact(re), self.printed_terms.exact(im)
            if free.isdisjoint(sought):
                given.append((self.printed_terms.sum(angle), (-x, -y)))
            else:
                unknown.append((self.printed_terms.sum(angle), (x, y)))
        return tuple(unknown), tuple(given)

    def _angle(self, equation: AngleEquation) -> PrintedAngle:
        x, y = equation.there
        A, C = self._vector(equation.here), (self._put(x), self._put(y))
        a = sp.Add(*A)
        scale = ONE if ZERO not in A else sp.Abs(a) if a.is_Rational else a**2
        return PrintedAngle(self.shown[equation.angle], dot(A, C) / scale, cross(A, C) / scale)

    def _is_new(self, rate: RateEquation) -> bool:
        return all(s in self.found or s not in self.step.solved for s, _ in rate.left)

    def _rate(self, rate: RateEquation) -> PrintedRate:
        left, right = (
            tuple((self._put(part), self._put(weight)) for part, weight in side)
            for side in (rate.left, rate.right)
        )
        projected = tuple(self.printed_terms.tex(self._put(vector)) for vector in rate.projected)
        return PrintedRate(left, right, projected)

    def _in_words(self, words: str) -> str:
        letters = {field for _, field, _, _ in Formatter().parse(words) if field}
        names = {letter: self._symbol(quantity(letter)) for letter in letters}
        return words.format(**{k: self.printed_terms.tex(s) for k, s in names.items()})


def _is_letter(part: sp.Expr) -> bool:
    return bool(part.is_Symbol or (-part).is_Symbol)
