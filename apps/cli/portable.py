"""Write the folder of a robot with its kernel.

A kernel is a compiled library that runs on all processors of a platform.

On x86-64, a kernel contains the scalar code three times: for every processor, for processors with
AVX2 and for processors with AVX-512. When the kernel is loaded, the code that suits the machine's
processor is selected.
"""

from __future__ import annotations

import platform
from dataclasses import replace
from functools import partial
from pathlib import Path

from chasles import CacheError
from chasles.contract import Manifest, write_files
from chasles.library import GLUE_FILE, Compiler, find_compiler, kernel_recipe, write_library

_MANIFEST = "manifest.json"
_X86 = {"": "x86-64", "v3": "x86-64-v3", "v4": "x86-64-v4"}
_LEVELS = {"x86_64": _X86, "AMD64": _X86}
"""Instruction set levels for each machine architecture, with the value of the flag -march. Windows
reports AMD64."""
_NAMES = "chasles_names.h"
"""Header that renames the C functions for one instruction set level. Robot names never begin with
chasles_."""
_ENDS = ("", "_batch", "_nearest")
"""Suffixes of the external C names: one input, a batch of inputs, and the nearest solution."""


def write_portable(manifest: Manifest, folder: Path) -> Path:
    """Write the folder of a robot with its kernel.

    The folder can be loaded on every machine of this platform, without a compiler.

    Args:
        manifest: The robot.
        folder: The folder that will contain the robot's folder.

    Raises:
        CacheError: The folder cannot be written.
        ChaslesError: The compilation fails.
    """
    target = folder / manifest.name
    try:
        target.mkdir(parents=True, exist_ok=True)
        write_kernel(manifest, target)
        # A folder without a manifest cannot be loaded. The manifest is therefore written last.
        files = {target / file: _source(manifest, file) for file in (*manifest.files, _MANIFEST)}
        for path in files:
            path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CacheError(f"{target}: the folder cannot be written ({error})") from error
    write_files(files)
    return target


def _source(manifest: Manifest, file: str) -> bytes:
    own = manifest.folder / file
    return (own if own.exists() else manifest.path_of(file)).read_bytes()


def write_kernel(manifest: Manifest, folder: Path) -> Path:
    """Write the kernel of a robot into a folder, and remove older kernels."""
    recipe = kernel_recipe(manifest)
    recipe = replace(recipe, path=folder / recipe.path.name)
    for old in set(folder.glob(f"{manifest.name}-*.so")) - {recipe.path}:
        old.unlink()
    if not recipe.path.exists():
        write_library(recipe, partial(_compile_levels, manifest))
    return recipe.path


def _compile_levels(manifest: Manifest, folder: Path) -> None:
    compiler = find_compiler()
    flags = tuple(flag for flag in compiler.flags if flag not in ("-march=native", "-shared"))
    objects = []
    for level, march in _LEVELS.get(platform.machine(), {"": ""}).items():
        own = _processor_flags(compiler, march)
        if level:
            own += (f"-DCHASLES_LEVEL={level}", "-include", _NAMES)
            (folder / _NAMES).write_text(_renamings(manifest, level), encoding="utf-8")
        objects.append(f"level_{level}.o")
        replace(compiler, flags=(*flags, *own, "-c")).compile([GLUE_FILE], objects[-1], folder)
    # The flag -s removes debug symbols.
    replace(compiler, flags=("-shared", "-s")).compile(objects, "library.so", folder)


def _processor_flags(compiler: Compiler, march: str) -> tuple[str, ...]:
    """Return the compiler flags for a value of -march, or for the default processor if empty."""
    if any(Path(word).stem in ("zig", "ziglang") for word in compiler.command):
        # Zig writes processor names with underscores. Zig interprets -mtune as the target
        # processor, so -mtune is omitted.
        return (f"-mcpu={march.replace('-', '_') or 'baseline'}",)
    # With generic tuning, code with wide SIMD vectors is 40 % slower.
    is_wide = march not in ("", "x86-64")
    return (f"-march={march}",) * bool(march) + ("-mtune=haswell",) * is_wide


def _renamings(manifest: Manifest, level: str) -> str:
    """Return C pragmas that append the instruction set level to the external function names."""
    symbols = (f"{item.symbol}{end}" for item in manifest.functions for end in _ENDS)
    return "".join(f"#pragma redefine_extname {name} {name}_{level}\n" for name in symbols)
