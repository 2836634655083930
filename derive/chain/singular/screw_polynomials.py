"""Screws of a chain as polynomials in lengths, cosines and sines.

The polynomial ring has generators for the cosines and sines of constant angles and for roots of
integers. The screw polynomials hold for any values of the constant angles, because their cosines
and sines are generators. In every polynomial, the squares of sines and square roots are replaced by
polynomials in the other variables.
"""

from collections.abc import Mapping, Sequence
from operator import add
from typing import Any

import sympy as sp

from .views import View

Polynomial = Any
"""A polynomial, as an element of a SymPy ring."""


class ScrewRing:
    """Screws as polynomials in the constants and coordinates of a robot.

    Attributes:
        q: The coordinates.
        constants: Symbols of the parameters, and the symbols that stand for functions of constants.
        meanings: Expression that each symbol stands for, such as the cosine of a constant angle,
            keyed by symbol.
        cosines: Symbols for the cosines of the coordinates.
        sines: Symbols for the sines of the coordinates.
        slides: Symbols of the prismatic coordinates.
        ring: The ring of polynomials in the symbols for constants, cosines, sines and prismatic
            coordinates.
    """

    def __init__(
        self, S: sp.Matrix, q: Sequence[sp.Symbol], points: Sequence[sp.Matrix] = ()
    ) -> None:
        known = sp.Matrix([*S, *(entry for point in points for entry in point)])
        self.q = tuple(q)
        angles = enumerate(_angles(known))
        self.turns = [(sp.Dummy(f"C{k}"), sp.Dummy(f"S{k}"), x) for k, x in angles]
        self.meanings: dict[sp.Symbol, sp.Expr] = {}
        for cosine, sine, angle in self.turns:
            self.meanings |= {cosine: sp.cos(angle), sine: sp.sin(angle)}
        for k, root in enumerate(sorted(known.atoms(sp.Pow), key=str)):
            if root.base.is_Integer:
                self.meanings[sp.Dummy(f"R{k}")] = root
        self.symbols_of = {meaning: symbol for symbol, meaning in self.meanings.items()}
        self.constants = [*sorted(known.free_symbols, key=str), *self.meanings]
        self.cosines = [sp.Dummy(f"c{k}") for k, _ in enumerate(q)]
        self.sines = [sp.Dummy(f"s{k}") for k, _ in enumerate(q)]
        self.slides = [sp.Dummy(f"d{k}") for k, _ in enumerate(q)]
        symbols = [*self.constants, *self.cosines, *self.sines, *self.slides]
        self.ring = sp.ring(symbols, sp.QQ)[0]
        self.squares = self._squares()
        self.S = [self.vector(S[:, k]) for k in range(S.shape[1])]

    def _squares(self) -> list[tuple[int, Polynomial]]:
        places = {symbol: k for k, symbol in enumerate(self.ring.symbols)}
        pairs = [*zip(self.cosines, self.sines, strict=True), *((c, s) for c, s, _ in self.turns)]
        found = [(places[s], 1 - self.ring.gens[places[c]] ** 2) for c, s in pairs]
        roots = ((s, root) for s, root in self.meanings.items() if root.is_Pow)
        return found + [(places[s], self.ring.ground_new(int(root.base))) for s, root in roots]

    def vector(self, column: sp.Matrix) -> list[Polynomial]:
        """Convert a constant vector to polynomials."""
        return [
            self.reduced(self.ring.from_expr(sp.expand(entry.xreplace(self.symbols_of))))
            for entry in column
        ]

    def matrix(self, view: View, longest: int) -> list[list[Polynomial]] | None:
        """Return the Jacobian columns for the frame and the reference point of ``view``.

        If a Jacobian entry has more than ``longest`` terms, the method returns None.
        """
        point = self.vector(view.point)
        columns = []
        for i, screw in enumerate(self.S):
            seen, before = screw, i < view.body
            between = range(i + 1, view.body) if before else range(i - 1, view.body - 1, -1)
            for k in between:
                seen = self._carried(k, -1 if before else 1, seen)
                if max(map(len, seen)) > longest:
                    return None
            shift = _cross(seen[3:], point)
            columns.append([self.reduced(x) for x in [*map(add, seen[:3], shift), *seen[3:]]])
        return columns

    def _carried(self, k: int, sense: int, screw: list[Polynomial]) -> list[Polynomial]:
        """Return a screw moved by joint k.

        The argument ``sense`` is 1 for the motion of joint k and -1 for the inverse motion.
        """
        v, w = self.S[k][:3], self.S[k][3:]
        ring, zero = self.ring, self.ring.zero
        if all(x == zero for x in w):
            slide = sense * ring.from_expr(self.slides[k])
            shift = _cross([slide * x for x in v], screw[3:])
            return [*map(add, screw[:3], shift), *screw[3:]]
        c, s = ring.from_expr(self.cosines[k]), sense * ring.from_expr(self.sines[k])

        def turned(x: list[Polynomial]) -> list[Polynomial]:
            once = _cross(w, x)
            twice = _cross(w, once)
            return [
                self.reduced(a + s * b + (1 - c) * d)
                for a, b, d in zip(x, once, twice, strict=True)
            ]

        point = _cross(w, v)
        moved = [a - b for a, b in zip(point, turned(point), strict=True)]
        h = turned(screw[3:])
        return [*map(add, turned(screw[:3]), _cross(moved, h)), *h]

    def reduced(self, polynomial: Polynomial) -> Polynomial:
        """Replace the square of each sine or square root by a polynomial in the other variables."""
        for place, square in self.squares:
            if all(powers[place] < 2 for powers in polynomial):  # noqa: PLR2004
                continue
            total = self.ring.zero
            for powers, factor in polynomial.items():
                left = list(powers)
                left[place] %= 2
                term = self.ring.term_new(tuple(left), factor)
                total += term * square ** (powers[place] // 2)
            polynomial = total
        return polynomial

    def block(self, columns: list[list[Polynomial]], rows: Sequence[int]) -> Polynomial:
        """Return the determinant of the square submatrix with the given columns and row indices."""
        if len(rows) == 1:
            return columns[0][rows[0]]
        total = self.ring.zero
        for k, row in enumerate(rows):
            if columns[0][row] != 0:
                rest = self.block(columns[1:], [*rows[:k], *rows[k + 1 :]])
                total += (-1) ** k * columns[0][row] * rest
        return self.reduced(total)

    def in_sines(self, polynomial: Polynomial) -> sp.Expr:
        """Convert a polynomial to an expression without squares of cosines."""
        squares = {sp.cos(q) ** 2: 1 - sp.sin(q) ** 2 for q in self.q}
        return sp.expand(sp.expand(self.expression(polynomial, {})).subs(squares))

    def expression(self, polynomial: Polynomial, sums: Mapping[int, sp.Expr]) -> sp.Expr:
        """Convert a polynomial to an expression in coordinates and constants.

        Args:
            polynomial: The polynomial to convert, an element of ``ring``.
            sums: Angle sums, keyed by the index of the coordinate that each sum replaces in the
                expression.
        """
        known = dict(self.meanings)
        for k, q in enumerate(self.q):
            angle = sums.get(k, q)
            known |= {self.cosines[k]: sp.cos(angle), self.sines[k]: sp.sin(angle)}
            known[self.slides[k]] = q
        return polynomial.as_expr().xreplace(known)


def _angles(S: sp.Matrix) -> list[sp.Expr]:
    return sorted({f.args[0] for f in S.atoms(sp.cos, sp.sin)}, key=str)


def _cross(a: Sequence[Polynomial], b: Sequence[Polynomial]) -> list[Polynomial]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
