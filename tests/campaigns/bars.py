"""Comparison of the error measures of a random trial with their maximum allowed values."""

from collections.abc import Mapping

from .campaign import Outcome


def barred(kind: str, figures: object, bars: Mapping[str, float], title: str = "") -> Outcome:
    """Return a trial outcome that fails if an error measure exceeds its bound or is NaN."""
    values = {name: float(vars(figures)[name]) for name in bars}
    missed = [
        f"{name} {value:.3g}, bar {bars[name]:g}"
        for name, value in values.items()
        if not value <= bars[name]
    ]
    failures = (f"{title or kind}: {'; '.join(missed)}",) if missed else ()
    return Outcome({kind: 1}, failures, {name: x for name, x in values.items() if bars[name]})
