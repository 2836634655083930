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

    It holds a single CasADi function, whose outputs are the functions with roles in
    :data:`POSITIONS`, and ``fk_p(q, p)`` where it was asked for; CasADi differentiates
    them. If none of these was derived, there is no file.
    CasADi prints its own graph, so that the programs are not needed.
    """
    kept = [
        f
        for f in derivation.functions
        if f.role.name in (*POSITIONS, OF_GEOMETRY) and is_of_positions(f)
    ]
    if not kept:
        return {}
    name = derivation.robot.name
    joined = with_loops(derivation, kept) if any(f.calls for f in kept) else whole(kept, name)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "function.casadi"
        joined.save(str(path))
        return {f"{name}.casadi": path.read_text(encoding="ascii")}


def casadi_function(folder: str | Path, name: str) -> ca.Function:
    """One function of a generated robot as a ``casadi.Function``, to be used in an optimisation.

    Args:
        folder: The robot's generated folder.
        name: A function of positions, such as ``"fk"`` or ``"chain"``.
            Jacobians and rates follow by ``casadi.jacobian`` and ``casadi.jtimes``.

    Returns:
        A function of the arguments that it needs, for example q, with one matrix output.

    Raises:
        FileNotFoundError: The folder holds no ``.casadi`` file.
        KeyError: The file has no such function.
    """
    folder = Path(folder)
    found = sorted(folder.glob("*.casadi"))
    if not found:
        raise FileNotFoundError(f"no .casadi file in {folder}")
    everything = ca.Function.load(str(found[0]))
    if name not in everything.name_out():
        raise KeyError(
            f"{found[0]} has no {name!r}; it has {everything.name_out()}, to be differentiated"
        )
    # An implicit function has no graph of scalars.
    kind: Any = ca.SX if everything.is_a("SXFunction") else ca.MX
    inputs = {i: kind.sym(i, everything.numel_in(i)) for i in everything.name_in()}
    outputs: Any = everything.call(list(inputs.values()), kind is ca.MX, False)
    output = outputs[everything.name_out().index(name)]
    used = {i: symbol for i, symbol in inputs.items() if ca.depends_on(output, symbol)}
    return ca.Function(name, list(used.values()), [output], list(used), [name])
