"""The manifest describes the branches and coordinates of solutions."""

import pytest

import chasles
from tests.support.handwritten import scara


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda f: f["outputs"].pop(), r"expected q \(2, 4\), residual \(2\) and margin \(2\)"),
        (lambda f: f["labels"].append("c"), "labels: .* expected as many as the first dimension"),
        (lambda f: f["labels"].clear(), "expected labels for an inverse or for branches"),
        (lambda f: f.update(fixed=[4]), "fixed: .* expected indices below 4"),
        (lambda f: f["outputs"].reverse(), r"expected q \(2, 4\)"),
        (lambda f: f.update(fixed=[-1]), "expected a count"),
    ],
    ids=[
        "output missing",
        "extra label",
        "no labels",
        "index out of range",
        "outputs reversed",
        "negative index",
    ],
)
def test_invalid_branch_entry_in_manifest_is_rejected(tmp_path, cache, spoil, message):
    folder = scara.write(tmp_path / "scara")
    spoil(folder.manifest["functions"][2])
    folder.write_manifest()
    with pytest.raises(chasles.ManifestError, match=message):
        chasles.load(folder.path)


def test_geared_motors_do_not_wrap(tmp_path):
    from chasles.contract import read_manifest

    ratios = [1.0, -1.0, 2.0, 0.5]
    z = [{"name": f"z{i}", "unit": "rad"} for i in range(4)]
    actuated = [{"index": i, "ratio": ratio} for i, ratio in enumerate(ratios)]
    folder = scara.write(tmp_path / "scara", configuration=z, actuated_in_z=actuated)
    assert read_manifest(folder.path).wraps == (True, True, False, False)
