"""The C compiler and its flags for generated C.

Environment:
    CC: The compiler command, such as "ccache gcc". The default is the first of cc, gcc and clang.
    CHASLES_CFLAGS: Additional flags, which override the default flags ("-march=x86-64-v3").
"""

from __future__ import annotations

import itertools
import os
import platform
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ..errors import CompileError, CompilerNotFoundError

FLAGS = (
    "-std=c99",
    "-O3",
    # The next two flags preserve NaN and infinity, and drop only errno and traps, which are unused.
    "-fno-math-errno",
    "-fno-trapping-math",
    # Fused multiply-add: one rounding instead of two.
    "-ffp-contract=fast",
    # GCC 12 computes wrong results when it packs scalar code into AVX-512 vectors.
    "-fno-tree-slp-vectorize",
    "-march=native",
    # This macro restricts compilation to code for this processor, which halves the compile time.
    "-DCHASLES_NO_DISPATCH",
    "-shared",
    "-fvisibility=hidden",
)
UNSAFE_FLAGS = frozenset(
    ("-ffast-math", "-Ofast", "-ffinite-math-only", "-fno-honor-nans", "-ffp-model=fast")
)
"""Compiler flags that make `isnan` always false."""
MAX_LINES = 30
"""Maximum lines of compiler output in an error message."""
_CPU_FIELDS = frozenset(
    (
        *("vendor_id", "cpu family", "model", "model name", "flags"),
        *("CPU implementer", "CPU architecture", "CPU variant", "CPU part", "Features", "isa"),
    )
)


@dataclass(frozen=True, slots=True)
class Compiler:
    """A C compiler and its flags.

    Attributes:
        command: The program with its arguments.
        flags: The flags for generated C.
        identity: A text that identifies the compiler and its version.
    """

    command: tuple[str, ...]
    flags: tuple[str, ...]
    identity: str

    def compile(self, sources: Sequence[str], target: str, folder: Path) -> None:
        """Compile sources in a folder; a failure raises a CompileError with the compiler output."""
        run([*self.command, *self.flags, *sources, "-o", target, "-lm"], folder)


def run(command: Sequence[str], folder: Path) -> None:
    """Run a command in a folder; raise a CompileError with its output if it fails."""
    # The module is imported here, because loading a cached library does not need it.
    import subprocess  # noqa: PLC0415

    try:
        result = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, errors="replace", check=False
        )
    except FileNotFoundError:
        raise CompilerNotFoundError(f"{command[0]}: command not found; install it") from None
    if result.returncode != 0:
        output = (result.stderr + result.stdout).strip()
        raise CompileError(
            f"{shlex.join(command)}: the command failed with status {result.returncode}\n"
            f"{_start(output)}"
        )


def _start(output: str) -> str:
    lines = output.splitlines()
    more = len(lines) - MAX_LINES
    return "\n".join([*lines[:MAX_LINES], *([f"... and {more} more lines"] if more > 0 else [])])


def find_compiler() -> Compiler:
    """Return the compiler of this machine, without running it.

    Raises:
        CompilerNotFoundError: If no compiler was found.
        CompileError: If CC or CHASLES_CFLAGS is invalid.
    """
    command, program = _find_program()
    found = Path(program).resolve()
    status = found.stat()
    # Path, size and modification time identify the version: `cc --version` takes longer than
    # loading a robot. A new compiler behind the same wrapper script is not detected.
    identity = f"{shlex.join(command)} {found} {status.st_size} {status.st_mtime_ns}"
    extra = _words("CHASLES_CFLAGS")
    if unsafe := UNSAFE_FLAGS.intersection((*command, *extra)):
        raise CompileError(
            f"CC or CHASLES_CFLAGS: {min(unsafe)}: with this flag, poses out of reach would count "
            "as reached; omit the flag"
        )
    return Compiler(tuple(command), (*FLAGS, *_system_flags(command), *extra), identity)


def _system_flags(command: Sequence[str]) -> tuple[str, ...]:
    is_x86 = platform.machine() in ("x86_64", "AMD64")
    # By default, compilers use only half of each 512-bit vector on most processors with AVX-512.
    wide = ("-mprefer-vector-width=512",) * is_x86
    if os.name != "nt":
        return ("-fPIC", *wide)
    # On Windows, GCC aligns the stack to only 16 bytes, even for vectors of 32 bytes (GCC bug
    # 54412).
    is_gcc = not any(name in " ".join(command) for name in ("clang", "zig"))
    return (*wide, *("-Wa,-muse-unaligned-vector-move",) * is_gcc)


def is_compiler_chosen() -> bool:
    """Test whether the environment selects a compiler or flags."""
    return bool(os.environ.get("CC") or os.environ.get("CHASLES_CFLAGS"))


def _words(variable: str) -> list[str]:
    text = os.environ.get(variable, "").replace("\\", "/" if os.name == "nt" else "\\")
    try:
        return shlex.split(text)
    except ValueError as error:
        raise CompileError(f"{variable}={text!r}: {str(error).lower()}") from None


def _find_program() -> tuple[Sequence[str], str]:
    import shutil  # noqa: PLC0415

    chosen = _words("CC")
    candidates = [chosen] if chosen else [["cc"], ["gcc"], ["clang"]]
    for command in candidates:
        program = shutil.which(command[0])
        if program:
            return command, program
    sought = f"CC={chosen[0]}" if chosen else "cc, gcc and clang (CC is not set)"
    raise CompilerNotFoundError(
        f"no C compiler on PATH; install gcc or clang, or set CC; looked for {sought}"
    )


def describe_machine() -> str:
    """Return the system and the processor, because code for -march=native depends on both."""
    return f"{platform.system()} {platform.machine()}\n{_describe_processor()}"


def _describe_processor() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8", errors="replace") as file:
            # Linux generates this file while it is read, so only the first processor is read.
            first = itertools.takewhile(str.strip, file)
            lines = [line for line in first if line.partition(":")[0].strip() in _CPU_FIELDS]
    except OSError:
        # Only Linux has /proc/cpuinfo. Other operating systems seldom share a cache folder.
        return platform.version()
    return "".join(lines)
