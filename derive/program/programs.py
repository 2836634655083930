"""The programs of everything that was derived: what every language is printed from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..terms.casadi_graph import lower, lower_branch
from ..terms.symbolic_function import SymbolicFunction
from .operations import Program
from .reading import programs as programs_of


@dataclass(frozen=True)
class Programs:
    """The programs of a robot's functions.

    Attributes:
        whole: The program of each function, by the function's name; those with branches compute
            all of them, one after the other.
        branch: The program of one branch, with the signs as a last argument ``choice``, of each
            function with branches.
    """

    whole: Mapping[str, Program]
    branch: Mapping[str, Program]

    def alone(self, function: SymbolicFunction) -> Program:
        """The program of one branch of a function with branches, of the whole function else."""
        return self.branch.get(function.name) or self.whole[function.name]


def programs(functions: Sequence[SymbolicFunction], prefix: str) -> Programs:
    """Lowers functions to CasADi and reads their programs.

    Args:
        functions: Functions over the same terms.
        prefix: The robot's name, with which the programs' names begin.

    Raises:
        LoweringError: An expression or an operation has no rule.
    """
    if not functions:
        return Programs({}, {})
    names = [function.name for function in functions]
    branched = [function for function in functions if function.signs]
    branches = programs_of([lower_branch(function, prefix) for function in branched])
    return Programs(
        dict(zip(names, programs_of(lower(functions, prefix)), strict=True)),
        {function.name: program for function, program in zip(branched, branches, strict=True)},
    )
