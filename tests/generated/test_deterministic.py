"""Equal descriptions give equal bytes in all generated files.

The bytes of generated files do not depend on directory, hash seed, date or processor.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from chasles.contract import read_manifest
from chasles.derive.emit.c.header import support_files
from chasles.derive.emit.manifest import sha256
from tests.support.derivations import ALL, GENERATED

LIMIT = 10 * 2**20
OLD_PROCESSOR = {
    "OPENBLAS_CORETYPE": "Prescott",
    "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR",
}
"""Environment variables that select the OpenBLAS and NumPy kernels for an old processor.

By default, OpenBLAS and NumPy select kernels for the processor of the machine.
"""

DERIVED = ("five_bar",)
"""Name of the tested robot, a mechanism with a loop.

`make check-generated` and .ci/run derive all robots and compare the bytes.
"""


def generate(folder, seed):
    environment = {**os.environ, **OLD_PROCESSOR, "PYTHONHASHSEED": seed}
    command = [sys.executable, "-m", "chasles", "derive", *DERIVED, "--to", str(folder)]
    subprocess.run(command, env=environment, check=True, capture_output=True, cwd=folder.parent)
    return contents(folder)


def contents(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != ".derived"
    }


def test_generated_files_do_not_depend_on_environment(tmp_path):
    """The committed files were generated in a different directory."""
    found = generate(tmp_path / "another place", "4242")
    assert len([name for name in found if name.endswith("manifest.json")]) == len(DERIVED)
    assert [name for name in found if committed(name) != found[name]] == []


def committed(name):
    own, shared = GENERATED / name, GENERATED / "support" / Path(name).name
    path = own if own.is_file() else shared
    return path.read_bytes() if path.is_file() else None


def test_shared_headers_are_those_of_the_compiler_and_used():
    used = {file for name in ALL for file in read_manifest(GENERATED / name).files}
    for path in (GENERATED / "support").iterdir():
        assert path.read_bytes() == support_files()[path.name].read_bytes()
        assert path.name in used
    own = {path.name for name in ALL for path in (GENERATED / name).glob("*.h")}
    assert not own & support_files().keys()


@pytest.mark.parametrize("name", ALL)
def test_manifest_lists_file_hashes_and_no_machine_names(name):
    text = (GENERATED / name / "manifest.json").read_text()
    manifest = read_manifest(GENERATED / name)
    for file, digest in manifest.files.items():
        assert sha256(manifest.path_of(file).read_text()) == digest
    assert str(GENERATED) not in text
    assert os.uname().nodename not in text or len(os.uname().nodename) < 4


def test_generated_files_stay_below_size_limit():
    size = sum(path.stat().st_size for path in GENERATED.rglob("*") if path.suffix != ".pyc")
    assert size <= LIMIT
