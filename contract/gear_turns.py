"""Full turns of coordinates whose joints are coupled to other joints of a robot with loops."""

from collections.abc import Sequence


def keeps_full_turns(index: int, rows: Sequence[Sequence[float]], is_angle: Sequence[bool]) -> bool:
    """Returns whether a full turn of a variable turns all coupled joints by full turns.

    Args:
        index: Index of the variable.
        rows: Factors of all variables in each coupling. The sum of factor * variable is constant.
        is_angle: Whether each variable is an angle.
    """
    waiting, seen = [index], {index}
    while waiting:
        k = waiting.pop()
        for row in rows:
            if row[k] == 0:
                continue
            for j, factor in enumerate(row):
                if factor == 0 or j == k:
                    continue
                turns = row[k] / factor
                if not is_angle[j] or turns != round(turns):
                    return False
                if j not in seen:
                    waiting.append(j)
                    seen.add(j)
    return True
