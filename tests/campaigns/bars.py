"""Bars: maximum values of a robot's figures."""

from collections.abc import Mapping

from .campaign import Outcome


def barred(kind: str, figures: object, bars: Mapping[str, float], title: str = "") -> Outcome:
    """Return a failure if a figure is above its bar or not a number.

    Args:
        kind: The kind of robots that is counted.
        figures: Its attributes have the names of the bars.
        bars: The maximum of each figure, by name.
        title: The name of the robot in a failure, by default its kind.
    """
    values = {name: float(vars(figures)[name]) for name in bars}
    missed = [
        f"{name} {value:.3g}, bar {bars[name]:g}"
        for name, value in values.items()
        if not value <= bars[name]
    ]
    failures = (f"{title or kind}: {'; '.join(missed)}",) if missed else ()
    return Outcome({kind: 1}, failures, {name: x for name, x in values.items() if bars[name]})
