"""The programs of all functions of a derivation, the source for every language."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..terms.branches import patterns
from ..terms.casadi_graph import lower
from ..terms.symbolic_function import SymbolicFunction
from .finite_targets import seeing_its_inputs
from .operations import Program
from .reading import programs as read_programs
from .unrolling import unrolled


@dataclass(frozen=True)
class Programs:
    """The programs of a robot's functions.

    Attributes:
        whole: The program of each function by name. The program of a function with branches
            computes all branches in order.
        branch: The single-branch program of each function with branches; its last argument
            ``choice`` contains the signs.
    """

    whole: Mapping[str, Program]
    branch: Mapping[str, Program]

    def alone(self, function: SymbolicFunction) -> Program:
        """Returns the single-branch program; the whole program for a function without branches."""
        return self.branch.get(function.name) or self.whole[function.name]


NO_PROGRAMS = Programs({}, {})
"""Empty programs, for output languages that print equations."""


def programs(functions: Sequence[SymbolicFunction], prefix: str) -> Programs:
    """Translates functions to CasADi and reads the generated programs.

    Args:
        functions: Functions over the same terms.
        prefix: The robot's name, the prefix of the program names.

    Raises:
        LoweringError: No rule converts an expression or an operation.
    """
    read = [
        seeing_its_inputs(program) if f.role.finds_coordinates else program
        for f, program in zip(functions, read_programs(lower(functions, prefix)), strict=True)
    ]
    branch = {f.name: program for f, program in zip(functions, read, strict=True) if f.signs}
    whole = {
        f.name: unrolled(program, patterns(f), f"{prefix}_{f.name}") if f.signs else program
        for f, program in zip(functions, read, strict=True)
    }
    return Programs(whole, branch)
