"""The C of shipped robots, compiled outside of the runtime, computes what Python returns."""

import ctypes
import math
from pathlib import Path

import numpy as np
import pytest

import chasles
from tests.support.native import UNPACKED, Source, compiled
from tests.support.processor import require_features
from tests.support.tolerances import AGREEMENT

AVX2 = ("-march=x86-64", "-mavx2", "-mfma")
INVERSES = ("ur5e", "puma560")
LOOPED = (
    ("well_manipulator", "chain"),
    ("well_manipulator", "actuators"),
    ("delta", "fk"),
    ("delta", "actuators"),
    ("planar_3rrr", "actuators"),
    ("planar_3rrr", "actuators_all"),
    ("stewart_gough", "actuators"),
)
SPREAD = 0.05
"""Distance from the reference configuration, at which all loops close [rad or m]."""


def native(robot, function, flags=()):
    """A function from one input array to a list of results, called through ctypes."""
    files = {f.name: f.read_text(encoding="utf-8") for f in Path(robot.folder).glob("*.[ch]")}
    export = f'__attribute__((visibility("default"))) void (*entry)() = {robot.name}_{function};'
    main = f'#include "{robot.name}.c"\n{export}\n'
    source = Source(
        f"native-{robot.name}-{function}", {"main.c": main, **files}, (UNPACKED, *flags)
    )
    library = ctypes.CDLL(str(compiled(source)))
    shapes = [output.shape for output in robot.functions[function].outputs]
    kinds = [ctypes.c_void_p] * (1 + len(shapes))
    address = ctypes.c_void_p.in_dll(library, "entry").value
    entry = ctypes.CFUNCTYPE(None, *kinds)(address)

    def call(row):
        row = np.ascontiguousarray(row)
        results = [np.zeros(max(math.prod(shape), 1)) for shape in shapes]
        entry(row.ctypes.data, *(result.ctypes.data for result in results))
        assert library
        return [r.reshape(shape) for r, shape in zip(results, shapes, strict=True)]

    return call


@pytest.mark.parametrize("name", INVERSES)
@pytest.mark.parametrize("flags", [(), AVX2], ids=["native", "avx2"])
def test_inverse_in_c_returns_the_solutions_of_python(name, flags):
    if flags:
        require_features({"avx2"})
    robot = chasles.load(name)
    ik = native(robot, "ik", flags)
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (20, robot.n))
    for pose in robot.fk(q):
        found, expected = ik(pose), robot.ik(pose)
        assert np.abs(np.exp(1j * found[0]) - np.exp(1j * expected.q)).max() <= AGREEMENT


@pytest.mark.parametrize(("name", "function"), LOOPED)
def test_function_of_loops_in_c_returns_the_results_of_python(name, function):
    robot = chasles.load(name)
    rng = np.random.default_rng(0)
    q = np.array(robot.reference.q) + rng.uniform(-SPREAD, SPREAD, (20, robot.n))
    q = q[robot.valid(q)]
    assert len(q) >= 5
    starts_from_q = robot.functions[function].inputs[0].name == "q"
    call = native(robot, function)
    for row in q if starts_from_q else robot.chain(q):
        expected = getattr(robot, function)(row)
        several = expected if isinstance(expected, tuple) else (expected,)
        for found, result in zip(call(row), several, strict=True):
            np.testing.assert_allclose(found, result, rtol=0, atol=AGREEMENT)
