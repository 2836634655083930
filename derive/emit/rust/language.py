"""Writes a Rust crate for the functions that call no iterative solver."""

import json
import textwrap
from collections.abc import Iterable, Sequence
from importlib.metadata import version
from pathlib import Path

from ...derivation import Derivation
from ...program.programs import Programs
from ...terms.symbolic_function import SymbolicFunction
from ..c.expressions import WIDTH, number
from ..c.header import description
from ..precision.errors import SOLVED
from ..printed import (
    coordinate_lines,
    example_inverse,
    example_start,
    missing_functions,
    printed_functions,
)
from ..seeds import missing_nearest, printed_nearest
from ..templates import filled
from .functions import definition, nearest

SUPPORT = Path(__file__).parent / "support"
NEAREST = """\
mod nearest;

use nearest::{Moves, Slots, FULL_TURN};
pub use nearest::{Missing, Nearest};
"""


def files(derivation: Derivation, programs: Programs) -> dict[str, str]:
    """Return the files of the crate, keyed by path."""
    printed = printed_functions(derivation)
    missing = (missing_functions(derivation), missing_nearest(derivation, printed))
    values = {
        "robot": derivation.robot.name,
        "title": derivation.robot.title,
        "version": version("chasles"),
        "missing": " ".join(filter(None, missing)),
    }
    found = {
        "src/lib.rs": _library(derivation, printed, programs, values),
        "src/math.rs": filled(SUPPORT / "math.rs", {}),
        "Cargo.toml": filled(SUPPORT / "Cargo.toml", values),
        "README.md": f"{filled(SUPPORT / 'README.md', values).rstrip()}\n",
    }
    if printed_nearest(derivation, printed):
        found["src/nearest.rs"] = filled(SUPPORT / "nearest.rs", {})
    return found | _example(derivation, printed, values)


def _library(
    derivation: Derivation,
    printed: Sequence[SymbolicFunction],
    programs: Programs,
    values: dict[str, str],
) -> str:
    selected = printed_nearest(derivation, printed)
    comment = [f"//! {line}".rstrip() for line in textwrap.wrap(values["missing"], WIDTH - 4)]
    filled_in = values | {
        "coordinates": "\n".join(f"//! {line}" for line in coordinate_lines(derivation)),
        "missing": "".join(f"{line}\n" for line in [*comment, "//!"] if comment),
        "constants": _constants(derivation),
        "nearest": NEAREST if selected else "",
    }
    head = filled(SUPPORT / "lib.rs.in", filled_in)
    bodies = [definition(f, description(f, programs), programs.whole[f.name]) for f in printed]
    return "\n".join([head, *bodies, *(nearest(derivation, f, own) for f, own in selected)])


def _constants(derivation: Derivation) -> str:
    moved = derivation.robot.coordinates
    limits = [
        f"[{_bound(c.limits[0], 'f64::NEG_INFINITY')}, {_bound(c.limits[1], 'f64::INFINITY')}]"
        for c in moved
    ]
    return "\n".join(
        [
            "/// Number of coordinates.",
            f"pub const N: usize = {len(moved)};",
            "/// Largest residual of a solution (meter or radian).",
            f"pub const SOLVED: f64 = {number(SOLVED)};",
            "/// Names of the coordinates.",
            *_array("COORDINATE_NAMES: [&str; N]", (_text(c.name) for c in moved)),
            "/// Units of the coordinates.",
            *_array("COORDINATE_UNITS: [&str; N]", (_text(c.unit) for c in moved)),
            "/// Lower and upper limits of the coordinates.",
            *_array("COORDINATE_LIMITS: [[f64; 2]; N]", limits),
        ]
    )


def _array(head: str, values: Iterable[str]) -> list[str]:
    return [f"pub const {head} = [", *(f"    {value}," for value in values), "];"]


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _bound(value: object, infinite: str) -> str:
    return infinite if value is None else number(float(value))  # type: ignore[arg-type]


def _example(
    derivation: Derivation, printed: Sequence[SymbolicFunction], values: dict[str, str]
) -> dict[str, str]:
    if not any(function.name == "fk" for function in printed):
        return {}
    values = values | {"start": ", ".join(map(number, example_start(derivation)))}
    inverse = example_inverse(derivation, printed)
    if inverse is None:
        return {"examples/pose.rs": filled(SUPPORT / "pose.rs.in", values)}
    fixed = (f"&[q[{k}]]" for k in inverse.role.fixed)
    values |= {
        "inverse": inverse.name,
        "slots": str(inverse.branches),
        "inputs": ", ".join(["&pose", *fixed]),
    }
    return {"examples/solutions.rs": filled(SUPPORT / "solutions.rs.in", values)}
