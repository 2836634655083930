"""Draws of robots that are judged by bars, one after the other."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TypeVar

from bench.report import out, paced

Draw = TypeVar("Draw")
"""What is measured at a draw: its attributes have the names of the bars."""


def judged_draws(
    judged: Callable[[int], Draw], numbers: Sequence[int], bars: Mapping[str, float]
) -> tuple[list[Draw], int]:
    """Judges draws, and prints those that miss a bar, how far it is, and the worst of all.

    Args:
        judged: The measurements at a draw, by its number.
        numbers: Numbers of the draws.
        bars: The largest value that each measurement may have, by its name.

    Returns:
        The draws, and how many of them miss a bar.
    """

    def over(draw: Draw) -> list[str]:
        return [key for key, bar in bars.items() if not vars(draw)[key] <= bar]

    def each() -> Iterator[Draw]:
        for number in numbers:
            draw = judged(number)
            if missed := over(draw):
                values = (f"{key} {vars(draw)[key]:.3g}" for key in missed)
                out.print(f"draw {number}: " + ", ".join(values))
            yield draw

    def count(draws: Sequence[Draw]) -> int:
        return sum(bool(over(draw)) for draw in draws)

    found = paced(each(), len(numbers), lambda draws: f"{count(draws)} draws miss a bar")
    for key, bar in bars.items():
        most = max(float(vars(draw)[key]) for draw in found)
        out.print(f"  {key:8} at most {most:.3g}, bar {bar:g}")
    return found, count(found)
