"""Prints the functions of a robot for CUDA."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ...derivation import Derivation
from ...program.operations import Program
from ...terms.symbolic_function import Argument, Result, Signature, SymbolicFunction
from ..c import expressions
from ..c.expressions import wrapped
from ..c.nearest import bounds, turns
from ..c_float.functions import SINGLE, Precision, statements
from ..precision.single import single
from ..reserved import RESERVED
from ..seeds import SeedInputs, counts

DOUBLE = Precision("double", expressions.number, {})
PRECISIONS = (SINGLE, DOUBLE)
POSE = "  const size_t pose = (size_t)blockIdx.x * blockDim.x + threadIdx.x;"
OWN = frozenset(["poses", "pose", "of", "by", "at", "slot", "own", "own_residual", "own_margin"])
"""Names of local variables in the generated CUDA functions. An argument with the name of a local
variable, or with a reserved name, gets a trailing underscore."""


def renamed(function: SymbolicFunction) -> SymbolicFunction:
    """Return the function with names that are valid in CUDA."""
    inputs = tuple(replace(a, name=_safe(a.name)) for a in function.inputs)
    outputs = tuple(replace(r, name=_safe(r.name)) for r in function.outputs)
    return replace(function, inputs=inputs, outputs=outputs)


def _safe(name: str) -> str:
    return f"{name}_" if name in RESERVED | OWN else name


def device_function(function: SymbolicFunction, program: Program, precision: Precision) -> str:
    """Return the CUDA device function for one pose."""
    program = replace(program, arguments=tuple(map(_safe, program.arguments)))
    program = single(program) if precision is SINGLE else program
    head = f"CHASLES_INLINE void {function.name}({', '.join(_columns(function, precision.kind))})"
    used = {program.arguments[entry.argument] for entry in program.inputs}
    unused = [f"  (void){a.name};" for a in function.inputs if a.name not in used]
    lines = [*unused, *statements(function, program, precision)]
    return "\n".join([*wrapped(head), "{", *lines, "}\n"])


def _columns(function: Signature, kind: str) -> list[str]:
    inputs = [f"column<const {kind}> {a.name}" for a in function.inputs]
    return inputs + [f"column<{kind}> {r.name}" for r in function.outputs]


def kernel(function: Signature) -> str:
    """Return the kernel of a function, with one thread for each pose."""
    inputs = [f"const Real *{a.name}" for a in function.inputs]
    outputs = [f"Real *{r.name}" for r in function.outputs]
    passed = [*map(_column, function.inputs), *map(_column, function.outputs)]
    return _kernel(function.name, [*inputs, *outputs], [f"{function.name}({', '.join(passed)});"])


def _column(value: Argument | Result) -> str:
    const = "const " if isinstance(value, Argument) else ""
    return f"column<{const}Real>({value.name} + pose, poses)"


def _kernel(name: str, arguments: Sequence[str], body: Sequence[str]) -> str:
    head = f"__global__ void __launch_bounds__(CHASLES_THREADS) {name}_kernel(size_t poses, "
    lines = [line for statement in body for line in wrapped(statement, "    ")]
    start = ["{", POSE, "  if (pose < poses) {"]
    heads = ["template <typename Real>", *wrapped(f"{head}{', '.join(arguments)})")]
    return "\n".join([*heads, *start, *lines, "  }", "}\n"])


@dataclass(frozen=True)
class Nearest:
    """A function that returns the solution nearest to a seed.

    Attributes:
        derivation: The derivation of the robot.
        inverse: The inverse.
        inputs: Inputs of the inverse kinematics function after the target.
    """

    derivation: Derivation
    inverse: SymbolicFunction
    inputs: SeedInputs

    @property
    def name(self) -> str:
        """The name of the generated function."""
        return f"{self.inverse.name}_nearest"

    def device_function(self, precision: Precision) -> str:
        """Return the CUDA device function for one pose."""
        kind, n = precision.kind, len(self.derivation.robot.coordinates)
        of, (target, *more) = f"<{kind}, {n}", renamed(self.inverse).inputs
        tables = ", ".join(f"{{{', '.join(row)}}}" for row in self._tables())
        inputs = ", ".join([target.name, *(f"&{a.name}" for a in more)])
        arguments = [f"column<const {kind}> {name}" for name in (target.name, "q_seed")]
        arguments += [f"const {kind} *{name}" for name in ("lower", "upper", "weights")]
        arguments += [f"{kind} *{name}" for name in ("q", "residual", "margin")]
        return "\n".join(
            [
                *wrapped(f"CHASLES_INLINE int {self.name}({', '.join(arguments)})"),
                "{",
                f"  slots{of}, {self.inverse.branches}> of;",
                *wrapped(f"moves{of}> by = {{{tables}}};", "  "),
                "  by.replace(lower, upper, weights);",
                *self._own_inputs(kind, [a.name for a in more]),
                f"  {self.inverse.name}({inputs}, of.q, of.residual, of.margin);",
                "#pragma unroll",
                f"  for (int j = 0; j < {n}; j++) {{",
                "    of.seed[j] = q_seed[j];",
                "  }",
                "  return of.nearest(by, q, residual, margin);",
                "}\n",
            ]
        )

    def _tables(self) -> list[Sequence[str]]:
        limits = [bounds(c.limits) for c in self.derivation.robot.coordinates]
        ones = [str(int(is_one)) for is_one in counts(self.derivation, self.inverse)]
        return [*zip(*limits, strict=True), ones, turns(self.derivation, self.inverse)]

    def _own_inputs(self, kind: str, names: Sequence[str]) -> list[str]:
        own = self.inputs
        source = "own" if own.function else "q_seed"
        call = [f"  {kind} own[{own.size}];", f"  {own.function}(q_seed, own);"]
        pairs = zip(names, own.entries, strict=True)
        values = [f"  const {kind} {name} = {source}[{k}];" for name, k in pairs]
        return [*(call if own.function else ()), *values]

    def kernel(self) -> str:
        """Return the CUDA kernel, which uses the same limits and weights for all poses."""
        n, target = len(self.derivation.robot.coordinates), renamed(self.inverse).inputs[0]
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
