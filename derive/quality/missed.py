"""Describes axis displacements that the parameters of a model cannot represent."""

import numpy as np
from numpy.typing import NDArray

from ..model.tolerances import ZERO_SINGULAR_VALUE

_SHOWN = 1e-3
"""Smallest reported component of a displacement, relative to the largest component."""


def missed(rows: NDArray[np.float64], words: tuple[str, ...]) -> tuple[str, ...]:
    """Describes the displacements outside the span of the columns, one sentence each.

    Args:
        rows: (d, k) displacements for each of k parameters.
        words: The name of each row.
    """
    U, values, _ = np.linalg.svd(rows, full_matrices=True)
    rank = int(np.sum(values > ZERO_SINGULAR_VALUE))
    return tuple(_named(direction, words) for direction in _sparse(U[:, rank:].T))


def _sparse(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns a basis of the same space with many zeros (reduced row echelon form)."""
    found = directions.copy()
    taken: list[int] = []
    for k in range(len(found)):
        size = np.abs(found[k])
        size[taken] = 0
        pivot = int(np.argmax(size))
        taken.append(pivot)
        found[k] /= found[k, pivot]
        for other in range(len(found)):
            if other != k:
                found[other] -= found[other, pivot] * found[k]
    return found


def _named(direction: NDArray[np.float64], words: tuple[str, ...]) -> str:
    largest = int(np.argmax(np.abs(direction)))
    direction = direction / direction[largest]
    others = [
        f"{abs(part):.3g} of a {word}"
        for k, (part, word) in enumerate(zip(direction, words, strict=True))
        if k != largest and abs(part) > _SHOWN
    ]
    return " with ".join([words[largest], *others])
