"""The cache compiles each library once and rebuilds damaged files."""

import gc
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import chasles
from chasles.call import _call
from chasles.contract import read_manifest
from chasles.library.cache import build, cache_folder, make_recipe
from chasles.library.compiler import find_compiler
from tests.support.handwritten import tiny
from tests.support.tools import path_of

Q = np.array([0.3, -1.2])


@pytest.fixture(autouse=True)
def fast(cache, monkeypatch):
    """Set compiler flags for fast compilation."""
    monkeypatch.setenv("CHASLES_CFLAGS", "-O0")


def libraries(cache):
    return sorted(cache.iterdir()) if cache.exists() else []


def test_library_is_compiled_once(folder, cache):
    chasles.load(folder.path)
    (library,) = libraries(cache)
    assert library.name.startswith("tiny-")
    before = library.stat()
    robot = chasles.load(folder.path)
    assert library.stat().st_mtime_ns == before.st_mtime_ns
    np.testing.assert_allclose(robot.fk(Q), tiny.fk(Q), rtol=1e-14)


def test_a_built_robot_loads_without_running_the_compiler(folder, monkeypatch):
    chasles.load(folder.path)
    monkeypatch.setattr(subprocess, "run", None)
    np.testing.assert_allclose(chasles.load(folder.path).fk(Q), tiny.fk(Q), rtol=1e-14)


@pytest.mark.parametrize("file", ["tiny.c", "tiny.h"])
def test_changed_source_is_rejected(folder, file):
    chasles.load(folder.path)
    (folder.path / file).write_text((folder.path / file).read_text() + "\n")
    with pytest.raises(
        chasles.MismatchError, match=rf"{file}: the file has changed .*derive tiny again"
    ):
        chasles.load(folder.path)
    (folder.path / file).unlink()
    with pytest.raises(chasles.MismatchError, match=rf"{file}: cannot be read"):
        chasles.load(folder.path)


def test_new_equations_get_a_new_library(folder, cache):
    old = chasles.load(folder.path)
    folder.write(tiny.SOURCE.replace("sin", "cos"))
    new = chasles.load(folder.path)
    assert len(libraries(cache)) == 2
    assert old.fk([0, 0])[0, 0] == 0
    assert new.fk([0, 0])[0, 0] == 1


def test_cached_file_depends_on_flags_and_compiler(folder, monkeypatch, tmp_path):
    manifest = read_manifest(folder.path)
    paths = [make_recipe(manifest).path]
    monkeypatch.setenv("CHASLES_CFLAGS", "-O1")
    paths.append(make_recipe(manifest).path)
    compiler = tmp_path / "mycc"
    compiler.write_text('#!/bin/sh\nexec cc "$@"\n')
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    paths.append(make_recipe(manifest).path)
    compiler.write_text('#!/bin/sh\nexec cc  "$@"\n')
    paths.append(make_recipe(manifest).path)
    os.utime(compiler, ns=(0, 0))
    paths.append(make_recipe(manifest).path)
    assert len(set(paths)) == 5
    assert build(manifest)


@pytest.mark.parametrize("spoil", ["byte", "truncate", "empty", "text"])
def test_damaged_library_is_rejected_and_rebuilt(folder, cache, spoil, monkeypatch):
    chasles.load(folder.path)
    (library,) = libraries(cache)
    content = bytearray(library.read_bytes())
    if spoil == "byte":
        content[len(content) // 2] ^= 1
    spoiled = {
        "byte": bytes(content),
        "truncate": bytes(content[: len(content) // 2]),
        "empty": b"",
        "text": b"not a library at all, but long enough to end in something like a digest",
    }[spoil]
    library.unlink()  # The old file stays mapped in memory, so the test writes a new file.
    library.write_bytes(spoiled)
    with monkeypatch.context() as without_compiler:
        without_compiler.setenv("PATH", "/nonexistent")
        with pytest.raises(chasles.MismatchError, match=r"damaged library; .*chasles build"):
            chasles.load(folder.path)
    np.testing.assert_allclose(chasles.load(folder.path).fk(Q), tiny.fk(Q), rtol=1e-14)
    library.unlink()
    library.write_bytes(spoiled)
    manifest = read_manifest(folder.path)
    assert build(manifest)
    assert not build(manifest)
    chasles.load(folder.path).fk(Q)


def test_library_with_wrong_content_hash_is_rejected(folder, cache):
    chasles.load(folder.path)
    (old,) = libraries(cache)
    folder.write(tiny.SOURCE.replace("sin", "cos"))
    manifest = read_manifest(folder.path)
    recipe = make_recipe(manifest)
    shutil.copy(old, recipe.path)
    with pytest.raises(chasles.MismatchError, match=r"compiled for content .* is expected"):
        _call.open(recipe.path, recipe.key)
    assert build(manifest)
    assert chasles.load(folder.path).fk([0, 0])[0, 0] == 1


def test_open_rejects_foreign_or_missing_libraries(folder, tmp_path):
    recipe = make_recipe(read_manifest(folder.path))
    build(read_manifest(folder.path))
    with pytest.raises(chasles.MismatchError, match="is expected"):
        _call.open(recipe.path, "0" * 64)
    with pytest.raises(chasles.MismatchError, match="cannot be opened"):
        _call.open(tmp_path / "nothing.so", recipe.key)
    with pytest.raises(chasles.MismatchError, match="has no chasles_hash"):
        _call.open(np._core._multiarray_umath.__file__, recipe.key)
    for bad in ((), (1, 2), ("a\0b", ""), (recipe.path,)):
        with pytest.raises((TypeError, ValueError)):
            _call.open(*bad)


def test_function_must_agree_with_the_library(folder):
    manifest = read_manifest(folder.path)
    build(manifest)
    recipe = make_recipe(manifest)
    library = _call.open(recipe.path, recipe.key)
    fk, blend = manifest.functions[:2]
    rest = {"label": "x", "doc": "", "signature": None, "operations": {}, "reduced": ()}
    rest |= {"guard": None, "solutions": None, "rescue": None, "poses": 0, "fk": None, "unit": 1.0}
    rest |= {"general": None, "parameters": ()}
    assert library.function("fk", fk.inputs, fk.outputs, **rest)(Q).shape == (3, 4)
    for inputs, outputs in [
        (fk.outputs, fk.inputs),
        (blend.inputs, fk.outputs),
        (fk.inputs, fk.inputs),
    ]:
        with pytest.raises(chasles.MismatchError, match="other arguments or sizes"):
            library.function("fk", inputs, outputs, **rest)
    with pytest.raises(chasles.MismatchError, match="has no function 'nope'"):
        library.function("nope", fk.inputs, fk.outputs, **rest)
    for bad in [(), (1,), fk.inputs * 40]:
        with pytest.raises((TypeError, ValueError, AttributeError)):
            library.function("fk", bad, fk.outputs, **rest)


@pytest.mark.parametrize(("index", "output"), [(0, False), (0, True), (3, True)])
def test_manifest_sizes_that_contradict_header_are_rejected(folder, index, output):
    function = folder.manifest["functions"][index]
    function["outputs" if output else "inputs"][0]["shape"] = [4, 4]
    folder.write_manifest()
    message = r"tiny\.h: tiny_\w+: the declared sizes differ .* expected .*16"
    with pytest.raises(chasles.ManifestError, match=message):
        chasles.load(folder.path)


def test_header_may_hold_comments_and_pointers(folder):
    header = tiny.HEADER.replace("q[2], double T[12])", "q[2] /* rad (2) */,\n  double T[12])")
    folder.write(header=header.replace("double d[1]", "double *d"))
    assert chasles.load(folder.path).distance(2, [3, 4]) == 10


@pytest.mark.parametrize("compiler", ["gcc", "clang", "tcc", "cc -m64"])
def test_every_supported_compiler_gives_correct_results(folder, monkeypatch, compiler):
    path_of(compiler.split()[0])
    monkeypatch.setenv("CC", compiler)
    np.testing.assert_allclose(chasles.load(folder.path).fk(Q), tiny.fk(Q), rtol=1e-14)


def test_functions_outlive_robot_and_library(folder):
    function = chasles.load(folder.path).fk
    ufunc = chasles.load(folder.path).blend.ufunc
    expected = tiny.fk(Q)
    np.testing.assert_allclose(function(Q), expected, rtol=1e-14)
    del function
    assert ufunc(Q, np.ones((2, 3))).shape == (2,)
    assert "Blends." in ufunc.__doc__


@pytest.mark.usefixtures("few_objects")
@pytest.mark.usefixtures("few_objects")
def test_library_is_closed_with_its_last_function(folder, cache):
    maps = Path("/proc/self/maps")
    if not maps.exists():
        pytest.skip("no /proc")
    robot = chasles.load(folder.path)
    (library,) = libraries(cache)
    last = robot.fk.ufunc
    robot.blend([1, 2], np.ones((4, 2, 3)))
    del robot
    gc.collect()
    assert str(library) in maps.read_text()
    del last
    gc.collect()
    assert str(library) not in maps.read_text()


def test_compiler_failure_reports_its_output(folder, cache):
    folder.write(tiny.SOURCE + "\nthis is not C;\n")
    with pytest.raises(chasles.CompileError, match=r"(?s)failed with status 1.*this is not C"):
        chasles.load(folder.path)
    assert libraries(cache) == []


def test_long_compiler_output_is_truncated(folder):
    folder.write(tiny.SOURCE + "".join(f"\nwrong{k} is not C;\n" for k in range(100)))
    with pytest.raises(chasles.CompileError, match=r"(?s)wrong0.*\.\.\. and \d+ more lines$"):
        chasles.load(folder.path)


@pytest.mark.parametrize(
    ("variable", "text", "message"),
    [
        (
            "CHASLES_CFLAGS",
            "-O2 -ffast-math",
            "CC or CHASLES_CFLAGS: -ffast-math: with this flag, poses",
        ),
        ("CHASLES_CFLAGS", "-Ofast", "CC or CHASLES_CFLAGS: -Ofast: with this flag, poses"),
        ("CHASLES_CFLAGS", "-ffinite-math-only", "CC or CHASLES_CFLAGS: -ffinite-math-only: with"),
        ("CHASLES_CFLAGS", "-ffp-model=fast", "CC or CHASLES_CFLAGS: -ffp-model=fast: with"),
        ("CC", "cc -ffast-math", "CC or CHASLES_CFLAGS: -ffast-math: with this flag, poses"),
        ("CHASLES_CFLAGS", "-D'x", 'CHASLES_CFLAGS="-D\'x": no closing quotation'),
        ("CC", 'gcc "', "CC='gcc \"': no closing quotation"),
    ],
)
def test_unusable_compiler_settings_are_refused(monkeypatch, variable, text, message):
    monkeypatch.setenv(variable, text)
    with pytest.raises(chasles.CompileError, match=f"^{message}"):
        find_compiler()


def test_missing_compiler_error_gives_install_hint(folder, monkeypatch, tmp_path):
    monkeypatch.setenv("CC", "no-such-cc -O2")
    with pytest.raises(
        chasles.CompilerNotFoundError, match=r"install gcc or clang, .*CC=no-such-cc"
    ):
        chasles.load(folder.path)
    monkeypatch.delenv("CC")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(chasles.CompilerNotFoundError, match="cc, gcc and clang"):
        chasles.load(folder.path)


def test_paths_with_spaces_and_quotes_are_supported(folder, tmp_path, monkeypatch):
    odd = tmp_path / 'a "folder" with\\ spaces, ümläuts'
    shutil.copytree(folder.path, odd)
    monkeypatch.setenv("CHASLES_CACHE", str(odd / "my cache"))
    assert chasles.load(odd).fk(Q).shape == (3, 4)
    assert len(libraries(odd / "my cache")) == 1


def test_unwritable_cache_error_names_environment_variable(folder, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("CHASLES_CACHE", str(tmp_path / "file" / "cache"))
    with pytest.raises(chasles.CacheError, match="set CHASLES_CACHE"):
        chasles.load(folder.path)


def test_cache_folder_follows_xdg_and_home(monkeypatch, tmp_path):
    monkeypatch.delenv("CHASLES_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "chasles"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert cache_folder() == tmp_path / "home" / ".cache" / "chasles"


def test_concurrent_builds_produce_single_library(folder, cache):
    code = "import sys, chasles; print(chasles.load(sys.argv[1]).fk([0.0, 1.0])[0, 1])"
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", code, str(folder.path)], stdout=subprocess.PIPE, text=True
        )
        for _ in range(2)
    ]
    assert [process.communicate()[0] for process in processes] == ["1.0\n"] * 2
    assert len(libraries(cache)) == 1


def test_only_two_symbols_are_visible(folder, cache):
    nm = path_of("nm")
    chasles.load(folder.path)
    (library,) = libraries(cache)
    listing = subprocess.check_output([nm, "-D", "--defined-only", library], text=True)
    assert {line.split()[2] for line in listing.splitlines()} == {
        "chasles_hash",
        "chasles_kernels",
    }


def test_compiled_bytes_do_not_depend_on_folder(folder, cache, tmp_path, monkeypatch):
    chasles.load(folder.path)
    moved = tmp_path / "elsewhere"
    shutil.copytree(folder.path, moved)
    monkeypatch.setenv("CHASLES_CACHE", str(tmp_path / "other"))
    chasles.load(moved)
    (one,), (two,) = libraries(cache), libraries(tmp_path / "other")
    assert one.name == two.name
    assert one.read_bytes() == two.read_bytes()
    assert os.fsencode(tmp_path) not in one.read_bytes()


@pytest.mark.skipif(os.name != "posix", reason="permissions of POSIX")
def test_cache_that_others_may_write_is_refused(folder, cache):
    robot = chasles.load(folder.path)
    assert cache.stat().st_mode & 0o777 == 0o700
    cache.chmod(0o770)
    with pytest.raises(chasles.CacheError, match=f"chmod 700 {cache}"):
        chasles.load(folder.path)
    cache.chmod(0o700)
    assert chasles.load(folder.path).name == robot.name
