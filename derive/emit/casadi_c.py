"""The C that CasADi's own generator prints, with CasADi's interface: ``casadi.external`` loads it.

The C of chasles is printed from typed programs (``emit/c``) and has an interface of its own. This
language serves programs that hand functions of a robot to CasADi. Its functions are named
``<robot>_<function>``, take and return dense vectors in row-major order, and come with their
derivatives, ``jac_<robot>_<function>``.

Loops without a closed form are closed by CasADi's rootfinder. Functions with branches (inverses)
have no graph, and are left out, as are velocities through such loops: they are derivatives.
"""

from collections.abc import Iterator, Sequence

import casadi as ca

from ..derivation import Derivation
from ..loops.parametric.parametric_loops import START
from ..program.programs import Programs
from ..terms.casadi_graph import lower
from ..terms.symbolic_function import SymbolicFunction
from .casadi_loops import is_of_positions, with_loops


def files(derivation: Derivation, _: Programs) -> dict[str, str]:
    """The C file, by name; none if no function has a graph."""
    functions = [f for f in derivation.functions if not f.signs and is_of_positions(f)]
    if not functions:
        return {}
    name = f"{derivation.robot.name}_casadi.c"
    generator = ca.CodeGenerator(name)
    plain = lower([f for f in functions if not f.calls], derivation.robot.name)
    for function in (*plain, *_through_loops(derivation, functions)):
        generator.add(function)
        generator.add(function.jacobian())
    return {name: generator.dump()}


def _through_loops(
    derivation: Derivation, functions: Sequence[SymbolicFunction]
) -> Iterator[ca.Function]:
    """The functions of positions that call solvers of loops, with dense vectors, row by row.

    The solver of any geometry starts from the joints of the nominal robot.
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
