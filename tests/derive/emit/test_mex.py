"""MATLAB functions, compiled and called by Octave, and the S-function of Simulink."""

import ctypes
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

import chasles
from tests.support.cpp_driver import inputs_of
from tests.support.exports import inverse_of, right_angles
from tests.support.octave import (
    FUNCTIONS,
    call,
    difference_of_solutions,
    exported,
    make,
    missing_solutions,
    octave,
    results,
)
from tests.support.pages import examples
from tests.support.tools import needs

NAMES = ["ur5e", "excavator"]
PAGE = "how-to/matlab.md"
SAMPLES = 100
TOLERANCE = 1e-12
SIMULINK = Path(__file__).parents[2] / "support" / "simulink"
WRONG = {
    "ur5e_fk(zeros(5, 1))": "q: expected 6 x 1 or 6 x N real doubles",
    "ur5e_fk(single(zeros(6, 1)))": "q: expected 6 x 1 or 6 x N real doubles",
    "ur5e_fk(zeros(6, 2) + 1i)": "q: expected 6 x 1 or 6 x N real doubles",
    "ur5e_ik(zeros(4, 3))": "T: expected 4 x 4 or 4 x 4 x N real doubles",
    "ur5e_ik_nearest(eye(4))": "ik_nearest: expected 2 to 5 inputs",
    "ur5e_ik_nearest(zeros(4, 4, 2), zeros(6, 3))": "different numbers of configurations",
    "chasles_ur5e('no')": "no function no",
    "chasles_ur5e()": "expected the name of a function",
}


def compared(robot):
    return [info for info in robot.manifest.functions if info.name in FUNCTIONS]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder, script = tmp_path_factory.mktemp("octave"), []
    (folder / "robots").symlink_to(folder)
    for name in NAMES:
        robot = chasles.load(name)
        exported(robot, folder)
        script.append(examples(PAGE, "")[0] if name == "ur5e" else make(name))
        for info in compared(robot):
            inputs = inputs_of(robot, info, np.random.default_rng(4), SAMPLES)
            script.append(call(name, info, inputs, folder, name))
    robot = chasles.load("ur5e")
    poses = robot.fk(right_angles(robot, 50))
    script.append(call("ur5e", inverse_of(robot), [poses], folder, "right"))
    script.append(Path(folder, "page.m").name[:-2])
    Path(folder, "page.m").write_text(examples(PAGE, "matlab")[0])
    tries = [
        f"try, {code}; catch failure, printf('%s | %s\\n', \"{code}\", failure.message); end"
        for code in WRONG
    ]
    shapes = "disp(size(ur5e_fk(zeros(1, 6)))); disp(size(ur5e_ik(zeros(4, 4, 0))))"
    text = octave("\n".join([*script, *tries, "disp(class(valid))", shapes]), folder)
    (folder / "printed.txt").write_text(text)
    return folder


@needs("octave-cli")
@pytest.mark.parametrize("name", NAMES)
def test_functions_equal_the_compiled_c(name, folder):
    robot = chasles.load(name)
    checked = 0
    for info in compared(robot):
        inputs = inputs_of(robot, info, np.random.default_rng(4), SAMPLES)
        found = results(info, SAMPLES, folder, name)
        if info.role.is_inverse:
            worst, solutions = difference_of_solutions(robot, inputs, found)
            assert worst <= TOLERANCE
            assert solutions >= SAMPLES
        else:
            exact = robot.functions[info.name].ufunc(*inputs)
            exact = exact if isinstance(exact, tuple) else (exact,)
            for x, y in zip(found, exact, strict=True):
                np.testing.assert_allclose(x, y, rtol=TOLERANCE, atol=TOLERANCE)
        checked += 1
    assert checked >= 4


@needs("octave-cli")
def test_inverse_is_complete_at_right_angle_poses(folder):
    robot = chasles.load("ur5e")
    poses = robot.fk(right_angles(robot, 50))
    found = results(inverse_of(robot), len(poses), folder, "right")
    assert missing_solutions(robot, [poses], found) == 0


@needs("octave-cli")
def test_errors_shapes_and_page(folder):
    printed = (folder / "printed.txt").read_text()
    for code, message in WRONG.items():
        (line,) = (line for line in printed.splitlines() if line.startswith(f"{code} | "))
        assert message in line
    assert "logical" in printed
    tail = printed.splitlines()[-2:]
    assert [line.split() for line in tail] == [["4", "4"], ["6", "8", "0"]]
    for comment in re.findall(r"% (.*)$", examples(PAGE, "matlab")[0], re.MULTILINE):
        assert comment in printed


def test_each_function_has_its_help(tmp_path):
    robot = chasles.load("ur5e")
    help_of = {file.stem: file.read_text() for file in exported(robot, tmp_path).glob("ur5e_*.m")}
    assert set(help_of) == {
        *(f"ur5e_{name}" for name in FUNCTIONS & set(robot.functions)),
        "ur5e_ik_nearest",
    }
    for name, text in help_of.items():
        assert text.splitlines()[1].startswith(f"% {name.upper()}  ")
        assert "For N configurations" in text


@needs("gcc")
@pytest.mark.parametrize("name", NAMES)
def test_s_function_computes_a_step(name, tmp_path):
    robot, made = chasles.load(name), exported(chasles.load(name), tmp_path)
    source = made / "src" / f"chasles_{name}_sfunction.c"
    warnings = ["-Wall", "-Wextra", "-Werror", "-DMATLAB_MEX_FILE"]
    flags = ["-std=c99", "-O1", "-shared", "-fPIC", f"-I{SIMULINK}", f"-I{made / 'src'}"]
    library = tmp_path / "block.so"
    sources = [source, made / "src" / f"{name}.c"]
    subprocess.run(["gcc", *flags, *warnings, *sources, "-lm", "-o", library], check=True)
    block = ctypes.CDLL(str(library))

    def simulate(function, *inputs):
        values = np.concatenate([np.ravel(x, order="F") for x in inputs])
        outputs = np.full(1000, np.nan)
        passed = (np.ctypeslib.as_ctypes(values), np.ctypeslib.as_ctypes(outputs))
        return outputs[: block.simulate(function.encode(), *passed)]

    q = np.array(robot.reference.q if robot.reference else [0.3, -1.2, 1.4, -0.5, 0.8, 0.2])
    T, J = robot.fk_jacobian_mixed(q)
    found = simulate("fk_jacobian_mixed", q)
    expected = np.concatenate([T.ravel(order="F"), J.ravel(order="F")])
    np.testing.assert_allclose(found, expected, atol=TOLERANCE)
    solution = simulate("ik_nearest", T, q + 0.01)
    np.testing.assert_allclose(solution[: robot.n], q, atol=1e-9)
    assert solution[robot.n] >= 1
    assert block.simulate(b"no", None, None) == -1
