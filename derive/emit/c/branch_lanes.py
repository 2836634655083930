"""The C of functions with branches for one pose: all branches at once, a branch a lane.

``<robot>_branches.h`` is what ``<robot>.c`` takes where the compiler's flags allow AVX2 or AVX-512;
elsewhere that file has the branches one after the other, in plain C.
"""

import re
from collections.abc import Sequence
from dataclasses import replace

from ...model.mechanism import Described
from ...program.statements import Body, Compute, Store, bodies
from ...program.strength import reduced
from ...terms.branches import branch, patterns
from ...terms.casadi_graph import lower_branch
from ...terms.symbolic_function import SymbolicFunction
from .lanes import SUPPORT, Sizes, kernel, offsets, sizes
from .scalar import branches_file, branches_flag, notice

WIDEST = 8
"""Branches that one vector of AVX-512 holds."""
_WORD = re.compile(r"\w+")


def files(robot: Described, functions: Sequence[SymbolicFunction]) -> dict[str, str]:
    """The header of a robot's branches, by file name; none for a robot without branches."""
    branched = [function for function in functions if function.signs]
    if not branched:
        return {}
    lowered = [lower_branch(function, robot.name) for function in branched]
    pairs = zip(branched, bodies(lowered), strict=True)
    kernels = "\n".join(_branch(robot.name, *pair) for pair in pairs)
    return {branches_file(robot): _header(robot, kernels, max(f.branches for f in branched))}


def _header(robot: Described, kernels: str, most: int) -> str:
    flag = branches_flag(robot)
    wide = (
        "#if defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512VL__)\n"
        "#define CHASLES_ISA 2\n#else\n#define CHASLES_ISA 1\n#endif"
    )
    return f"""\
{notice(robot)}
/* All branches of a function at once, a branch a lane, where the compiler's flags allow AVX2 or
 * AVX-512 on glibc; define CHASLES_PLAIN to have the plain C of {robot.name}.c everywhere. */
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


def _branch(prefix: str, function: SymbolicFunction, body: Body) -> str:
    """The C of a function's branches: some of them on lanes, and the function of one pose."""
    name = f"{prefix}_{function.name}"
    k, n_signs = function.branches, len(function.signs)
    of = sizes(branch(function))
    fastest = f"choice_{n_signs - 1}"
    body, alike = _angles_last(reduced(body, fastest), fastest)
    lines = kernel(body, _loads(function, body), of, alike)
    parameters = [f"const double *{a.name}" for a in function.inputs]
    head = (
        f"LANES_INLINE void LANES_NAME({name}_branch)(\n"
        f"    {', '.join(parameters)}, const double (*choice)[{max(k, WIDEST)}], int b, lanes *out)"
    )
    return "\n".join([head, "{", *lines, "}\n", _all_branches(name, function, of)])


def _loads(function: SymbolicFunction, body: Body) -> list[str]:
    lines = []
    for i, k in body.loads:
        if i < len(function.inputs):
            name = function.inputs[i].name
            lines.append(f"  const lanes {name}_{k} = LANES_OF({name}[{k}]);")
        else:
            row = f"*(const LANES_NAME(lanes_row) *)(choice[{k}] + b)"
            lines.append(f"  const lanes choice_{k} = {row};")
    return lines


def _all_branches(name: str, function: SymbolicFunction, of: Sizes) -> str:
    """The function of one pose: kernels, then lanes to rows."""
    k = function.branches
    width = max(k, WIDEST)
    # Lanes without a branch repeat the last one, so that they compute something tame.
    columns = [[*c, *[c[-1]] * (width - k)] for c in zip(*patterns(function), strict=True)]
    table = ",\n".join(f"    {{{', '.join(map(str, column))}}}" for column in columns)
    call = f"LANES_NAME({name}_branch)({', '.join(a.name for a in function.inputs)}, choice"
    lines = [
        f"  static const double choice[{len(columns)}][{width}] = {{\n{table}}};",
        f"  enum {{ BRANCHES = {k}, COUNT = BRANCHES < LANES ? BRANCHES : LANES }};",
        f"  lanes out[BRANCHES / COUNT][{sum(of.outputs)}];",
        f"  for (int b = 0; b < BRANCHES; b += {WIDEST}) {{",
        f"    {call}, b, out[b / COUNT]);",
    ]
    if k >= WIDEST:
        lines += ["#if LANES == 4", f"    {call}, b + 4, out[b / COUNT + 1]);", "#endif"]
    lines += [
        "  }",
        "  for (int b = 0; b < BRANCHES; b += COUNT) {",
        "    const lanes *from = out[b / COUNT];",
    ]
    for result, size, first in zip(function.outputs, of.outputs, offsets(of.outputs), strict=True):
        rows = f"(from + {first}, {size}, COUNT, {result.name} + b * {size}, {size})"
        lines.append(f"    LANES_NAME(lanes_scatter){rows};")
    lines.append("  }")
    parameters = [f"const double *{a.name}" for a in function.inputs]
    parameters += [f"double *{r.name}" for r in function.outputs]
    head = f"static LANES_SCHEDULED LANES_TARGET void LANES_NAME({name}_branches)"
    return "\n".join([f"{head}({', '.join(parameters)})", "{", *lines, "}\n"])


def _angles_last(body: Body, sign: str) -> tuple[Body, list[str]]:
    """A body with the angles that do not depend on a sign, and what depends on them, at its end.

    Returns:
        The body, and the names of those angles.
    """
    varying, late = {sign}, set[str]()
    angles: list[str] = []
    for statement in body.computed:
        parts = set(_WORD.findall(statement.expression))
        if parts & varying:
            varying.add(statement.name)
        if parts & late.union(angles):
            late.add(statement.name)
        elif statement.name not in varying and statement.expression.startswith("atan2("):
            angles.append(statement.name)

    def place(statement: Compute | Store) -> int:
        if isinstance(statement, Store):
            return 2 if statement.value in late or statement.value in angles else 0
        return 2 if statement.name in late else int(statement.name in angles)

    return replace(body, statements=tuple(sorted(body.statements, key=place))), angles
