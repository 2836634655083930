"""Tests that a portable library runs the code for the processor level of this machine."""

import platform
import subprocess
from pathlib import Path

import pytest

import chasles
from chasles import MismatchError
from chasles.call import _call
from tests.support.tools import needs

RUNTIME = Path(chasles.__file__).parent
SOURCE = """
#include "_kernel.h"
CHASLES_EXPORT const char chasles_hash[] = "levels";
CHASLES_EXPORT const chasles_kernel chasles_kernels[] = {{"level_1"}, {NULL}};
CHASLES_EXPORT const chasles_kernel chasles_kernels_v3[] = {{"level_3"}, {NULL}};
CHASLES_EXPORT const chasles_kernel chasles_kernels_v4[] = {{"level_4"}, {NULL}};
"""
V3 = {"avx2", "fma", "bmi1", "bmi2"}
V4 = V3 | {"avx512f", "avx512dq", "avx512vl", "avx512bw", "avx512cd"}

pytestmark = [
    needs("gcc"),
    pytest.mark.skipif(platform.machine() != "x86_64", reason="levels of x86-64"),
]


def level() -> int:
    """Return the processor level of this machine, from the features that Linux lists."""
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    flags = set(next(line for line in lines if line.startswith("flags")).split())
    return 4 if flags >= V4 else 3 if flags >= V3 else 1


def has_function(library, name) -> bool:
    texts = dict.fromkeys(("label", "doc"), name)
    rest = ("signature", "guard", "solutions", "rescue", "fk", "general")
    values = {"operations": {}, "reduced": (len, ()), "poses": 0, "unit": 1.0, "parameters": ()}
    with pytest.raises((ValueError, MismatchError), match=r"has no function|0 inputs") as error:
        library.function(name, (), (), **texts, **dict.fromkeys(rest), **values)
    return "0 inputs" in str(error.value)


@pytest.mark.skipif(not Path("/proc/cpuinfo").exists(), reason="needs Linux")
def test_library_is_called_at_the_level_of_the_processor(tmp_path):
    (tmp_path / "levels.c").write_text(SOURCE)
    library = tmp_path / "levels.so"
    command = ["gcc", "-shared", "-fPIC", f"-I{RUNTIME / 'library'}", "levels.c", "-o", library]
    subprocess.run(command, check=True, cwd=tmp_path)
    opened = _call.open(library, "levels")
    assert [k for k in (1, 3, 4) if has_function(opened, f"level_{k}")] == [level()]
