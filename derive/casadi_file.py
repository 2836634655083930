"""The CasADi functions of a robot, kept for optimal control: written here, read back here."""

import tempfile
from pathlib import Path

import casadi as ca

from .derivation import Derivation
from .lower import whole


def serialized(derivation: Derivation) -> str:
    """Text of the file that ``casadi.Function.load`` reads: one function with an output each."""
    function = whole(derivation.functions, derivation.robot.name)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "function.casadi"
        function.save(str(path))
        return path.read_text(encoding="ascii")


def casadi_function(folder: str | Path, name: str) -> ca.Function:
    """One function of a generated robot as a ``casadi.Function``, to be used in an optimisation.

    Args:
        folder: The robot's generated folder.
        name: A function of the robot, ``"fk"`` say.

    Returns:
        A function of the coordinates that it needs, out of q, qd and qdd, with one matrix output.

    Raises:
        FileNotFoundError: The folder holds no robot.
        KeyError: The robot has no such function.
    """
    folder = Path(folder)
    files = sorted(folder.glob("*.casadi"))
    if not files:
        raise FileNotFoundError(f"no .casadi file in {folder}")
    everything = ca.Function.load(str(files[0]))
    if name not in everything.name_out():
        raise KeyError(f"{everything.name()} has no {name!r}; it has {everything.name_out()}")
    inputs = {i: ca.SX.sym(i, everything.numel_in(i)) for i in everything.name_in()}
    output = everything(**inputs)[name]
    used = {i: symbol for i, symbol in inputs.items() if ca.depends_on(output, symbol)}
    return ca.Function(name, list(used.values()), [output], list(used), [name])
