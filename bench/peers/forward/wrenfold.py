"""wrenfold generates C++ from the equations in `formulas.py` during the benchmark."""

from wrenfold import code_generation, sym, type_annotations
from wrenfold.code_generation import OutputArg

from tests.support.native import Source

from ...cases.arms import Arm
from ...native.library import Loop, headers, loop
from .formulas import fk_jacobian

MAIN = """
#include "generated.h"
template <int rows, int columns, typename T> static auto span(T *data)
{{
    return wf::make_span(data, wf::make_constant_value_pack<rows, columns>(),
                         wf::make_constant_value_pack<columns, 1>());
}}
static void fk(void *, const double *q, double *T)
{{
    gen::pose<double>(span<{n}, 1>(q), span<4, 4>(T));
}}
static void fk_jacobian(void *, const double *q, double *T, double *J)
{{
    gen::both<double>(span<{n}, 1>(q), span<4, 4>(T), span<6, {n}>(J));
}}
#include "loop.h"
"""


def loops(arm: Arm) -> list[Loop]:
    files = {"main.cpp": MAIN.format(n=arm.joints), "generated.h": _generated(arm)}
    folder = headers("wrenfold", "/wrenfold/span.h")
    source = Source(f"wrenfold-{arm.name}", files, (f"-isystem{folder}",))
    return [loop("wrenfold", arm.joints, source)]


def _generated(arm: Arm) -> str:
    vector = getattr(type_annotations, f"Vector{arm.joints}")

    def both(q):
        T, J = fk_jacobian(arm, [q[k] for k in range(arm.joints)], sym.cos, sym.sin)
        return [OutputArg(sym.matrix(T), "T"), OutputArg(sym.matrix(J), "J")]

    def pose(q):
        return both(q)[:1]

    generator = code_generation.CppGenerator()
    texts = []
    for function in (pose, both):
        function.__annotations__["q"] = vector
        texts.append(code_generation.generate_function(function, generator))
    return generator.apply_preamble("\n".join(texts), namespace="gen")
