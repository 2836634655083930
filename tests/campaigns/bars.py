"""Bounds: maximum allowed values of the error measures of a robot."""

from collections.abc import Mapping

from .campaign import Outcome


def barred(kind: str, figures: object, bars: Mapping[str, float], title: str = "") -> Outcome:
    """Returns an outcome with a failure if an error measure exceeds its bound or is NaN.

    Args:
        kind: The kind of robot, used as the name of the count.
        figures: Object with one attribute for the bound of each error measure.
        bars: Maximum of each error measure, keyed by name.
        title: The name of the robot in a failure message; default: the kind.
    """
    values = {name: float(vars(figures)[name]) for name in bars}
    missed = [
        f"{name} {value:.3g}, bar {bars[name]:g}"
        for name, value in values.items()
        if not value <= bars[name]
    ]
    failures = (f"{title or kind}: {'; '.join(missed)}",) if missed else ()
    return Outcome({kind: 1}, failures, {name: x for name, x in values.items() if bars[name]})
