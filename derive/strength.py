"""Strength reduction: statements that cost much, replaced by what vectors have for less.

Square roots, divisions and angles of points are most of what an inverse costs. What stands here in
their place differs from them by roundings.
"""

import re
from collections.abc import Sequence
from dataclasses import replace

from .statements import NAME, Body, Compute, Store

FUNCTIONS = ("rsqrt", "supplement")
"""Functions of vectors alone: ``rsqrt(x)`` is 1 / sqrt(x), and ``supplement(a, y)`` the angle whose
size and that of a are together pi, with the sign of y."""
_ROOT = re.compile(r"sqrt\((\w+)\)")
_QUOTIENT = re.compile(r"(\S+) / (\w+)")
_NEGATIVE = re.compile(r"-([a-zA-Z]\w*)")
_ANGLE = re.compile(r"atan2\((\S+), (\S+)\)")


def reduced(body: Body) -> Body:
    """A body with reciprocal roots for lengths that only divide, and one angle for opposite points.

    Satisfies: atan2(-y, x) = -atan2(y, x), and atan2(y, -x) = pi - atan2(y, x) where y > 0.
    """
    return _angles_of_opposites(_reciprocal_roots(body)).used().by_depth()


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
        point = None if isinstance(statement, Store) else _ANGLE.fullmatch(statement.expression)
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
