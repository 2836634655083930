"""Runs the examples of the documentation page about generated C code."""

import ctypes
import re
import subprocess

import numpy as np
import pytest

import chasles
from tests.support.compiling import COMPILER
from tests.support.derivations import GENERATED
from tests.support.pages import examples

PAGE = "how-to/c.md"
STRICT = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror"]
DOUBLES = ctypes.POINTER(ctypes.c_double)


@pytest.fixture
def folder(tmp_path):
    """Return a temporary folder that contains a link to the generated robots."""
    (tmp_path / "generated").symlink_to(GENERATED)
    return tmp_path


def test_program_prints_its_comment(folder):
    program, (command,) = examples(PAGE, "c")[0], examples(PAGE, "")
    (folder / "main.c").write_text(program)
    subprocess.run([*command.split(), *STRICT], cwd=folder, check=True)
    done = subprocess.run(["./a.out"], cwd=folder, capture_output=True, text=True, check=True)
    assert done.stdout.strip() in re.findall(r"/\* (.*) \*/", program)


def test_functions_for_one_pose_and_many_poses(folder):
    functions = examples(PAGE, "c")[1:]
    assert len(functions) == 2
    (folder / "page.c").write_text("\n".join(functions))
    generated = [f"generated/ur5e/ur5e{part}.c" for part in ("", "_batch")]
    places = ["-fPIC", "-Igenerated/ur5e", "-Igenerated/support"]
    # GCC takes four seconds to compile the generated code, so this test prefers Clang. Other tests
    # compile the generated code with GCC.
    for command in (
        ["gcc", *STRICT, "-O1", *places, "-c", "page.c"],
        [
            COMPILER or "gcc",
            "-O0",
            *places,
            "-shared",
            *generated,
            "page.o",
            "-lm",
            "-o",
            "page.so",
        ],
    ):
        subprocess.run(command, cwd=folder, check=True)
    page, robot = ctypes.CDLL(str(folder / "page.so")), chasles.load("ur5e")
    rows = np.random.default_rng(1).uniform(-3, 3, (20, 6))
    poses = np.empty((20, 4, 4))
    page.reach(ctypes.c_size_t(20), address(rows), address(poses))
    np.testing.assert_allclose(poses, robot.fk(rows), atol=1e-12)
    for T, row in zip(poses, rows, strict=True):
        q = row + 0.01
        assert page.follow(address(T), address(q)) == 1
        np.testing.assert_allclose(robot.fk(q), T, atol=1e-9)
        np.testing.assert_allclose(q, robot.ik_nearest(T, row + 0.01).q, atol=1e-9)
    poses[0, :3, 3] = 9
    assert page.follow(address(poses[0]), address(q)) == 0
    assert np.isnan(q).all()


def address(array):
    return array.ctypes.data_as(DOUBLES)
