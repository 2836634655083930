"""Compiles C and C++ for the benchmarks; keeps the libraries in build/bench by content."""

import ctypes
import hashlib
import math
import os
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path
from typing import Any

import numpy as np

from chasles.contract.compiler import FLAGS

BUILD = Path(__file__).parents[2] / "build" / "bench"
LOOP = Path(__file__).with_name("loop.h")
UNPACKED = "-fno-tree-slp-vectorize"
"""Flag for the C of chasles alone: GCC 12 vectorises it wrongly; the peers would lose speed."""
FLAGS_OF_ALL = (
    *(flag for flag in FLAGS if flag != UNPACKED and not flag.startswith("-std")),
    "-DNDEBUG",
)
"""Flags of chasles' own C, which every peer gets too: -O3 -march=native, no errno.

NDEBUG serves the peers: Eigen's assertions take as long as the kinematics.
"""


@dataclass(frozen=True)
class Source:
    """A library to be compiled.

    Attributes:
        name: Its name.
        files: The text of each file; the first file is compiled.
        flags: Further flags: include folders, definitions.
    """

    name: str
    files: Mapping[str, str]
    flags: Sequence[str] = ()

    @property
    def command(self) -> tuple[str, ...]:
        """Compiler and flags, by the ending of the first file."""
        plus = next(iter(self.files)).endswith(".cpp")
        compiler = shlex.split(os.environ.get("CXX", "c++") if plus else os.environ.get("CC", "cc"))
        standard = "-std=c++17" if plus else "-std=c99"
        return (*compiler, standard, *FLAGS_OF_ALL, *self.flags)

    @property
    def path(self) -> Path:
        """Path of the compiled library."""
        parts = [*self.command, *self.files, *self.files.values(), compiler_version(self.command)]
        digest = hashlib.sha256("\0".join(parts).encode()).hexdigest()
        return BUILD / f"{self.name}-{digest[:16]}.so"


def compiler_version(command: Sequence[str]) -> str:
    """The first line of a compiler's ``--version``, or '' without a compiler."""
    if shutil.which(command[0]) is None:
        return ""
    done = subprocess.run([command[0], "--version"], capture_output=True, text=True, check=False)
    return done.stdout.partition("\n")[0]


def compiled(source: Source) -> Path:
    """The library; compiles it if it is not there yet."""
    if not source.path.exists():
        BUILD.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=BUILD) as folder:
            for name, text in source.files.items():
                (Path(folder) / name).write_text(text, encoding="utf-8")
            first = next(iter(source.files))
            command = [*source.command, first, "-o", "library.so", "-lm"]
            subprocess.run(command, cwd=folder, check=True, capture_output=True)
            (Path(folder) / "library.so").replace(source.path)
    return source.path


@dataclass(frozen=True)
class Loop:
    """Compiled fk and fk with Jacobian, run over arrays by loop.h.

    Attributes:
        name: The peer's name.
        library: The loaded library.
        joints: Number of joints of its arm.
        by_columns: Whether its Jacobian lies column by column.
        context: The first argument of its functions.
    """

    name: str
    library: ctypes.CDLL
    joints: int
    by_columns: bool = False
    context: int | None = None

    def fk(self, q: np.ndarray, T: np.ndarray) -> None:
        """Poses of all rows of q, each into its row of T, or all into the single row of T."""
        self._run(self.library.run_fk, q, T)

    def fk_jacobian(self, q: np.ndarray, T: np.ndarray, J: np.ndarray) -> None:
        """Poses and Jacobians of all rows of q, as :meth:`fk`."""
        self._run(self.library.run_fk_jacobian, q, T, J)

    def _run(self, function, q: np.ndarray, *outputs: np.ndarray) -> None:
        assert q.shape[1] == self.joints
        assert {len(output) for output in outputs} <= {1, len(q)}
        step = int(len(outputs[0]) > 1)
        pointers = [ctypes.c_void_p(output.ctypes.data) for output in outputs]
        sizes = [ctypes.c_long(self.joints), ctypes.c_long(len(q))]
        context, first = ctypes.c_void_p(self.context), ctypes.c_void_p(q.ctypes.data)
        function(context, first, *sizes, *pointers, ctypes.c_long(step))


def aligned(*shape: int) -> np.ndarray:
    """Zeros aligned to a cache line, for a result that is written repeatedly.

    With another alignment, stores into two lines make one run slower than the next.
    """
    memory = np.zeros(math.prod(shape) + 8)
    start = -memory.ctypes.data % 64 // 8
    return memory[start : start + math.prod(shape)].reshape(shape)


def complete(source: Source) -> Source:
    """The source with loop.h, which it includes."""
    files = {**source.files, LOOP.name: LOOP.read_text(encoding="utf-8")}
    return Source(source.name, files, source.flags)


def loop(name: str, joints: int, source: Source, **options: Any) -> Loop:
    """A loop over the functions of a source that ends in ``#include "loop.h"``."""
    return Loop(name, ctypes.CDLL(str(compiled(complete(source)))), joints, **options)


def headers(package: str, ending: str) -> Path:
    """The folder that holds a header of an installed package."""
    try:
        found = [file for file in files(package) or () if str(file).endswith(ending)]
    except PackageNotFoundError as error:
        raise ImportError(f"{package} is not installed") from error
    if not found:
        raise ImportError(f"{package} has no {ending}")
    return Path(str(found[0].locate())).parents[ending.strip("/").count("/")]
