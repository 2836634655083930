"""The C compiler, and the flags for generated C.

Environment:
    CC: The compiler, with arguments if need be ("ccache gcc"); else cc, gcc, clang are tried.
    CHASLES_CFLAGS: Flags put after the own ones, so that they win ("-march=x86-64-v3").
"""

from __future__ import annotations

import itertools
import os
import platform
import shlex
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ..errors import CompileError, CompilerNotFoundError

FLAGS = (
    "-std=c99",
    "-O3",
    # Never -ffast-math, see UNSAFE_FLAGS: poses out of reach would count as reached. These two
    # keep NaN and infinity, and give up only errno and traps, which nobody reads.
    "-fno-math-errno",
    "-fno-trapping-math",
    # A product and a sum may be one instruction: rounded once instead of twice.
    "-ffp-contract=fast",
    # GCC 12 was seen to give wrong numbers where it packs scalar code into AVX-512 vectors.
    "-fno-tree-slp-vectorize",
    "-march=native",
    "-fPIC",
    "-shared",
    "-fvisibility=hidden",
)
UNSAFE_FLAGS = frozenset({"-ffast-math", "-Ofast", "-ffinite-math-only"})
"""Flags under which `isnan` is false."""
MOST_LINES = 30
"""Lines of the compiler's output that an error holds."""
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
        identity: A text that differs between compilers and between their versions.
    """

    command: tuple[str, ...]
    flags: tuple[str, ...]
    identity: str

    def compile(self, source: str, target: str, folder: Path) -> None:
        """Compiles a source to a shared library, both named relative to the folder.

        Raises:
            CompileError: If the compiler fails; holds its output.
        """
        # Loading a robot that was compiled before needs no subprocess.
        import subprocess  # noqa: PLC0415

        command = [*self.command, *self.flags, source, "-o", target, "-lm"]
        result = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, errors="replace", check=False
        )
        if result.returncode != 0:
            output = (result.stderr + result.stdout).strip()
            raise CompileError(
                f"{shlex.join(command)}: failed with status {result.returncode}\n{_start(output)}"
            )


def _start(output: str) -> str:
    """The first lines of a compiler's output: later errors mostly follow from them."""
    lines = output.splitlines()
    more = len(lines) - MOST_LINES
    return "\n".join([*lines[:MOST_LINES], *([f"... and {more} more lines"] if more > 0 else [])])


def find_compiler() -> Compiler:
    """The compiler of this machine, found without running it.

    Raises:
        CompilerNotFoundError: If there is none.
        CompileError: If CC or CHASLES_CFLAGS cannot be used.
    """
    command, program = _find_program()
    found = Path(program).resolve()
    status = found.stat()
    # Path, size and time stand for the version: `cc --version` costs more than loading a robot.
    # A new version behind a wrapper may go unnoticed; the equations are part of the key anyway.
    identity = f"{shlex.join(command)} {found} {status.st_size} {status.st_mtime_ns}"
    extra = _words("CHASLES_CFLAGS")
    unsafe = UNSAFE_FLAGS.intersection(extra)
    if unsafe:
        raise CompileError(
            f"CHASLES_CFLAGS: {min(unsafe)} would make poses out of reach count as reached"
        )
    return Compiler(tuple(command), (*FLAGS, *extra), identity)


def _words(variable: str) -> list[str]:
    """The words of an environment variable, split like a shell does."""
    text = os.environ.get(variable, "")
    try:
        return shlex.split(text)
    except ValueError as error:
        raise CompileError(f"{variable}={text!r}: {str(error).lower()}") from error


def _find_program() -> tuple[Sequence[str], str]:
    chosen = _words("CC")
    candidates = [chosen] if chosen else [["cc"], ["gcc"], ["clang"]]
    for command in candidates:
        program = shutil.which(command[0])
        if program:
            return command, program
    sought = f"CC={chosen[0]}" if chosen else "cc, gcc and clang (CC is not set)"
    raise CompilerNotFoundError(
        f"no C compiler: looked for {sought} on PATH; install gcc or clang, or set CC to one"
    )


def describe_machine() -> str:
    """The system and the processor: -march=native code may not run on another one."""
    return f"{platform.system()} {platform.machine()}\n{_describe_processor()}"


def _describe_processor() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8", errors="replace") as file:
            # The kernel writes this file as it is read, so take the first processor only.
            first = itertools.takewhile(str.strip, file)
            lines = [line for line in first if line.partition(":")[0].strip() in _CPU_FIELDS]
    except OSError:
        # Other systems have no such file; their caches are seldom shared between machines.
        return platform.version()
    return "".join(lines)
