"""Writes and loads a file with the CasADi functions of a robot."""

import tempfile
from pathlib import Path
from typing import Any

import casadi as ca

from ..derivation import Derivation
from ..program.programs import Programs
from ..terms.casadi_graph import combined
from .casadi_loops import is_of_positions, with_loops

POSITIONS = frozenset(
    {
        *("pose", "link poses", "map", "margin", "constraint", "lengths"),
        *("assembly polynomial", "assembly pose", "assembly mirror"),
    }
)
"""Roles of functions that compute poses or joint values."""
OF_GEOMETRY = "parametric pose"
"""Role of the forward kinematics function that has the geometric parameters as inputs."""


def files(derivation: Derivation, _: Programs) -> dict[str, str]:
    """Return the text of the file for ``casadi.Function.load``, keyed by file name.

    The file contains the function that ``joined`` returns. CasADi saves its own expression graph,
    so the second argument is ignored.
    """
    function = joined(derivation)
    if function is None:
        return {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "function.casadi"
        function.save(str(path))
        return {f"{derivation.robot.name}.casadi": path.read_text(encoding="ascii")}


def joined(derivation: Derivation) -> ca.Function | None:
    """Return one CasADi function with all position functions as outputs.

    The outputs are the robot functions whose roles are in ``POSITIONS``. If the forward kinematics
    function ``fk_p(q, p)`` with variable geometry was derived, its result is also an output. CasADi
    can differentiate all outputs. The result is None if the robot has no position function.
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
    return combined(kept, derivation.robot.name)


def output_of(everything: ca.Function, name: str) -> ca.Function:
    """Return one output as a CasADi function of only those arguments that affect it."""
    # A CasADi function that solves equations by iteration has no graph of scalar operations (SX).
    kind: Any = ca.SX if everything.is_a("SXFunction") else ca.MX
    inputs = {i: kind.sym(i, everything.numel_in(i)) for i in everything.name_in()}
    outputs: Any = everything.call(list(inputs.values()), kind is ca.MX, False)
    output = outputs[everything.name_out().index(name)]
    used = {i: symbol for i, symbol in inputs.items() if ca.depends_on(output, symbol)}
    return ca.Function(name, list(used.values()), [output], list(used), [name])
