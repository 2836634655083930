"""Prints the functions of a robot as a C table and as MATLAB functions."""

import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

from ...derivation import Derivation
from ...terms.symbolic_function import Argument, Result, Signature
from ..c.expressions import WIDTH
from ..c.header import notice
from ..seeds import nearest_summary, seeded

_KEYWORDS = (
    "break case catch classdef continue else elseif end for function global if otherwise parfor "
    "persistent return spmd switch try while"
)
_RESERVED = frozenset(_KEYWORDS.split())
"""Keywords of MATLAB. An argument or result that has the name of a keyword gets a trailing
underscore."""


@dataclass(frozen=True)
class Array:
    """An input or output of a MATLAB function.

    Attributes:
        name: Name in MATLAB.
        meaning: Meaning and unit of the array entries.
        shape: Sizes in MATLAB.
        has_columns: Whether C stores one solution per row and MATLAB one solution per column.
        is_condition: Whether the entries are booleans.
    """

    name: str
    meaning: str
    shape: tuple[int, ...]
    has_columns: bool = False
    is_condition: bool = False

    @property
    def size(self) -> int:
        """Number of entries."""
        return math.prod(self.shape)

    @property
    def sizes(self) -> str:
        """The shape of the array as text."""
        return " x ".join(map(str, self.shape))


@dataclass(frozen=True)
class Function:
    """A MATLAB function.

    Attributes:
        name: Name of the C function without the robot's prefix.
        summary: Description of the function, as lines of text.
        inputs: The inputs.
        required: Number of required inputs.
        outputs: The outputs.
        body: C statements that read the inputs ``in`` and write the outputs ``out``.
    """

    name: str
    summary: tuple[str, ...]
    inputs: tuple[Array, ...]
    required: int
    outputs: tuple[Array, ...]
    body: tuple[str, ...]


def functions(derivation: Derivation) -> list[Function]:
    """Return the MATLAB functions of a robot."""
    found = [
        f
        for f in (*derivation.functions, *derivation.written)
        if f.role.has_slots or not f.role.is_intermediate
    ]
    return [
        *(_function(derivation, f) for f in found),
        *(_nearest(derivation, f) for f in seeded(derivation)),
    ]


def table(derivation: Derivation, listed: Sequence[Function]) -> str:
    """Return the C header with the table of functions."""
    name = derivation.robot.name
    calls: list[str] = []
    rows: list[str] = []
    for f in listed:
        calls += [f"static void call_{f.name}(const double *const *in, double *const *out)", "{"]
        calls += [*(f"  {line}" for line in f.body), "}\n"]
        rows += [
            f'  {{"{f.name}", {len(f.inputs)}, {f.required}, {len(f.outputs)},',
            f"   {{{', '.join(map(_array, f.inputs))}}},",
            f"   {{{', '.join(map(_array, f.outputs))}}},",
            f"   call_{f.name}}},",
        ]
    head = [notice(derivation.robot), '#include "chasles_functions.h"', f'#include "{name}.h"', ""]
    ends = [f"static const chasles_function {name}_functions[] = {{", *rows, "};", ""]
    return "\n".join([*head, *calls, *ends])


def _array(array: Array) -> str:
    shape = ", ".join(map(str, [*array.shape, 1, 1][:3]))
    flags = f"{int(array.has_columns)}, {int(array.is_condition)}"
    return f'{{"{array.name}", {{{shape}}}, {flags}}}'


def help_file(derivation: Derivation, function: Function) -> str:
    """Return the MATLAB file with the help text of a function."""
    robot = derivation.robot.name
    name = f"{robot}_{function.name}"
    inputs = [array.name for array in function.inputs]
    outputs = ", ".join(array.name for array in function.outputs)
    result = outputs if len(function.outputs) == 1 else f"[{outputs}]"
    call = f"{result} = {name}({', '.join(inputs[: function.required])})"
    first, *others = function.summary
    lines = [f"{name.upper()}  {first}", *(f"  {line}" for line in others), f"  {call}"]
    if function.required < len(inputs):
        lines.append(f"  {result} = {name}({', '.join(inputs)})")
    lines += [f"  {a.name}: {a.meaning}, {a.sizes}" for a in (*function.inputs, *function.outputs)]
    lines.append("  For N configurations, each array has a further dimension of size N.")
    comment = [
        f"% {part}"
        for line in lines
        for part in textwrap.wrap(line, WIDTH - 2, subsequent_indent="    ") or [""]
    ]
    passed = "varargin{:}" if function.required < len(inputs) else ", ".join(inputs)
    arguments = "varargin" if function.required < len(inputs) else passed
    body = f"{result} = chasles_{robot}('{function.name}', {passed});"
    return "\n".join([f"function {result} = {name}({arguments})", *comment, body, "end", ""])


def _safe(name: str) -> str:
    return f"{name}_" if name in _RESERVED else name


def _of(value: Argument | Result, *, has_slots: bool = False) -> Array:
    shape, meaning = value.shape or (1,), f"{value.meaning} ({value.unit})"
    if len(shape) == 1:
        return Array(_safe(value.name), meaning, (*shape, 1))
    if has_slots:
        meaning = meaning.replace(" per row", " per column")
        return Array(_safe(value.name), meaning, shape[::-1], has_columns=True)
    return Array(_safe(value.name), meaning, shape)


def _function(derivation: Derivation, function: Signature) -> Function:
    inputs = tuple(_of(argument) for argument in function.inputs)
    outputs = [_of(result, has_slots=function.role.has_slots) for result in function.outputs]
    places, further = list(range(len(outputs))), []
    if function.role.is_inverse:
        slots = function.outputs[0].shape[0]
        valid = Array(
            "valid", "whether each column of q is a solution", (slots, 1), is_condition=True
        )
        outputs.insert(1, valid)
        places = [0, 2, 3]
        further = [
            f"for (int k = 0; k < {slots}; k++) {{",
            "  out[1][k] = out[2][k] <= CHASLES_SOLVED;",
            "}",
        ]
    passed = [*(f"in[{k}]" for k in range(len(inputs))), *(f"out[{k}]" for k in places)]
    call = f"{derivation.robot.name}_{function.name}({', '.join(passed)});"
    return Function(
        function.name,
        (function.summary, *textwrap.wrap(function.identity, WIDTH - 8)),
        inputs,
        len(inputs),
        tuple(outputs),
        (call, *further),
    )


def _nearest(derivation: Derivation, function: Signature) -> Function:
    n, target = len(derivation.robot.coordinates), _of(function.inputs[0])
    column = (n, 1)
    optional = [
        Array("lower", "lower limits; [] means the limits of the robot", column),
        Array("upper", "upper limits; [] means the limits of the robot", column),
        Array("weights", "weights of the displacements; [] for 1", column),
    ]
    inputs = (target, Array("q_seed", "start configuration (rad or m)", column), *optional)
    outputs = (
        Array("q", "coordinates, NaN without a solution (rad or m)", column),
        Array("slot", "number of the solution in ik; -1 out of reach, -2 outside limits", (1, 1)),
        Array("residual", "distance of fk(q) from the target (m or rad)", (1, 1)),
        Array("margin", "distance from the boundary of the reachable set", (1, 1)),
    )
    name = f"{function.name}_nearest"
    passed = [f"in[{k}]" for k in range(5)] + ["out[0]", "out[2]", "out[3]"]
    call = f"const int slot = {derivation.robot.name}_{name}({', '.join(passed)});"
    body = (call, "out[1][0] = slot < 0 ? slot : slot + 1;")
    return Function(name, tuple(nearest_summary(function)), inputs, 2, outputs, body)
