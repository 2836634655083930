"""Generates C that computes all solution branches of one pose in parallel.

``<robot>.c`` includes ``<robot>_branches.h`` if the compiler supports AVX2 or AVX-512. Without AVX2
and AVX-512, plain C computes the solution branches one after another.
"""

from collections.abc import Sequence
from dataclasses import replace

from ...model.mechanism import Described
from ...program.counting import count_operations
from ...program.operations import Input, Operand, Operation, Program, Statement, Store, Variable
from ...program.programs import Programs
from ...program.strength import reduced
from ...terms.branches import branch, patterns
from ...terms.symbolic_function import SymbolicFunction
from .expressions import naming
from .header import notice
from .lanes import SUPPORT, Sizes, kernel, offsets, sizes
from .scalar import branches_file, branches_flag
from .sections import summary

WIDEST = 8
"""Number of solution branches that one AVX-512 vector contains."""


def files(
    robot: Described, functions: Sequence[SymbolicFunction], programs: Programs
) -> dict[str, str]:
    """Return the C header that computes solution branches in parallel, keyed by file name."""
    branched = [function for function in functions if function.signs]
    if not branched:
        return {}
    kernels = "\n".join(_branch(robot.name, f, programs.branch[f.name]) for f in branched)
    return {branches_file(robot): _header(robot, kernels, max(f.branches for f in branched))}


def _header(robot: Described, kernels: str, most: int) -> str:
    flag = branches_flag(robot)
    wide = (
        "#if defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512VL__)\n"
        "#define CHASLES_ISA 2\n#else\n#define CHASLES_ISA 1\n#endif"
    )
    return f"""\
{notice(robot)}
/* All branches of a function at once, one per vector lane, if the compiler's flags allow AVX2 or
 * AVX-512 on glibc; define CHASLES_PLAIN to use the plain C of {robot.name}.c everywhere. */
#ifndef {flag}
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__AVX2__) && defined(__FMA__) && \\
    defined(__has_builtin) && !defined(CHASLES_PLAIN)
#if __has_builtin(__builtin_shufflevector)
#define {flag} 1
{wide if most >= WIDEST else "#define CHASLES_ISA 1"}

#ifdef __cplusplus
extern "C" {{
#endif

#include "{SUPPORT}"

{kernels}
#ifdef __cplusplus
}}
#endif

#undef CHASLES_ISA
#endif
#endif
#endif
"""


def _branch(prefix: str, function: SymbolicFunction, program: Program) -> str:
    name = f"{prefix}_{function.name}"
    k, size = function.branches, sizes(branch(function))
    # The last argument of the branch function contains the branch signs. The last branch sign
    # alternates between neighboring SIMD lanes.
    fastest = Input(len(function.inputs), len(function.signs) - 1)
    program, alike = _angles_last(reduced(program, fastest), fastest)
    lines = kernel(program, _loads(function, program), size, alike)
    parameters = [f"const double *{a.name}" for a in function.inputs]
    head = (
        f"// One branch of {function.name}: {summary(count_operations(program))}\n"
        f"LANES_INLINE void LANES_NAME({name}_branch)(\n"
        f"    {', '.join(parameters)}, const double (*choice)[{max(k, WIDEST)}], int b, lanes *out)"
    )
    return "\n".join([head, "{", *lines, "}\n", _all_branches(name, function, size)])


def _loads(function: SymbolicFunction, program: Program) -> list[str]:
    name = naming(program)
    lines = []
    for entry in program.inputs:
        if entry.argument < len(function.inputs):
            argument = function.inputs[entry.argument].name
            lines.append(f"  const lanes {name(entry)} = LANES_OF({argument}[{entry.entry}]);")
        else:
            row = f"*(const LANES_NAME(lanes_row) *)(choice[{entry.entry}] + b)"
            lines.append(f"  const lanes {name(entry)} = {row};")
    return lines


def _all_branches(name: str, function: SymbolicFunction, size: Sizes) -> str:
    k, width, inputs = function.branches, sum(size.outputs), [a.name for a in function.inputs]
    given = [f"const double *{name}" for name in inputs]
    names = [result.name for result in function.outputs]
    results = [f"double *{result}" for result in names]
    rows = [
        f"    LANES_NAME(lanes_scatter)(from + {first}, {count}, LANES_COUNT({k}), "
        f"{result.name} + b * {count}, {count});"
        for result, count, first in zip(
            function.outputs, size.outputs, offsets(size.outputs), strict=True
        )
    ]
    return "\n".join(
        [
            f"LANES_INLINE void LANES_NAME({name}_lanes)(",
            f"    {', '.join([*given, f'lanes (*out)[{width}]'])})",
            "{",
            *_kernel_calls(name, function),
            "}\n",
            f"LANES_INLINE void LANES_NAME({name}_rows)(",
            f"    {', '.join([f'const lanes (*out)[{width}]', *results])})",
            "{",
            f"  for (int b = 0; b < {k}; b += LANES_COUNT({k})) {{",
            f"    const lanes *from = out[b / LANES_COUNT({k})];",
            *rows,
            "  }",
            "}\n",
            f"static LANES_SCHEDULED LANES_TARGET void LANES_NAME({name}_branches)(",
            f"    {', '.join([*given, *results])})",
            "{",
            f"  lanes out[{k} / LANES_COUNT({k})][{width}];",
            f"  LANES_NAME({name}_lanes)({', '.join([*inputs, 'out'])});",
            f"  LANES_NAME({name}_rows)({', '.join(['out', *names])});",
            "}\n",
        ]
    )


def _kernel_calls(name: str, function: SymbolicFunction) -> list[str]:
    k = function.branches
    width = max(k, WIDEST)
    # Unused SIMD lanes repeat the last branch, so that all lanes contain valid values.
    columns = [[*c, *[c[-1]] * (width - k)] for c in zip(*patterns(function), strict=True)]
    table = ",\n".join(f"    {{{', '.join(map(str, column))}}}" for column in columns)
    call = f"LANES_NAME({name}_branch)({', '.join(a.name for a in function.inputs)}, choice"
    two = ["#if LANES == 4", f"    {call}, b + 4, out[b / LANES + 1]);", "#endif"]
    return [
        f"  static const double choice[{len(columns)}][{width}] = {{\n{table}}};",
        f"  for (int b = 0; b < {k}; b += {WIDEST}) {{",
        f"    {call}, b, out[b / LANES]);",
        *(two if k >= WIDEST else ()),
        "  }",
    ]


def _angles_last(program: Program, sign: Input) -> tuple[Program, list[Variable]]:
    """Move arc tangents that do not depend on a given branch sign behind other operations.

    Args:
        program: Sequence of operations that computes a single solution branch.
        sign: Branch sign that alternates between neighboring SIMD lanes.

    Returns:
        The reordered operations, and the variables that contain the moved arc tangents.
    """
    varying: set[Operand] = {sign}
    late: set[Operand] = set()
    angles: list[Variable] = []
    for statement in program.computed:
        operands = set(statement.operands)
        if operands & varying:
            varying.add(statement.result)
        if operands & late.union(angles):
            late.add(statement.result)
        elif statement.result not in varying and statement.operation is Operation.ATAN2:
            angles.append(statement.result)

    def position(statement: Statement) -> int:
        if isinstance(statement, Store):
            return 2 if statement.value in late or statement.value in angles else 0
        return 2 if statement.result in late else int(statement.result in angles)

    return replace(program, statements=tuple(sorted(program.statements, key=position))), angles
