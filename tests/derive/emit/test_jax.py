"""The JAX module returns correct values and solutions in single and double precision."""

from functools import cache
from importlib.util import module_from_spec, spec_from_file_location

import numpy as np
import pytest

import chasles
from chasles.autodiff import for_jax
from chasles.derive import write
from chasles.derive.emit.jax.functions import definition, safe
from chasles.derive.emit.precision.evaluation import evaluate
from tests.support.cuda_shim import SOLVED, TOLERANCE
from tests.support.derivations import robot_of
from tests.support.every_operation import INPUTS, every_operation
from tests.support.exports import (
    apart,
    configurations,
    expected,
    inputs_of,
    inverse_of,
    regular_slots,
    right_angles,
)

NAMES = ["ur5e", "panda", "puma560", "excavator"]
FUNCTIONS = ["fk", "jacobian_mixed", "twist_mixed", "acceleration_mixed", "ik", "chain"]
KINDS = {"double": np.float64, "float": np.float32}
SAMPLES = 10_000


@cache
def jax():
    """Return the module jax with double precision enabled.

    JAX starts threads, so only these tests import JAX.
    """
    module = pytest.importorskip("jax")
    module.config.update("jax_enable_x64", True)
    return module


@pytest.fixture(autouse=True)
def installed():
    jax()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("jax")
    for name in NAMES:
        names = [info.name for info in functions_of(name)]
        write(robot_of(name), folder / name, functions=names, languages=["jax"])
    return folder


def functions_of(name):
    return [info for info in chasles.load(name).manifest.functions if info.name in FUNCTIONS]


def module_of(path):
    spec = spec_from_file_location(path.stem, path)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def called(folder, name, info, kind, inputs):
    function = getattr(module_of(folder / name / f"{name}_jax.py"), info.name)
    arrays = [
        np.reshape(x, (len(x), *item.shape)).astype(KINDS[kind])
        for x, item in zip(inputs, info.inputs, strict=True)
    ]
    found = jax().jit(function)(*arrays)
    found = found if isinstance(found, tuple) else (found,)
    assert {x.dtype for x in found} == {np.dtype(KINDS[kind])}
    return list(map(np.asarray, found))


def bounds(folder, name, info, kind):
    """Return float32 error bounds from a JAX function's docstring, or the float64 tolerances."""
    function = getattr(module_of(folder / name / f"{name}_jax.py"), info.name)
    lines = [line for line in function.__doc__.splitlines() if ", error " in line]
    stated = [float(line.split(", error ")[1]) for line in lines]
    return stated if kind == "float" else [TOLERANCE[kind]] * len(info.outputs)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", NAMES)
def test_functions_equal_the_compiled_c(name, kind, folder):
    robot, checked = chasles.load(name), 0
    q = configurations(robot, SAMPLES)
    for info in functions_of(name):
        inputs = inputs_of(robot, info, q)
        found, exact = called(folder, name, info, kind, inputs), expected(robot, info, inputs)
        kept = slice(None)
        if info.role.is_inverse:
            kept = regular_slots(robot, info, *exact[:2])
            assert kept.sum() >= len(q) // 2
            assert (found[1][kept] <= SOLVED[kind]).all()
        for x, y, bound in zip(found, exact, bounds(folder, name, info, kind), strict=True):
            assert apart(x, y)[kept].max() <= bound, info.name
        checked += 1
    assert checked >= 4


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["ur5e", "panda", "puma560"])
def test_inverse_is_complete_at_right_angle_poses(name, kind, folder):
    robot = chasles.load(name)
    info = inverse_of(robot)
    inputs = inputs_of(robot, info, right_angles(robot, 2000))
    exact = expected(robot, info, inputs)
    q, residual, _ = called(folder, name, info, kind, inputs)
    solved = exact[1] <= SOLVED["double"]
    np.testing.assert_array_equal(residual <= SOLVED[kind], solved)
    T = np.broadcast_to(inputs[0][:, None], (*solved.shape, 4, 4))[solved]
    assert np.abs(robot.fk(q[solved].astype(float)) - T).max() <= SOLVED[kind]


def test_leading_dimensions_are_batches(folder):
    module = module_of(folder / "panda" / "panda_jax.py")
    q = np.random.default_rng(0).uniform(-1, 1, (2, 3, 7))
    T = module.fk(q)
    assert T.shape == (2, 3, 4, 4)
    assert module.fk(q[0, 0]).shape == (4, 4)
    found, residual, margin = module.ik(T, q[..., 6])
    assert found.shape == (2, 3, 8, 7)
    assert residual.shape == margin.shape == (2, 3, 8)
    with pytest.raises(ValueError, match=r"must have shape \(\.\.\., \(7,\)\), got \(2, 6\)"):
        module.fk(q[0, :2, :6])


def test_for_jax_calls_the_module_on_other_devices(tmp_path):
    write(robot_of("ur5e"), tmp_path / "ur5e", languages=["jax"])
    robot = chasles.load("ur5e")
    arm, q = for_jax(robot, tmp_path / "ur5e"), configurations(robot, 20)
    for function in (arm.fk, arm.ik):
        argument = q if function is arm.fk else robot.fk(q)
        lowered = jax().jit(function).trace(argument).lower(lowering_platforms=("cuda",)).as_text()
        assert "chasles_rows" not in lowered
        assert "chasles_rows" in jax().jit(function).lower(argument).as_text()
    np.testing.assert_array_equal(arm.fk(q), robot.fk(q))
    gradients = jax().vmap(jax().grad(lambda q: arm.fk(q)[2, 3]))(q)
    np.testing.assert_allclose(gradients, robot.jacobian_mixed(q)[:, 2], atol=1e-15)


def test_for_jax_refuses_a_folder_without_the_module(tmp_path, folder):
    robot = chasles.load("ur5e")
    with pytest.raises(chasles.InputValueError, match="run chasles export jax ur5e --to"):
        for_jax(robot, tmp_path)
    with pytest.raises(chasles.InputValueError, match="no current jax source of ur5e"):
        for_jax(robot, folder / "panda")
    with pytest.raises(chasles.InputValueError, match="has no function hessian_mixed"):
        for_jax(robot, folder / "ur5e")


def test_module_names_functions_that_need_a_solver(tmp_path):
    write(robot_of("jaco2"), tmp_path, functions=["fk", "ik"], languages=["jax"])
    module = module_of(tmp_path / "jaco2_jax.py")
    assert "Only in C, because of an iterative solver: ik." in module.__doc__
    assert module.fk(np.zeros(6)).shape == (4, 4)
    assert not hasattr(module, "ik")


def test_each_operation_equals_its_meaning(folder, tmp_path):
    function, program = every_operation("lambda")
    head = (folder / "ur5e" / "ur5e_jax.py").read_text().split("\ndef fk(")[0]
    path = tmp_path / "every.py"
    path.write_text(f"{head}\n{definition(function, ['All.'], program)}")
    (exact,) = evaluate(program, [INPUTS], np.float64)
    np.testing.assert_allclose(module_of(path).every(INPUTS), exact, rtol=1e-15, atol=0)
    assert [safe("q"), safe("lambda"), safe("batch")] == ["q", "lambda_", "batch_"]
