"""Exported kernels on GPU arrays. The compilation of the kernels needs no GPU."""

from ctypes.util import find_library
from importlib.util import find_spec

import numpy as np
import pytest

import chasles
from chasles import InputValueError
from chasles.cuda import Kernels
from chasles.derive import write
from tests.support.cuda_shim import FUNCTIONS
from tests.support.derivations import robot_of
from tests.support.exports import apart, configurations
from tests.support.pages import run

PAGE = "how-to/cuda.md"
COUNT = 1000
"""Number of poses, chosen so that the last block of GPU threads is not full."""


HAS_NVRTC = find_spec("cuda") is not None and find_spec("cuda.bindings") is not None


def has_gpu():
    if not (HAS_NVRTC and find_library("cuda")):
        return False
    from cuda.bindings import driver

    return int(driver.cuInit(0)[0]) == 0


needs_nvrtc = pytest.mark.skipif(not HAS_NVRTC, reason="cuda-bindings is not installed")
needs_gpu = pytest.mark.skipif(not has_gpu(), reason="no GPU")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("cuda") / "robots" / "ur5e"
    names = [name for name in FUNCTIONS if name in chasles.load("ur5e").functions]
    write(robot_of("ur5e"), path, functions=names, languages=["cuda"])
    return path


@needs_nvrtc
@pytest.mark.parametrize("real", ["float", "double"])
@pytest.mark.parametrize("name", ["fk", "ik", "ik_nearest"])
def test_nvrtc_compiles_kernels(name, real, folder):
    from chasles.cuda import compiled

    source = compiled.read(folder / "ur5e.cuh")
    image, entry = compiled.compiled(source, "ur5e", name, real, "sm_90")
    assert image.startswith(b"\x7fELF")
    assert entry in image
    with pytest.raises(InputValueError, match="no kernel hessian"):
        compiled.compiled(source, "ur5e", "hessian_mixed", real, "sm_90")


@needs_nvrtc
def test_another_robot_is_an_error(folder, tmp_path):
    for robot, path in ((chasles.load("panda"), folder), (chasles.load("ur5e"), tmp_path)):
        with pytest.raises(InputValueError, match=f"chasles export cuda {robot.name}"):
            Kernels(robot, path)


@needs_nvrtc
def test_arrays_in_other_memory_are_an_error(folder):
    arm = Kernels(chasles.load("ur5e"), folder)
    with pytest.raises(InputValueError, match="expected an array in GPU memory, got ndarray"):
        arm("fk", np.zeros((6, 2)))
    with pytest.raises(InputValueError, match="no function 'other'"):
        arm("other", np.zeros((6, 2)))


@needs_gpu
@pytest.mark.parametrize("kind", ["float32", "float64"])
@pytest.mark.parametrize("package", ["cupy", "torch", "jax"])
def test_kernels_equal_the_compiled_c(package, kind, folder):
    put, get = conversions(package)
    robot, tolerance = chasles.load("ur5e"), 1e-4 if kind == "float32" else 1e-9
    arm = Kernels(robot, folder)
    q = configurations(robot, COUNT)
    poses, J = robot.fk_jacobian_mixed(q)
    T = put(np.ascontiguousarray(np.moveaxis(poses, 0, -1), dtype=kind))
    own, own_J = arm("fk_jacobian_mixed", put(np.ascontiguousarray(q.T, dtype=kind)))
    assert type(own) is type(T)
    assert np.abs(np.moveaxis(get(own), -1, 0) - poses).max() <= tolerance
    assert np.abs(np.moveaxis(get(own_J), -1, 0) - J).max() <= tolerance
    _, residual, _ = arm("ik", T)
    solved = np.moveaxis(get(residual), -1, 0) <= (2e-5 if kind == "float32" else 1e-9)
    assert (solved == (robot.ik(poses).residual <= 1e-9)).mean() >= 0.999
    seed = put(np.ascontiguousarray(q.T + 0.1, dtype=kind))
    near, _, _, slot = arm.ik_nearest(T, seed, weights=put(np.ones(6, dtype=kind)))
    assert (get(slot) >= 0).all()
    assert np.quantile(apart(get(near).T, robot.ik_nearest(poses, q + 0.1).q), 0.99) <= tolerance


def conversions(package):
    """Return functions that copy arrays to the GPU and back."""
    module = pytest.importorskip(package)
    if package == "cupy":
        return module.asarray, module.asnumpy
    if package == "torch":
        return lambda x: module.tensor(x, device="cuda"), lambda x: x.cpu().numpy()
    module.config.update("jax_enable_x64", True)
    return module.numpy.asarray, np.asarray


@needs_gpu
def test_examples_of_the_page_run(folder, monkeypatch):
    pytest.importorskip("cupy")
    pytest.importorskip("torch")
    monkeypatch.chdir(folder.parents[1])
    run(PAGE)
