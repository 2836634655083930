"""Compiled robot libraries: built once, cached, and checked when opened.

The cache key is part of the file name. It is the SHA-256 of the C code, the glue code, the
compiler, the flags and the processor (`make_recipe`). A library contains its key. It ends with the
SHA-256 of the preceding bytes, so that a damaged library is rejected before the system maps it.

Environment:
    CHASLES_CACHE: The cache folder; by default `chasles` in XDG_CACHE_HOME or in ~/.cache.
"""

from __future__ import annotations

import hashlib
import math
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ..call import _call
from ..contract import FunctionInfo, Manifest, ManifestError, remove_abandoned
from ..errors import CacheError, MismatchError
from .compiler import Compiler, describe_machine, find_compiler

_KERNEL_HEADER = Path(__file__).with_name("_kernel.h")
GLUE_FILE = "chasles_glue.c"
"""File name of the glue code; no robot name begins with chasles_."""
_NEAREST = "chasles_nearest.h"
"""The generated file that selects the nearest solution of an inverse."""
_MAX_NEAREST = 64
"""Largest number of slots for this selection."""
ABANDONED = 86400.0
"""Age [s] of temporary folders in the cache whose process was killed."""
_DIGEST_SIZE = hashlib.sha256().digest_size


def cache_folder() -> Path:
    """Return the folder of compiled libraries."""
    chosen = os.environ.get("CHASLES_CACHE")
    if chosen:
        return Path(chosen).absolute()
    xdg = os.environ.get("XDG_CACHE_HOME", "")
    # The XDG standard ignores relative paths.
    base = Path(xdg) if os.path.isabs(xdg) else Path.home() / ".cache"
    return base / "chasles"


@dataclass(frozen=True)
class Recipe:
    """All inputs that determine the compiled library of a robot.

    Attributes:
        name: The robot name.
        folder: The folder of the generated files.
        sources: The content of each file that the compiler reads, by name.
        compiler: The compiler with its flags.
        key: The cache key, SHA-256 of sources, compiler and processor.
        path: The library file in the cache.
    """

    name: str
    folder: Path
    sources: Mapping[str, bytes]
    compiler: Compiler
    key: str
    path: Path


def make_recipe(manifest: Manifest) -> Recipe:
    """Return the recipe for compiling a robot on this machine.

    Raises:
        MismatchError: If the C code or the header does not match the hash in the manifest.
        ManifestError: If header and manifest declare different sizes.
        CompilerNotFoundError: If no compiler was found.
    """
    name = manifest.name
    sources = {file: manifest.read_source(file) for file in manifest.c_files}
    check_header(manifest, sources[f"{name}.h"].decode(errors="replace"))
    sources["_kernel.h"] = _KERNEL_HEADER.read_bytes()
    sources[GLUE_FILE] = write_glue(manifest).encode()
    compiler = find_compiler()
    parts = [
        *(text for item in sorted(sources.items()) for text in (item[0].encode(), item[1])),
        compiler.identity.encode(),
        "\0".join(compiler.flags).encode(),
        describe_machine().encode(),
    ]
    # Each part is hashed separately, so that different lists cannot have the same concatenation.
    digests = b"".join(hashlib.sha256(part).digest() for part in parts)
    key = hashlib.sha256(digests).hexdigest()
    sources[GLUE_FILE] += f'const char chasles_hash[] = "{key}";\n'.encode()
    return Recipe(
        name, manifest.folder, sources, compiler, key, cache_folder() / f"{name}-{key[:32]}.so"
    )


def check_header(manifest: Manifest, header: str) -> None:
    """Raise a ManifestError if array sizes in the header and in the manifest differ.

    The C compiler does not check them: it treats the parameter `double T[16]` as a pointer. A
    kernel that writes 16 doubles into an array of 12 would corrupt memory.
    """
    code = re.sub(r"/\*.*?\*/|//[^\n]*", " ", header, flags=re.DOTALL)
    declarations = dict(re.findall(r"\bvoid\s+(\w+)\s*\(([^()]*)\)\s*;", code))
    for function in manifest.functions:
        found = declarations.get(function.symbol)
        declared = [_declared_size(item) for item in found.split(",")] if found else []
        if declared != _sizes(function):
            raise ManifestError(
                f"{manifest.folder / manifest.name}.h: {function.symbol}: declared with sizes "
                f"{declared}, expected {_sizes(function)} as in manifest.json"
            )


def _declared_size(parameter: str) -> int:
    bound = re.search(r"\[\s*(\d+)\s*\]\s*$", parameter)
    return int(bound[1]) if bound else 1


def write_glue(manifest: Manifest) -> str:
    """Return the glue code: one wrapper for each function, and the table of all functions."""
    batched = manifest.batch_file in manifest.c_files
    lines = [
        '#include "_kernel.h"',
        f'#include "{manifest.name}.c"',
        *([f'#include "{manifest.batch_file}"'] if batched else []),
        "",
        "extern CHASLES_EXPORT const chasles_kernel chasles_kernels[];",
        "extern CHASLES_EXPORT const char chasles_hash[];",
        "",
    ]
    for index, function in enumerate(manifest.functions):
        lines += _wrapper(index, function)
        lines += _nearest(index, function) if _has_nearest(manifest, function) else []
    lines += ["const chasles_kernel chasles_kernels[] = {"]
    for index, function in enumerate(manifest.functions):
        rows = f"{function.symbol}_rows" if batched else "0"
        counts = f"{len(function.inputs)}, {len(function.outputs)}"
        nearest = f"chasles_nearest_{index}" if _has_nearest(manifest, function) else "0"
        names = f'"{function.name}", chasles_call_{index}, {rows}, {nearest}'
        lines += [f"    {{{names}, {counts}, chasles_sizes_{index}}},"]
    lines += ["    {0, 0, 0, 0, 0, 0, 0},", "};", ""]
    return "\n".join(lines)


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
    """Test whether the generated C selects the nearest solution of a function."""
    slots = function.outputs[0].shape[0] if function.role.is_inverse else 0
    return _NEAREST in manifest.c_files and 0 < slots <= _MAX_NEAREST


def _nearest(index: int, function: FunctionInfo) -> list[str]:
    slots, n = function.outputs[0].shape
    return [
        f"static void chasles_nearest_{index}(size_t n, int k, const double *const *slots,",
        "    double tolerance, const double *const *moves, const double *q_seed,",
        "    ptrdiff_t seed_step, double *const *outputs, signed char *slot)",
        "{",
        "    const chasles_moves by = {moves[0], moves[1], moves[2], moves[3]};",
        "    for (size_t row = 0; row < n; row++, q_seed += seed_step) {",
        f"        if (k == {slots}) {{",
        *_selection(n, str(slots)),
        "        } else {",
        *_selection(n, "k"),
        "        }",
        "    }",
        "}",
        "",
    ]


def _selection(n: int, k: str) -> list[str]:
    """Return C that selects among k slots of a row; a constant k is faster."""
    at = [f"slots[{i}] + row * {size} * (size_t){k}" for i, size in enumerate((n, 1, 1))]
    to = [f"outputs[0] + row * {n}", "outputs[1] + row", "outputs[2] + row"]
    return [
        f"            const chasles_slots of = {{{n}, {k}, {', '.join(at)}, tolerance}};",
        f"            slot[row] = (signed char)chasles_nearest(&of, &by, q_seed, {', '.join(to)});",
    ]


def build(manifest: Manifest) -> bool:
    """Compile the library of a robot unless the cache has an intact one; return if it compiled.

    Raises:
        ChaslesError: If compilation fails; the message states the reason.
    """
    recipe = make_recipe(manifest)
    if _is_sound(recipe):
        return False
    _compile(recipe)
    _open(recipe)
    return True


def open_library(manifest: Manifest) -> _call.Library:
    """Return the library of a robot, after compilation if the cache has none.

    Raises:
        MismatchError: If the library in the cache is damaged or has a different key.
        ChaslesError: If compilation fails; the message states the reason.
    """
    recipe = make_recipe(manifest)
    if not recipe.path.exists():
        _compile(recipe)
    return _open(recipe)


def _is_sound(recipe: Recipe) -> bool:
    if not recipe.path.exists():
        return False
    try:
        _open(recipe)
    except MismatchError:
        return False
    return True


def _open(recipe: Recipe) -> _call.Library:
    _check_owner(recipe.path.parent)
    advice = f"compile it again with `python -m chasles build {recipe.folder}`"
    try:
        content = recipe.path.read_bytes()
    except OSError as error:
        raise CacheError(f"{recipe.path}: cannot be read ({error.strerror})") from error
    body, digest = content[:-_DIGEST_SIZE], content[-_DIGEST_SIZE:]
    if hashlib.sha256(body).digest() != digest:
        raise MismatchError(f"{recipe.path}: damaged in the cache; {advice}")
    try:
        return _call.open(recipe.path, recipe.key)
    except MismatchError as error:
        raise MismatchError(f"{error}; {advice}") from None


def _check_owner(cache: Path) -> None:
    """Raise a CacheError for a folder in which another user could replace a library."""
    facts = cache.stat()
    if os.name == "posix" and (facts.st_uid not in (0, os.getuid()) or facts.st_mode & 0o022):
        raise CacheError(
            f"{cache}: another user may write here, so no library is loaded; run "
            f"`chmod 700 {cache}`, or set CHASLES_CACHE to a folder of your own"
        )


def _compile(recipe: Recipe) -> None:
    # Imported here: loading a cached library does not need it.
    import tempfile  # noqa: PLC0415

    cache = recipe.path.parent
    try:
        cache.mkdir(mode=0o700, parents=True, exist_ok=True)
        remove_abandoned(cache, ".*-*", ABANDONED)
        with tempfile.TemporaryDirectory(prefix=f".{recipe.name}-", dir=cache) as name:
            # The compiler reads copies of the hashed bytes. Their plain names cannot break an
            # #include, and no path enters the library.
            folder = Path(name)
            for file, content in recipe.sources.items():
                (folder / file).write_bytes(content)
            recipe.compiler.compile(GLUE_FILE, "library.so", folder)
            library = folder / "library.so"
            _seal(library)
            # Atomic: other processes see the complete library or none.
            library.replace(recipe.path)
    except OSError as error:
        raise CacheError(
            f"{cache}: cannot write a library ({error}); set CHASLES_CACHE to a writable folder"
        ) from error


def _seal(library: Path) -> None:
    with library.open("r+b") as file:
        # After read() the file position is at the end; the system does not map appended bytes.
        file.write(hashlib.sha256(file.read()).digest())
