"""Compiled robot libraries: built once, cached, and checked when opened.

The key of a library is the SHA-256 of the C code, the glue code and the processor features. The
file name of the library and its content contain this key. A library ends with the SHA-256 of the
preceding bytes, so that a damaged library is rejected before the system maps it.

A kernel is a compiled robot library that contains code for all processors of a platform
(`chasles build --portable`). Kernels are in the folders of generated robots, not in the cache.

Environment:
    CHASLES_CACHE: The cache folder. The default is `chasles` in XDG_CACHE_HOME or ~/.cache, or in
        LOCALAPPDATA on Windows.
"""

from __future__ import annotations

import hashlib
import math
import os
import platform
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from ..call import _call
from ..contract import FunctionInfo, Manifest, ManifestError, read_input, temporary_folder
from ..errors import CacheError, CompilerNotFoundError, MismatchError
from .compiler import Compiler, describe_machine, find_compiler, is_compiler_chosen

_KERNEL_HEADER = Path(__file__).with_name("_kernel.h")
GLUE_FILE = "chasles_glue.c"
"""File name of the glue code; no robot name begins with chasles_."""
_NEAREST = "chasles_nearest.h"
"""The generated file that selects the nearest solution of an inverse kinematics function."""
_MAX_NEAREST = 64
"""Largest number of solution slots for which compiled code selects the nearest solution."""
_DIGEST_SIZE = hashlib.sha256().digest_size


def cache_folder() -> Path:
    """Return the folder of compiled libraries."""
    chosen = os.environ.get("CHASLES_CACHE")
    if chosen:
        return Path(chosen).absolute()
    base = os.environ.get("LOCALAPPDATA" if os.name == "nt" else "XDG_CACHE_HOME", "")
    # The XDG standard requires that programs ignore relative paths.
    return (Path(base) if os.path.isabs(base) else Path.home() / ".cache") / "chasles"


@dataclass(frozen=True)
class Recipe:
    """All inputs that determine the compiled library of a robot.

    Attributes:
        name: The robot name.
        folder: The folder of the generated files.
        sources: The content of each file that the compiler reads, keyed by name.
        compiler: The compiler with its flags, or None if the library already exists.
        key: The SHA-256 of the sources and the processor features. The library contains the key.
        path: The library file. In the cache, the file name also contains a hash of the compiler and
            its flags.
    """

    name: str
    folder: Path
    sources: Mapping[str, bytes]
    compiler: Compiler | None
    key: str
    path: Path


def make_recipe(manifest: Manifest) -> Recipe:
    """Return the data needed to find or compile the robot's library on this machine.

    A kernel in the robot's folder is used without a compiler, unless the environment variable CC or
    CHASLES_CFLAGS is set.

    Raises:
        MismatchError: The hash of the C code or of the header is not in the manifest. The error is
            also raised if no compiler was found and the robot's kernel is for another version of
            chasles or another platform.
        ManifestError: If header and manifest declare different sizes.
        CompilerNotFoundError: No compiler was found, and the cache has no library for this
            processor.
    """
    sources = sources_of(manifest)
    kernel = kernel_recipe(manifest, sources)
    if kernel.path.exists() and not is_compiler_chosen():
        return kernel
    name, key = manifest.name, _key(sources, describe_machine())
    try:
        compiler = find_compiler()
    except CompilerNotFoundError:
        found = max(
            cache_folder().glob(f"{name}-{key[:32]}-*.so"), key=os.path.getmtime, default=None
        )
        if found is None and any(manifest.folder.glob(f"{name}-*.so")):
            raise MismatchError(
                f"{manifest.folder}: the kernel in this folder was built for another version of "
                "chasles or another platform; install chasles and this robot in the same version, "
                "write the folder again with `chasles build --portable`, or install a C compiler"
            ) from None
        if found is None:
            raise
        return Recipe(name, manifest.folder, sources, None, key, found)
    how = hashlib.sha256("\0".join((compiler.identity, *compiler.flags)).encode()).hexdigest()
    path = cache_folder() / f"{name}-{key[:32]}-{how[:16]}.so"
    return Recipe(name, manifest.folder, sources, compiler, key, path)


def kernel_recipe(manifest: Manifest, sources: Mapping[str, bytes] | None = None) -> Recipe:
    """Return sources, key and path of the kernel in a robot's folder, for this platform."""
    sources = sources or sources_of(manifest)
    key = _key(sources, f"{platform.system()} {platform.machine()}")
    path = manifest.folder / f"{manifest.name}-{key[:32]}.so"
    return Recipe(manifest.name, manifest.folder, sources, None, key, path)


def sources_of(manifest: Manifest) -> dict[str, bytes]:
    """Return the content of each file that the compiler reads, keyed by name."""
    files = {file: manifest.read_source(file) for file in manifest.c_files}
    check_header(manifest, files[f"{manifest.name}.h"].decode(errors="replace"))
    return {**files, "_kernel.h": _KERNEL_HEADER.read_bytes(), GLUE_FILE: write_glue(manifest)}


def _key(sources: Mapping[str, bytes], machine: str) -> str:
    parts = [text for item in sorted(sources.items()) for text in (item[0].encode(), item[1])]
    # Each part is hashed separately, so that different lists cannot have the same concatenation.
    digests = (hashlib.sha256(part).digest() for part in (*parts, machine.encode()))
    return hashlib.sha256(b"".join(digests)).hexdigest()


def check_header(manifest: Manifest, header: str) -> None:
    """Raise a ManifestError if array sizes in the header and in the manifest differ.

    The C compiler does not check array sizes: it treats the parameter `double T[16]` as a pointer.
    A kernel that writes 16 doubles into an array of 12 would corrupt memory.
    """
    code = re.sub(r"/\*.*?\*/|//[^\n]*", " ", header, flags=re.DOTALL)
    declarations = dict(re.findall(r"\bvoid\s+(\w+)\s*\(([^()]*)\)\s*;", code))
    for function in manifest.functions:
        found = declarations.get(function.symbol)
        declared = [_declared_size(item) for item in found.split(",")] if found else []
        if declared != _sizes(function):
            raise ManifestError(
                f"{manifest.folder / manifest.name}.h: {function.symbol}: the declared sizes "
                f"differ from manifest.json: expected {_sizes(function)}, got {declared}"
            )


def _declared_size(parameter: str) -> int:
    bound = re.search(r"\[\s*(\d+)\s*\]\s*$", parameter)
    return int(bound[1]) if bound else 1


def write_glue(manifest: Manifest) -> bytes:
    """Return the glue code: one wrapper for each function, and the table of all functions.

    The glue code of a portable kernel is compiled for each feature level (CHASLES_LEVEL).
    """
    batched = manifest.batch_file in manifest.c_files
    lines = [
        '#include "_kernel.h"',
        "#ifdef CHASLES_LEVEL",
        "#define chasles_kernels CHASLES_AT(chasles_kernels)",
        "#endif",
        f'#include "{manifest.name}.c"',
        *([f'#include "{manifest.batch_file}"'] if batched else []),
        "",
        "extern CHASLES_EXPORT const chasles_kernel chasles_kernels[];",
        "extern CHASLES_EXPORT const char chasles_hash[];",
        "",
    ]
    for index, function in enumerate(manifest.functions):
        lines += _wrapper(index, function)
        lines += _nearest_rows(index, function) if _has_nearest(manifest, function) else []
    lines += ["const chasles_kernel chasles_kernels[] = {"]
    for index, function in enumerate(manifest.functions):
        rows = f"{function.symbol}_rows" if batched else "0"
        counts = f"{len(function.inputs)}, {len(function.outputs)}"
        nearest = "0, 0"
        if _has_nearest(manifest, function):
            nearest = f"chasles_nearest_rows_{index}, chasles_nearest_slots"
        names = f'"{function.name}", chasles_call_{index}, {rows}, {nearest}'
        lines += [f"    {{{names}, {counts}, chasles_sizes_{index}}},"]
    lines += ["    {0, 0, 0, 0, 0, 0, 0, 0},", "};", ""]
    return "\n".join(lines).encode()


def _sizes(function: FunctionInfo) -> list[int]:
    return [math.prod(item.shape) for item in (*function.inputs, *function.outputs)]


def _wrapper(index: int, function: FunctionInfo) -> list[str]:
    sizes = ", ".join(map(str, _sizes(function)))
    inputs = [f"inputs[{i}]" for i in range(len(function.inputs))]
    outputs = [f"outputs[{i}]" for i in range(len(function.outputs))]
    return [
        f"static const int chasles_sizes_{index}[] = {{{sizes}}};",
        f"static void chasles_call_{index}(const double *const *inputs, double *const *outputs)",
        "{",
        f"    {function.symbol}({', '.join(inputs + outputs)});",
        "}",
        "",
    ]


def _has_nearest(manifest: Manifest, function: FunctionInfo) -> bool:
    slots = function.outputs[0].shape[0] if function.role.is_inverse else 0
    return _NEAREST in manifest.c_files and 0 < slots <= _MAX_NEAREST


def _nearest_rows(index: int, function: FunctionInfo) -> list[str]:
    """Return a C function that computes the nearest solutions of many poses with SIMD."""
    name, n = function.symbol, function.outputs[0].shape[1]
    count = len(function.inputs)
    inputs = [f"inputs[{i}] + (ptrdiff_t)row * input_steps[{i}]" for i in range(count)]
    return [
        f"static void chasles_nearest_rows_{index}(size_t n, const double *const *inputs,",
        "    const ptrdiff_t *input_steps, double tolerance, const double *const *moves,",
        "    const double *q_seed, ptrdiff_t seed_step, double *const *outputs, signed char *slot)",
        "{",
        "    const chasles_moves by = {moves[0], moves[1], moves[2], moves[3]};",
        f"#if defined {name.upper()}_NEAREST_ROWS && !defined chasles_nearest_slots",
        "    const chasles_seeds seeds = {q_seed, seed_step, &by, tolerance};",
        f"    {name.upper()}_NEAREST_ROWS",
        "#endif",
        "    for (size_t row = 0; row < n; row++, q_seed += seed_step) {",
        f"        slot[row] = (signed char){name}_nearest_by({', '.join(inputs)}, &by, tolerance,",
        f"            q_seed, outputs[0] + row * {n}, outputs[1] + row, outputs[2] + row);",
        "    }",
        "}",
        "",
    ]


def build(manifest: Manifest) -> bool:
    """Compile the library of a robot unless an intact one exists; return whether it was compiled.

    Raises:
        ChaslesError: If the compilation fails; the message states the reason.
    """
    return open_library(manifest)[0]


def open_library(manifest: Manifest) -> tuple[bool, _call.Library]:
    """Load or compile the library of a robot; the first result is whether it was compiled.

    Raises:
        MismatchError: If the library is damaged, and no compiler was found.
        ChaslesError: If the compilation fails; the message states the reason.
    """
    recipe = make_recipe(manifest)
    if recipe.compiler is None:
        return False, _open(recipe)
    if recipe.path.exists():
        with suppress(MismatchError):
            return False, _open(recipe)
    write_library(recipe, partial(recipe.compiler.compile, [GLUE_FILE], "library.so"))
    return True, _open(recipe)


def _open(recipe: Recipe) -> _call.Library:
    advice = f"compile it again with `python -m chasles build {recipe.folder}`"
    if recipe.path.parent == recipe.folder:
        advice = "install or write the robot's folder again"
    else:
        _check_owner(recipe.path.parent)
    try:
        content = read_input(recipe.path)
    except OSError as error:
        raise CacheError(f"{recipe.path}: cannot read the library ({error.strerror})") from None
    body, digest = content[:-_DIGEST_SIZE], content[-_DIGEST_SIZE:]
    if hashlib.sha256(body).digest() != digest:
        raise MismatchError(f"{recipe.path}: damaged library; {advice}")
    try:
        return _call.open(str(recipe.path), recipe.key)
    except MismatchError as error:
        raise MismatchError(f"{error}; {advice}") from None


def _check_owner(cache: Path) -> None:
    """Raise a CacheError for a folder in which other users can replace files."""
    facts = cache.stat()
    if os.name == "posix" and (facts.st_uid not in (0, os.getuid()) or facts.st_mode & 0o022):
        raise CacheError(
            f"{cache}: another user may write to this folder, so no library is loaded; set "
            f"CHASLES_CACHE to a folder of your own, or run `chmod 700 {cache}`"
        )


def write_library(recipe: Recipe, compile_in: Callable[[Path], None]) -> None:
    """Write the library of a robot. `compile_in` compiles the sources in a folder."""
    cache = recipe.path.parent
    try:
        cache.mkdir(mode=0o700, parents=True, exist_ok=True)
        with temporary_folder(cache, recipe.name) as folder:
            # The compiler reads copies of the hashed source files. The names of the copies and the
            # file names in the include lines contain no folder. Therefore, the compiled library
            # contains no paths.
            for file, content in recipe.sources.items():
                (folder / file).write_bytes(content)
            with (folder / GLUE_FILE).open("a") as glue:
                glue.write(
                    f'#ifndef CHASLES_LEVEL\nconst char chasles_hash[] = "{recipe.key}";\n#endif\n'
                )
            compile_in(folder)
            library = folder / "library.so"
            _seal(library)
            # The move is atomic: other processes see the complete library or no library.
            # Windows does not replace a library that another process has loaded.
            with suppress(*[PermissionError] * (os.name == "nt" and recipe.path.exists())):
                library.replace(recipe.path)
    except OSError as error:
        raise CacheError(
            f"{cache}: cannot write a library ({error}); set CHASLES_CACHE to a writable folder"
        ) from error


def _seal(library: Path) -> None:
    with library.open("r+b") as file:
        # read() moves the file position to the end, so write() appends the hash. The system
        # ignores the appended bytes when it opens the library.
        file.write(hashlib.sha256(file.read()).digest())
