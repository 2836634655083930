"""Compiled functions of chasles and other libraries, run over arrays."""

import ctypes
import math
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path
from typing import Any

import numpy as np

from tests.support.native import Source, compiled

LOOP = Path(__file__).with_name("loop.h")


@dataclass(frozen=True)
class Loop:
    """Compiled fk and fk with Jacobian, run over arrays by loop.h.

    Attributes:
        name: Name of the compared library.
        library: The loaded library.
        joints: Number of joints of the arm.
        by_columns: Whether the Jacobian is stored by columns.
        context: The first argument of the library's functions.
    """

    name: str
    library: ctypes.CDLL
    joints: int
    by_columns: bool = False
    context: int | None = None

    def fk(self, q: np.ndarray, T: np.ndarray) -> None:
        """Compute the pose of each row of q. Each pose overwrites T if T has a single row."""
        self._run(self.library.run_fk, q, T)

    def fk_jacobian(self, q: np.ndarray, T: np.ndarray, J: np.ndarray) -> None:
        """Compute the poses and Jacobians of all rows of q."""
        self._run(self.library.run_fk_jacobian, q, T, J)

    def results(self, q: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return the poses of fk, and the poses and Jacobians of fk_jacobian."""
        shape = (self.joints, 6) if self.by_columns else (6, self.joints)
        T, both, J = (np.zeros((len(q), *of)) for of in ((4, 4), (4, 4), shape))
        self.fk(q, T)
        self.fk_jacobian(q, both, J)
        return T, both, J.transpose(0, 2, 1) if self.by_columns else J

    def _run(self, function, q: np.ndarray, *outputs: np.ndarray) -> None:
        assert q.shape[1] == self.joints
        assert {len(output) for output in outputs} <= {1, len(q)}
        step = int(len(outputs[0]) > 1)
        pointers = [ctypes.c_void_p(output.ctypes.data) for output in outputs]
        sizes = [ctypes.c_long(self.joints), ctypes.c_long(len(q))]
        context, first = ctypes.c_void_p(self.context), ctypes.c_void_p(q.ctypes.data)
        function(context, first, *sizes, *pointers, ctypes.c_long(step))


def aligned(*shape: int) -> np.ndarray:
    """Return zeros aligned to a cache line, for a result that is written repeatedly.

    Without this alignment, stores across two cache lines would slow down some runs.
    """
    memory = np.zeros(math.prod(shape) + 8)
    start = -memory.ctypes.data % 64 // 8
    return memory[start : start + math.prod(shape)].reshape(shape)


def complete(source: Source) -> Source:
    """Return the source code together with the included file loop.h."""
    files = {**source.files, LOOP.name: LOOP.read_text(encoding="utf-8")}
    return Source(source.name, files, source.flags)


def loop(name: str, joints: int, source: Source, **options: Any) -> Loop:
    """Compile a source that ends in ``#include "loop.h"``.

    The included loop calls the functions of the source.
    """
    return Loop(name, ctypes.CDLL(str(compiled(complete(source)))), joints, **options)


def headers(package: str, ending: str) -> Path:
    """Return the folder of a header of an installed package."""
    try:
        found = [file for file in files(package) or () if str(file).endswith(ending)]
    except PackageNotFoundError as error:
        raise ImportError(f"package {package} is not installed") from error
    if not found:
        raise ImportError(f"package {package}: no file ends with {ending}")
    return Path(str(found[0].locate())).parents[ending.strip("/").count("/")]
