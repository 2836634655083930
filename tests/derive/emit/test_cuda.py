"""CUDA kernels compiled for the CPU return correct values, solutions and nearest solutions.

The continuous integration does not install nvcc, the compiler of CUDA.
"""

import re
import shutil
import subprocess

import numpy as np
import pytest

import chasles
from chasles.derive import write
from tests.support.cuda_shim import SOLVED, Shim, differing, incomplete
from tests.support.derivations import robot_of
from tests.support.exports import configurations, inverse_of, regular_slots, right_angles
from tests.support.pages import examples
from tests.support.tools import needs

NAMES = ["ur5e", "panda", "excavator"]
PAGE = "how-to/cuda.md"
SAMPLES = 2000

CALLED = """\
{includes}
void called(size_t poses, const float *T, float *q, float *residual, float *margin)
{{
{statements}
}}
"""
"""C++ function that contains the example of the documentation page about CUDA."""


@pytest.fixture(scope="module")
def shims(tmp_path_factory):
    """Return a function that compiles the CUDA kernels of a robot once."""
    folder, built = tmp_path_factory.mktemp("cuda"), {}

    def shim(name):
        if name not in built:
            built[name] = Shim(name, folder / name)
        return built[name]

    return shim


@needs("g++")
@pytest.mark.parametrize("kind", ["double", "float"])
@pytest.mark.parametrize("name", NAMES)
def test_kernels_equal_the_compiled_c(name, kind, shims):
    assert len(shims(name).functions) >= 4
    assert not differing(shims(name), kind, configurations(chasles.load(name), SAMPLES))


@needs("g++")
@pytest.mark.parametrize("kind", ["double", "float"])
@pytest.mark.parametrize("name", ["ur5e", "panda"])
def test_inverse_is_complete_at_right_angle_poses(name, kind, shims):
    assert not incomplete(shims(name), kind, right_angles(chasles.load(name), SAMPLES))


@needs("g++")
@pytest.mark.parametrize("name", NAMES)
def test_nearest_solution_equals_the_compiled_c(name, shims):
    shim, robot = shims(name), chasles.load(name)
    info, rng = inverse_of(robot), np.random.default_rng(5)
    q = configurations(robot, SAMPLES)
    seed = q + rng.uniform(-1, 1, q.shape) * (0.1 if robot.reference else 2)
    seed[:, list(info.role.fixed)] = q[:, list(info.role.fixed)]
    T, weights = robot.fk(q), rng.uniform(0.5, 2, robot.n)
    narrow = dict(zip(("lower", "upper"), np.quantile(q, [0.1, 0.9], axis=0), strict=True))
    for options in ({}, {"weights": weights}, narrow):
        exact = robot.ik_nearest(T, seed, **limited(options))
        states = np.select([exact.valid, exact.reason == "limits"], [0, -2], -1)
        regular = regular_slots(robot, info, exact.q, np.where(exact.valid, exact.residual, 1))
        assert regular.sum() > SAMPLES // 10
        for kind, solved in SOLVED.items():
            bound = shim.bounds(kind, "ik")[0]
            found, residual, _, slot = shim.nearest(kind, T, seed, **options)
            assert (np.minimum(slot, 0) == states).mean() >= (1 if kind == "double" else 0.998)
            assert np.isnan(found[slot < 0]).all()
            kept = regular & (slot >= 0)
            assert (residual[kept] <= solved).all()
            lengths = options.get("weights", np.ones(robot.n))
            own, other = (np.abs((x - seed) * lengths)[kept].max(axis=-1) for x in (found, exact.q))
            assert np.abs(own - other).max() <= bound * lengths.max()
            assert (np.abs(found - exact.q)[kept].max(axis=-1) <= bound).mean() >= 0.998


def limited(options):
    """Convert options of a nearest-solution kernel to options of the method ``ik_nearest``."""
    if "lower" not in options:
        return options
    return {"limits": np.transpose([options["lower"], options["upper"]])}


@needs("g++")
def test_nearest_solution_reports_its_reason(shims):
    shim, robot = shims("ur5e"), chasles.load("ur5e")
    q = np.array([[0.4, -1.2, 1.3, 0.4, 0.5, 0.6]] * 3)
    T, seed = robot.fk(q), q.copy()
    T[1, :3, 3] = 9
    seed[2, 3] = np.nan
    for kind in SOLVED:
        found, residual, _, slot = shim.nearest(kind, T, seed)
        assert slot[0] >= 0
        np.testing.assert_array_equal(slot[1:], [-1, -3])
        assert residual[1] > 1
        assert np.isnan(found[1:]).all()
        limits = np.full(6, 0.1)
        assert (shim.nearest(kind, T[:1], q[:1], lower=-limits, upper=limits)[3] == -2).all()


def test_header_names_functions_that_exist_only_in_c(tmp_path):
    write(robot_of("jaco2"), tmp_path, functions=["fk", "ik"], languages=["cuda"])
    text = (tmp_path / "jaco2.cuh").read_text()
    assert "Only in C, because of an iterative solver: ik." in text
    assert " ik_nearest." in text
    assert " fk_kernel(" in text
    assert "ik_kernel" not in text
    assert not (tmp_path / "example.cu").exists()


@pytest.mark.skipif(not shutil.which("nvcc"), reason="nvcc is not installed")
def test_nvcc_compiles_the_example_of_the_page(shims):
    (example,) = examples(PAGE, "cuda")
    includes, statements = example.split("\n\nconst ")
    text = CALLED.format(includes=includes, statements=f"const {statements}")
    folder = shims("ur5e").folder
    (folder / "page.cu").write_text(text)
    command = ["nvcc", "-std=c++17", "-arch=sm_90", "-Werror", "all-warnings", "-c", "page.cu"]
    done = subprocess.run(command, cwd=folder, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()


@pytest.mark.skipif(not shutil.which("nvcc"), reason="nvcc is not installed")
def test_nvcc_compiles_the_example_without_spilled_registers(shims):
    command = ["nvcc", "-std=c++17", "-arch=sm_90", "-Xptxas", "-v", "-cubin", "example.cu"]
    done = subprocess.run(command, cwd=shims("ur5e").folder, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()
    spilled = re.findall(r"(\d+) bytes spill", done.stdout.decode() + done.stderr.decode())
    assert len(spilled) >= 4
    assert set(spilled) == {"0"}
