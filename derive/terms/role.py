"""The roles of functions, and the labels of their solution branches."""

from collections.abc import Sequence
from dataclasses import dataclass

from chasles import contract


@dataclass(frozen=True)
class Role(contract.Role):
    """The role of a function, with properties for the compiler."""

    @property
    def finds_coordinates(self) -> bool:
        """Whether the function computes coordinates, either of this robot or of a nominal robot."""
        return self.is_inverse or self.is_start

    @property
    def is_start(self) -> bool:
        """Whether the computed configurations are start values for another function."""
        return self.name == "nominal inverse"


OTHER = Role("other")


def branch_label(choices: Sequence[tuple[str, str]]) -> str:
    """Return the label of a branch, such as "coupler_1 left, coupler_2 right".

    Args:
        choices: Pairs (name of a joint or body, branch), one pair for each choice between two
            solutions.
    """
    return ", ".join(f"{part} {side}" for part, side in choices) or "the only one"


def side_of(sign: int) -> str:
    """Return "+" or "-" as the default name of the branch with the given sign."""
    return "+" if sign > 0 else "-"
