"""The generated C meets firmware rules: plain C99, libm only, no global state, one prefix."""

import re
import subprocess

import pytest

from chasles.contract import read_manifest
from tests.support.compiling import COMPILER
from tests.support.derivations import GENERATED
from tests.support.tools import path_of

STRICT = ["-pedantic", "-Wall", "-Wextra", "-Werror"]
LIBM = {
    *("fmax", "fmin", "sin", "cos", "sincos", "tan", "atan", "atan2", "sqrt"),
    *("frexp", "ldexp", "log", "floor", "ceil", "rint"),
}
BUILTIN = {"memcpy", "memset"}
"""Functions that a compiler calls even in a program without a C library."""
COMPILERS = {
    "gcc": ["gcc", "-std=c99", "-O1", "-c"],
    "fastest": [COMPILER or "gcc", "-std=c99", "-O0", "-c"],
    "clang": ["clang", "-std=c99", "-fsyntax-only"],
    "g++": ["g++", "-std=c++11", "-x", "c++", "-fsyntax-only"],
}
"""Compiler commands.

The C++ command checks only the syntax, because GCC's optimizer reports the same warnings for C and
C++.
"""


NAMES = ("iiwa14", "jaco2", "well_manipulator", "stewart_gough")
"""Tested robots: a redundant arm, one with an iterative inverse kinematics function, one with
loops, and a platform.

The file test_one_unit compiles the C code of all robots with each compiler.
"""


SUPPORT = f"-I{GENERATED / 'support'}"
"""Header folder that all robots share."""


def compiled(compiler, name, folder, suffix="", flags=()):
    path_of(COMPILERS[compiler][0])
    target = folder / f"{name}.o"
    source = GENERATED / name / f"{name}{suffix}.c"
    command = [*COMPILERS[compiler], *STRICT, *flags, SUPPORT, str(source), "-o", str(target)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[:2000]
    return target


@pytest.mark.parametrize(
    ("name", "compiler", "flags"),
    [
        ("scara", "gcc", ()),
        ("ur5e", "clang", ("-mavx512f", "-mavx512dq")),
        ("scara", "g++", ("-mavx2", "-mfma")),
    ],
)
def test_batches_compile_without_a_warning(name, compiler, flags, tmp_path):
    compiled(compiler, name, tmp_path, "_batch", flags)


@pytest.mark.parametrize("name", NAMES)
def test_object_exports_only_documented_symbols(name, tmp_path):
    target = compiled("gcc" if name == "jaco2" else "fastest", name, tmp_path)
    listing = subprocess.run(["nm", str(target)], capture_output=True, text=True, check=True)
    symbols = [line.split()[-2:] for line in listing.stdout.splitlines()]
    exported = {symbol for kind, symbol in symbols if kind == "T"}
    missing = {symbol for kind, symbol in symbols if kind == "U"}
    state = [symbol for kind, symbol in symbols if kind in "bBdDC"]
    functions = read_manifest(GENERATED / name).functions
    wanted = {f"{name}_{f.name}" for f in functions}
    wanted |= {f"{name}_{f.name}_nearest" for f in functions if f.role.is_inverse}
    assert exported == wanted
    assert missing <= LIBM | BUILTIN
    # The only data symbols are tables of addresses that the loader fills in.
    assert set(state) <= {f"{name}_ik_tables", f"{name}_modes_tables"}


def test_header_documents_every_function():
    header = (GENERATED / "ur5e" / "ur5e.h").read_text()
    declared = re.findall(r"\*/\nvoid ur5e_(\w+)\(", header)
    assert declared == [function.name for function in read_manifest(GENERATED / "ur5e").functions]
    assert max(map(len, header.splitlines())) <= 110
