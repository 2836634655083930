"""The examples of docs/studies.md run."""

import re
from pathlib import Path

import matplotlib
import numpy as np
import pytest

pytest.importorskip("coal", reason="coal comes with pin")
PAGE = Path(__file__).parents[3] / "docs" / "studies.md"


def test_studies_page_examples_run(tmp_path, monkeypatch, capsys):
    matplotlib.use("Agg")
    monkeypatch.chdir(tmp_path)
    examples = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(examples) == 10
    names = {}
    for example in examples:
        exec(compile(example, str(PAGE), "exec"), names)
    assert names["share"].max() == 1
    assert names["found"].grid().shape == (20, 20, 11)
    assert names["path"].found
    assert 0.5 < names["fast"].duration < names["motion"].duration
    assert len(names["bricks"].t) > 1000
    lengths = 1000 * np.ptp(names["lengths"], axis=0)
    np.testing.assert_allclose(lengths, [348.9, 302.7, 318.9, 123.2], atol=0.05)
    printed = capsys.readouterr().out
    assert "volume 3." in printed
    matplotlib.pyplot.close("all")
