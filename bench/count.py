"""Instruction counts from valgrind, reproducible on a busy machine.

Instructions of the math library are excluded. To count a call from Python, one run makes 100 calls
and another run makes 400 calls. The difference of the two instruction counts, divided by 300, is
the instruction count of one call.
"""

import json
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

import chasles
import chasles.derive
from chasles.contract import SUPPORT
from tests.support.native import compiler_version
from tests.support.oracles.screws import ROBOTS

from .cases.arms import ARMS
from .report import out, table

EXPECTED = Path(__file__).with_name("instructions.json")
FLAGS = ("-O2", "-march=x86-64", "-std=c99")
FUNCTIONS = ("fk", "jacobian_mixed", "fk_jacobian_mixed", "jacobian_mixed_dot", "hessian_mixed")
COUNTED = {
    **{arm.name: FUNCTIONS for arm in ARMS},
    "well_manipulator": ("fk_jacobian_mixed",),
    "board_installer": ("fk_jacobian_mixed",),
    "five_bar": ("fk_jacobian_mixed", "chain", "chain_D_q"),
}
"""Names of the kernels whose instructions are counted, keyed by robot."""
RISE = 0.02
"""Maximum relative increase of an instruction count that passes the check."""
TIMES = 100
"""Number of counted calls of a kernel."""
CALLS = (100, 400)
"""Numbers of Python calls in the short and in the long measurement."""
CALLED = ("fk", "fk_jacobian_mixed")
"""Robot functions that the measured Python program calls."""
PYTHON = """
import ctypes, os, sys, numpy as np, chasles
library, *folders = sys.argv[1:]
calls = [
    (getattr(arm, function), np.linspace(-1.0, 1.0, arm.n))
    for arm in map(chasles.load, folders)
    for function in CALLED
]
ctypes.CDLL(library).start()
for call, q in calls:
    for count in (50, *CALLS):
        for _ in range(count):
            call(q)
        os.getppid()
"""
"""Python program that calls the functions whose instructions are counted.

At each getppid call, valgrind writes its instruction counts and sets them to zero.
"""
START = """
#include <valgrind/callgrind.h>
void start(void) { CALLGRIND_START_INSTRUMENTATION; }
"""
"""C function that starts the instruction counting of valgrind.

The Python program calls the function after the slow imports.
"""


def run(write: bool) -> int:
    """Count instructions, then write or check the expected counts."""
    reason = impossible()
    if reason:
        out.print(f"cannot count instructions: {reason}")
        return 0
    found = {"versions": versions(), "kernels": kernels(), "python": python_calls()}
    if write:
        EXPECTED.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
        return 0
    expected = json.loads(EXPECTED.read_text(encoding="utf-8"))
    failures = [
        *compare("kernels", expected, found, ("compiler",), exactly=True),
        *compare("python", expected, found, tuple(found["versions"])),
    ]
    for line in failures:
        out.print(f"different instruction count: {line}")
    return 1 if failures else 0


def impossible() -> str | None:
    """Return the reason why this machine cannot count instructions, or None."""
    if platform.machine() != "x86_64":
        return "the counts are of x86-64"
    missing = [name for name in ("valgrind", "gcc") if shutil.which(name) is None]
    return f"{' and '.join(missing)} not installed" if missing else None


def versions() -> dict[str, str]:
    return {
        "compiler": compiler_version(("gcc",)),
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "libc": " ".join(platform.libc_ver()),
    }


def compare(
    kind: str,
    expected: Mapping[str, dict],
    found: Mapping[str, dict],
    same: tuple[str, ...],
    exactly: bool = False,
) -> list[str]:
    """Print the instruction counts of functions next to the expected counts.

    Args:
        kind: "kernels" or "python".
        expected: Expected software versions and instruction counts, from bench/instructions.json.
        found: Software versions and instruction counts, measured on the current machine.
        same: Names of programs whose version affects the instruction counts, such as "compiler". If
            one of these programs has another version than expected, no instruction count is
            checked.
        exactly: If True, any changed instruction count or missing function fails the check. If
            False, only a relative increase above RISE fails the check.

    Returns:
        One line for each instruction count that fails the check.
    """
    other = [n for n in same if expected["versions"].get(n) != found["versions"][n]]
    rows = [(name, expected[kind].get(name, "new"), count) for name, count in found[kind].items()]
    message = f" (another {', '.join(other)}: for information)" if other else ""
    table(f"Instructions, {kind}{message}", ("function", "expected", "now"), rows)
    if other:
        return []
    return (differences if exactly else rises)(expected[kind], found[kind])


def differences(expected: Mapping[str, int], found: Mapping[str, int]) -> list[str]:
    """Return the functions whose count is missing or differs from the expected count."""
    names = {**expected, **found}
    return [
        f"{name}: {found.get(name, 'not counted')}, expected {expected.get(name, 'none')}"
        for name in names
        if found.get(name) != expected.get(name)
    ]


def rises(expected: Mapping[str, int], found: Mapping[str, int]) -> list[str]:
    """Return the functions with a count that increased by more than RISE."""
    both = [name for name in found if name in expected]
    return [
        f"{name}: {found[name]}, were {expected[name]}"
        for name in both
        if found[name] > expected[name] * (1 + RISE)
    ]


def kernels() -> dict[str, int]:
    """Return the instructions per call of each generated kernel, without the math library."""
    with tempfile.TemporaryDirectory() as folder:
        return {
            f"{name}.{function}": count
            for name in COUNTED
            for function, count in _of_robot(name, Path(folder)).items()
        }


def _of_robot(name: str, folder: Path) -> dict[str, int]:
    robot = chasles.load(name)
    main = folder / f"{name}_main.c"
    main.write_text(_driver(robot), encoding="utf-8")
    program = folder / name
    # Bind symbols at program start (-z now). With lazy binding, the first call of a library
    # function would include the instructions of the dynamic linker.
    options = [
        f"-I{robot.folder}",
        f"-I{robot.folder.parent / SUPPORT}",
        str(main),
        "-o",
        str(program),
        "-lm",
        "-Wl,-z,now",
    ]
    subprocess.run(["gcc", *FLAGS, *options], check=True)
    profile = folder / f"{name}.out"
    options = [
        "--tool=callgrind",
        "--dump-before=getppid",
        f"--callgrind-out-file={profile}",
        "--compress-strings=no",
    ]
    subprocess.run(["valgrind", *options, str(program)], check=True, capture_output=True)
    # valgrind writes one output file per getppid call. The first file contains the program start.
    # Each later file contains the calls of one kernel.
    parts = [Path(f"{profile}.{k + 2}") for k in range(len(COUNTED[name]))]
    totals = [
        own_instructions(part.read_text(encoding="utf-8"), (f"{name}_", "chasles_"))
        for part in parts
    ]
    return {f: round(total / TIMES) for f, total in zip(COUNTED[name], totals, strict=True)}


def _driver(robot: chasles.Robot) -> str:
    """Return a C program that calls each kernel ``TIMES`` times.

    Calls of getppid mark the intervals.
    """
    start, step = _inputs(robot)
    calls = []
    for name in COUNTED[robot.name]:
        function = robot.functions[name]
        outputs = ", ".join(f"out[{k}]" for k in range(len(function.outputs)))
        inputs = ", ".join("in" for _ in function.inputs)
        calls += [
            f"    for (int k = 0; k < {TIMES}; k++) {{",
            f"        for (int i = 0; i < {robot.n}; i++) in[i] = start[i] + {step} * k;",
            f"        {robot.name}_{name}({inputs}, {outputs});",
            "    }",
            "    getppid();",
        ]
    return "\n".join(
        (
            f'#include "{robot.name}.c"',
            "#include <unistd.h>",
            "static double in[64], out[4][4096];",
            f"static const double start[] = {{{', '.join(map(repr, start))}}};",
            "int main(void)",
            "{",
            "    getppid();",
            *calls,
            "    return 0;",
            "}",
            "",
        )
    )


def _inputs(robot: chasles.Robot) -> tuple[list[float], float]:
    """Return (first input vector, step between inputs). The loops close at all inputs."""
    if robot.reference:
        return list(robot.reference.q), 0.0001
    return [0.1 * (i + 1) for i in range(robot.n)], 0.01


def own_instructions(profile: str, prefixes: tuple[str, ...]) -> int:
    """Return the number of instructions of the functions whose names start with a prefix.

    The instructions of a called function count only if its own name starts with a prefix.
    """
    total, ours, called = 0, False, False
    for line in profile.splitlines():
        if line.startswith("fn="):
            ours = line[3:].startswith(prefixes)
        elif line.startswith("calls="):
            called = True
        elif re.match(r"[+\-*\d]", line):
            # In the profile, the line after "calls=" contains the instructions of the called
            # function.
            total += int(line.split()[1]) if ours and not called else 0
            called = False
    return total


def python_calls() -> dict[str, int]:
    """Return the number of instructions of a Python call.

    The number includes the kernel and the math library.
    """
    names = [f"{arm.name}.{function}" for arm in ARMS for function in CALLED]
    with tempfile.TemporaryDirectory() as folder:
        arms = [_with_called_functions(arm.name, Path(folder)) for arm in ARMS]
        start = Path(folder, "start.c")
        start.write_text(START, encoding="utf-8")
        library = f"{folder}/start.so"
        subprocess.run(["gcc", "-shared", "-fPIC", str(start), "-o", library], check=True)
        # Run the program once without valgrind to compile the robots. So valgrind does not
        # trace the compiler.
        _python(library, *arms)
        options = [
            "--tool=callgrind",
            "--instr-atstart=no",
            "--dump-before=getppid",
            f"--callgrind-out-file={folder}/out",
        ]
        _python(library, *arms, before=("valgrind", *options))
        parts = [_total(Path(f"{folder}/out.{k + 1}")) for k in range(3 * len(names))]
    few, many = parts[1::3], parts[2::3]
    more = CALLS[1] - CALLS[0]
    return {n: round((b - a) / more) for n, a, b in zip(names, few, many, strict=True)}


def _with_called_functions(name: str, folder: Path) -> str:
    """Derive a shipped robot again, with only the functions in CALLED. Return the folder."""
    target = folder / name
    described = chasles.derive.read(ROBOTS / f"{name}.toml")
    chasles.derive.write(described, target, functions=CALLED, languages=("c", "python"))
    return str(target)


def _python(*arguments: str, before: tuple[str, ...] = ()) -> None:
    program = PYTHON.replace("CALLS", str(CALLS)).replace("CALLED", str(CALLED))
    # valgrind does not run AVX-512. The library is therefore compiled without AVX-512.
    settings = {
        "CC": "gcc",
        "CHASLES_CACHE": f"{Path(arguments[0]).parent}/cache",
        "CHASLES_CFLAGS": "-O2 -march=x86-64",
        "PYTHONHASHSEED": "0",
    }
    command = [*before, sys.executable, "-c", program, *arguments]
    subprocess.run(command, check=True, capture_output=True, env={**os.environ, **settings})


def _total(part: Path) -> int:
    found = re.search(r"^(?:totals|summary): (\d+)", part.read_text(encoding="utf-8"), re.MULTILINE)
    assert found, f"{part}: no total"
    return int(found[1])
