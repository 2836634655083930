"""Crafted files end with an error that names the file."""

import pytest

import chasles
from chasles.derive import ChaslesError, apply_calibration, read

ALIASES = "".join(f"a{k + 1}: &a{k + 1} [{', '.join([f'*a{k}'] * 9)}]\n" for k in range(12))
CALIBRATIONS = {
    "aliased-key.yaml": f"a0: &a0 [x]\n{ALIASES}? *a12\n: 1\n",
    "deep.yaml": "[" * 5000,
    "lines.conf": "\n" * 900_000,
}


@pytest.mark.parametrize("name", CALIBRATIONS)
def test_crafted_calibration_is_refused(name, tmp_path):
    file = tmp_path / name
    file.write_text(CALIBRATIONS[name])
    with pytest.raises(ChaslesError, match=name):
        apply_calibration(read("ur5e"), file)


@pytest.mark.parametrize("encoding", ["punycode", "undefined"])
def test_unusual_encoding_is_refused(encoding, tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_text(f'<?xml version="1.0" encoding="{encoding}"?><robot name="r"/>')
    with pytest.raises(ChaslesError, match=r"arm\.urdf"):
        read(file)


def test_deep_manifest_is_refused(tmp_path):
    (tmp_path / "manifest.json").write_text("[" * 100_000)
    with pytest.raises(ChaslesError, match=r"manifest\.json"):
        chasles.load(tmp_path)
