"""The extensions compile for Windows without warnings."""

import subprocess
import sysconfig
from pathlib import Path
from shutil import which

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
MINGW = "x86_64-w64-mingw32-gcc"
"""C compiler for Windows; the continuous integration does not install this compiler."""
FLAGS = ("-fsyntax-only", "-Wall", "-Wextra", "-Wno-unused-parameter", "-Werror")
WINDOWS = ("-DPy_PYCONFIG_H", "-include", ROOT / "tests/platforms/pyconfig.h")
BYTE_ORDER = "#define __LITTLE_ENDIAN 1234\n#define __BIG_ENDIAN 4321\n#define __BYTE_ORDER 1234\n"
"""The macros of endian.h that NumPy's headers need. Windows does not have this header."""
NUMPY = ("-DNPY_NO_DEPRECATED_API=NPY_2_0_API_VERSION", "-DNPY_TARGET_VERSION=NPY_2_0_API_VERSION")
SYSTEM_CALLS = (
    *("runtime/call/kernel/compiled_library.c", "runtime/call/kernel/buffer_pool.c"),
    "runtime/iterative/native/batch.c",
)
"""Files that load libraries, map memory or start threads."""


@pytest.mark.skipif(not which(MINGW), reason=f"no {MINGW}")
def test_extensions_compile_for_windows(tmp_path):
    (tmp_path / "endian.h").write_text(BYTE_ORDER)
    sources = sorted((ROOT / "runtime").rglob("*.c"))
    assert {ROOT / file for file in SYSTEM_CALLS} <= set(sources)
    folders = (tmp_path, ROOT / "runtime", ROOT / "contract", np.get_include())
    include = [f"-I{folder}" for folder in (*folders, sysconfig.get_paths()["include"])]
    subprocess.run([MINGW, *FLAGS, *WINDOWS, *NUMPY, *include, *sources], check=True)
