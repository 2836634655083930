"""Prints the functions of a robot as device functions and kernels for CUDA."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, replace

from ...derivation import Derivation
from ...program.operations import Program
from ...terms.symbolic_function import Argument, Result, Signature, SymbolicFunction
from ..c import expressions
from ..c.expressions import WIDTH
from ..c.nearest import bounds, parameters, seeded, turns, wraps_of
from ..c.windings import shares_limits
from ..c_float.functions import SINGLE, Precision, statements
from ..cpp.header import RESERVED, safe
from ..precision.single import single

DOUBLE = Precision("double", expressions.number, {})
PRECISIONS = (SINGLE, DOUBLE)
OWN = frozenset(["poses", "pose", "of", "by", "at", "slot", "own_residual", "own_margin"])
"""Names of the local variables in the printed functions. An argument with one of these names, or
with a reserved name of C++, gets a trailing underscore."""


def renamed(function: SymbolicFunction) -> SymbolicFunction:
    """Returns a function whose arguments and results have names that are valid in CUDA."""
    inputs = tuple(replace(a, name=_safe(a.name)) for a in function.inputs)
    outputs = tuple(replace(r, name=_safe(r.name)) for r in function.outputs)
    return replace(function, inputs=inputs, outputs=outputs)


def _safe(name: str) -> str:
    return f"{name}_" if name in RESERVED | OWN else name


def device_function(function: SymbolicFunction, program: Program, precision: Precision) -> str:
    """Returns the device function for one pose in one precision, for all branches of an inverse."""
    program = replace(program, arguments=tuple(map(_safe, program.arguments)))
    program = single(program) if precision is SINGLE else program
    head = f"CHASLES_INLINE void {function.name}({', '.join(_columns(function, precision.kind))})"
    used = {program.arguments[entry.argument] for entry in program.inputs}
    unused = [f"  (void){a.name};" for a in function.inputs if a.name not in used]
    lines = [*unused, *statements(function, program, precision)]
    return "\n".join([*_wrapped(head), "{", *lines, "}\n"])


def _columns(function: Signature, kind: str) -> list[str]:
    inputs = [f"column<const {kind}> {a.name}" for a in function.inputs]
    return inputs + [f"column<{kind}> {r.name}" for r in function.outputs]


def kernel(function: Signature) -> str:
    """Returns the kernel of a function, with one thread for each pose."""
    inputs = [f"const Real *{a.name}" for a in function.inputs]
    outputs = [f"Real *{r.name}" for r in function.outputs]
    passed = [*map(_column, function.inputs), *map(_column, function.outputs)]
    return _kernel(function.name, [*inputs, *outputs], [f"{function.name}({', '.join(passed)});"])


def _column(value: Argument | Result) -> str:
    const = "const " if isinstance(value, Argument) else ""
    return f"column<{const}Real>({value.name} + pose, poses)"


def _kernel(name: str, arguments: Sequence[str], body: Sequence[str]) -> str:
    head = f"__global__ void __launch_bounds__(CHASLES_THREADS) {name}_kernel(size_t poses, "
    lines = [line for statement in body for line in _wrapped(statement, "    ")]
    start = ["{", "  const size_t pose = own_pose();", "  if (pose < poses) {"]
    wrapped = _wrapped(f"{head}{', '.join(arguments)})")
    return "\n".join(["template <typename Real>", *wrapped, *start, *lines, "  }", "}\n"])


@dataclass(frozen=True)
class Nearest:
    """A function that returns the nearest solution of an inverse.

    Attributes:
        derivation: The derivation of the robot.
        function: The inverse, with names that are valid in CUDA.
    """

    derivation: Derivation
    function: SymbolicFunction

    @property
    def name(self) -> str:
        """The name of the printed function."""
        return f"{self.function.name}_nearest"

    def device_function(self, precision: Precision) -> str:
        """Returns the device function for one pose in one precision."""
        kind, n = precision.kind, len(self.derivation.robot.coordinates)
        of, (target, *more) = f"<{kind}, {n}", self.function.inputs
        tables = ", ".join(f"{{{', '.join(row)}}}" for row in self._tables())
        inputs = ", ".join([target.name, *(f"&{a.name}" for a in more)])
        arguments = [f"column<const {kind}> {name}" for name in (target.name, "q_seed")]
        arguments += [f"const {kind} *{name}" for name in ("lower", "upper", "weights")]
        arguments += [f"{kind} *{name}" for name in ("q", "residual", "margin")]
        return "\n".join(
            [
                *_wrapped(f"CHASLES_INLINE int {self.name}({', '.join(arguments)})"),
                "{",
                f"  slots{of}, {self.function.outputs[0].shape[0]}> of;",
                *_wrapped(f"moves{of}> by = {{{tables}}};", "  "),
                "  by.replace(lower, upper, weights);",
                *self._own_inputs(kind),
                f"  {self.function.name}({inputs}, of.q, of.residual, of.margin);",
                "#pragma unroll",
                f"  for (int j = 0; j < {n}; j++) {{",
                "    of.seed[j] = q_seed[j];",
                "  }",
                "  return of.nearest(by, q, residual, margin);",
                "}\n",
            ]
        )

    def _tables(self) -> list[Sequence[str]]:
        """Returns the limits, the weights and the periods of the coordinates."""
        coordinates, role = self.derivation.robot.coordinates, self.function.role
        lower, upper = zip(*(bounds(c.limits) for c in coordinates), strict=True)
        fixed = {*role.fixed, *role.free}
        ones = ["0" if k in fixed else "1" for k in range(len(coordinates))]
        return [lower, upper, ones, turns(self.derivation, self.function)]

    def _own_inputs(self, kind: str) -> list[str]:
        """Returns the lines that compute the further inputs of the inverse from the seed."""
        name = self.derivation.robot.name
        lines = parameters(self.derivation, self.function) or []
        # The namespace distinguishes a function from a variable of the same name.
        called = (line.replace(f"  {name}_", f"  {safe(name)}::") for line in lines)
        return [line.replace("double ", f"{kind} ") for line in called]

    def kernel(self) -> str:
        """Returns the kernel, with the same limits and weights for all poses."""
        n, target = len(self.derivation.robot.coordinates), self.function.inputs[0]
        arguments = [f"const Real *{name}" for name in (target.name, "q_seed")]
        arguments += [f"const Real *{name}" for name in ("lower", "upper", "weights")]
        arguments += [f"Real *{name}" for name in ("q", "residual", "margin")] + ["int *slot"]
        passed = f"{_column(target)}, column<const Real>(q_seed + pose, poses), lower, upper"
        body = [
            f"Real at[{n}], own_residual, own_margin;",
            f"slot[pose] = {self.name}({passed}, weights, at, &own_residual, &own_margin);",
            f"for (int j = 0; j < {n}; j++) {{",
            "  q[j * poses + pose] = at[j];",
            "}",
            "residual[pose] = own_residual;",
            "margin[pose] = own_margin;",
        ]
        return _kernel(self.name, arguments, body)


def nearest_of(derivation: Derivation, functions: Sequence[SymbolicFunction]) -> list[Nearest]:
    """Returns the functions for the nearest solutions of the printed inverses.

    A robot has no such function if couplings require a search over windings, or if an input of its
    inverse is computed by a function that is not printed.
    """
    printed, inverses = {f.name for f in functions}, {f.name for f in seeded(derivation)}
    if shares_limits(derivation, wraps_of(derivation)):
        return []
    found = [Nearest(derivation, f) for f in map(renamed, functions) if f.name in inverses]
    return [nearest for nearest in found if _called(nearest) <= printed]


def _called(nearest: Nearest) -> set[str]:
    """Returns the names of functions that compute further inputs of the inverse from the seed."""
    prefix = f"  {nearest.derivation.robot.name}_"
    lines = parameters(nearest.derivation, nearest.function) or []
    return {line.removeprefix(prefix).split("(")[0] for line in lines if line.startswith(prefix)}


def _wrapped(line: str, indent: str = "") -> list[str]:
    return textwrap.wrap(line, WIDTH, initial_indent=indent, subsequent_indent=f"{indent}    ")
