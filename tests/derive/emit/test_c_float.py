"""C in single precision has bounded errors, finds all regular solutions and runs on a Cortex-M4."""

import ctypes
import re
import subprocess

import numpy as np
import pytest

import chasles
from chasles.cli.app import run as main
from chasles.derive import write
from tests.support import cortex_m4
from tests.support.derivations import robot_of
from tests.support.exports import (
    apart,
    configurations,
    expected,
    inputs_of,
    inverse_of,
    regular_slots,
    right_angles,
)
from tests.support.pages import examples
from tests.support.tools import needs

NAMES = ["ur5e", "panda", "excavator"]
SOLVED_IN_C = {"planar_3rrr": 5, "jaco2": 4}
"""Robots with solvers that exist only in C. The value is the number of functions that are compared
in single precision."""
FUNCTIONS = ["fk", "fk_jacobian_mixed", "jacobian_mixed", "acceleration_mixed", "ik", "chain"]
FUNCTIONS += ["actuators", "chain_fk", "chain_acceleration_mixed", "constraint", "constraint_D_z"]
FLAGS = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]
FLAGS += ["-Wdouble-promotion", "-Wfloat-conversion", "-fno-math-errno"]
COMPILERS = {"gcc": [], cortex_m4.CC: cortex_m4.FLAGS}
LEVELS = ["-O1", "-O2", "-Os"]
CALLED = {"sinf", "cosf", "sincosf", "sqrtf", "atan2f"}
SAMPLES = 10_000
PAGE = "how-to/microcontroller.md"
SOLVED = 2e-5
INTERRUPT = """\
#include "control_step.c"

static struct { volatile unsigned SR; } timer, *const TIM6 = &timer;
static float target[16], q[UR5E_FLOAT_N];
void send_to_drives(const float *q);
void stop_drives(void);
void TIM6_DAC_IRQHandler(void);

"""
"""C declarations of names that an STM32 program defines."""
SINGLE = ctypes.POINTER(ctypes.c_float)


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """Export the single-precision C code of each tested robot."""
    folder = tmp_path_factory.mktemp("float")
    for name in [*NAMES, *SOLVED_IN_C]:
        functions = sorted(set(FUNCTIONS) & set(chasles.load(name).functions))
        write(robot_of(name), folder / name, functions=functions, languages=["c_float"])
    return folder


@pytest.fixture(scope="module")
def built(exported):
    libraries = {}
    for name in [*NAMES, *SOLVED_IN_C]:
        options = ["-O2", "-shared", "-fPIC", "-o", "robot.so"]
        steps = sorted(path.name for path in (exported / name).glob("control_step.c"))
        sources = [f"{name}_float.c", *steps]
        compiled("gcc", [*FLAGS, *options, *sources, "-lm"], exported / name)
        libraries[name] = ctypes.CDLL(str(exported / name / "robot.so"))
    return libraries


def compiled(compiler, options, folder):
    done = subprocess.run([compiler, *options], cwd=folder, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()


def printed_errors(folder, name, function):
    """Return the error bounds that the exported C header states for a function."""
    text = (folder / name / f"{name}_float.h").read_text()
    comment = text.split(f"void {name}_float_{function}(")[0].rsplit("/*", 1)[1]
    return [float(bound) for bound in re.findall(r", error (\S+)$", comment, re.MULTILINE)]


def called(library, name, info, inputs):
    """Call a single-precision C function for each row of inputs, and return its outputs."""
    function = library[f"{name}_float_{info.name}"]
    given = [np.ascontiguousarray(x.reshape(len(x), -1), dtype=np.float32) for x in inputs]
    found = [np.empty((len(given[0]), *item.shape), dtype=np.float32) for item in info.outputs]
    arrays = (*given, *found)
    function.argtypes = [ctypes.c_void_p] * len(arrays)
    rows = [range(x.ctypes.data, x.ctypes.data + x.nbytes, x[0].nbytes) for x in arrays]
    for addresses in zip(*rows, strict=True):
        function(*addresses)
    return found


@needs("gcc")
@pytest.mark.parametrize("name", [*NAMES, *SOLVED_IN_C])
def test_errors_are_within_the_printed_bounds(name, exported, built):
    robot, checked = chasles.load(name), 0
    q = configurations(robot, SAMPLES)
    header = (exported / name / f"{name}_float.h").read_text()
    assert "error not measured" not in header
    for info in robot.manifest.functions:
        is_printed = f"void {name}_float_{info.name}(" in header
        if info.name not in FUNCTIONS or info.role.is_inverse or not is_printed:
            continue
        inputs = inputs_of(robot, info, q)
        found = called(built[name], name, info, inputs)
        bounds = printed_errors(exported, name, info.name)
        for x, y, bound in zip(found, expected(robot, info, inputs), bounds, strict=True):
            assert np.abs(x - y).max() <= bound, (info.name, bound)
        checked += 1
    assert checked >= SOLVED_IN_C.get(name, 4)


@needs("gcc")
@pytest.mark.parametrize("name", NAMES)
def test_inverse_finds_all_regular_solutions_within_the_printed_bounds(name, exported, built):
    robot = chasles.load(name)
    info = inverse_of(robot)
    inputs = inputs_of(robot, info, configurations(robot, SAMPLES))
    exact = expected(robot, info, inputs)
    q, residual, margin = called(built[name], name, info, inputs)
    regular = regular_slots(robot, info, *exact[:2])
    assert regular.sum() >= SAMPLES // 2
    assert (residual[regular] <= SOLVED).all()
    errors = [apart(q, exact[0]).max(axis=-1), np.abs(residual - exact[1])]
    errors.append(np.abs(margin - exact[2]))
    for error, bound in zip(errors, printed_errors(exported, name, "ik"), strict=True):
        assert error[regular].max() <= bound


@needs("gcc")
@pytest.mark.parametrize("name", ["ur5e", "panda"])
def test_right_angle_poses_have_as_many_solutions(name, built):
    robot = chasles.load(name)
    info = inverse_of(robot)
    inputs = inputs_of(robot, info, right_angles(robot, 2000))
    exact = expected(robot, info, inputs)
    q, residual, _ = called(built[name], name, info, inputs)
    solved = exact[1] <= 1e-9
    np.testing.assert_array_equal(residual <= SOLVED, solved)
    reached = robot.fk(q[solved].astype(float))
    T = np.broadcast_to(inputs[0][:, None], (*solved.shape, 4, 4))[solved]
    assert np.abs(reached - T).max() <= SOLVED
    distance = apart(q, exact[0]).max(axis=-1)
    assert distance[regular_slots(robot, info, *exact[:2])].max() <= 1e-4
    # For the UR5e, the single- and double-precision code find the same solutions.
    if name == "ur5e":
        assert distance[solved].max() <= 1e-4


@pytest.mark.parametrize("compiler", [pytest.param(cc, marks=needs(cc)) for cc in COMPILERS])
@pytest.mark.parametrize("name", NAMES)
def test_code_needs_no_double_no_heap_and_the_printed_stack(name, compiler, exported):
    folder = exported / name
    header = (folder / f"{name}_float.h").read_text()
    printed = re.findall(r"Stack: (\d+) bytes\. \*/\nvoid (\w+)\(", header)
    limits = {function: int(size) for size, function in printed}
    for level in LEVELS:
        options = [*FLAGS, *COMPILERS[compiler], level, "-fstack-usage", "-c", "-o", "robot.o"]
        compiled(compiler, [*options, f"{name}_float.c"], folder)
        usage = re.findall(r":(\w+)\t(\d+)\tstatic", (folder / "robot.su").read_text())
        sizes = {function: int(size) for function, size in usage if function in limits}
        assert sizes.keys() == limits.keys()
        assert all(sizes[function] <= limits[function] for function in limits), (level, sizes)
        symbols = compiler.replace("gcc", "nm")
        command = [symbols, "-u", "robot.o"]
        undefined = subprocess.run(command, cwd=folder, capture_output=True, check=True)
        assert set(undefined.stdout.decode().split()) - {"U"} <= CALLED


@needs("gcc")
def test_control_step_follows_a_path(built):
    robot, step = chasles.load("ur5e"), built["ur5e"].control_step
    q = np.array([0.4, -1.2, 1.3, 0.4, 0.5, 0.6], dtype=np.float32)
    path = q + np.linspace(0, 0.5, 200)[:, None] * np.array([1, -1, 0.5, 1, 1, -1])
    for T in robot.fk(path):
        pose = np.ascontiguousarray(T, dtype=np.float32)
        assert step(pose.ctypes.data_as(SINGLE), q.ctypes.data_as(SINGLE)) == 1
    np.testing.assert_allclose(q, path[-1], atol=1e-4)
    pose[0, 3] = 5
    assert step(pose.ctypes.data_as(SINGLE), q.ctypes.data_as(SINGLE)) == 0
    np.testing.assert_allclose(q, path[-1], atol=1e-4)


@needs(cortex_m4.CC)
@needs(cortex_m4.QEMU)
def test_cortex_m4_needs_few_instructions(exported):
    robot, folder, source = chasles.load("ur5e"), exported / "ur5e", "ur5e_float.c"
    q = configurations(robot, 20)
    T = robot.fk(q).reshape(-1, 16)
    count, pose = cortex_m4.results(folder, source, "ur5e_float_fk(x, y)", q, 16)
    assert count.max() <= 900
    assert np.abs(pose - T).max() <= printed_errors(exported, "ur5e", "fk")[0]
    call = "ur5e_float_ik(x, y, y + 48, y + 56)"
    count, found = cortex_m4.results(folder, source, call, T, 64)
    exact = robot.ik(T.reshape(-1, 4, 4))
    assert count.max() <= 10_000
    solved = exact.residual <= 1e-9
    assert (found[:, 48:56][solved] <= SOLVED).all()
    distance = apart(found[:, :48].reshape(-1, 8, 6), exact.q).max(axis=-1)
    assert distance[solved].max() <= printed_errors(exported, "ur5e", "ik")[0]


@needs("gcc")
def test_example_of_the_page_prints_its_comment(exported, tmp_path):
    (example,) = examples(PAGE, "c")
    (tmp_path / "main.c").write_text(example)
    code = exported / "ur5e"
    options = ["-I", str(code), str(code / "ur5e_float.c"), "main.c", "-lm", "-o", "main"]
    compiled("gcc", [*FLAGS, *options], tmp_path)
    done = subprocess.run([tmp_path / "main"], capture_output=True, check=True)
    (comment,) = re.findall(r"/\* (\d.*) \*/", example)
    assert done.stdout.decode().strip() == comment


@needs(cortex_m4.CC)
def test_command_and_interrupt_of_the_page_compile(exported, tmp_path):
    command, handler = examples(PAGE, "")
    code = exported / "ur5e"
    words = command.split()
    assert words[0] == cortex_m4.CC
    compiled(words[0], [*words[1:], *FLAGS, "-o", str(tmp_path / "robot.o")], code)
    comment = (code / "control_step.c").read_text().split("*/")[0]
    assert handler in re.sub(r"^ \*   ", "", comment, flags=re.MULTILINE)
    (tmp_path / "main.c").write_text(INTERRUPT + handler)
    compiled(words[0], ["-I", str(code), "-Wall", "-Werror", "-c", "main.c"], tmp_path)


def test_header_names_functions_that_need_double_precision(tmp_path):
    write(robot_of("jaco2"), tmp_path, functions=["fk", "ik"], languages=["c_float"])
    text = (tmp_path / "jaco2_float.h").read_text()
    assert "Only in double precision, because of an iterative solver: ik." in text
    assert "void jaco2_float_fk(" in text
    assert "jaco2_float_ik" not in text


def test_real_float_belongs_to_the_language_c(tmp_path, capsys):
    command = ["ur5e", "--to", str(tmp_path), "--real", "float"]
    assert main(["export", "cpp", *command]) == 1
    assert "use the language c" in capsys.readouterr().err
    assert main(["export", "c", *command, "--functions", "fk,jacobian_mixed,ik"]) == 0
    assert (tmp_path / "ur5e" / "ur5e_float.h").exists()
    assert not (tmp_path / "ur5e" / "ur5e.h").exists()
