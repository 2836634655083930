"""Short symbols of an arm that is a part of a robot with loops."""

from collections.abc import Sequence

import sympy as sp

from .notation import ENTRY, LETTERS, Notation


class ArmNotation(Notation):
    """Notation of an arm.

    The arm uses the constants and terms of the robot's notation.
    """

    def __init__(self, whole: Notation, q: Sequence[sp.Symbol], called: Sequence[str]) -> None:
        # The arm and the whole robot share the symbol tables, so no symbol has two meanings.
        self.__dict__.update(whole.__dict__)
        self.q, self.called = tuple(q), tuple(called)

    def trigonometric(self, expression: sp.Expr) -> sp.Expr:
        """Return a cosine or sine unchanged, without a short symbol."""
        return expression

    def entries(self) -> tuple[sp.Symbol | None, ...]:
        """Return the names of the entries of a pose (4, 4) in row-major order."""
        r, p = (
            next(letter for letter in LETTERS[kind][1:] if letter not in self.called)
            for kind in ("rotation", "position")
        )
        named: list[sp.Symbol | None] = []
        for i, axis in enumerate("xyz", 1):
            row = [f"{r}_{{{i}{j}}}" for j in (1, 2, 3)] + [f"{p}_{{{axis}}}"]
            named += [self.symbol(tex, (ENTRY, (tex,))) for tex in row]
        return (*named, *(None,) * 4)
