"""The generated C code of a robot gives the same results through casadi.external."""

import ctypes
import re
import subprocess

import casadi as ca
import numpy as np
import pytest

import chasles
from chasles.derive import derive, read
from chasles.derive.emit.languages import ON_DEMAND
from tests.support.derivations import description

LONG = re.compile("hessian|_dot|acceleration|fk_p")
"""Pattern of the names of functions with long C code, which the tests do not compile."""


@pytest.fixture(scope="module", params=["scara", "four_bar", "planar_3rrr"])
def loaded(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    robot = chasles.load(request.param)
    names = [name for name in robot.functions if not LONG.search(name)]
    derived = derive(read(description(request.param)), functions=names)
    ((name, text),) = ON_DEMAND["casadi_c"].files(derived, None).items()
    (folder / name).write_text(text, encoding="ascii")
    library = folder / "library.so"
    subprocess.run(
        ["cc", "-O0", "-shared", "-fPIC", folder / name, "-o", library, "-lm"], check=True
    )
    return robot, str(library)


def values(robot, rng, function):
    middle = np.array(robot.reference.q) if robot.reference else np.full(robot.n, 0.4)
    if function.inputs[0].name == "theta":
        middle = robot.chain(middle)
    first = middle + rng.uniform(-0.05, 0.05, middle.shape)
    return [first, *(rng.uniform(-1, 1, item.shape) for item in function.inputs[1:])]


def test_external_functions_compute_what_the_robot_computes(loaded):
    robot, library = loaded
    rng, checked = np.random.default_rng(0), 0
    for info in robot.manifest.functions:
        function = robot.functions[info.name]
        if info.role.has_slots or function.inputs[0].name not in ("q", "theta"):
            continue
        if not hasattr(ctypes.CDLL(library), info.symbol):
            continue
        inputs = values(robot, rng, function)
        expected = function(*inputs)
        expected = expected if isinstance(expected, tuple) else (expected,)
        found = ca.external(info.symbol, library).call(inputs)
        for own, other in zip(expected, found, strict=True):
            np.testing.assert_allclose(np.asarray(other).ravel(), np.ravel(own), atol=1e-12)
        checked += 1
    assert checked >= (5 if robot.name == "planar_3rrr" else 9)


def test_external_functions_have_derivatives(loaded):
    robot, library = loaded
    fk, q, step = ca.external(f"{robot.name}_fk", library), np.full(robot.n, 0.4), 1e-6
    if robot.reference:
        q = np.array(robot.reference.q)
    around = q + step * np.concatenate([np.eye(robot.n), -np.eye(robot.n)])
    ahead, behind = robot.fk(around).reshape(2, robot.n, 16)
    x = ca.MX.sym("x", robot.n)
    slopes = ca.Function("slopes", [x], [ca.jacobian(fk(x), x)])
    np.testing.assert_allclose(np.asarray(slopes(q)), ((ahead - behind) / (2 * step)).T, atol=1e-8)
