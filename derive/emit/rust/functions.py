"""Prints the functions of a robot in Rust."""

import textwrap
from collections.abc import Sequence

from ...derivation import Derivation
from ...program.operations import Operation, Program, Store
from ...terms.symbolic_function import Argument, Result, Signature, SymbolicFunction
from ..c.expressions import FUNCTIONS, WIDTH, expression, naming, wrapped
from ..seeds import SeedInputs, counts, nearest_summary, periodic

_KEYWORDS = (
    "abstract as async await become box break const continue crate do dyn else enum extern false "
    "final fn for gen if impl in let loop macro match mod move mut override priv pub ref return "
    "self Self static struct super trait true try type typeof union unsafe unsized use virtual "
    "where while yield"
)
CONSTANTS = ("N", "SOLVED", "COORDINATE_NAMES", "COORDINATE_UNITS", "COORDINATE_LIMITS")
"""Names of constants in the crate."""
RESERVED = frozenset([*_KEYWORDS.split(), *CONSTANTS])
"""Names that a Rust argument must not have.

An argument with a reserved name gets a trailing underscore.
"""
_TEMPLATES = {
    Operation.SIGN: "if {0} < 0.0 {{ -1.0 }} else if {0} > 0.0 {{ 1.0 }} else {{ {0} }}",
    Operation.SELECT: "if {0} {{ {1} }} else {{ {2} }}",
    Operation.ABS: "math::abs({0})",
    Operation.MIN: "f64::min({0}, {1})",
    Operation.MAX: "f64::max({0}, {1})",
}
_CALLS = {
    operation: f"math::{name}"
    for operation, name in FUNCTIONS.items()
    if operation not in _TEMPLATES
}


def safe(name: str) -> str:
    """Return a valid name for a Rust argument."""
    return f"{name}_" if name in RESERVED else name


def definition(function: Signature, described: Sequence[str], program: Program) -> str:
    """Return a Rust function with its comment.

    Args:
        function: The function.
        described: The lines of the comment; the first line is the summary of the function.
        program: The expression graph of all branches of the function.
    """
    first, *others = described
    # The comment lines are a text block, because Markdown would read products and indices as
    # emphasis and links.
    comment = [f"/// {first}", "///", "/// ```text", *(f"/// {line}" for line in others), "/// ```"]
    inputs = [f"{safe(a.name)}: &{kind(a)}" for a in function.inputs]
    outputs = [f"{safe(r.name)}: &mut {kind(r)}" for r in function.outputs]
    head = f"pub fn {function.name}({', '.join([*inputs, *outputs])}) {{"
    used = {program.arguments[entry.argument] for entry in program.inputs}
    unused = [f"    let _ = {safe(a.name)};" for a in function.inputs if a.name not in used]
    wrapped = textwrap.wrap(head, WIDTH, subsequent_indent="    ")
    return "\n".join([*comment, *wrapped, *unused, *_statements(function, program), "}\n"])


def nearest(derivation: Derivation, function: SymbolicFunction, own: SeedInputs) -> str:
    """Return the Rust function for the solution nearest to a seed.

    Args:
        derivation: The derivation of the robot.
        function: The inverse.
        own: Inputs of the inverse kinematics function after the target.
    """
    lines = [
        *nearest_summary(function),
        "The distance is the largest weighted displacement of a coordinate from `q_seed`; limits",
        "and weights without restriction: `&COORDINATE_LIMITS` and `&[1.0; N]`.",
    ]
    target, slots = function.inputs[0], function.branches
    name, at = safe(target.name), "own" if own.function else "q_seed"
    head = (
        f"pub fn {function.name}_nearest({name}: &{kind(target)}, q_seed: &[f64; N], "
        "limits: &[[f64; 2]; N], weights: &[f64; N]) -> Result<Nearest<N>, Missing> {"
    )
    passed = [name, *(f"&[{at}[{k}]]" for k in own.entries)]
    passed += [f"&mut found.{output}" for output in ("q", "residual", "margin")]
    called = [f"let mut own = [0.0; {own.size}];", f"{own.function}(q_seed, &mut own);"]
    zeros = f"q: [[0.0; N]; {slots}], residual: [0.0; {slots}], margin: [0.0; {slots}]"
    turns = ", ".join("FULL_TURN" if wraps else "0.0" for wraps in periodic(derivation, function))
    counted = enumerate(counts(derivation, function))
    fixed = [f"scale[{k}] = 0.0;" for k, is_counted in counted if not is_counted]
    body = [
        f"let mut found = Slots {{ {zeros} }};",
        *(called if own.function else ()),
        f"{function.name}({', '.join(passed)});",
        f"let {'mut ' if fixed else ''}scale = *weights;",
        *fixed,
        f"found.nearest(q_seed, &Moves {{ limits, scale, turn: [{turns}] }})",
    ]
    wrapped_body = [line for statement in body for line in wrapped(statement, "    ")]
    return "\n".join([*(f"/// {line}" for line in lines), *wrapped(head), *wrapped_body, "}\n"])


def kind(value: Argument | Result) -> str:
    """Return the Rust type of an argument.

    The coordinates of several solutions are an array of arrays. Arrays of residuals and margins
    have one entry per solution.
    """
    if is_slots(value):
        slots, n = value.shape
        return f"[[f64; {n}]; {slots}]"
    return f"[f64; {value.size}]"


def is_slots(value: Argument | Result) -> bool:
    """Whether a result contains the coordinates of all solutions."""
    return isinstance(value, Result) and value.name == "q" and len(value.shape) > 1


def _statements(function: Signature, program: Program) -> list[str]:
    name = naming(program)
    lines = [
        f"    let {name(entry)} = {safe(program.arguments[entry.argument])}[{entry.entry}];"
        for entry in program.inputs
    ]
    for statement in program.statements:
        if isinstance(statement, Store):
            place = _place(function.outputs[statement.output], statement.entry)
            lines.append(f"    {place} = {name(statement.value)};")
            continue
        terms = [name(operand) for operand in statement.operands]
        if statement.operation in _TEMPLATES:
            right = _TEMPLATES[statement.operation].format(*terms)
        elif statement.operation in _CALLS:
            right = f"{_CALLS[statement.operation]}({', '.join(terms)})"
        else:
            right = expression(statement, name)
        lines.append(f"    let {name(statement.result)} = {right};")
    return lines


def _place(result: Result, entry: int) -> str:
    if is_slots(result):
        slot, k = divmod(entry, result.shape[1])
        return f"{safe(result.name)}[{slot}][{k}]"
    return f"{safe(result.name)}[{entry}]"
