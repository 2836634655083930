"""Checks whether a full turn of one joint moves all coupled joints by full turns."""

from collections.abc import Sequence

_ROUNDING = 1e-12
"""Maximum relative rounding error of a number of turns."""


def keeps_full_turns(index: int, rows: Sequence[Sequence[float]], is_angle: Sequence[bool]) -> bool:
    """Return whether a full turn of a variable turns all coupled joints by full turns.

    Args:
        index: Index of the variable that makes a full turn.
        rows: Factors of all variables, with one row per coupling. In each coupling, the sum of
            factor * variable is constant.
        is_angle: Whether each variable is an angle.
    """
    turns, waiting = {index: 1.0}, [index]
    while waiting:
        k = waiting.pop()
        for row in rows:
            if row[k] == 0:
                continue
            for j, factor in enumerate(row):
                if factor == 0 or j in turns:
                    continue
                turns[j] = abs(turns[k] * row[k] / factor)
                if not is_angle[j] or abs(turns[j] - round(turns[j])) > _ROUNDING * turns[j]:
                    return False
                waiting.append(j)
    return True
