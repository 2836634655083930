"""The examples of docs/inverse.md run, and what their comments promise holds."""

import re
from pathlib import Path

import numpy as np
import pytest

PAGE = Path(__file__).parents[3] / "docs" / "inverse.md"


def test_inverse_page_examples_run_as_documented(capsys):
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) == 7
    names = {}
    seen = []
    for block in blocks:
        exec(compile(block, str(PAGE), "exec"), names)
        seen.append(dict(names))
    first, rounded, chosen, far, nearest, along, redundant = seen
    arm, q_now = first["arm"], first["q_now"]
    assert first["solutions"].array().shape == (8, 6)
    np.testing.assert_allclose(first["solutions"].nearest(q_now), q_now, atol=1e-12)
    assert rounded["se3"].deviation(rounded["coarse"]) == pytest.approx(5e-4, rel=0.1)
    assert arm.ik(rounded["se3"].project(rounded["coarse"], tolerance=1e-3)).count == 8
    assert chosen["solutions"].q.shape == (256, 6)
    np.testing.assert_allclose(chosen["solutions"].array()[0], q_now, atol=1e-12)
    assert not arm.ik(far["far"]).valid.any()
    assert far["best"].residual > 0.5
    assert nearest["found"].valid
    np.testing.assert_allclose(nearest["found"].q, q_now, atol=1e-12)
    path = along["path"]
    assert path.complete
    assert path.q.shape == (500, 6)
    assert capsys.readouterr().out == re.findall(r"print\(path\)  # (.*)", blocks[5])[0] + "\n"
    assert [item.name for item in redundant["panda"].redundancy] == ["q7"]
