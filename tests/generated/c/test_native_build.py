"""The C code of shipped robots, compiled without the runtime, gives the same results as Python."""

import ctypes
import math

import numpy as np
import pytest

import chasles
from tests.support.native import UNPACKED, Source, compiled
from tests.support.processor import require_features
from tests.support.tolerances import AGREEMENT

AVX2 = ("-march=x86-64", "-mavx2", "-mfma")
LOOPED = {
    "well_manipulator": ("chain", "actuators"),
    "planar_3rrr": ("actuators", "actuators_all"),
    "stewart_gough": ("actuators",),
}
EXPORTED = '__attribute__((visibility("default"), externally_visible))'
SPREAD = 0.05
"""Distance from the reference configuration within which all loops close [rad or m]."""


def native(robot, functions, flags=()):
    """Compile C functions with one input array, and load them through ctypes.

    The compiler drops functions that are not exported, which saves most of the compile time.
    """
    files = robot.manifest.sources()
    exports = "".join(f"{EXPORTED} void (*entry_{f})() = {robot.name}_{f};\n" for f in functions)
    main = f'#include "{robot.name}.c"\n{exports}'
    source = Source(
        f"native-{robot.name}-{'-'.join(functions)}",
        {"main.c": main, **files},
        (UNPACKED, "-fwhole-program", *(flags or ("-O1",))),
    )
    library = ctypes.CDLL(str(compiled(source)))
    return [entry_point(library, robot, function) for function in functions]


def entry_point(library, robot, function):
    shapes = [output.shape for output in robot.functions[function].outputs]
    kinds = [ctypes.c_void_p] * (1 + len(shapes))
    address = ctypes.c_void_p.in_dll(library, f"entry_{function}").value
    entry = ctypes.CFUNCTYPE(None, *kinds)(address)

    def call(row):
        row = np.ascontiguousarray(row)
        results = [np.zeros(max(math.prod(shape), 1)) for shape in shapes]
        entry(row.ctypes.data, *(result.ctypes.data for result in results))
        assert library
        return [r.reshape(shape) for r, shape in zip(results, shapes, strict=True)]

    return call


def test_inverse_in_c_returns_the_solutions_of_python():
    """The test compiles the C code for AVX2.

    The tests in test_nearest_in_c compile C code for the processor of the machine.
    """
    require_features({"avx2"})
    robot = chasles.load("puma560")
    (ik,) = native(robot, ["ik"], AVX2)
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (20, robot.n))
    for pose in robot.fk(q):
        found, expected = ik(pose), robot.ik(pose)
        assert np.abs(np.exp(1j * found[0]) - np.exp(1j * expected.q)).max() <= AGREEMENT


@pytest.mark.parametrize("name", LOOPED)
def test_functions_of_loops_in_c_return_the_results_of_python(name):
    robot = chasles.load(name)
    rng = np.random.default_rng(0)
    q = np.array(robot.reference.q) + rng.uniform(-SPREAD, SPREAD, (20, robot.n))
    q = q[robot.loops_close(q)]
    assert len(q) >= 5
    for function, call in zip(LOOPED[name], native(robot, LOOPED[name]), strict=True):
        starts_from_q = robot.functions[function].inputs[0].name == "q"
        for row in q if starts_from_q else robot.chain(q):
            expected = robot.functions[function](row)
            several = expected if isinstance(expected, tuple) else (expected,)
            for found, result in zip(call(row), several, strict=True):
                np.testing.assert_allclose(found, result, rtol=0, atol=AGREEMENT)
