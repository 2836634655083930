"""The C code of all robots compiles as a single translation unit."""

import subprocess
from shutil import which

import pytest

from tests.support.derivations import ALL, GENERATED, SAMPLE
from tests.support.tools import path_of

CHECK = ["-pedantic", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"]
MINGW = "x86_64-w64-mingw32-gcc"
"""C compiler for Windows, which the continuous integration does not install."""
C, CPP = ["-std=c99"], ["-std=c++11", "-x", "c++"]


@pytest.mark.parametrize(
    ("compiler", "flags", "names"),
    [
        ("gcc", C, ALL),
        ("gcc", [*C, "-DCHASLES_PLAIN"], ALL),
        ("clang", [*C, "-mavx2", "-mfma"], SAMPLE),
        ("g++", CPP, SAMPLE),
        pytest.param(
            MINGW, C, ALL, marks=pytest.mark.skipif(not which(MINGW), reason=f"no {MINGW}")
        ),
    ],
    ids=["gcc", "plain", "clang-avx2", "g++", "mingw-w64"],
)
def test_robots_compile_in_single_translation_unit(compiler, flags, names, tmp_path):
    path_of(compiler)
    unit = tmp_path / "unit.c"
    unit.write_text("".join(f'#include "{name}/{name}.c"\n' for name in names))
    folders = [f"-I{GENERATED}", *(f"-I{GENERATED / name}" for name in ("support", *names))]
    subprocess.run([compiler, *CHECK, *flags, *folders, unit], check=True)
