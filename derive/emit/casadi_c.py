"""Writes C with the code generator of CasADi.

The default C output of chasles has a different interface. The C code that CasADi generates is for
programs that call robot functions through ``casadi.external``. The C functions have the names
``<robot>_<function>`` and use dense row-major vectors. The derivatives of the C functions have the
names ``jac_<robot>_<function>``.

A CasADi rootfinder solves loops that have no closed-form solution. Inverse kinematics functions
with several branches have no CasADi graph and are omitted. For robots whose loops are solved by
iteration, velocity functions are omitted. The derivatives of the position functions replace the
omitted velocity functions.
"""

import textwrap
from collections.abc import Iterator, Sequence

import casadi as ca

from ..derivation import Derivation
from ..loops.parametric.parametric_loops import START
from ..program.programs import Programs
from ..terms.casadi_graph import lower
from ..terms.symbolic_function import SymbolicFunction
from .c.expressions import WIDTH
from .casadi_loops import is_of_positions, with_loops


def files(derivation: Derivation, _: Programs) -> dict[str, str]:
    """Return the C file, keyed by name, or {} if no function has a CasADi graph."""
    functions = [f for f in derivation.functions if not f.signs and is_of_positions(f)]
    if not functions:
        return {}
    name = f"{derivation.robot.name}_casadi.c"
    generator = ca.CodeGenerator(name)
    plain = lower([f for f in functions if not f.calls], derivation.robot.name)
    for function in (*plain, *_through_loops(derivation, functions)):
        generator.add(function)
        generator.add(function.jacobian())
    return {name: f"{_missing(derivation, functions)}{generator.dump()}"}


def _missing(derivation: Derivation, functions: Sequence[SymbolicFunction]) -> str:
    others = (f for f in (*derivation.functions, *derivation.written) if f not in functions)
    names = ", ".join(f.name for f in others if not f.role.is_intermediate)
    if not names:
        return ""
    text = f"Only in the default C, because of branches, iterative solvers or loop rates: {names}."
    lines = textwrap.wrap(text, WIDTH - 3)
    return "\n".join([f"/* {lines[0]}", *(f" * {line}" for line in lines[1:]), " */\n"])


def _through_loops(
    derivation: Derivation, functions: Sequence[SymbolicFunction]
) -> Iterator[ca.Function]:
    kept = [f for f in functions if f.calls or f.name == START]
    if not any(f.calls for f in kept):
        return
    joined = with_loops(derivation, kept)
    inputs = dict(zip(joined.name_in(), joined.mx_in(), strict=True))
    outputs = joined.call(list(inputs.values()))
    for function, output in zip(kept, outputs, strict=True):
        if function.calls:
            names = [argument.name for argument in function.inputs]
            name = f"{derivation.robot.name}_{function.name}"
            given = [inputs[n] for n in names]
            yield ca.Function(name, given, [ca.vec(output.T)], names, [function.name])
