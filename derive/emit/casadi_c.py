"""Writes C with the generator of CasADi and its interface, for ``casadi.external``.

The default C (``emit/c``) is printed from typed programs and has a different interface. This output
language is for programs that pass robot functions to CasADi. The C functions have the names
``<robot>_<function>``, take and return dense vectors in row-major order, and include the
derivatives ``jac_<robot>_<function>``.

A CasADi rootfinder closes loops without a closed form. Functions with branches (inverses) have no
CasADi graph and are omitted. Velocities through loops without a closed form are derivatives, and
are also omitted.
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
    """Returns the C file, keyed by name, or {} if no function has a CasADi graph."""
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
    """Returns a comment that names the public functions that the file omits, or an empty text."""
    others = (f for f in (*derivation.functions, *derivation.written) if f not in functions)
    names = ", ".join(f.name for f in others if not f.role.is_intermediate)
    if not names:
        return ""
    text = f"Only in the default C, because of branches, solvers or rates through loops: {names}."
    lines = textwrap.wrap(text, WIDTH - 3)
    return "\n".join([f"/* {lines[0]}", *(f" * {line}" for line in lines[1:]), " */\n"])


def _through_loops(
    derivation: Derivation, functions: Sequence[SymbolicFunction]
) -> Iterator[ca.Function]:
    """Builds the position functions that call loop solvers; their vectors are dense and row-major.

    The solver for an arbitrary geometry starts from the nominal joint positions.
    """
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
