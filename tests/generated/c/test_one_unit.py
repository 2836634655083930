"""Robots side by side in one program: the C of all of them in one translation unit."""

import subprocess

import pytest

from tests.support.derivations import ALL, GENERATED
from tests.support.tools import path_of

CHECK = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"]


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("flags", [[], ["-mavx2", "-mfma"]], ids=["plain", "avx2"])
def test_all_robots_compile_in_single_translation_unit(compiler, flags, tmp_path):
    path_of(compiler)
    unit = tmp_path / "unit.c"
    unit.write_text("".join(f'#include "{name}/{name}.c"\n' for name in ALL))
    folders = [f"-I{GENERATED}", *(f"-I{GENERATED / name}" for name in ALL)]
    subprocess.run([compiler, *CHECK, *flags, *folders, unit], check=True)
