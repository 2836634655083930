"""The CasADi functions of a robot for optimal control: writes their file and loads it."""

import tempfile
from pathlib import Path
from typing import Any

import casadi as ca

from ..derivation import Derivation
from ..program.programs import Programs
from ..terms.casadi_graph import whole
from .casadi_loops import is_of_positions, with_loops

POSITIONS = frozenset(
    {
        *("pose", "link poses", "map", "margin", "constraint", "lengths"),
        *("assembly polynomial", "assembly pose", "assembly mirror"),
    }
)
"""Roles of functions of positions, which follow from no other function by differentiation."""
OF_GEOMETRY = "parametric pose"
"""The role of such a function that is derived on demand."""


def files(derivation: Derivation, _: Programs) -> dict[str, str]:
    """The file that ``casadi.Function.load`` reads, by name.

    It holds :func:`joined`. CasADi prints its own graph, so that the programs are not needed.
    """
    function = joined(derivation)
    if function is None:
        return {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "function.casadi"
        function.save(str(path))
        return {f"{derivation.robot.name}.casadi": path.read_text(encoding="ascii")}


def joined(derivation: Derivation) -> ca.Function | None:
    """All functions of positions as the outputs of a single CasADi function.

    Its outputs are the functions with roles in :data:`POSITIONS`, and ``fk_p(q, p)`` if it was
    derived; CasADi differentiates them. None if none of these was derived.
    """
    kept = [
        f
        for f in derivation.functions
        if f.role.name in (*POSITIONS, OF_GEOMETRY) and is_of_positions(f)
    ]
    if not kept:
        return None
    if any(f.calls for f in kept):
        return with_loops(derivation, kept)
    return whole(kept, derivation.robot.name)


def output_of(everything: ca.Function, name: str) -> ca.Function:
    """One output of a function, as a function of the arguments that it needs."""
    # An implicit function has no graph of scalars.
    kind: Any = ca.SX if everything.is_a("SXFunction") else ca.MX
    inputs = {i: kind.sym(i, everything.numel_in(i)) for i in everything.name_in()}
    outputs: Any = everything.call(list(inputs.values()), kind is ca.MX, False)
    output = outputs[everything.name_out().index(name)]
    used = {i: symbol for i, symbol in inputs.items() if ca.depends_on(output, symbol)}
    return ca.Function(name, list(used.values()), [output], list(used), [name])
