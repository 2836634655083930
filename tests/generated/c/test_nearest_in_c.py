"""`<robot>_ik_nearest` in generated C returns the solution that Python returns."""

import ctypes
from pathlib import Path

import numpy as np
import pytest

import chasles
from chasles.derive import read_text, write
from tests.support.compiling import loaded
from tests.support.native import UNPACKED, Source, compiled

POINTER = ctypes.c_void_p
EXPORTED = '__attribute__((visibility("default"), externally_visible))'


def nearest_in_c(name, flags):
    """Load the C function `ik_nearest` of a shipped robot."""
    return robot_nearest_in_c(chasles.load(name), flags)


def robot_nearest_in_c(robot, flags):
    """Load the C function `ik_nearest`, which returns solution slot, q, residual and margin."""
    name, files = robot.name, robot.manifest.sources()
    main = f'#include "{name}.c"\n{EXPORTED} int (*entry)() = {name}_ik_nearest;\n'
    source = Source(
        f"nearest-{name}", {"main.c": main, **files}, (UNPACKED, "-O1", "-fwhole-program", *flags)
    )
    library = ctypes.CDLL(str(compiled(source)))
    entry = ctypes.CFUNCTYPE(ctypes.c_int, *[POINTER] * 8)(POINTER.in_dll(library, "entry").value)

    def call(T, seed, lower=None, upper=None, weights=None, *, in_place=False):
        q = seed.copy()
        start = q if in_place else seed
        results = np.empty(2)
        optional = [None if a is None else a.ctypes.data for a in (lower, upper, weights)]
        addresses = q.ctypes.data, results.ctypes.data, results[1:].ctypes.data
        slot = entry(np.ascontiguousarray(T).ctypes.data, start.ctypes.data, *optional, *addresses)
        assert library
        return slot, q, *results

    return robot, call


@pytest.mark.parametrize(
    ("name", "flags"),
    [("ur5e", ()), ("iiwa14", ()), ("panda", ("-DCHASLES_PLAIN",))],
    ids=["lanes-ur5e", "lanes-iiwa14", "plain-panda"],
)
def test_c_returns_the_solution_of_python(name, flags):
    robot, call = nearest_in_c(name, flags)
    rng = np.random.default_rng(0)
    weights = rng.uniform(0.1, 2, robot.n)
    for _ in range(30):
        q = rng.uniform(robot.lower, robot.upper)
        T, seed = robot.fk(q), q + rng.uniform(-1, 1, robot.n)
        for options in ({}, {"weights": weights}):
            expected = robot.ik_nearest(T, seed, **options)
            slot, found, residual, _ = call(T, seed, **options)
            assert (slot >= 0) == expected.valid
            np.testing.assert_allclose(found, expected.q, atol=1e-9)
            assert np.isclose(residual, expected.residual, atol=1e-9)


def test_c_keeps_joint_limits_of_a_coupled_robot_with_explicit_motor_limits(tmp_path):
    page = Path(__file__).parents[3] / "docs" / "how-to" / "couplings.md"
    text = next(t for t in page.read_text(encoding="utf-8").split("```toml\n") if "planetary" in t)
    robot, call = robot_nearest_in_c(compiled_robot(text.split("```")[0], tmp_path), ())
    q, seeds = robot.random_q(50), robot.random_q(50, rng=7)
    joint = robot.joint_names.index("j5")
    lower, upper = robot.joint_limits[joint]
    for T, seed in zip(robot.fk(q), seeds, strict=True):
        slot, found, *_ = call(T, seed)
        assert slot >= 0
        np.testing.assert_allclose(found, robot.ik_nearest(T, seed).q, atol=1e-9)
        wide = np.full(robot.n, 100.0)
        _, other, *_ = call(T, seed, -wide, wide)
        theta = robot.chain(np.stack([found, other]))[:, joint]
        assert ((theta >= lower) & (theta <= upper)).all()


def compiled_robot(text, folder):
    write(read_text(text), folder, languages=("c",))
    return loaded(folder)


def test_result_may_take_the_place_of_the_seed():
    robot, call = nearest_in_c("ur5e", ())
    rng = np.random.default_rng(1)
    for _ in range(30):
        T, seed = robot.fk(rng.uniform(-3, 3, 6)), rng.uniform(-9, 9, 6)
        np.testing.assert_array_equal(call(T, seed)[1], call(T, seed, in_place=True)[1])


def test_reasons_are_negative_results():
    robot, call = nearest_in_c("ur5e", ())
    q = np.array([0.3, -1.2, 1.5, -0.4, 0.9, 0.2])
    T = robot.fk(q)
    far = T.copy()
    far[:3, 3] *= 10
    narrow = np.full(6, -0.1), np.full(6, 0.1)
    assert [call(far, q)[0], call(T, q, *narrow)[0], call(T * np.nan, q)[0]] == [-1, -2, -3]
    assert np.isnan(call(far, q)[1]).all()
