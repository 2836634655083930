"""Generated C and the solvers that call it, under the compiler's sanitizers.

Reads and writes out of bounds, undefined behaviour and data races do not show in results.
"""

import os
import re
import shutil
import subprocess
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

import chasles
from chasles.contract.library import write_glue
from chasles.contract.manifest import read_manifest
from chasles.iterative.numeric_inverse import screws_before
from tests.support.tools import needs

DRIVER = Path(__file__).with_name("kernels.c")
SOLVERS = Path(__file__).with_name("solvers.c")
GENERATED = Path(__file__).parents[3] / "generated"
RUNTIME = Path(chasles.__file__).parent
INCLUDES = [f"-I{RUNTIME}", f"-I{RUNTIME / 'contract'}"]
SOLVER_SOURCES = [
    *sorted(map(str, (RUNTIME / "iterative" / "native").glob("*.c"))),
    str(RUNTIME / "velocity" / "native" / "damped_box.c"),
]
GCC = shutil.which("gcc")

# A build without flags has code for several instruction sets and chooses one when called. Here the
# better sets are hidden from it, so that each code runs. Linux lists the sets of the processor.
CHOSEN = [
    *("-include", str(DRIVER.with_name("chosen_sets.h"))),
    "-D__builtin_cpu_supports(set)=chosen_sets_have(set)",
]
SETS = {
    "avx512": ("avx512f", "avx512dq", "avx512vl", "avx2", "fma"),
    "avx2": ("avx2", "fma"),
    "baseline": (),
}

CASES = 40 * 6 + 4
"""Batch lengths times layouts, and long batches at different alignments, per function."""

pytestmark = needs("gcc")


def build(name, folder, *flags):
    """Compiles the driver with all functions of a robot."""
    manifest = read_manifest(GENERATED / name)
    (folder / "glue.c").write_text(write_glue(manifest))
    paths = [*INCLUDES, f"-I{manifest.folder}"]
    command = [GCC, "-std=gnu99", "-Wall", "-Wextra", "-Werror", "-Wno-psabi", *flags, *paths]
    libraries = ["-lpthread", "-lmvec", "-lm"]
    subprocess.run(
        [*command, str(DRIVER), "glue.c", "-o", "kernels", *libraries], cwd=folder, check=True
    )
    return folder / "kernels", len(manifest.functions)


def build_solvers(name, folder, sanitizers):
    """Compiles the driver of the solvers with a robot's functions for one pose at a time."""
    manifest = read_manifest(GENERATED / name)
    files = {file: digest for file, digest in manifest.files.items() if file != manifest.batch_file}
    (folder / "glue.c").write_text(write_glue(replace(manifest, files=files)))
    flags = ["-std=gnu11", "-Wall", "-Wextra", "-Werror", "-O1", "-fno-sanitize-recover=all"]
    paths = [f"-fsanitize={sanitizers}", *INCLUDES, f"-I{manifest.folder}"]
    command = [GCC, *flags, *paths, str(SOLVERS), *SOLVER_SOURCES, "glue.c", "-o", "solvers"]
    subprocess.run([*command, "-lpthread", "-lm"], cwd=folder, check=True)
    return folder / "solvers"


def run(program, mode, given="", sets=()):
    environment = {**os.environ, "CHOSEN_SETS": " ".join(sets)}
    ways = {"capture_output": True, "text": True}
    done = subprocess.run([program, mode], check=False, input=given, env=environment, **ways)
    assert done.returncode == 0, done.stderr[:3000]
    return int(done.stdout)


def require(folder, sanitizer):
    """Skips the test where an empty program cannot be compiled or run with the sanitizer."""
    (folder / "empty.c").write_text("int main(void) { return 0; }\n")
    command = [GCC, f"-fsanitize={sanitizer}", "empty.c", "-o", "empty"]
    for step in (command, ["./empty"]):
        done = subprocess.run(step, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            pytest.skip(f"the sanitizer {sanitizer} does not run: {done.stderr[:200]}")


def require_processor(chosen):
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        text = ""
    found = re.search(r"^flags\s*:(.*)$", text, re.MULTILINE)
    missing = set(SETS[chosen]) - set(found[1].split() if found else ())
    if missing:
        pytest.skip(f"this processor has no {', '.join(sorted(missing))}")


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A program with code for all instruction sets, by robot and flags."""

    @cache
    def of(name, *flags):
        return build(name, tmp_path_factory.mktemp(name), *CHOSEN, *flags)

    return of


@pytest.mark.parametrize("chosen", SETS)
@pytest.mark.parametrize("name", ["ur5e", "panda"])
def test_generated_code_stays_within_array_bounds(name, chosen, built, tmp_path):
    require_processor(chosen)
    require(tmp_path, "address")
    program, functions = built(name, "-Og", "-fsanitize=address")
    assert run(program, "bounds", sets=SETS[chosen]) == functions * CASES


def test_generated_code_has_no_undefined_behaviour(tmp_path):
    require(tmp_path, "undefined")
    watch = ["-Og", "-fsanitize=undefined", "-fno-sanitize-recover=all"]
    program, functions = build("ur5e", tmp_path, "-march=native", *watch)
    assert run(program, "bounds") == functions * CASES


@pytest.mark.parametrize("chosen", SETS)
def test_vector_code_touches_only_its_rows(chosen, built):
    """Optimized code between protected pages: the sanitizer knows no masked or streaming stores."""
    require_processor(chosen)
    program, functions = built("panda", "-O2")
    assert run(program, "pages", sets=SETS[chosen]) == 2 * functions * CASES


@pytest.mark.parametrize("flags", [["-march=native"], []], ids=["native", "any processor"])
def test_generated_code_has_no_data_races(flags, tmp_path):
    require(tmp_path, "thread")
    program, functions = build("ur5e", tmp_path, "-Og", "-fsanitize=thread", *flags)
    assert run(program, "threads") == functions
    found = subprocess.run([program, "race"], capture_output=True, text=True, check=False)
    assert "data race" in found.stderr, "the sanitizer misses a data race"


SHARED = {"solve": 576, "decompose": 575, "logarithm": 600}
"""Cases of each mode of the functions that the solvers share."""


def test_shared_numerics_are_correct_and_memory_safe(tmp_path):
    require(tmp_path, "address,undefined")
    flags = ["-std=gnu11", "-Wall", "-Wextra", "-Werror", "-O1", "-fsanitize=address,undefined"]
    sources = [str(DRIVER.with_name("numerics.c")), str(RUNTIME / "numerics" / "_svd.c")]
    program = tmp_path / "numerics"
    command = [GCC, *flags, "-fno-sanitize-recover=all", *INCLUDES, *sources, "-o", str(program)]
    subprocess.run([*command, "-lm"], check=True)
    assert {mode: run(program, mode) for mode in SHARED} == SHARED


SOLVED = {"tool": 5 * 24, "link": 5 * 24, "platform": 5 * 24, "box": 400}
"""Cases of each mode: poses times tasks, with seeds and without; steps along a path."""


def screws_for(name):
    """The screws between the base and the last link but one, as the driver reads them."""
    robot = chasles.load(name)
    screws = screws_before(robot, len(robot.frames.links) - 2)
    return "\n".join([str(len(screws)), *(" ".join(map(repr, row)) for row in screws.tolist())])


@pytest.mark.parametrize(
    ("name", "modes"),
    [
        ("ur5e", ["tool", "box"]),
        ("panda", ["tool", "link", "box"]),
        ("stewart_gough", ["platform"]),
    ],
    ids=["ur5e", "panda", "stewart_gough"],
)
def test_iterative_solvers_are_memory_safe(name, modes, tmp_path):
    require(tmp_path, "address,undefined")
    program = build_solvers(name, tmp_path, "address,undefined")
    for mode in modes:
        assert run(program, mode, screws_for(name) if mode == "link" else "") == SOLVED[mode]


def test_iterative_solver_has_no_data_races(tmp_path):
    require(tmp_path, "thread")
    assert run(build_solvers("ur5e", tmp_path, "thread"), "tool") == SOLVED["tool"]
