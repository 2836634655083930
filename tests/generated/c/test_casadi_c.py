"""The C that CasADi itself generates computes the same as ours: every function of a sample."""

import ctypes
import subprocess

import casadi as ca
import numpy as np
import pytest

import chasles
from chasles.derive.terms.branches import patterns
from tests.support.derivations import SAMPLE, derivation, kernels

TOLERANCE = 2e-12
"""In parts of the largest entry of an output: cosines differ by a last place, and loops near their
dead points multiply that."""
POSES = 20
POINTER = ctypes.POINTER(ctypes.c_double)


@pytest.fixture(scope="module", params=SAMPLE)
def robot(request):
    return chasles.load(request.param)


@pytest.fixture(scope="module")
def library(robot, tmp_path_factory):
    """CasADi's C of all functions, compiled as it stands."""
    folder = tmp_path_factory.mktemp(robot.name)
    generator = ca.CodeGenerator("casadi_kernels.c")
    for kernel in kernels(robot.name).values():
        generator.add(kernel)
    generator.generate(f"{folder}/")
    shared = folder / "casadi_kernels.so"
    source = folder / "casadi_kernels.c"
    subprocess.run(["cc", "-O0", "-shared", "-fPIC", source, "-o", shared, "-lm"], check=True)
    return ctypes.CDLL(str(shared))


def called(library, kernel, inputs):
    """The outputs of CasADi's C, flat."""
    outputs = [np.full(kernel.numel_out(k), -77.0) for k in range(kernel.n_out())]
    given = [np.ascontiguousarray(value, float) for value in inputs]
    arg = (POINTER * kernel.sz_arg())(*(v.ctypes.data_as(POINTER) for v in given))
    res = (POINTER * kernel.sz_res())(*(v.ctypes.data_as(POINTER) for v in outputs))
    iw = (ctypes.c_longlong * max(kernel.sz_iw(), 1))()
    w = (ctypes.c_double * max(kernel.sz_w(), 1))()
    assert library[kernel.name()](arg, res, iw, w, 0) == 0
    return outputs


def every_branch(library, kernel, function, inputs):
    """The outputs of all branches, one after the other, where there are branches."""
    if not function.signs:
        return called(library, kernel, inputs)
    found = [called(library, kernel, [*inputs, signs]) for signs in patterns(function)]
    return [np.concatenate(outputs) for outputs in zip(*found, strict=True)]


def arguments(robot, rng):
    """A value for every argument that a function may have, near the reference if there is one."""
    hybrid = derivation(robot.name).hybrid
    q = rng.uniform(-1, 1, robot.n)
    values = {"swivel": rng.uniform(-1, 1)}
    if hybrid is not None:
        near = rng.uniform(-0.02, 0.02, robot.n)
        q = np.array(robot.reference.q) + near
        z = np.array(robot.reference.z)
        values["z"] = z + rng.uniform(-0.02, 0.02, z.shape)
        values["zd"] = rng.uniform(-1, 1, z.shape)
        theta = [hybrid.at_reference[joint.name] for joint in hybrid.mechanism.main_chain.moving]
        values["theta"] = np.array(theta) + rng.uniform(-0.02, 0.02, len(theta))
        values["thetad"] = rng.uniform(-1, 1, len(theta))
        values["thetadd"] = rng.uniform(-1, 1, len(theta))
    values |= {"q": q, "qd": rng.uniform(-1, 1, robot.n), "qdd": rng.uniform(-1, 1, robot.n)}
    values |= {f"q{k + 1}": value for k, value in enumerate(q)}
    if "fk" in robot.functions:
        values["T"] = np.asarray(robot.functions["fk"](q))
    return values


def test_casadi_generated_c_agrees_with_every_function(robot, library):
    compared, functions = set(), derivation(robot.name).functions
    # Functions behind calls of a solver are compared with finite differences of iterated loops.
    straight = {f.name for f in functions if not f.calls}
    for name, kernel in kernels(robot.name).items():
        if name not in straight:
            continue
        own, rng = robot.functions[name], np.random.default_rng(7)
        finite = 0
        for _ in range(POSES):
            values = arguments(robot, rng)
            names = [n for n in kernel.name_in() if n != "choice"]
            inputs = [values.get(n, rng.uniform(-1, 1, kernel.numel_in(n))) for n in names]
            expected = every_branch(library, kernel, derivation(robot.name).function(name), inputs)
            found = computed(own, inputs)
            assert len(found) == len(expected)
            for ours, theirs in zip(found, expected, strict=True):
                scale = max(1.0, np.max(np.abs(theirs), where=np.isfinite(theirs), initial=0.0))
                np.testing.assert_allclose(
                    ours.ravel(), theirs, rtol=0, atol=TOLERANCE * scale, err_msg=name
                )
                finite += np.isfinite(theirs).sum()
        assert finite, name
        compared.add(name)
    assert compared == straight
    assert len(compared) >= 15


def computed(own, inputs):
    """The outputs of our C, without what the runtime makes of poses out of reach."""
    batch = [np.asarray(value, float)[None] for value in inputs]
    result = own(*batch)
    if isinstance(result, chasles.Solutions):
        return [result.q[0], result.residual[0], result.margin[0]]
    return [np.asarray(r)[0] for r in (result if isinstance(result, tuple) else (result,))]
