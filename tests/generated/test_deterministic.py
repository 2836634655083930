"""Equal descriptions give equal bytes: C, headers, CasADi files, LaTeX and manifests.

Neither the directory nor the hash seed nor the day nor the processor may show in them.
"""

import json
import os
import subprocess
import sys

import pytest

from chasles.derive.emit.manifest import sha256
from tests.support.derivations import ALL, GENERATED

LIMIT = 10 * 2**20
OLD_PROCESSOR = {
    "OPENBLAS_CORETYPE": "Prescott",
    "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR",
}
"""OpenBLAS and NumPy choose their loops by the processor; these run on all, and round otherwise."""

DERIVED = ("jaco2", "five_bar")
"""An arm whose inverse iterates numerically, and a mechanism with a loop.

`make check-generated` and .ci/run derive all robots in this way.
"""


def generate(folder, seed):
    environment = {**os.environ, **OLD_PROCESSOR, "PYTHONHASHSEED": seed}
    command = [sys.executable, "-m", "chasles.derive", *DERIVED, "--to", str(folder)]
    subprocess.run(command, env=environment, check=True, capture_output=True, cwd=folder.parent)
    return contents(folder)


def contents(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != ".derived"
    }


def test_generated_files_do_not_depend_on_environment(tmp_path):
    """The committed files came from their own directory."""
    found = generate(tmp_path / "another place", "4242")
    assert len([name for name in found if name.endswith("manifest.json")]) == len(DERIVED)
    assert [name for name in found if read(GENERATED / name) != found[name]] == []


def read(path):
    return path.read_bytes() if path.is_file() else None


@pytest.mark.parametrize("name", ALL)
def test_manifest_lists_file_hashes_and_no_machine_names(name):
    text = (GENERATED / name / "manifest.json").read_text()
    for file, digest in json.loads(text)["files"].items():
        assert sha256((GENERATED / name / file).read_text()) == digest
    assert str(GENERATED) not in text
    assert os.uname().nodename not in text or len(os.uname().nodename) < 4


def test_generated_files_stay_below_size_limit():
    size = sum(path.stat().st_size for path in GENERATED.rglob("*") if path.suffix != ".pyc")
    assert size <= LIMIT
