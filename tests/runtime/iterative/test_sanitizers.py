"""Generated C and its solvers run under the compiler's sanitizers.

The campaign ``memory`` runs the generated C of other robots under the sanitizers.
"""

import json
import re
import shutil
import subprocess
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

import chasles
from chasles.iterative.numeric_inverse import screws_up_to
from tests.campaigns.memory import (
    CASES,
    CHOSEN,
    DRIVER,
    GCC,
    GENERATED,
    INCLUDES,
    RUNTIME,
    SETS,
    build,
    build_solvers,
    run,
)
from tests.support.compiling import COMPILER
from tests.support.processor import require_features
from tests.support.tools import needs

pytestmark = needs("gcc")
SMALL, LARGE = "scara", "panda"
"""The robot SMALL compiles fast, and has vector code, branches and both joint types."""
SHAPES = ("acceleration_mixed", "ik")
"""Tested functions: one with several inputs and one result, and one with branches and several
results.

The test campaign ``memory`` runs all functions.
"""
SUFFIXES = ("", "_branch", "_rows", "_batch")
"""Suffixes of the C functions that belong to one generated function."""
UNUSED = "-Wno-unused-function"
"""Compiler option that turns off the warning about unused functions, because no test calls some
functions of the vector code."""
FUNCTION = re.compile(r"^(?:static )?void (\w+)\(.*?^}\n", re.MULTILINE | re.DOTALL)


def part(name, functions, folder):
    made = Path(shutil.copytree(GENERATED / name, folder / name))
    shutil.copytree(GENERATED / "support", folder / "support", dirs_exist_ok=True)
    manifest = made / "manifest.json"
    content = json.loads(manifest.read_text())
    left_out = [f["name"] for f in content["functions"] if f["name"] not in functions]
    content["functions"] = [f for f in content["functions"] if f["name"] in functions]
    assert len(content["functions"]) == len(functions)
    manifest.write_text(json.dumps(content))
    cut = {f"{name}_{function}{suffix}" for function in left_out for suffix in SUFFIXES}
    for source in (made / f"{name}.c", made / f"{name}_batch.c"):
        text = source.read_text()
        if "ik" in left_out:
            text = text.replace(f'#include "{name}_nearest.h"\n', "")
        source.write_text(FUNCTION.sub(lambda one: "" if one[1] in cut else one[0], text))
    return made


@cache
def error_of(sanitizer):
    """Compile and run an empty program with the sanitizer.

    The function returns the error message, or None if the empty program runs.
    """
    with TemporaryDirectory() as folder:
        Path(folder, "empty.c").write_text("int main(void) { return 0; }\n")
        command = [GCC, f"-fsanitize={sanitizer}", "empty.c", "-o", "empty"]
        for step in (command, ["./empty"]):
            done = subprocess.run(step, cwd=folder, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                return done.stderr[:200]
    return None


def require(sanitizer):
    """Skip the test if the sanitizer cannot compile or run an empty program."""
    if (error := error_of(sanitizer)) is not None:
        pytest.skip(f"the sanitizer {sanitizer} does not run: {error}")


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Return a function that compiles a test program of a robot for all instruction sets."""

    @cache
    def of(name, *flags, compiler=GCC):
        folder = tmp_path_factory.mktemp(name)
        made = part(name, SHAPES, folder)
        return build(made, folder, UNUSED, *CHOSEN, *flags, compiler=compiler)

    return of


WATCHED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")


@pytest.mark.parametrize("chosen", SETS)
def test_generated_code_stays_in_bounds_without_undefined_behaviour(chosen, built):
    require_features(SETS[chosen])
    require("address,undefined")
    program, functions = built(SMALL, "-Og", *WATCHED)
    assert run(program, "bounds", sets=SETS[chosen]) == functions * CASES


@pytest.mark.parametrize("chosen", SETS)
def test_vector_code_touches_only_its_rows(chosen, built):
    """Protected pages surround the data, because sanitizers miss masked and streaming stores."""
    require_features(SETS[chosen])
    program, functions = built(SMALL, "-O1", compiler=COMPILER or GCC)
    assert run(program, "pages", sets=SETS[chosen]) == 2 * functions * CASES


def test_generated_code_has_no_data_races(tmp_path):
    """A build for one processor would not select the instruction set at run time."""
    require("thread")
    small = part(SMALL, ["ik"], tmp_path)
    program, functions = build(small, tmp_path, UNUSED, "-Og", "-fsanitize=thread")
    assert run(program, "threads") == functions
    found = subprocess.run([program, "race"], capture_output=True, text=True, check=False)
    assert "data race" in found.stderr, "the sanitizer misses a data race"


SHARED = {"solve": 400, "decompose": 575, "logarithm": 600}
"""Number of test cases for each mode of the program `numerics.c`, which tests the shared numerical
code."""


def test_shared_numerics_are_correct_and_memory_safe(tmp_path):
    require("address,undefined")
    flags = ["-std=gnu11", "-Wall", "-Wextra", "-Werror", "-O0", "-fsanitize=address,undefined"]
    sources = [str(DRIVER.with_name("numerics.c")), str(RUNTIME / "numerics" / "_svd.c")]
    program = tmp_path / "numerics"
    command = [GCC, *flags, "-fno-sanitize-recover=all", *INCLUDES, *sources, "-o", str(program)]
    subprocess.run([*command, "-lm"], check=True)
    assert {mode: run(program, mode) for mode in SHARED} == SHARED


CALLED = {
    "tool": ("fk_jacobian_mixed", "hessian_mixed"),
    "link": ("link_poses",),
    "box": ("fk_jacobian_mixed",),
}
"""Functions that the driver calls in each test mode for serial robots."""
SOLVED = {"tool": 5 * 24, "link": 5 * 24, "box": 400}
"""Number of test cases for each mode: poses and tasks, with and without start values, and steps
along a path."""


def screws_for(name):
    """Return screws of the links in the driver's input format."""
    robot = chasles.load(name)
    screws = screws_up_to(robot.manifest, len(robot.link_names) - 2)
    return "\n".join([str(len(screws)), *(" ".join(map(repr, row)) for row in screws.tolist())])


def test_iterative_solvers_are_memory_safe(tmp_path):
    require("address,undefined")
    called = {function for functions in CALLED.values() for function in functions}
    program = build_solvers(part(LARGE, called, tmp_path), tmp_path, "address,undefined")
    for mode in CALLED:
        assert run(program, mode, screws_for(LARGE) if mode == "link" else "") == SOLVED[mode]


def test_iterative_solver_has_no_data_races(tmp_path):
    require("thread")
    small = part(SMALL, CALLED["tool"], tmp_path)
    assert run(build_solvers(small, tmp_path, "thread"), "tool") == SOLVED["tool"]
