"""The steps of an inverse in printed symbols: what each solves, in what earlier ones gave.

A step's coefficients are named A, B, C with the step's number. As elsewhere products are written
out, and a sum that occurs more often, or is too long for a bracket, is a shared term. The cosine
and sine of an angle that was found are c and s with its index, those of two parallel joints that
turn what comes after them one after the other are put together to c_{23}.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import sympy as sp

from ...inverse.steps.work import InverseStep, NamedVector
from ...inverse.structure.lines import Axis, Lines
from ...inverse.subproblems.found import Direction, FoundLength, FoundTurn, Linear, Simultaneous
from ...inverse.subproblems.turns import CosSin
from ...inverse.tasks.slots import POSE_SYMBOLS
from ...inverse.tasks.task import InputLetter, Solved
from ...model.robot import Robot
from ...terms.symbolic_function import Argument
from ..setting import names
from ..setting.notation import ENTRY, LENGTH, OTHER, Notation
from ..setting.printed_terms import PrintedTerms
from ..setting.sharing import BRACKET, DEEPEST, Definition, depth, numbered
from ..setting.widths import LINE, width

COEFFICIENTS = {
    "A": ("A", r"\mathcal{A}", r"\mathrm{A}"),
    "B": ("B", r"\mathcal{B}", r"\mathrm{B}"),
    "C": ("C", r"\mathcal{C}", r"\mathrm{C}"),
    "sigma": (r"\sigma", r"\varsigma", r"\epsilon"),
    "sum": (r"\theta", r"\chi", r"\vartheta"),
    "side": (r"\varepsilon", r"\eta", r"\iota"),
    "slide": (r"\xi", r"\zeta", r"\Xi"),
}
"""Letters in order of preference."""
TINY = 1e-100
"""Numbers below it keep a quotient of zeros from being none; a reader does without them."""
SHORT = 30.0
"""Width of a sum that is written out wherever it occurs, and of an unnamed coefficient (pt)."""
DIRECT = 0.6 * LINE
"""Width of two coefficients that stand in their atan2 (pt)."""


@dataclass(frozen=True)
class PrintedInverseStep:
    """One step of an inverse in printed symbols.

    Attributes:
        step: The step itself.
        number: Its number in the article.
        definitions: Shared terms and coefficients, each in those before it.
        unknown: What the step finds: a coordinate or a sum of coordinates.
        name: The coordinate, or a name for the sum.
        sense: -1 where the unknown counts against what turns about the step's axis.
        coefficients: A, B and C of its equation, by name or as they are.
        solution: What add up to the unknown, in the coefficients; nothing where the equation is
            one for several unknowns, which a quartic solves.
    """

    step: InverseStep
    number: int
    definitions: tuple[Definition, ...]
    unknown: sp.Expr
    name: sp.Symbol
    sense: int
    coefficients: tuple[sp.Expr, ...]
    solution: tuple[sp.Expr, ...]


@dataclass(frozen=True)
class PrintedVector:
    """A vector that steps speak of.

    Attributes:
        called: The vector itself.
        letter: LaTeX of its letter.
        shown: Its components, by name where these are sums; none where it rests on steps.
    """

    called: NamedVector
    letter: str
    shown: tuple[sp.Expr, ...] = ()


@dataclass(frozen=True)
class PrintedTask:
    """A task in printed symbols.

    Attributes:
        solved: The task.
        inputs: The symbols of each input.
        signs: The symbols of the signs.
        vectors: What the steps speak of by name.
        definitions: The components of what rests on no step.
        steps: The steps.
        rest: Coordinates that follow from a sum, and what they are.
        free: Coordinates that the task leaves at 0.
        symbols: The printed symbol of each input's symbol and sign of the derivation.
    """

    solved: Solved
    inputs: tuple[tuple[Argument, tuple[sp.Symbol, ...]], ...]
    signs: tuple[sp.Symbol, ...]
    vectors: tuple[PrintedVector, ...]
    definitions: tuple[Definition, ...]
    steps: tuple[PrintedInverseStep, ...]
    rest: tuple[Definition, ...]
    free: tuple[sp.Symbol, ...]
    symbols: Mapping[sp.Symbol, sp.Symbol]


def printed_task(
    robot: Robot,
    notation: Notation,
    lines: Lines,
    solved: Solved,
    first: int,
    actuators: Mapping[str, sp.Symbol],
) -> PrintedTask:
    """The steps of a task; shared terms go on counting.

    Args:
        robot: The chain.
        notation: Its short symbols; receives those that are new.
        lines: Its axes.
        solved: The task.
        first: Number of the first step.
        actuators: Printed symbols of actuated coordinates that steps may find, by name.
    """
    return _Writer(robot, notation, lines, solved, actuators).printed(first)


class _Writer:
    """One task on its way into print."""

    def __init__(
        self,
        robot: Robot,
        notation: Notation,
        lines: Lines,
        solved: Solved,
        actuators: Mapping[str, sp.Symbol],
    ) -> None:
        self.robot, self.notation, self.solved = robot, notation, solved
        self.terms, self.work, self.actuators = solved.work.terms, solved.work, actuators
        self.axes = lines.axes
        self.slid: set[int] = set()
        self.taken = _taken(robot, notation)
        self.letters = {kind: self._letter(options) for kind, options in COEFFICIENTS.items()}
        self.printed_terms = PrintedTerms(self.terms, notation, {})
        self.printer = self.printed_terms.printer
        self.inputs = self._named_inputs()
        self.signs = tuple(
            notation.symbol(f"{self.letters['sigma']}_{{{k}}}", (LENGTH, (-2, k)))
            for k in range(1, len(self.work.signs) + 1)
        )
        self.symbols = self.inputs | dict(zip(self.work.signs, self.signs, strict=True))
        self.known: dict[sp.Symbol, sp.Expr] = dict(self.symbols)
        self.inlined: dict[sp.Symbol, sp.Expr] = {}
        self.definitions: list[Definition] = []
        self.changed: dict[sp.Symbol, sp.Expr] = {}
        self.preferred: dict[sp.Symbol, sp.Expr] = {}
        self.uses: Counter[sp.Symbol] = Counter()
        self._seed_turns()

    def printed(self, first: int) -> PrintedTask:
        """The task."""
        wanted = [self._entries(step) for step in self.work.steps]
        everything = [entry for entries in wanted for entry in entries]
        self._merge(everything)
        vectors = tuple(self._vector(called) for called in self.work.vectors)
        of_vectors = tuple(self._taken())
        self.uses = self._counted(everything)
        steps = tuple(
            self._step(step, entries, number)
            for number, (step, entries) in enumerate(
                zip(self.work.steps, wanted, strict=True), first
            )
        )
        rest = tuple(_rest(steps, self.notation.q))
        coordinates = zip(self.robot.moving, self.notation.q, strict=True)
        done = {step.name for step in steps} | {q for q, _ in rest}
        free = tuple(
            q
            for joint, q in coordinates
            if q not in done and joint.name not in self.solved.given and not self.actuators
        )
        arguments = tuple(
            (argument, tuple(self.inputs[s] for s in argument.symbols if s in self.inputs))
            for argument in self.solved.function.inputs
        )
        return PrintedTask(
            self.solved,
            arguments,
            self.signs,
            vectors,
            of_vectors,
            steps,
            rest,
            free,
            self.symbols,
        )

    # --- names ---

    def _named_inputs(self) -> dict[sp.Symbol, sp.Symbol]:
        """The printed symbol of each input's symbol; coordinates are their own."""
        entries = self.notation.entries()
        named = {
            symbol: entry
            for symbol, entry in zip(POSE_SYMBOLS, entries, strict=True)
            if entry is not None
        }
        for task_input in self.solved.inputs:
            for symbol, shown in zip(task_input.argument.symbols, task_input.printed, strict=True):
                letter = isinstance(shown, InputLetter)
                named[symbol] = self._lettered(symbol, shown) if letter else named[shown]
        asked = {s for argument in self.solved.function.inputs for s in argument.symbols}
        known = {symbol: shown for symbol, shown in named.items() if symbol in asked}
        return known | {q: q for q in self.notation.q if q in asked}

    def _lettered(self, symbol: sp.Symbol, letter: InputLetter) -> sp.Symbol:
        """The printed symbol of an input that no entry of the pose is."""
        tex = self._letter(letter.letters)
        if letter.component is None:
            return self.notation.symbol(tex, (OTHER, (symbol.name,)))
        tex = f"{tex}_{{{'xyz'[letter.component]}}}"
        return self.notation.symbol(tex, (ENTRY, (letter.letters[0], letter.component)))

    def _letter(self, options: Sequence[str]) -> str:
        return _free(options, self.taken)

    def _seed_turns(self) -> None:
        """Cosine and sine of every angle that a step finds, or that follows from a sum."""
        for step in self.work.steps:
            if isinstance(step.found, FoundTurn):
                self._seed(step.found.turn, self._angle(step.joints))
        for joint, turn in self.work.turns.items():
            self._seed(turn, self._value_of(joint))

    def _seed(self, turn: CosSin, angle: sp.Expr) -> None:
        for function, value in ((sp.cos, turn.c), (sp.sin, turn.s)):
            sign, term = value.as_coeff_Mul()
            if term in self.terms.definitions and term not in self.known:
                self.known[term] = sign * self._trigonometric(function, angle)

    def _trigonometric(self, function: type[sp.Function], angle: sp.Expr) -> sp.Expr:
        negative = angle.could_extract_minus_sign()
        angle = -angle if negative else angle
        known = angle.free_symbols <= {*self.notation.q}
        shown = self.notation.trigonometric(function(angle)) if known else function(angle)
        return -shown if negative and function is sp.sin else shown

    def _value_of(self, joint: int) -> sp.Expr:
        """The value of a joint of the chain, or of a slide that stands for several."""
        slides = [axis.joint for axis in self.axes if not axis.turns]
        if not self.actuators and joint == len(self.robot.moving):
            # The joint that would turn the tool about its own axis.
            return self.notation.symbol(f"q_{{{joint + 1}}}", (LENGTH, (92, joint)))
        if not self.actuators or joint not in slides:
            return self.robot.moving[joint].direction * self.notation.q[joint]
        number = 1 + slides.index(joint)
        tex = f"{self.letters['slide']}_{{{number}}}"
        return self.notation.symbol(tex, (LENGTH, (93, number)))

    def _angle(self, joints: Sequence[str]) -> sp.Expr:
        """The sum that joints turn by about the first of them, in coordinates."""
        if joints[0] in self.actuators:
            return self.actuators[joints[0]]
        axes = [self._axis(name) for name in joints]
        total = sp.Integer(0)
        for axis in axes:
            sense = 1 if float(axes[0].direction @ axis.direction) > 0 else -1
            total += sense * self._value_of(axis.joint)
        return total

    def _axis(self, name: str) -> Axis:
        """The axis of that name, the next one where several slides share it."""
        named = [axis for axis in self.axes if axis.name == name]
        return next((a for a in named if a.joint not in self.slid), named[0])

    def _vector(self, called: NamedVector) -> PrintedVector:
        """Gives the components of a vector that are sums or quotients the vector's letter."""
        letter = self._letter(called.letters)
        shown = []
        for axis, component in zip("xyz", called.vector, strict=True):
            sign, term = component.as_coeff_Mul()
            if term in self.terms.definitions and term not in self.known:
                name = self.notation.symbol(f"{letter}_{{{axis}}}", (LENGTH, (-1, letter, axis)))
                self.preferred.setdefault(term, sign * name)
            if not called.after:
                self._settle_below(component)
                shown.append(self._value(component))
        return PrintedVector(called, letter, tuple(shown))

    # --- sums of parallel joints ---

    def _merge(self, entries: Sequence[sp.Expr]) -> None:
        """Definitions in the sum of two parallel angles where they hold these only together."""
        pairs = list(self._pairs())
        for term in self.terms.needed(entries):
            if term in self.known:
                continue
            for one, other, total in pairs:
                merged = self._merged(term, one, other, total)
                if merged is not None:
                    self.changed[term] = merged

    def _pairs(self) -> Iterable[tuple[CosSin, CosSin, CosSin]]:
        """Turns of neighbouring parallel axes with symbols for the turn by their sum."""
        axes = [axis for axis in self.axes if axis.joint in self.work.turns]
        for a, b in pairwise(axes):
            turns = self.work.turns[a.joint], self.work.turns[b.joint]
            product = float(a.direction @ b.direction)
            if abs(product) < _PARALLEL or not all(_is_pair(turn) for turn in turns):
                continue
            angle = self._angle((a.name, b.name))
            c, s = sp.symbols(f"_c{a.joint}_{b.joint} _s{a.joint}_{b.joint}", real=True)
            # Called c_{23} and s_{23} once they are used.
            self.known[c], self.known[s] = sp.cos(angle), sp.sin(angle)
            yield turns[0], turns[1].counted(1 if product > 0 else -1), CosSin(c, s)

    def _merged(self, term: sp.Symbol, one: CosSin, other: CosSin, total: CosSin) -> sp.Expr | None:
        """A term that is a turn by one angle of what was turned by the other."""
        definition = self.terms.definitions[term]
        if not definition.is_Add or _symbols(other).isdisjoint(definition.free_symbols):
            return None
        inner = {
            symbol: self.terms.definitions[symbol]
            for symbol in definition.free_symbols
            if symbol in self.terms.definitions and symbol not in self.known
        }
        generators = [*_factors(one), *_factors(other)]
        polynomial = sp.expand(definition.xreplace(inner)).as_poly(*(g for _, g in generators))
        if polynomial is None or not set(polynomial.monoms()) <= _BILINEAR.keys():
            return None
        found = dict.fromkeys(_BILINEAR.values(), sp.Integer(0))
        for powers, coefficient in polynomial.terms():
            signs = (sign for (sign, _), power in zip(generators, powers, strict=True) if power)
            found[_BILINEAR[powers]] = coefficient * sp.prod(signs)
        if sp.expand(found["cc"] + found["ss"]) == 0 == sp.expand(found["sc"] - found["cs"]):
            return found["cc"] * total.c + found["sc"] * total.s
        return None

    # --- what gets a name ---

    def _definition(self, term: sp.Symbol) -> sp.Expr:
        """What a term stands for, without numbers that are there for rounding alone."""
        definition = self.changed.get(term, self.terms.definitions[term])
        tiny = {x: sp.Integer(0) for x in definition.atoms(sp.Float) if abs(x) < TINY}
        return definition.xreplace(tiny)

    def _open(self, entries: Iterable[sp.Expr]) -> list[sp.Symbol]:
        """The terms without a name that entries rest on, in the order of their definition."""
        found: set[sp.Symbol] = set()
        waiting = [symbol for entry in entries for symbol in entry.free_symbols]
        while waiting:
            symbol = waiting.pop()
            if (
                symbol in self.terms.definitions
                and symbol not in self.known
                and symbol not in found
            ):
                found.add(symbol)
                if not _is_trigonometric(self._definition(symbol)):
                    waiting.extend(self._definition(symbol).free_symbols)
        return [symbol for symbol in self.terms.definitions if symbol in found]

    def _counted(self, entries: Sequence[sp.Expr]) -> Counter[sp.Symbol]:
        """How often each term is written once products are written out."""
        uses = Counter(symbol for entry in entries for symbol in entry.free_symbols)
        for term in reversed(self._open(entries)):
            definition = self._definition(term)
            if not _is_trigonometric(definition):
                times = 1 if _is_nameable(definition) else uses[term]
                for addend in sp.Add.make_args(definition):
                    uses.update(dict.fromkeys(addend.free_symbols, times))
        return uses

    def _settle_below(self, entry: sp.Expr) -> None:
        """Names, or keeps to be written out, the terms that an entry rests on."""
        _, own = entry.as_coeff_Mul()
        for term in self._open([entry]):
            if term not in self.inlined:
                self._settle(term, is_once=term == own or self.uses[term] <= 1)

    def _settle(self, term: sp.Symbol, *, is_once: bool) -> None:
        definition = self._definition(term)
        if _is_trigonometric(definition):
            self.known[term] = self._named_function(definition)
            return
        value = self._value(definition)
        if term in self.preferred:
            sign, name = self.preferred[term].as_coeff_Mul()
            self.known[term] = sign * name
            self.definitions.append((name, sign * value))
        elif isinstance(value, sp.Piecewise):
            self.known[term] = self.notation.symbol(self.letters["side"], (LENGTH, (-2, 0)))
            self.definitions.append((self.known[term], value))
        elif is_once or not _is_nameable(value) or self._is_short(value):
            self.inlined[term] = value
        else:
            self._name(term, value)

    def _named_function(self, function: sp.Expr) -> sp.Expr:
        (angle,) = function.args
        if angle.free_symbols & set(self.notation.q):
            return self._trigonometric(function.func, angle)
        return function.func(angle.xreplace(self.known))

    def _is_short(self, value: sp.Expr) -> bool:
        return value.is_Add and width(self.printer.tex(value)) < SHORT

    def _value(self, expression: sp.Expr) -> sp.Expr:
        """An expression of named terms in printed symbols."""
        for addend in sp.Add.make_args(expression):
            factors = sp.Mul.make_args(addend.as_coeff_Mul()[1])
            for factor in factors:
                base = factor.base if factor.is_Pow else factor
                value = self.inlined.get(base)
                if value is not None and (factor.is_Pow or len(factors) > 1):
                    self._fit_in_brackets(base, value)
        known = {}
        for symbol in sorted(expression.free_symbols, key=numbered):
            if symbol in self.known:
                known[symbol] = self._lasting(symbol)
            elif symbol in self.inlined:
                known[symbol] = self.inlined[symbol]
            elif symbol in self.terms.constants:
                known[symbol] = self.printed_terms.constant(symbol)
        return _tidy(expression.xreplace(known))

    def _lasting(self, symbol: sp.Symbol) -> sp.Expr:
        """The name of a term; cosine and sine of a sum get theirs when they are first used."""
        shown = self.known[symbol]
        if isinstance(shown, sp.cos | sp.sin) and shown.free_symbols & set(self.notation.q):
            shown = self.known[symbol] = self._trigonometric(shown.func, shown.args[0])
        return shown

    def _fit_in_brackets(self, term: sp.Symbol, value: sp.Expr) -> None:
        if value.is_Add and (depth(value) >= DEEPEST or width(self.printer.tex(value)) > BRACKET):
            self._name(term, value)

    def _name(self, term: sp.Symbol, value: sp.Expr) -> None:
        name = self.notation.term()
        sign = -1 if self.printer.tex(value).startswith("-") else 1
        self.definitions.append((name, sign * value))
        self.known[term] = sign * name
        self.inlined.pop(term, None)

    def _taken(self) -> list[Definition]:
        """What was defined since this was last asked."""
        taken, self.definitions = self.definitions, []
        return taken

    # --- steps ---

    def _entries(self, step: InverseStep) -> tuple[sp.Expr, ...]:
        """The coefficients of a step's equation in its unknown coordinates."""
        found = step.found
        flip = self._flip(step)
        if isinstance(found, FoundLength):
            *first, linear, constant = found.equation
            return (*first, flip * linear, constant)
        equation = found.equation
        if isinstance(equation, Simultaneous):
            return tuple(entry for _, entries in equation.given for entry in entries)
        if isinstance(equation, Linear):
            return equation.a, flip * equation.b, equation.d
        return equation.a, flip * equation.b

    def _flip(self, step: InverseStep) -> int:
        """-1 where the first coordinate of a step counts against its joint."""
        return -1 if self._angle(step.joints[:1]).could_extract_minus_sign() else 1

    def _step(
        self, step: InverseStep, entries: Sequence[sp.Expr], number: int
    ) -> PrintedInverseStep:
        unknown = self._flip(step) * self._angle(step.joints)
        name = unknown
        if not unknown.is_Symbol:
            tex = f"{self.letters['sum']}_{{{number}}}"
            name = self.notation.symbol(tex, (LENGTH, (94, number)))
        shown = [self._as_it_is(entry) for entry in entries]
        if isinstance(getattr(step.found, "equation", None), Simultaneous):
            definitions = tuple(self._taken())
            return PrintedInverseStep(
                step, number, definitions, unknown, name, self._flip(step), tuple(shown), ()
            )
        if not self._fits(step, shown):
            shown = [self._coefficient(e, "ABC"[k], number) for k, e in enumerate(entries)]
        solution = self._solution(step, shown, entries)
        if isinstance(step.found, FoundLength):
            sign, term = step.found.length.as_coeff_Mul()
            if term in self.terms.definitions and term not in self.known:
                self.known[term] = sign * self._flip(step) * unknown
            if step.joints[0] not in self.actuators:
                self.slid.add(self._axis(step.joints[0]).joint)
        definitions = tuple(self._taken())
        return PrintedInverseStep(
            step, number, definitions, unknown, name, self._flip(step), tuple(shown), solution
        )

    def _as_it_is(self, entry: sp.Expr) -> sp.Expr:
        self._settle_below(entry)
        return self._value(entry)

    def _fits(self, step: InverseStep, values: Sequence[sp.Expr]) -> bool:
        """Whether a step's solution can be written without names for its coefficients."""
        found = step.found
        if isinstance(found, FoundLength) and len(values) == 2:  # noqa: PLR2004
            return True
        wide = sum(width(self.printer.tex(value)) for value in values)
        return (
            isinstance(found, FoundTurn)
            and isinstance(found.equation, Direction)
            and (wide < DIRECT)
        )

    def _coefficient(self, entry: sp.Expr, letter: str, number: int) -> sp.Expr:
        """A coefficient by name where it is not short; a sum is called so from then on."""
        value = self._value(entry)
        if not value.is_Add and width(self.printer.tex(value)) < SHORT:
            return value
        tex = f"{self.letters[letter]}_{{{number}}}"
        name = self.notation.symbol(tex, (LENGTH, (95, number, letter)))
        sign, term = entry.as_coeff_Mul()
        if term in self.inlined and self.inlined[term].is_Add:
            del self.inlined[term]
            self.known[term] = sign * name
        self.definitions.append((name, value))
        return name

    def _solution(
        self, step: InverseStep, shown: Sequence[sp.Expr], entries: Sequence[sp.Expr]
    ) -> tuple[sp.Expr, ...]:
        found = step.found
        sign = sp.Integer(1) if found.sign is None else self.known[found.sign] * self._flip(step)
        if isinstance(found, FoundLength):
            if len(shown) == 2:  # noqa: PLR2004
                return tuple(sp.Add.make_args(-shown[1] / shown[0]))
            half = shown[1] / 2
            root = sign * sp.sqrt(half**2 - shown[2])
            return (-half, root) if half != 0 else (root,)
        first = sp.atan2(shown[1], shown[0], evaluate=False)
        if not isinstance(found.equation, Linear):
            return (first,)
        A, B, C = shown
        if C == 0:
            return first, sign * sp.pi / 2
        second = sign * sp.atan2(sp.sqrt(A**2 + B**2 - C**2), C, evaluate=False)
        if B == 0 and self._is_positive(entries[0]):
            return (second,)
        return first, second

    def _is_positive(self, expression: sp.Expr) -> bool:
        return self.terms.is_constant(expression) and bool(self.terms.value(expression) > 0)


def _rest(steps: Iterable[PrintedInverseStep], q: Sequence[sp.Symbol]) -> Iterable[Definition]:
    """Coordinates that follow from a sum and the others."""
    found = {step.name for step in steps}
    for step in steps:
        missing = [one for one in q if step.unknown.has(one) and one not in found]
        if not step.unknown.is_Symbol and len(missing) == 1:
            factor = step.unknown.coeff(missing[0])
            yield missing[0], sp.expand(factor * (step.name - step.unknown)) + missing[0]


_PARALLEL = 1 - 1e-9
_BILINEAR = {(1, 0, 1, 0): "cc", (0, 1, 0, 1): "ss", (0, 1, 1, 0): "sc", (1, 0, 0, 1): "cs"}
"""Powers of cosine and sine of one angle and of the other."""


def _factors(turn: CosSin) -> list[tuple[sp.Expr, sp.Expr]]:
    """Sign and symbol of cosine and sine."""
    return [value.as_coeff_Mul() for value in (turn.c, turn.s)]


def _symbols(turn: CosSin) -> set[sp.Expr]:
    return {symbol for _, symbol in _factors(turn)}


def _is_pair(turn: CosSin) -> bool:
    return all(symbol.is_Symbol for symbol in _symbols(turn))


def _is_trigonometric(expression: sp.Expr) -> bool:
    return isinstance(expression, sp.cos | sp.sin)


def _tidy(expression: sp.Expr) -> sp.Expr:
    """The minus signs of a sum in brackets that has no others before them."""
    if expression.is_Add:
        return expression.func(*map(_tidy, expression.args))
    if not expression.is_Mul:
        return expression
    negative = [
        factor
        for factor in expression.args
        if factor.is_Add and all(term.as_coeff_Mul()[0].is_negative for term in factor.args)
    ]
    sign = sp.Integer(-1) ** len(negative)
    return sign * sp.Mul(*(-factor if factor in negative else factor for factor in expression.args))


def _is_nameable(expression: sp.Expr) -> bool:
    """A sum, or the root of one."""
    root = expression.is_Pow and expression.exp == sp.Rational(1, 2)
    return bool(expression.is_Add or root)


def _taken(robot: Robot, notation: Notation) -> set[str]:
    """The letters of parameters, coordinates and short symbols."""
    parameters = names.distinct(parameter.name for parameter in robot.parameters)
    taken = set(map(names.head, (*parameters.values(), *notation.called)))
    return taken | {*notation.letters.values()}


def _free(options: Sequence[str], taken: Collection[str]) -> str:
    """The first letter that is not taken, or else the last."""
    return next((letter for letter in options if letter not in taken), options[-1])
