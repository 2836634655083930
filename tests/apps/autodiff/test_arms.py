"""Functions of a robot in JAX and PyTorch."""

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import chasles
from chasles import ChaslesError, InputValueError, NotInstalledError
from chasles.autodiff import for_jax, for_torch
from chasles.derive import write
from tests.support.derivations import robot_of
from tests.support.pages import examples

PAGE = "how-to/jax-and-torch.md"
NAMES = ["ur5e", "panda", "excavator"]
"""The test robots: a serial arm, an arm with a fixed joint, and a robot with loops and four
coordinates."""


@cache
def jax():
    module = pytest.importorskip("jax")
    module.config.update("jax_enable_x64", True)
    return module


@cache
def torch():
    return pytest.importorskip("torch")


def configurations(robot, count):
    """Return random configurations away from singularities."""
    rng = np.random.default_rng(4)
    if robot.reference:
        return np.array(robot.reference.q) + rng.uniform(-0.1, 0.1, (count, robot.n))
    q = rng.uniform(-2.5, 2.5, (3 * count, robot.n))
    fixed = [item.index for item in robot.redundancy]
    J = np.delete(robot.jacobian_mixed(q), fixed, axis=-1)
    return q[np.linalg.svd(J, compute_uv=False)[:, -1] > 0.05][:count]


def fixed_of(robot, q):
    return [q[..., item.index] for item in robot.redundancy]


def differences(function, q):
    step = 1e-5
    columns = []
    for k in range(q.shape[-1]):
        moved = np.eye(q.shape[-1])[k] * step
        columns.append((function(q + moved) - function(q - moved)) / (2 * step))
    return np.stack(columns, axis=-1)


def mapping_flags(address):
    inside = False
    for line in Path("/proc/self/smaps").read_text().splitlines():
        head, *flags = line.split()
        if head == "VmFlags:" and inside:
            return flags
        if "-" in head and not head.endswith(":"):
            start, end = (int(part, 16) for part in head.split("-"))
            inside = start <= address < end
    return []


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux has huge pages on request")
def test_large_results_of_jax_request_huge_pages_up_to_both_ends():
    if not Path("/sys/kernel/mm/transparent_hugepage").is_dir():
        pytest.skip("the kernel has no transparent huge pages")
    function = jax().jit(for_jax(chasles.load("ur5e")).fk)
    T = jax().block_until_ready(function(np.zeros((50_000, 6))))
    address = T.unsafe_buffer_pointer()
    assert "hg" in mapping_flags(address)
    assert "hg" in mapping_flags(address + T.nbytes - 1)


@pytest.mark.parametrize("name", NAMES)
def test_jax_returns_the_values_of_the_robot(name):
    robot, arm = chasles.load(name), for_jax(chasles.load(name)) if jax() else None
    q = configurations(robot, 50)
    T = robot.fk(q)
    np.testing.assert_array_equal(jax().jit(arm.fk)(q), T)
    np.testing.assert_array_equal(jax().vmap(arm.jacobian)(q), robot.jacobian_mixed(q))
    np.testing.assert_array_equal(arm.hessian(q), robot.hessian_mixed(q))
    found = arm.ik(T, *fixed_of(robot, q))
    expected = robot.functions["ik"].ufunc(T, *fixed_of(robot, q))
    for ours, theirs in zip(found, expected, strict=True):
        np.testing.assert_array_equal(ours, theirs)


@pytest.mark.parametrize("name", NAMES)
def test_jax_derivatives_agree_with_differences_at_a_thousand_poses(name):
    robot, jnp = chasles.load(name), jax().numpy
    arm, q = for_jax(robot), configurations(robot, 1000)
    for function, exact in ((arm.fk, robot.fk), (arm.jacobian, robot.jacobian_mixed)):
        derivative = jax().jit(jax().vmap(jax().jacrev(function)))(q)
        np.testing.assert_allclose(derivative, differences(exact, q), atol=1e-6)

    def itself(q):
        found = arm.ik(arm.fk(q), *fixed_of(robot, q))
        slot = jnp.argmin(jnp.max(jnp.abs(jnp.nan_to_num(found.q, nan=9.0) - q), axis=-1))
        return found.q[slot]

    derivative = jax().jit(jax().vmap(jax().jacrev(itself)))(q)
    np.testing.assert_allclose(
        derivative, np.broadcast_to(np.eye(robot.n), derivative.shape), atol=1e-6
    )
    forward = jax().jit(jax().vmap(jax().jacfwd(itself)))(q[:50])
    np.testing.assert_allclose(forward, derivative[:50], atol=1e-9)


def test_jax_second_derivatives_are_those_of_the_hessian():
    robot = chasles.load("ur5e")
    arm, q = for_jax(robot) if jax() else None, configurations(robot, 1)[0]
    second = jax().hessian(lambda q: arm.fk(q)[:3, 3])(q)
    np.testing.assert_allclose(
        second, differences(lambda q: robot.jacobian_mixed(q)[:3], q), atol=1e-6
    )


def test_jax_single_precision_converts():
    robot, jnp = chasles.load("ur5e"), jax().numpy
    arm, q = for_jax(robot), configurations(robot, 1000)
    T = arm.fk(jnp.asarray(q, dtype=jnp.float32))
    assert T.dtype == jnp.float32
    np.testing.assert_allclose(T, robot.fk(q), atol=1e-6)
    gradient = jax().grad(lambda T: arm.ik(T).q[0, 0])(T[0])
    assert gradient.dtype == jnp.float32
    assert np.isfinite(gradient).all()


def test_derivative_of_ik_is_nan_at_singular_poses_and_zero_without_solution():
    robot = chasles.load("ur5e")
    arm = for_jax(robot) if jax() else None
    derivative = jax().jacrev(lambda T: arm.ik(T).q)
    assert np.isnan(derivative(robot.fk(np.zeros(6)))).any()
    far = np.eye(4)
    far[0, 3] = 5
    assert (derivative(far) == 0).all()


def test_jax_without_a_compiler_says_which_compiler_it_needs(monkeypatch, tmp_path):
    jax()
    from chasles.autodiff import jax_functions

    monkeypatch.setenv("CHASLES_CACHE", str(tmp_path))
    monkeypatch.setenv("CXX", "/no/compiler")
    with pytest.raises(ChaslesError, match="JAX requires a C\\+\\+17 compiler"):
        jax_functions._library()


@pytest.mark.parametrize("name", NAMES)
def test_torch_derivatives_agree_with_differences_at_a_thousand_poses(name):
    robot, q = chasles.load(name), configurations(chasles.load(name), 1000)
    weights = np.random.default_rng(5).uniform(-1, 1, (1000, 4, 4))
    variable = torch().tensor(q, requires_grad=True)
    T = for_torch(robot).fk(variable)
    total = (torch().tensor(weights) * T).sum()
    (found,) = torch().autograd.grad(total, variable, retain_graph=True)
    exact = np.einsum("mijk,mij->mk", differences(robot.fk, q), weights)
    np.testing.assert_allclose(found, exact, atol=1e-6)
    solutions = for_torch(robot).ik(T, *fixed_of(robot, variable)).q
    slots = np.nan_to_num(solutions.detach().numpy(), nan=9.0) - q[:, None]
    own = solutions[np.arange(1000), np.abs(slots).max(axis=-1).argmin(axis=-1)]
    for k in range(robot.n):
        (found,) = torch().autograd.grad(own[:, k].sum(), variable, retain_graph=True)
        np.testing.assert_allclose(found, np.tile(np.eye(robot.n)[k], (1000, 1)), atol=1e-6)


@pytest.mark.parametrize("name", NAMES)
def test_torch_passes_gradcheck(name):
    robot, check = chasles.load(name), torch().autograd
    arm = for_torch(robot)
    q = torch().tensor(configurations(robot, 3), requires_grad=True)
    np.testing.assert_array_equal(arm.fk(q).detach(), robot.fk(q.detach().numpy()))
    np.testing.assert_array_equal(arm.hessian(q.detach()), robot.hessian_mixed(q.detach().numpy()))
    tolerance = {"atol": 1e-6, "rtol": 1e-6}
    assert check.gradcheck(arm.fk, q, **tolerance)
    assert check.gradcheck(arm.jacobian, q, **tolerance)
    assert check.gradgradcheck(arm.fk, q, **tolerance)

    def solutions(q):
        found = arm.ik(arm.fk(q), *fixed_of(robot, q))
        return torch().where((found.residual <= 1e-9)[..., None], found.q, 0)

    assert check.gradcheck(solutions, q, **tolerance)


@pytest.mark.filterwarnings("ignore:The .grad attribute:UserWarning")
def test_torch_operators_are_valid_and_compile():
    robot = chasles.load("ur5e")
    arm = for_torch(robot) if torch() else None
    q = torch().tensor(configurations(robot, 20), requires_grad=True)
    key = f"{robot.name} {robot.digest}"
    torch().library.opcheck(torch().ops.chasles.fk, (q, key))
    torch().library.opcheck(
        torch().ops.chasles.ik, (arm.fk(q).detach(), q.new_empty((20, 0)), key, [])
    )

    sin = torch().sin

    def height(q):
        return arm.fk(sin(q))[..., 2, 3].sum()

    compiled = torch().compile(height, backend="aot_eager", fullgraph=True)
    (expected,) = torch().autograd.grad(height(q), q)
    (found,) = torch().autograd.grad(compiled(q), q)
    np.testing.assert_allclose(found, expected, atol=1e-15)


def test_torch_single_precision_converts_and_double_is_not_copied():
    robot = chasles.load("ur5e")
    arm = for_torch(robot) if torch() else None
    q = torch().tensor(configurations(robot, 20))
    T = arm.fk(q.float())
    assert T.dtype == torch().float32
    np.testing.assert_allclose(T, robot.fk(q.numpy()), atol=1e-6)
    assert arm.ik(arm.fk(q)[0]).q.shape == (8, 6)


@pytest.mark.parametrize("language", [for_jax, for_torch])
def test_robots_without_inverse_or_with_a_swivel_angle_are_refused(language):
    (jax if language is for_jax else torch)()
    with pytest.raises(InputValueError, match="robot planar_3rrr has no function ik"):
        language(chasles.load("planar_3rrr"))
    with pytest.raises(InputValueError, match="an angle that is not a coordinate"):
        language(chasles.load("iiwa14"))


@pytest.mark.parametrize(("language", "package"), [(for_jax, "jax"), (for_torch, "torch")])
def test_missing_package_names_its_command(language, package, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.delitem(sys.modules, f"chasles.autodiff.{package}_functions", raising=False)
    monkeypatch.delattr(f"chasles.autodiff.{package}_functions", raising=False)
    with pytest.raises(NotInstalledError, match=f"chasles\\[{package}\\]"):
        language(chasles.load("ur5e"))


@pytest.mark.parametrize(("package", "count"), [(jax, 2), (torch, 1)])
def test_examples_of_the_page_run(package, count, tmp_path, monkeypatch, capsys):
    write(robot_of("ur5e"), tmp_path / "robots" / "ur5e", languages=["jax"])
    monkeypatch.chdir(tmp_path)
    name, names = package().__name__, {}
    blocks = [block for block in examples(PAGE) if f"for_{name}" in block]
    assert len(blocks) == count
    for block in blocks:
        exec(block, names)
    assert package is torch or capsys.readouterr().out.endswith("\n8\n")
