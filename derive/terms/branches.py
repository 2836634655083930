"""Solution branches of a function."""

import itertools
from collections.abc import Iterator
from dataclasses import replace

from .symbolic_function import Argument, SymbolicFunction


def patterns(function: SymbolicFunction) -> Iterator[tuple[int, ...]]:
    """Return the signs of each solution branch, in the order of the branches."""
    return itertools.product((1, -1), repeat=len(function.signs))


def branch(function: SymbolicFunction) -> SymbolicFunction:
    """Return a function for a single branch, whose last input ``choice`` contains the signs."""
    meaning = "1 or -1 for each choice"
    signs = Argument("choice", function.signs, (len(function.signs),), "1", meaning)
    return replace(
        function,
        name=f"{function.name}_branch",
        inputs=(*function.inputs, signs),
        outputs=tuple(replace(result, shape=result.shape[1:]) for result in function.outputs),
        signs=(),
    )
