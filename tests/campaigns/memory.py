"""Runs the generated C code of shipped robots with compiler sanitizers.

Sanitizers detect out-of-bounds access, undefined behavior and data races even if such faults do not
change the results.
"""

import os
import random
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import chasles
from chasles.contract import read_manifest
from chasles.library.cache import write_glue
from tests.support.processor import features

from .campaign import Campaign, Outcome

DRIVER = Path(__file__).parents[1] / "support" / "native" / "kernels.c"
SOLVERS = DRIVER.with_name("solvers.c")
GENERATED = Path(__file__).parents[2] / "generated"
RUNTIME = Path(chasles.__file__).parent
INCLUDES = [f"-I{RUNTIME}", f"-I{RUNTIME / 'library'}"]
SUPPORT = f"-I{GENERATED / 'support'}"
SOLVER_SOURCES = [
    *sorted(map(str, (RUNTIME / "iterative" / "native").glob("*.c"))),
    str(RUNTIME / "velocity" / "native" / "damped_box.c"),
]
GCC = shutil.which("gcc")

# A default build contains code for several instruction sets and selects one at run time. The test
# hides newer instruction sets so that the code for older instruction sets also runs. The test reads
# the processor's instruction sets from the list that Linux provides.
CHOSEN = [
    *("-include", str(DRIVER.with_name("chosen_sets.h"))),
    "-D__builtin_cpu_supports(set)=chosen_sets_have(set)",
]
SETS = {
    "avx512": ("avx512f", "avx512dq", "avx512vl", "avx2", "fma"),
    "avx2": ("avx2", "fma"),
    "baseline": (),
}

ROBOTS = ("ur5e", "panda", "scara")
"""Names of the tested robots, which are serial because loops cannot be closed at arbitrary inputs.
"""
CASES = 40 * 6 + 4
"""Number of test cases per function: 40 batch lengths with 6 memory layouts each, and 4 long
batches with different memory alignments."""


def build(name, folder, *flags, compiler=GCC):
    manifest = read_manifest(GENERATED / name)
    (folder / "glue.c").write_bytes(write_glue(manifest))
    paths = [*INCLUDES, f"-I{manifest.folder}", SUPPORT]
    command = [compiler, "-std=gnu99", "-Wall", "-Wextra", "-Werror", "-Wno-psabi", *flags, *paths]
    libraries = ["-lpthread", "-lmvec", "-lm"]
    subprocess.run(
        [*command, str(DRIVER), "glue.c", "-o", "kernels", *libraries], cwd=folder, check=True
    )
    return folder / "kernels", len(manifest.functions)


def build_solvers(name, folder, sanitizers):
    manifest = read_manifest(GENERATED / name)
    files = {file: digest for file, digest in manifest.files.items() if file != manifest.batch_file}
    (folder / "glue.c").write_bytes(write_glue(replace(manifest, files=files)))
    flags = ["-std=gnu11", "-Wall", "-Wextra", "-Werror", "-Og", "-fno-sanitize-recover=all"]
    paths = [f"-fsanitize={sanitizers}", *INCLUDES, f"-I{manifest.folder}", SUPPORT]
    command = [GCC, *flags, *paths, str(SOLVERS), *SOLVER_SOURCES, "glue.c", "-o", "solvers"]
    subprocess.run([*command, "-lpthread", "-lm"], cwd=folder, check=True)
    return folder / "solvers"


def run(program, mode, given="", sets=()):
    environment = {**os.environ, "CHOSEN_SETS": " ".join(sets)}
    ways = {"capture_output": True, "text": True}
    done = subprocess.run([program, mode], check=False, input=given, env=environment, **ways)
    assert done.returncode == 0, done.stderr[:3000]
    return int(done.stdout)


def trial(number: int) -> Outcome:
    draw = random.Random(number)
    name, kind = draw.choice(ROBOTS), draw.choice(("address", "undefined", "thread"))
    flags = ["-O0", f"-fsanitize={kind}", "-fno-sanitize-recover=all"]
    with TemporaryDirectory() as folder:
        program, functions = build(name, Path(folder), *CHOSEN, *flags)
        sets = [chosen for chosen, needed in SETS.items() if set(needed) <= features()]
        mode, cases = ("threads", 1) if kind == "thread" else ("bounds", CASES)
        counted = [run(program, mode, sets=SETS[chosen]) for chosen in sets]
    if counted != [functions * cases] * len(sets):
        return Outcome(failures=(f"{name}, {kind}: {counted} cases of {functions} functions",))
    return Outcome({"functions": functions, "cases": sum(counted)})


CAMPAIGN = Campaign(
    "memory",
    "No function of some serial robots reads or writes out of bounds, is undefined, or races.",
    trial,
)
