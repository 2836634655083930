"""Prints the functions of a robot as C in single precision."""

import textwrap
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ...program.counting import count_operations
from ...program.operations import Constant, Operand, Operation, Program, Store
from ...terms.symbolic_function import SymbolicFunction
from ..c.expressions import WIDTH, expression, naming
from ..c.sections import summary

_CALLS = {
    Operation.ATAN: "CHASLES_ATAN2F({0}, 1.0f)",
    Operation.ATAN2: "CHASLES_ATAN2F({0}, {1})",
    Operation.SQRT: "CHASLES_SQRTF({0})",
    Operation.ABS: "fabsf({0})",
    Operation.MIN: "chasles_least({0}, {1})",
    Operation.MAX: "chasles_greatest({0}, {1})",
    Operation.SIGN: "{0} < 0.0f ? -1.0f : {0} > 0.0f ? 1.0f : {0}",
}
_TURNS = {
    Operation.COS: "cos_{0}",
    Operation.SIN: "sin_{0}",
    Operation.TAN: "(sin_{0} / cos_{0})",
}
"""C expressions for the cosine, sine and tangent of an angle. One call computes both the cosine and
the sine of an angle."""


def number(value: float) -> str:
    """Return the shortest decimal number that parses to the same single-precision number."""
    text = str(np.float32(value))
    return f"{text}f" if "." in text or "e" in text else f"{text}.0f"


@dataclass(frozen=True)
class Precision:
    """The C syntax of one number type.

    Attributes:
        kind: The type.
        number: Function that formats a constant as C text.
        calls: C templates of the operations whose C function differs from the one in double
            precision, such as ``fabsf`` instead of ``fabs``.
    """

    kind: str
    number: Callable[[float], str]
    calls: Mapping[Operation, str]


SINGLE = Precision("float", number, _CALLS)


def signature(prefix: str, function: SymbolicFunction) -> str:
    """Return the prototype of a function, without the semicolon."""
    inputs = [f"const float {a.name}[{a.size}]" for a in function.inputs]
    outputs = [f"float {r.name}[{r.size}]" for r in function.outputs]
    text = f"void {prefix}_{function.name}({', '.join(inputs + outputs)})"
    return "\n".join(textwrap.wrap(text, WIDTH, subsequent_indent="    "))


def definition(prefix: str, function: SymbolicFunction, program: Program) -> str:
    """Return the C code of a function with its comment."""
    comment = textwrap.wrap(function.summary, WIDTH - len("// "))
    counted = summary(count_operations(program))
    head = [*(f"// {line}" for line in [*comment, counted]), signature(prefix, function)]
    # Outputs may overlap inputs, because all inputs are read before an output is written.
    used = {program.arguments[entry.argument] for entry in program.inputs}
    unused = [f"  (void){a.name};" for a in function.inputs if a.name not in used]
    return "\n".join([*head, "{", *unused, *statements(function, program), "}\n"])


def statements(
    function: SymbolicFunction, program: Program, precision: Precision = SINGLE
) -> list[str]:
    """Return the lines of a function's body."""
    named, angles, turns = naming(program), dict[Operand, int](), dict[Operand, str]()
    real = precision.kind

    def name(operand: Operand) -> str:
        if isinstance(operand, Constant):
            return precision.number(operand.value)
        return turns.get(operand) or named(operand)

    lines = [
        f"  const {real} {name(entry)} = {program.arguments[entry.argument]}[{entry.entry}];"
        for entry in program.inputs
    ]
    for statement in program.statements:
        if isinstance(statement, Store):
            output = function.outputs[statement.output].name
            lines.append(f"  {output}[{statement.entry}] = {name(statement.value)};")
        elif statement.operation in _TURNS:
            (angle,) = statement.operands
            if angle not in angles:
                k = angles[angle] = len(angles)
                lines.append(f"  {real} cos_{k}, sin_{k};")
                lines.append(f"  CHASLES_COS_SIN({name(angle)}, &cos_{k}, &sin_{k});")
            turns[statement.result] = _TURNS[statement.operation].format(angles[angle])
        else:
            kind = "int" if statement.is_condition else real
            template = precision.calls.get(statement.operation)
            right = (
                template.format(*map(name, statement.operands))
                if template
                else expression(statement, name)
            )
            lines.append(f"  const {kind} {name(statement.result)} = {right};")
    return lines
