"""The report of a calibration as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .identify import Calibration

_SHOWN = {"m": (1e3, "mm"), "rad": (1e3, "mrad"), "1": (1.0, ""), "m/rad": (1e3, "mm/rad")}


def report(found: Calibration) -> str:
    """Errors before and after, parameters with their 95 % intervals, and what was left out.

    Args:
        found: A calibration.
    """
    units = {item.name: item.unit for item in found.robot.geometry}
    lines = [
        f"{found.robot.name}: {len(found.names)} variables from {len(found.observation.rows)} "
        "measured numbers",
        f"error before {found.before:.4g}, after {found.after:.4g} standard deviations; the noise "
        f"is {found.noise:.3g} times the one that was stated",
        "",
        f"{'parameter':<28}{'nominal':>12}{'change':>12}{'+-95 %':>10}",
    ]
    reach = (found.intervals[:, 1] - found.intervals[:, 0]) / 2
    rows = zip(found.names, found.values, found.deviations, reach, strict=True)
    for name, value, deviation, half in rows:
        factor, unit = _SHOWN[units.get(name, "m")]
        nominal, change, half_width = (factor * x for x in (value - deviation, deviation, half))
        lines.append(f"{name:<28}{nominal:12.4f}{change:+12.4f}{half_width:10.4f} {unit}")
    lines += ["", *(f"held at nominal: {item}" for item in found.redundant)]
    lines += [f"left out: {label}" for label in found.outliers]
    return "\n".join(lines).rstrip()
