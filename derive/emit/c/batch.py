"""Generates C that computes many poses in parallel with SIMD instructions.

``<robot>_lanes.h`` defines each function for SIMD vectors that hold one pose per lane.
``<robot>_batch.c`` compiles ``<robot>_lanes.h`` for each instruction set and selects the
instruction set at run time. On platforms other than x86-64 with glibc, a plain loop computes the
poses one after another. ``chasles_lanes.h`` and ``chasles_batch.h`` are the same for every robot.
"""

from collections.abc import Sequence

from ...model.mechanism import Described
from ...program.counting import count_operations
from ...program.operations import Program
from ...program.programs import Programs
from ...program.strength import reduced
from ...terms.symbolic_function import NativeSolverFunction, Signature, SymbolicFunction
from ..seeds import has_nearest
from .expressions import naming
from .header import notice, support
from .lanes import SUPPORT, Sizes, kernel, offsets, sizes
from .nearest import BATCH
from .sections import summary

RUN = "chasles_batch.h"
MAX_INPUTS, MAX_OUTPUTS, MAX_ARGUMENTS = 256, 512, 8
"""Array sizes in the support file ``chasles_batch.h``."""
_SETS = (
    (2, "avx512", " && CHASLES_HAS_AVX512"),
    (1, "avx2", " && CHASLES_HAS_AVX2"),
    (0, "baseline", ""),
)
"""Index, name and required processor feature of each instruction set. The instruction set with the
widest vectors is first.
"""


def files(
    robot: Described,
    functions: Sequence[SymbolicFunction],
    programs: Programs,
    written: Sequence[NativeSolverFunction] = (),
) -> dict[str, str]:
    """Return the C files that compute batches of poses, keyed by file name."""
    vector = [function for function in functions if has_lanes(function)]
    return {
        f"{robot.name}_batch.h": _header(robot, [*functions, *written]),
        f"{robot.name}_batch.c": _source(robot, [*functions, *written], vector),
        f"{robot.name}_lanes.h": _lanes(robot, vector, programs),
        SUPPORT: support(SUPPORT),
        RUN: support(RUN),
    }


def has_lanes(function: SymbolicFunction) -> bool:
    """Return whether SIMD lanes can compute a function.

    SIMD lanes compute only small functions that call no solver and compute no start values for
    other functions.
    """
    size = sizes(function)
    return (
        not function.role.is_start
        and not function.calls
        and sum(size.inputs) <= MAX_INPUTS
        and sum(size.outputs) <= MAX_OUTPUTS
        and max(len(function.inputs), len(function.outputs)) <= MAX_ARGUMENTS
    )


def _header(robot: Described, functions: Sequence[Signature]) -> str:
    guard = f"CHASLES_BATCH_OF_{robot.name.upper()}_H"
    declarations = "\n".join(f"{_signature(robot, function)};" for function in functions)
    return f"""\
{notice(robot)}
/* The functions of {robot.name}.h for n poses. Row k of every array belongs to pose k; rows are
 * contiguous. Outputs must not overlap inputs. The last digits may differ from the results of
 * {robot.name}.h. */
#ifndef {guard}
#define {guard}

#include <stddef.h>

#ifdef __cplusplus
extern "C" {{
#endif

{declarations}

#ifdef __cplusplus
}}
#endif

#endif
"""


def _source(robot: Described, functions: Sequence[Signature], vector: Sequence[Signature]) -> str:
    has_inverse = any(has_nearest(robot, function) for function in vector)
    headers = [SUPPORT, RUN, *([BATCH] if has_inverse else []), f"{robot.name}_lanes.h"]
    lines = "\n".join(f'#include "{header}"' for header in headers)
    included = "\n\n".join(
        f"#if CHASLES_SET_{name.upper()}\n#define CHASLES_ISA {number}\n{lines}\n"
        "#undef CHASLES_ISA\n#endif"
        for number, name, _ in _SETS
    )
    runs = "".join(_run(isa, condition) for _, isa, condition in _SETS)
    definitions = "\n".join(_definition(robot, f, f in vector) for f in functions)
    return f"""\
{notice(robot)}
#include "{robot.name}_batch.h"

#include <math.h>

#include "{robot.name}.h"

/* Compiles each x86-64 instruction set above the compiler flags, and selects a set at run time.
 * CHASLES_NO_DISPATCH selects the set of the compiler flags, CHASLES_PLAIN plain C. With clang,
 * the set is not selected at run time: without AVX flags, clang passes wide vectors to libmvec in
 * the wrong registers. */
#if defined(__clang__) && !defined(CHASLES_NO_DISPATCH)
#define CHASLES_NO_DISPATCH 1
#endif
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__has_builtin) && !defined(CHASLES_PLAIN)
#if __has_builtin(__builtin_shufflevector)
#define CHASLES_LANES 1
#if defined(__AVX512F__) || !defined(CHASLES_NO_DISPATCH)
#define CHASLES_SET_AVX512 1
#endif
#if !defined(__AVX512F__) && (defined(__AVX2__) || !defined(CHASLES_NO_DISPATCH))
#define CHASLES_SET_AVX2 1
#endif
#ifndef __AVX2__
#define CHASLES_SET_BASELINE 1
#endif
#endif
#endif

#ifdef __cplusplus
extern "C" {{
#endif

{included}

#ifdef __cplusplus
}}
#endif

#ifdef __clang__
#define CHASLES_HAS_AVX512 1
#define CHASLES_HAS_AVX2 1
#else
#define CHASLES_HAS_AVX512 \\
  (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && \\
   __builtin_cpu_supports("avx512vl"))
#define CHASLES_HAS_AVX2 (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
#endif

{runs}
{definitions}"""


def _definition(robot: Described, function: Signature, vector: bool) -> str:
    name = f"{robot.name}_{function.name}"
    size = sizes(function)
    pointers = [f"inputs[{i}] + k * input_steps[{i}]" for i in range(len(size.inputs))]
    pointers += [f"outputs[{i}] + k * output_steps[{i}]" for i in range(len(size.outputs))]
    steps_in, steps_out = (", ".join(map(str, rows)) for rows in (size.inputs, size.outputs))
    on_lanes = vector and has_nearest(robot, function)
    return f"""\
{_nearest(name, size, function) if on_lanes else ""}\
/* Accepts any row stride, in doubles. */
static void {name}_rows(size_t n, const double *const *inputs, const ptrdiff_t *input_steps,
    double *const *outputs, const ptrdiff_t *output_steps)
{{
{_choice(name, size) if vector else ""}\
  for (ptrdiff_t k = 0; k < (ptrdiff_t)n; k++) {{
    {name}({", ".join(pointers)});
  }}
}}

{_signature(robot, function)}
{{
  const double *const inputs[] = {{{", ".join(a.name for a in function.inputs)}}};
  double *const outputs[] = {{{", ".join(r.name for r in function.outputs)}}};
  const ptrdiff_t input_steps[] = {{{steps_in}}}, output_steps[] = {{{steps_out}}};
  {name}_rows(n, inputs, input_steps, outputs, output_steps);
}}
"""


def _choice(name: str, size: Sizes) -> str:
    runs = "".join(
        f"  CHASLES_RUN_{isa.upper()}(lanes_run, {name}, outputs, output_steps)\n"
        for _, isa, _ in _SETS
    )
    return f"""\
#if CHASLES_LANES
  static const int sizes[] = {{{", ".join(map(str, (*size.inputs, *size.outputs)))}}};
  static const lanes_shape shape = {{{len(size.inputs)}, {len(size.outputs)}, sizes}};
{runs}#endif
"""


def _nearest(name: str, size: Sizes, function: Signature) -> str:
    """Return the C macro that computes the nearest solutions on SIMD lanes.

    The C code that expands the macro must define the variables ``n``, ``inputs``, ``input_steps``,
    ``seeds``, ``outputs`` and ``slot``.
    """
    k, n = function.outputs[0].shape
    runs = " \\\n".join(
        f"  CHASLES_RUN_{isa.upper()}(lanes_nearest, {name}, {n}, {k}, &seeds, outputs, slot)"
        for _, isa, _ in _SETS
    )
    return f"""\
#if CHASLES_LANES
#define {name.upper()}_NEAREST_ROWS \\
  static const int sizes[] = {{{", ".join(map(str, (*size.inputs, *size.outputs)))}}}; \\
  static const lanes_shape shape = {{{len(size.inputs)}, {len(size.outputs)}, sizes}}; \\
{runs}
#endif

"""


def _run(isa: str, condition: str) -> str:
    name = isa.upper()
    return f"""\
#if CHASLES_SET_{name}
#define CHASLES_RUN_{name}(run, kernel, ...) \\
  if (n > 1{condition}) {{ \\
    run##_{isa}(kernel##_{isa}, &shape, n, inputs, input_steps, __VA_ARGS__); \\
    return; \\
  }}
#else
#define CHASLES_RUN_{name}(run, kernel, ...)
#endif
"""


def _signature(robot: Described, function: Signature) -> str:
    inputs = [f"const double *{argument.name}" for argument in function.inputs]
    outputs = [f"double *{result.name}" for result in function.outputs]
    return f"void {robot.name}_{function.name}_batch(size_t n, {', '.join(inputs + outputs)})"


def _lanes(robot: Described, functions: Sequence[SymbolicFunction], programs: Programs) -> str:
    parts = [
        notice(robot),
        f"/* {robot.name}.h on vector lanes: all inputs in one array, all outputs in another. */\n",
    ]
    for function in functions:
        program = programs.whole[function.name]
        sparing = "LANES_SPARING " if function.signs else ""
        head = f"static {sparing}LANES_TARGET void LANES_NAME({robot.name}_{function.name})"
        # Strength reduction replaces expensive square roots and angles. Only functions with
        # solution branches contain such operations.
        cheap = reduced(program) if function.signs else program
        lines = kernel(cheap, loads(cheap, sizes(function)), sizes(function))
        comment = f"// {function.name}: {summary(count_operations(cheap))}"
        head = f"{comment}\n{head}(const lanes *in, lanes *out)"
        parts.append("\n".join([head, "{", *lines, "}\n"]))
    return "\n".join(parts)


def loads(program: Program, size: Sizes) -> list[str]:
    """Return C lines that copy the consecutive inputs in the array ``in`` to named variables."""
    name, first = naming(program), offsets(size.inputs)
    lines = [
        f"  const lanes {name(e)} = in[{first[e.argument] + e.entry}];" for e in program.inputs
    ]
    return lines or ["  (void)in;"]
