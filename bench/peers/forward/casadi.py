"""CasADi functions called directly, called through their buffer, and compiled as C."""

import tempfile
from pathlib import Path

import casadi as ca
import numpy as np

from tests.support.native import Source, compiled

from ...cases.arms import Arm
from . import Call
from .formulas import fk_jacobian


def calls(arm: Arm) -> list[Call]:
    interpreted = functions(arm)
    return [
        _called(*interpreted),
        _buffered("CasADi FunctionBuffer", arm, *interpreted),
        _buffered("CasADi buffer, compiled", arm, *_external(arm)),
    ]


def functions(arm: Arm) -> tuple[ca.Function, ca.Function]:
    """Return dense SX functions fk and fk_jacobian."""
    q = ca.SX.sym("q", arm.joints)
    T, J = fk_jacobian(arm, [q[k] for k in range(arm.joints)], ca.cos, ca.sin)
    pose, jacobian = (
        ca.densify(ca.vertcat(*(ca.horzcat(*row) for row in rows))) for rows in (T, J)
    )
    both = ca.cse([pose, jacobian])
    return ca.Function("fk", [q], [ca.cse(pose)]), ca.Function("fk_jacobian", [q], both)


def _called(fk: ca.Function, pair: ca.Function) -> Call:
    return Call("CasADi Function", lambda q: (fk(q),), pair, lambda r: tuple(map(np.array, r)))


def _buffered(name: str, arm: Arm, fk: ca.Function, pair: ca.Function) -> Call:
    # CasADi stores matrices by columns.
    T, J = np.zeros((4, 4)).T, np.zeros((arm.joints, 6)).T
    return Call(name, _buffer(arm, fk, (T,)), _buffer(arm, pair, (T, J)), tuple)


def _buffer(arm: Arm, function: ca.Function, results: tuple[np.ndarray, ...]):
    buffer, run = function.buffer()
    argument = np.zeros(arm.joints)
    buffer.set_arg(0, memoryview(argument))
    for k, result in enumerate(results):
        buffer.set_res(k, memoryview(result.T))

    def call(q, keep=buffer):  # noqa: ARG001
        argument[:] = q
        run()
        return results

    return call


def _external(arm: Arm) -> tuple[ca.Function, ca.Function]:
    generator = ca.CodeGenerator("functions.c")
    for function in functions(arm):
        generator.add(function)
    with tempfile.TemporaryDirectory() as folder:
        generator.generate(f"{folder}/")
        text = (Path(folder) / "functions.c").read_text(encoding="utf-8")
    # The compiler flags hide symbols without an export attribute. With GCC_HASCLASSVISIBILITY, the
    # C code of CasADi adds this attribute.
    source = Source(f"casadi-{arm.name}", {"functions.c": text}, ("-DGCC_HASCLASSVISIBILITY",))
    path = str(compiled(source))
    return ca.external("fk", path), ca.external("fk_jacobian", path)
