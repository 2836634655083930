"""The C that CasADi's own generator prints, with CasADi's interface: ``casadi.external`` loads it.

The C of chasles is printed from typed programs (``emit/c``) and has an interface of its own. This
language serves programs that hand functions of a robot to CasADi. Its functions are named
``<robot>_<function>``, take and return dense vectors in row-major order, and come with their
derivatives, ``jac_<robot>_<function>``.

Functions with branches (inverses) and functions that close loops by iteration have no graph of
scalars, and are left out.
"""

import casadi as ca

from ..derivation import Derivation
from ..program.programs import Programs
from ..terms.casadi_graph import lower


def files(derivation: Derivation, _: Programs) -> dict[str, str]:
    """The C file, by name; none if no function has a graph of scalars."""
    functions = [function for function in derivation.functions if not function.signs]
    if not functions:
        return {}
    name = f"{derivation.robot.name}_casadi.c"
    generator = ca.CodeGenerator(name)
    for function in lower(functions, derivation.robot.name):
        generator.add(function)
        generator.add(function.jacobian())
    return {name: generator.dump()}
