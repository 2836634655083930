"""Strength reduction: statements that cost much, replaced by what vectors have for less.

Square roots, divisions and angles of points are most of what an inverse costs. What stands here in
their place differs from them by roundings.
"""

import itertools
import re
from collections.abc import Callable, Sequence
from dataclasses import replace

from .statements import NAME, Body, Compute, Store

FUNCTIONS = ("rsqrt", "supplement")
"""Functions of vectors alone: ``rsqrt(x)`` is 1 / sqrt(x), and ``supplement(a, y)`` the angle whose
size and that of a are together pi, with the sign of y."""
_ROOT = re.compile(r"sqrt\((\w+)\)")
_QUOTIENT = re.compile(r"(\S+) / (\w+)")
_NEGATIVE = re.compile(r"-([a-zA-Z]\w*)")
_PRODUCT = re.compile(r"(\S+) \* (\S+)")
_TERM = re.compile(r"\w+|-?\d\S*")
_ANGLE = re.compile(r"atan2\((\S+), (\S+)\)")


def reduced(body: Body, sign: str = "") -> Body:
    """A body with reciprocal roots for lengths that only divide, and one angle for opposite points.

    Angles do not wait for the length that their points are divided by.

    Satisfies: atan2(-y, x) = -atan2(y, x), and atan2(y, -x) = pi - atan2(y, x) where y > 0.

    Args:
        body: The statements.
        sign: Name of an input that is 1 or -1, on which as few angles as can be are to depend.
    """
    body = _angles_before_lengths(_angles_of_opposites(_reciprocal_roots(body)))
    return (_angles_before_sign(body, sign) if sign else body).used().by_depth()


def _reciprocal_roots(body: Body) -> Body:
    roots = {s.name: match[1] for s in body.computed if (match := _ROOT.fullmatch(s.expression))}
    for statement in body.statements:
        quotient = _quotient(statement)
        taken = NAME.findall(quotient[1] if quotient else _text(statement))
        for name in roots.keys() & set(taken):
            del roots[name]

    def cheap(statement: Compute | Store) -> Compute | Store:
        if isinstance(statement, Store):
            return statement
        if statement.name in roots:
            return replace(statement, expression=f"rsqrt({roots[statement.name]})")
        quotient = _quotient(statement)
        if quotient and quotient[2] in roots:
            return replace(statement, expression=f"{quotient[1]} * {quotient[2]}")
        return statement

    return replace(body, statements=tuple(map(cheap, body.statements)))


def _quotient(statement: Compute | Store) -> re.Match[str] | None:
    return None if isinstance(statement, Store) else _QUOTIENT.fullmatch(statement.expression)


def _point(statement: Compute | Store) -> re.Match[str] | None:
    return None if isinstance(statement, Store) else _ANGLE.fullmatch(statement.expression)


def _text(statement: Compute | Store) -> str:
    return statement.value if isinstance(statement, Store) else statement.expression


def _angles_of_opposites(body: Body) -> Body:
    negatives = {
        s.name: match[1] for s in body.computed if (match := _NEGATIVE.fullmatch(s.expression))
    }

    def signed(name: str) -> tuple[str, bool]:
        """What a name is up to sign, and whether it is the negative of that."""
        negative = False
        while name in negatives:
            name, negative = negatives[name], not negative
        return name, negative

    known: dict[Sequence[str], tuple[str, bool, bool]] = {}

    def cheap(statement: Compute | Store) -> Compute | Store:
        point = _point(statement)
        if point is None or isinstance(statement, Store):
            return statement
        (y, down), (x, left) = map(signed, point.groups())
        angle, known_down, known_left = known.setdefault((y, x), (statement.name, down, left))
        if angle == statement.name:
            return statement
        if left != known_left:
            return replace(statement, expression=f"supplement({angle}, {point[1]})")
        assert down != known_down
        return replace(statement, expression=f"-{angle}")

    return replace(body, statements=tuple(map(cheap, body.statements)))


class _Products:
    """Takes factors out of the products of a body, and gives names to what is left."""

    def __init__(self, body: Body) -> None:
        self._expressions = {s.name: s.expression for s in body.computed}
        self._statements: list[Compute | Store] = []
        self._numbers = itertools.count(len(body.statements) + 1)

    def with_angles(self, body: Body, angle: Callable[[str, str], str]) -> Body:
        """The body with each angle of a point (x, y) as a function of y and x writes it."""
        for statement in body.statements:
            point = _point(statement)
            if point and isinstance(statement, Compute):
                self._statements.append(Compute(statement.name, angle(*point.groups())))
            else:
                self._statements.append(statement)
        return replace(body, statements=tuple(self._statements))

    def named(self, expression: str) -> str:
        """The name of an expression; a name or a number is its own."""
        if _TERM.fullmatch(expression):
            return expression
        name = f"v{next(self._numbers)}"
        self._statements.append(Compute(name, expression))
        return name

    def without(self, term: str, factor: str) -> str | None:
        """What a term is the product of with a factor, or None where it is no such product."""
        expression = self._expressions.get(term, "")
        if negative := _NEGATIVE.fullmatch(expression):
            rest = self.without(negative[1], factor)
            return rest and self.named(f"-{rest}")
        product = _PRODUCT.fullmatch(expression)
        for one, other in itertools.permutations(product.groups()) if product else ():
            if other == factor:
                return one
            if rest := self.without(one, factor):
                return self.named(f"{rest} * {other}")
        return None


def _angles_before_lengths(body: Body) -> Body:
    products = _Products(body)
    lengths = [s.name for s in body.computed if s.expression.startswith("rsqrt(")]

    def angle(y: str, x: str) -> str:
        for length in lengths:
            bare_y, bare_x = products.without(y, length), products.without(x, length)
            if bare_y and bare_x:
                return f"atan2({bare_y}, {bare_x})"
        return f"atan2({y}, {x})"

    return products.with_angles(body, angle)


def _angles_before_sign(body: Body, sign: str) -> Body:
    products = _Products(body)

    def angle(y: str, x: str) -> str:
        bare_y, bare_x = products.without(y, sign), products.without(x, sign)
        one = f"atan2({bare_y or y}, {bare_x or x})"
        if bare_x:
            one = products.named(one)
            other = products.named(f"supplement({one}, {y})")
            return f"{products.named(f'0.0 < {sign}')} ? {one} : {other}"
        return f"{sign} * {products.named(one)}" if bare_y else one

    return products.with_angles(body, angle)
