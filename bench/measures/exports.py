"""Time of functions in the exported languages, compared with the same functions in generated C.

A loop in C and a loop in C++ call the same compiled C code. The loop in C and the loop in C++ run
alternately. Each time is the minimum of several short runs.
"""

import ctypes
import subprocess
import tempfile
from functools import partial
from pathlib import Path

import numpy as np

import chasles
from chasles.derive import read, write
from chasles.library.compiler import FLAGS
from tests.support.derivations import description

from ..report import out, table
from .nearest import ROUNDS, ROWS, minima, poses

ROBOT = "ur5e"
LIMIT = 1.05
"""Maximum ratio of the time in C++ to the time in C."""
FUNCTIONS = ("fk", "fk_jacobian_mixed", "ik", "ik_nearest")
LOOP = """
extern "C" __attribute__((visibility("default"))) void {name}(
    const double *x, const double *seed, long count, double *out) {{
  for (long k = 0; k < count; k++, x += {size}, seed += {n}) {{
    {call}
    __asm__ volatile("" : : "r"(out) : "memory");
  }}
}}
"""
IN_C = {
    "fk": "{robot}_fk(x, out);",
    "fk_jacobian_mixed": "{robot}_fk_jacobian_mixed(x, out, out + 16);",
    "ik": "{robot}_ik(x, out, out + 256, out + 384);",
    "ik_nearest": "{robot}_ik_nearest(x, seed, 0, 0, 0, out, out + 256, out + 384);",
}
IN_CPP = """
const auto found = chasles::{robot}::{name}({arguments});
__asm__ volatile("" : : "r"(&found) : "memory");
"""


def run() -> int:
    """Print the times and their ratios. Return 1 if a ratio exceeds the limit."""
    robot = chasles.load(ROBOT)
    T, seeds = (np.ascontiguousarray(array[:ROWS]) for array in poses(robot, ROWS)[:2])
    with tempfile.TemporaryDirectory() as folder:
        library = ctypes.CDLL(str(_compiled(robot, Path(folder))))
        cells = [(name, *_times(library, name, T, seeds)) for name in FUNCTIONS]
    rows = [(*cell, cell[2] / cell[1]) for cell in cells]
    table(f"{ROBOT}, a pose", ("function", "C ns", "C++ ns", "ratio"), rows)
    out.print(f"bar: ratio {LIMIT}")
    return int(any(row[-1] > LIMIT for row in rows))


def _times(
    library: ctypes.CDLL, name: str, T: np.ndarray, seeds: np.ndarray
) -> tuple[float, float]:
    """Return the time of a function in C and in C++ [ns]."""
    result, inputs = np.empty(512), T if name.startswith("ik") else seeds
    arrays = [ctypes.c_void_p(array.ctypes.data) for array in (inputs, seeds, result)]
    given = (*arrays[:2], ctypes.c_long(ROWS), arrays[2])
    works = [partial(library[f"{name}_in_{language}"], *given) for language in ("c", "cpp")]
    in_c, in_cpp = (taken / ROWS for taken in minima(works, 1, 10 * ROUNDS))
    return in_c, in_cpp


def _compiled(robot: chasles.Robot, folder: Path) -> Path:
    """Compile one library from the exported C code, a loop in C and a loop in C++."""
    write(read(description(ROBOT)), folder, functions=FUNCTIONS[:3], languages=["cpp"])
    include = folder / "include" / "chasles"
    loops = "".join(_loops(robot, name) for name in FUNCTIONS)
    (folder / "loops.cpp").write_text(f'#include "{ROBOT}.hpp"\n{loops}')
    flags = [flag for flag in FLAGS if flag not in ("-std=c99", "-shared")]
    places = ["-I", str(include), "-I", str(folder / "src")]
    c = ["cc", "-std=c99", *flags, *places, "-c", f"src/{ROBOT}.c", "-o", "robot.o"]
    cpp = ["c++", "-std=c++17", *flags, *places, "-shared", "loops.cpp", "robot.o", "-lm"]
    for command in (c, [*cpp, "-o", "loops.so"]):
        subprocess.run(command, cwd=folder, check=True)
    return folder / "loops.so"


def _loops(robot: chasles.Robot, name: str) -> str:
    """Return C++ code with two loops: one calls the C function, one the C++ function."""
    is_inverse = name.startswith("ik")
    size = 16 if is_inverse else robot.n
    arguments = f"chasles::View<{size}>(x)"
    if name == "ik_nearest":
        arguments += f", chasles::View<{robot.n}>(seed)"
    calls = {
        "c": IN_C[name].format(robot=ROBOT),
        "cpp": IN_CPP.format(robot=ROBOT, name=name, arguments=arguments),
    }
    return "".join(
        LOOP.format(name=f"{name}_in_{language}", size=size, n=robot.n, call=call)
        for language, call in calls.items()
    )
