"""Hints for missing attributes and keywords, read from `hints.toml` only for error messages."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from pathlib import Path
from typing import Any

_OF_LOOPS = "its q are its joints, since it has no loops"
_ITERATED = "its loops are solved by iteration"
_SPARE = 'its actuators outnumber its freedoms; closure = "least squares" in its file solves fk'
_ALWAYS_CLOSED = "its loops close everywhere, in one way"
_NO_PASSIVE = "all its joints are in the main chain"
_CLOSED_FORM = "it has a closed form, which needs no seed"
_NO_PLATFORM = "it is not a platform on legs"
_ON_DEMAND = "it is derived by chasles.load(..., parametric=True)"
_TWO_BRANCHES = "its actuators follow from the main chain in one way"
_REPRESENTATIONS = ("space", "body", "mixed")


@functools.cache
def _tables() -> dict[str, Any]:
    import tomllib  # noqa: PLC0415

    return tomllib.loads((Path(__file__).parent / "hints.toml").read_text(encoding="utf-8"))


def missing_attribute(owner: str, name: str, table: str) -> str:
    """Return the error message for a missing attribute, with a hint for other libraries' names."""
    row: dict[str, str] = next((r for r in _tables()[table] if name in r["names"]), {})
    library = f" ({row['library']})" if "library" in row else ""
    return f"{owner} has no {name!r}{library}" + (f"; {row['hint']}" if row else "")


def unknown_keyword(caller: str, name: str, known: Iterable[str]) -> str:
    """Return the message for an unknown keyword."""
    names, hint = [*known], _tables()["keywords"].get(name)
    here = f"; pass {hint}=" if hint in names else ""
    return f"{caller}: unknown argument {name!r}{here}; it takes {', '.join(names)}"


def explain(robot: Any, name: str) -> tuple[str, str]:
    """Return why a function or method is missing, and which alternatives exist."""
    if name in ("ik", "ik_path", "ik_nearest", *_tables()["tasks"]):
        return _no_inverse(robot)
    stem, _, suffix = name.partition("_")
    if stem in ("jacobian", "hessian", "twist", "acceleration") and suffix in ("", "dot"):
        named = ["_".join(filter(None, (stem, kind, suffix))) for kind in _REPRESENTATIONS]
        found = ", ".join(item for item in named if item in robot.functions)
        return "the representation must be named", found
    return _reason(robot, name), ", ".join(i for i in _instead(name) if i in dir(robot))


def _instead(name: str) -> list[str]:
    stem, _, rest = name.partition("_")
    others = [rest] if stem == "chain" else []
    if stem in ("jacobian", "hessian", "twist", "acceleration"):
        others = [f"jacobian_{rest.removesuffix('_dot')}"]
    return list(_tables()["instead"].get(name, others))


def _no_inverse(robot: Any) -> tuple[str, str]:
    tasks, solvers = _tables()["tasks"], _tables()["solvers"]
    found = [f"{name}, which takes {tasks[name]}" for name in robot.functions if name in tasks]
    is_serial = robot.manifest.kind == "serial"
    # For a serial arm, `actuators` converts joint values and does not solve a pose.
    has = {*dir(robot)} - ({"actuators"} if is_serial else set())
    found += [text for name, text in solvers.items() if name in has]
    if is_serial and "ik" not in robot.functions:
        found.append(solvers["fixed"])
    missing = robot.manifest.inverse.missing
    return missing or (_ITERATED if robot.manifest.is_iterated else ""), "; ".join(found)


def _reason(robot: Any, name: str) -> str:
    manifest, groups = robot.manifest, _tables()["groups"]
    if name in groups["parametric"]:
        return _ON_DEMAND
    if name in groups["platforms"] and robot.functions.keys().isdisjoint(("rods", "legs")):
        return _NO_PLATFORM
    if name in groups["loops"] and manifest.kind == "serial" and not manifest.loops.coupling:
        return _OF_LOOPS
    if name in groups["iterated"]:
        return _CLOSED_FORM
    if name in ("passive", "passive_D_q") and not manifest.loops.passive:
        return _NO_PASSIVE
    if manifest.is_iterated and name != "swivel":
        return _ITERATED if "fk" in robot.functions else _SPARE
    if name in ("margin", "chain_branches"):
        return _ALWAYS_CLOSED
    if name in ("actuator_branches", "actuator_margin", "chain_closes"):
        return _TWO_BRANCHES
    return ""
