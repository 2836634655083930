"""Compiles C and C++ for tests and benchmarks into build/native."""

import hashlib
import os
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from chasles.library.compiler import find_compiler
from tests.support.locking import locked

BUILD = Path(__file__).parents[3] / "build" / "native"
UNPACKED = "-fno-tree-slp-vectorize"
"""Compiler flag without which GCC 12 compiles the C code of chasles incorrectly.

Other libraries are compiled without this flag.
"""


@dataclass(frozen=True)
class Source:
    """The source text of a shared library.

    Attributes:
        name: Name of the library.
        files: Texts of the source files, keyed by name, of which the first file is compiled.
        flags: Additional compiler flags, such as include folders and definitions.
    """

    name: str
    files: Mapping[str, str]
    flags: Sequence[str] = ()

    @property
    def command(self) -> tuple[str, ...]:
        """The command line of the compiler: its name and its flags."""
        plus = next(iter(self.files)).endswith(".cpp")
        compiler = shlex.split(os.environ.get("CXX", "c++") if plus else os.environ.get("CC", "cc"))
        standard = "-std=c++17" if plus else "-std=c99"
        return (*compiler, standard, *flags_of_all(), *self.flags)

    @property
    def path(self) -> Path:
        parts = [*self.command, *self.files, *self.files.values(), compiler_version(self.command)]
        digest = hashlib.sha256("\0".join(parts).encode()).hexdigest()
        return BUILD / f"{self.name}-{digest[:16]}.so"


def flags_of_all() -> tuple[str, ...]:
    """Return the compiler flags that chasles and all other libraries share.

    For other libraries, NDEBUG disables assertions, because those of Eigen take as long as the
    kinematics.
    """
    flags = find_compiler().flags
    return (*(f for f in flags if f != UNPACKED and not f.startswith("-std")), "-DNDEBUG")


def compiler_version(command: Sequence[str]) -> str:
    """Return the first line of a compiler's ``--version`` output, or '' without a compiler."""
    if shutil.which(command[0]) is None:
        return ""
    done = subprocess.run([command[0], "--version"], capture_output=True, text=True, check=False)
    return done.stdout.partition("\n")[0]


def compiled(source: Source) -> Path:
    """Compile a shared library if necessary, and return its path.

    Each library is compiled once, and concurrent processes wait for its compilation. The compiled
    library is moved to its path atomically.
    """
    path = source.path
    if path.exists():
        return path
    with locked(path):
        if path.exists():
            return path
        with tempfile.TemporaryDirectory(dir=BUILD) as folder:
            for name, text in source.files.items():
                (Path(folder) / name).write_text(text, encoding="utf-8")
            first = next(iter(source.files))
            command = [*source.command, first, "-o", "library.so", "-lm"]
            subprocess.run(command, cwd=folder, check=True, capture_output=True)
            (Path(folder) / "library.so").replace(path)
    return path
