"""The steps of a closed-form solution in printed symbols: what is named, and what it means.

With J the quarter turn, e the direction of a line and components in the plane of the loop:

    two circles      C = D (p + i h) / D^2,  p = (D^2 + A^2 - B^2) / 2,  h = +-sqrt(D^2 A^2 - p^2)
                     A e^(i phi) = C,  B e^(i psi) = E = C - D
    circle and line  C = e (+-sqrt(A^2 - n^2) + i n),  n = e x D,  t = e . (C - D),  A e^(i phi) = C
    two lines        t = D x B / A x B,  u = A x D / A x B,  t A + u B = D
    two pins         A e^(i phi) = C |A| / |C|
    distance         t = |D|
    circle, sphere   two circles in the plane of the joint, B what the rod spans in it
    line, sphere     t = D_z +- sqrt(l^2 - D_x^2 - D_y^2), z along the joint
    three spheres    P = C1 + n +- w sqrt((l1^2 - n^2) / w^2),
                     see :mod:`chasles.derive.loops.spatial.legs`

These are the results of :mod:`chasles.derive.loops.planar.dyads`, in the forms that a reader knows.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial

import sympy as sp

from ...loops.planar.assembly import Step
from ...loops.planar.phasors import ONE, ZERO, cross, dot
from ...loops.solution import Solution
from ..setting.layout import Equation
from ..setting.printed_terms import Definition, PrintedTerms
from .members import Letters, dotted

Vector = tuple[sp.Expr, ...]
Weights = tuple[tuple[sp.Expr, sp.Expr], ...]
HALF = sp.Rational(1, 2)
NAMES = {
    "two circles": {"D": "D", "v": "A", "w": "B"},
    "circle and line": {"offset": "D", "direction": "B", "r": "A"},
    "two lines": {"offset": "D", "e": "A", "f": "B"},
    "two pins": {"there": "C", "here": "A"},
    "distance": {"d": "D"},
    "circle and sphere": {"D": "D", "v": "A", "w": "B"},
    "line and sphere": {"offset": "D", "l^2": ""},
    "three spheres": {"c1": "A", "c2": "B", "c3": "C", "l^2": "", "p": "P"},
}
"""What a step's vectors are called in print."""


@dataclass(frozen=True)
class Angle:
    """An angle that a step gives: its cosine and sine, up to a common positive factor."""

    symbol: sp.Symbol
    cosine: sp.Expr
    sine: sp.Expr


@dataclass(frozen=True)
class Rate:
    """How fast an unknown of a step moves: ``factor * rate(symbol)`` by the vectors' rates.

    Attributes:
        symbol: The angle or travel.
        factor: 0 at a dead point.
        by: Expressions with the weights of their rates in the sum.
        left: LaTeX of the left side where it is no product of factor and rate.
    """

    symbol: sp.Symbol
    factor: sp.Expr
    by: tuple[tuple[sp.Expr, sp.Expr], ...]
    left: str = ""


@dataclass(frozen=True)
class PrintedStep:
    """One step of a solution in printed symbols.

    Attributes:
        step: The step itself.
        number: Its number in the article.
        unknown: The side of the loop's equation that turns by what is sought: angle and vector.
        given: The other side.
        vectors: Components and lengths of what is given.
        results: Intermediate results and travels, each in those before it.
        formulas: Equations between vectors that take the place of results.
        angles: The angles that follow.
        margin: The step's margin, None where it always closes.
        rates: How the unknowns move.
    """

    step: Step
    number: int
    unknown: tuple[tuple[sp.Expr, Vector], ...] = ()
    given: tuple[tuple[sp.Expr, Vector], ...] = ()
    vectors: tuple[Definition, ...] = ()
    results: tuple[Definition, ...] = ()
    formulas: tuple[Equation, ...] = ()
    angles: tuple[Angle, ...] = ()
    margin: sp.Expr | None = None
    rates: tuple[Rate, ...] = ()


def printed_steps(
    terms: PrintedTerms,
    letters: Letters,
    solution: Solution,
    first: int,
    joints: Mapping[str, sp.Symbol],
) -> tuple[PrintedStep, ...]:
    """The steps of a solution; what they name keeps its name from then on.

    Args:
        terms: The robot's terms in printed symbols; receives the names.
        letters: Free letters for them.
        solution: Forward or backward.
        first: Number of the first step.
        joints: Symbols of the joints, by which unknowns are called that are a joint's value.
    """
    values = {solution.values[name]: s for name, s in joints.items() if name in solution.values}
    return tuple(
        _Writer(terms, letters, step, number, values).printed()
        for number, step in enumerate(solution.steps, first)
    )


class _Writer:
    """One step on its way into print."""

    def __init__(
        self,
        terms: PrintedTerms,
        letters: Letters,
        step: Step,
        number: int,
        values: Mapping[sp.Expr, sp.Symbol],
    ) -> None:
        self.printed_terms, self.letters, self.step, self.number = terms, letters, step, number
        self.values = values
        self.vectors: list[Definition] = []
        self.results: list[Definition] = []
        self.formulas: list[Equation] = []
        self.angles: list[Angle] = []
        self.rates: list[Rate] = []
        self.margin: sp.Expr | None = None
        self.unknown = [s for s in step.solved if s not in self.printed_terms.known]

    def printed(self) -> PrintedStep:
        """The step; afterwards its unknowns have names."""
        named = NAMES.get(self.step.kind, {})
        found = {
            named[name]: self._vector(named[name], vector)
            for name, vector in self.step.vectors.items()
            if name not in ("l^2", "p")
        }
        sought = {*self.unknown, *(t.as_coeff_Mul()[1] for t in self.step.travels)}
        travels = self._named_travels()
        for symbol in self.unknown:
            self.printed_terms.known[symbol] = self.values.get(symbol) or self.letters.next("angle")
        if found:
            self._solve(found, travels)
        unknown, given = self._sides(sought)
        return PrintedStep(
            self.step,
            self.number,
            unknown,
            given,
            tuple(self.vectors),
            tuple(self.results),
            tuple(self.formulas),
            tuple(self.angles),
            self.margin,
            tuple(self.rates),
        )

    def _sides(
        self, sought: Iterable[sp.Symbol]
    ) -> tuple[tuple[tuple[sp.Expr, Vector], ...], tuple[tuple[sp.Expr, Vector], ...]]:
        """The loop's equation, what is sought on one side."""
        unknown, given = [], []
        for angle, (re, im) in self.step.relation.terms.items():
            free = angle.free_symbols | re.free_symbols | im.free_symbols
            x, y = self.printed_terms.exact(re), self.printed_terms.exact(im)
            if free.isdisjoint(sought):
                given.append((self.printed_terms.sum(angle), (-x, -y)))
            else:
                unknown.append((self.printed_terms.sum(angle), (x, y)))
        return tuple(unknown), tuple(given)

    # --- names ---

    def _vector(self, kind: str, vector: Vector) -> Vector:
        """Components by name, except for letters and for numbers that stand alone."""
        parts = [self.printed_terms.of(part) for part in vector]
        found = []
        for axis, part in zip("xyz"[: len(parts)], parts, strict=True):
            alone = sum(other != 0 for other in parts) == 1
            if part == 0 or _is_letter(part) or (part.is_Rational and alone):
                found.append(part)
            else:
                found.append(self.letters.of_step(kind, self.number, axis))
                shown, new = self.printed_terms.shortened(part, partial(self.letters.next, "delta"))
                self.vectors += [*new, (found[-1], shown)]
        return tuple(found)

    def _length(self, kind: str, vector: Vector) -> sp.Expr:
        """The length of a vector by name; a component alone stands for it, whatever its sign."""
        if ZERO in vector:
            return vector[0] + vector[1]
        symbol = self.letters.of_step(kind, self.number)
        self.vectors.append((symbol, sp.sqrt(dot(vector, vector))))
        return symbol

    def _named_travels(self) -> list[sp.Symbol]:
        found = []
        for kind, travel in zip("tu", self.step.travels, strict=False):
            sign, term = travel.as_coeff_Mul()
            found.append(self.values.get(travel) or self.letters.of_step(kind, self.number))
            if (
                term in self.printed_terms.terms.definitions
                and term not in self.printed_terms.known
            ):
                self.printed_terms.known[term] = sign * found[-1]
        return found

    def _result(self, kind: str, value: sp.Expr, axis: str = "") -> sp.Expr:
        """An intermediate result by name, except for letters and numbers."""
        if _is_letter(value) or value.is_Rational:
            return value
        symbol = self.letters.of_step(kind, self.number, axis)
        self.results.append((symbol, value))
        return symbol

    def _pair(self, kind: str, x: sp.Expr, y: sp.Expr) -> Vector:
        return self._result(kind, x, "x"), self._result(kind, y, "y")

    # --- solutions ---

    def _solve(self, parts: dict[str, Vector], travels: list[sp.Symbol]) -> None:
        solvers: Mapping[str, Callable[..., None]] = {
            "two circles": self._two_circles,
            "circle and line": self._circle_and_line,
            "two lines": self._two_lines,
            "two pins": self._two_pins,
            "distance": self._distance,
            "circle and sphere": self._circle_and_sphere,
            "line and sphere": self._line_and_sphere,
            "three spheres": self._three_spheres,
        }
        solvers[self.step.kind](travels, **parts)

    def _distance(self, travels: list[sp.Symbol], D: Vector) -> None:
        (t,) = travels
        self.results.append((t, sp.sqrt(_square(D))))
        self.rates.append(Rate(t, t, _weights(D, D)))

    def _circle_and_sphere(self, travels: list[sp.Symbol], **parts: Vector) -> None:
        """Two circles in the joint's plane; the margin is that of the whole rod."""
        self._two_circles(travels, **parts)
        (square,) = map(self.printed_terms.of, self.step.vectors["l^2"])
        assert self.margin is not None
        b = self._length("B", parts["B"])
        self.margin = self.margin * b**2 / square

    def _line_and_sphere(self, travels: list[sp.Symbol], D: Vector) -> None:
        (t,), (square,) = travels, map(self.printed_terms.of, self.step.vectors["l^2"])
        inside = square - D[0] ** 2 - D[1] ** 2
        self.results.append((t, D[2] + self.step.sign * sp.sqrt(inside)))
        self.margin = inside / square
        weights = (-D[0], -D[1], t - D[2])
        self.rates.append(Rate(t, t - D[2], (*_weights(D, weights), (square, HALF))))

    def _three_spheres(
        self,
        _: list[sp.Symbol],
        A: Vector,
        B: Vector,
        C: Vector,
    ) -> None:
        """Vectors are too long to be multiplied out in print."""
        k = self.number
        a, b, c, P = (self.letters.of_step(kind, k) for kind in "ABCP")
        a, b, c, P = (self.printed_terms.tex(symbol) for symbol in (a, b, c, P))
        l1, l2, l3 = (
            self.printed_terms.tex(self.printed_terms.of(part)) for part in self.step.vectors["l^2"]
        )
        sign = "+" if self.step.sign > 0 else "-"
        self.formulas += [
            ("u", [f"{b} - {a}"]),
            ("v", [f"{c} - {a}"]),
            ("w", [r"u \times v"]),
            (r"\alpha", [_half("u^2", l1, l2)]),
            (r"\beta", [_half("v^2", l1, l3)]),
            ("n", [r"\bigl(\alpha\,(v \times w) + \beta\,(w \times u)\bigr) / w^2"]),
            (rf"\mu_{{{k}}}", [f"1 - n^2 / {l1}"]),
            (P, [f"{a} + n {sign} w", rf"\sqrt{{({l1} - n^2) / w^2}}"]),
        ]
        found = []
        for axis, part in zip("xyz", self.step.vectors["p"], strict=True):
            sign_of, term = part.as_coeff_Mul()
            found.append(self.letters.of_step("P", k, axis))
            self.printed_terms.known[term] = sign_of * found[-1]
        centres = zip((a, b, c), (A, B, C), found, strict=True)
        for name, centre, symbol in centres:
            spread = tuple(p - x for p, x in zip(found, centre, strict=True))
            left = rf"({P} - {name}) \cdot {dotted(P)}"
            self.rates.append(Rate(symbol, sp.S.One, _weights(centre, spread), left))

    def _two_circles(
        self,
        _: list[sp.Symbol],
        D: Vector,
        A: Vector,
        B: Vector,
    ) -> None:
        d, a, b = (self._length(k, v) for k, v in (("D", D), ("A", A), ("B", B)))
        p = self._result("p", sp.Mul(HALF, d**2 + a**2 - b**2, evaluate=False))
        h = self._result("h", self.step.sign * sp.sqrt(d**2 * a**2 - p**2))
        C = self._pair("C", (D[0] * p - D[1] * h) / d**2, (D[1] * p + D[0] * h) / d**2)
        E = self._pair("E", C[0] - D[0], C[1] - D[1])
        self.margin = h**2 / (a**2 * b**2)
        first = self.step.solved[0]
        turn_A = self._turn(first, A, a, C)
        by = (*_weights(D, E), *_weights(A, _turned_back(E, turn_A), -1), *_weights(B, B))
        self._rate(first, h, by)
        if len(self.step.solved) == 1:
            return
        second = self.step.solved[1]
        turn_B = self._turn(second, B, b, E)
        by = (*_weights(D, C), *_weights(A, A, -1), *_weights(B, _turned_back(C, turn_B)))
        self._rate(second, h, by)

    def _circle_and_line(
        self,
        travels: list[sp.Symbol],
        D: Vector,
        A: Vector,
        B: Vector,
    ) -> None:
        a = self._length("A", A)
        n = self._result("n", sp.expand(cross(B, D)))
        m = self._result("m", sp.expand(dot(B, D)))
        root = _absolute(A, a) if n == 0 else sp.sqrt(a**2 - n**2)
        (t,) = travels
        self.results.append((t, self.step.sign * root - m))
        C = self._pair("C", B[0] * (t + m) - B[1] * n, B[1] * (t + m) + B[0] * n)
        if self.step.margin is not None:
            self.margin = (a**2 - n**2) / a**2
        (angle,) = self.step.solved
        self._turn(angle, A, a, C)
        self.rates.append(Rate(t, t + m, (*_weights(A, A), *_weights(D, C, -1))))
        across = -C[1], C[0]
        by = (*_weights(D, across), (t, dot(across, B)), *_weights(A, (-A[1], A[0]), -1))
        self._rate(angle, a**2, by)

    def _two_lines(
        self,
        travels: list[sp.Symbol],
        D: Vector,
        A: Vector,
        B: Vector,
    ) -> None:
        n = self._result("n", sp.expand(cross(A, B)))
        t, u = travels
        self.results += [(t, sp.expand(cross(D, B)) / n), (u, sp.expand(cross(A, D)) / n)]
        for symbol, other, sign in ((t, B, 1), (u, A, -1)):
            normal = sign * other[1], -sign * other[0]
            by = (
                *_weights(D, normal),
                *_weights(A, _scaled(normal, -t)),
                *_weights(B, _scaled(normal, -u)),
            )
            self.rates.append(Rate(symbol, n, by))

    def _two_pins(self, _: list[sp.Symbol], C: Vector, A: Vector) -> None:
        c, a = self._length("C", C), self._length("A", A)
        (angle,) = self.step.solved
        if angle not in self.unknown:
            return
        symbol = self.printed_terms.known[angle]
        self.angles.append(Angle(symbol, dot(A, C), cross(A, C)))
        across_C, across_A = (-C[1], C[0]), (-A[1], A[0])
        by = (*_weights(C, across_C), *_weights(A, _scaled(across_A, -(c**2) / a**2)))
        self._rate(angle, c**2, by)

    def _turn(self, angle: sp.Symbol, A: Vector, a: sp.Expr, C: Vector) -> Vector:
        """The angle that turns A to C."""
        symbol = self.printed_terms.known[angle]
        if angle in self.unknown:
            scale = ONE if ZERO not in A else sp.Abs(a) if a.is_Rational else a**2
            self.angles.append(Angle(symbol, dot(A, C) / scale, cross(A, C) / scale))
        return sp.cos(symbol), sp.sin(symbol)

    def _rate(self, angle: sp.Symbol, factor: sp.Expr, by: Weights) -> None:
        if angle in self.unknown:
            self.rates.append(Rate(self.printed_terms.known[angle], factor, by))


def _half(square: str, one: str, other: str) -> str:
    if one == other:
        return rf"\tfrac{{1}}{{2}} {square}"
    return rf"\tfrac{{1}}{{2}} ({square} + {one} - {other})"


def _square(vector: Vector) -> sp.Expr:
    return sp.Add(*(part**2 for part in vector))


def _weights(vector: Vector, weights: Vector, sign: int = 1) -> Weights:
    """The components whose rates enter a sum with weights."""
    return tuple((part, sign * w) for part, w in zip(vector, weights, strict=True))


def _turned_back(vector: Vector, turn: Vector) -> Vector:
    """A vector in axes that are turned by an angle of that cosine and sine."""
    return dot(turn, vector), cross(turn, vector)


def _scaled(vector: Vector, factor: sp.Expr) -> Vector:
    return factor * vector[0], factor * vector[1]


def _is_letter(part: sp.Expr) -> bool:
    return bool(part.is_Symbol or (-part).is_Symbol)


def _absolute(vector: Vector, length: sp.Expr) -> sp.Expr:
    """A vector's length without the sign of its only component."""
    return sp.Abs(length) if ZERO in vector else length
