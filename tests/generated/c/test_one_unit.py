"""Robots side by side in one program: the C of all of them in one translation unit."""

import shutil
import subprocess

import pytest

from tests.support.derivations import ALL, GENERATED

CHECK = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"]


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("flags", [[], ["-mavx2", "-mfma"]], ids=["plain", "avx2"])
def test_all_robots_in_one_unit(compiler, flags, tmp_path):
    if shutil.which(compiler) is None:
        pytest.skip(f"{compiler} is not installed")
    unit = tmp_path / "unit.c"
    unit.write_text("".join(f'#include "{name}/{name}.c"\n' for name in ALL))
    folders = [f"-I{GENERATED}", *(f"-I{GENERATED / name}" for name in ALL)]
    subprocess.run([compiler, *CHECK, *flags, *folders, unit], check=True)
