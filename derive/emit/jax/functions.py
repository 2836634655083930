"""Prints the functions of a robot for JAX."""

import keyword
import textwrap
from collections.abc import Iterator, Sequence

from ...program.operations import Constant, Operand, Operation, Program, Store
from ...terms.branches import patterns
from ...terms.symbolic_function import Argument, SymbolicFunction
from ..c.expressions import FUNCTIONS, expression, naming
from ..precision.single import single

WIDTH = 100
"""Maximum line length of comments and results in the generated JAX module."""
CHOICE = "choice"
"""Name of the program argument that contains the branch signs."""
_TEMPLATES = {
    Operation.AND: "{0} & {1}",
    Operation.OR: "{0} | {1}",
    Operation.NOT: "~{0}",
    Operation.SQUARE: "{0} * {0}",
    Operation.SIGN: "jnp.where({0} < 0.0, -1.0, jnp.where({0} > 0.0, 1.0, {0}))",
    Operation.SELECT: "jnp.where({0}, {1}, {2})",
    Operation.ATAN: "jnp.arctan({0})",
    Operation.ATAN2: "jnp.arctan2({0}, {1})",
    Operation.ABS: "jnp.abs({0})",
}
_CALLS = {operation: f"jnp.{name}" for operation, name in FUNCTIONS.items()}


RESERVED = frozenset([*keyword.kwlist, "jnp", "batch", "is_single", CHOICE])
"""Names that an argument must not have. An argument with a reserved name gets a trailing
underscore.
"""


def safe(name: str) -> str:
    """Return a valid name for an argument or a result."""
    return f"{name}_" if name in RESERVED else name


def definition(function: SymbolicFunction, described: Sequence[str], program: Program) -> str:
    """Return the Python source of a JAX function with its docstring.

    Args:
        function: The function.
        described: The lines of the docstring; the first line is the summary.
        program: The expression graph of the function, or of a single branch if the function has
            several branches.
    """
    first, *others = described
    slots = list(patterns(function)) if function.signs else []
    lines = [
        f"def {function.name}({', '.join(safe(a.name) for a in function.inputs)}):",
        *_wrapped(f'"""{first}', "    "),
        "",
        *(f"    {line}".rstrip() for line in others),
        '    """',
        f"    is_single, batch, ({_names(function.inputs)}) = _inputs(({_pairs(function.inputs)}))",
        *(f"    {line}" for line in _signs(slots)),
        *(f"    {line}" for line in _entries(function, program, is_branch=bool(slots))),
        *(f"    {line}" for line in _statements(program, single(program))),
        *(f"    {line}" for line in _results(function, program)),
    ]
    return "\n".join([*lines, ""])


def _names(inputs: Sequence[Argument]) -> str:
    return "".join(f"{safe(a.name)}, " for a in inputs).rstrip()


def _pairs(inputs: Sequence[Argument]) -> str:
    return "".join(f"({safe(a.name)}, {a.shape}), " for a in inputs).rstrip()


def _signs(slots: Sequence[tuple[int, ...]]) -> Iterator[str]:
    for k, signs in enumerate(zip(*slots, strict=True)):
        yield f"{CHOICE}_{k} = jnp.array({[float(sign) for sign in signs]}, _real(is_single))"
    if slots:
        yield f"batch = (*batch, {len(slots)})"


def _entries(function: SymbolicFunction, program: Program, *, is_branch: bool) -> Iterator[str]:
    name, shapes = naming(program), {a.name: a.shape for a in function.inputs}
    for entry in program.inputs:
        argument = program.arguments[entry.argument]
        if argument not in shapes:
            continue
        index = _index(shapes[argument], entry.entry)
        places = ["...", *map(str, index), *(["None"] if is_branch else [])]
        yield f"{name(entry)} = {safe(argument)}[{', '.join(places)}]"


def _index(shape: tuple[int, ...], entry: int) -> list[int]:
    found = []
    for size in reversed(shape):
        entry, k = divmod(entry, size)
        found.append(k)
    return found[::-1]


def _statements(program: Program, rounded: Program) -> Iterator[str]:
    name = naming(program)
    for double, float32 in zip(program.computed, rounded.computed, strict=True):
        terms = {
            operand: _constant(operand, other) if isinstance(operand, Constant) else name(operand)
            for operand, other in zip(double.operands, float32.operands, strict=True)
        }
        operands = [terms[operand] for operand in double.operands]
        if double.operation in _TEMPLATES:
            right = _TEMPLATES[double.operation].format(*operands)
        elif double.operation in _CALLS:
            right = f"{_CALLS[double.operation]}({', '.join(operands)})"
        else:
            right = expression(double, terms.__getitem__)
        yield f"{name(double.result)} = {right}"


def _constant(double: Constant, float32: Operand) -> str:
    assert isinstance(float32, Constant)
    if double == float32:
        return repr(double.value)
    return f"({float32.value!r} if is_single else {double.value!r})"


def _results(function: SymbolicFunction, program: Program) -> Iterator[str]:
    name = naming(program)
    for k, result in enumerate(function.outputs):
        shape = result.shape[1:] if function.signs else result.shape
        values = ", ".join(name(store.value) for store in _ordered(program.stored, k))
        wrapped = textwrap.wrap(f"[{values}]", WIDTH - 8, subsequent_indent=" ")
        yield f"{safe(result.name)} = _array("
        yield from (f"    {line}" for line in wrapped[:-1])
        yield f"    {wrapped[-1]},"
        yield f"    {shape}, batch, is_single,"
        yield ")"
    yield f"return {', '.join(safe(result.name) for result in function.outputs)}"


def _ordered(stored: Sequence[Store], output: int) -> list[Store]:
    return sorted((s for s in stored if s.output == output), key=lambda store: store.entry)


def _wrapped(text: str, indent: str) -> list[str]:
    return textwrap.wrap(text, WIDTH, initial_indent=indent, subsequent_indent=indent)
