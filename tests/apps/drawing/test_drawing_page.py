"""The examples of docs/drawing.md run."""

import re
from pathlib import Path

import pytest

pytest.importorskip("matplotlib")
PAGE = Path(__file__).parents[3] / "docs" / "drawing.md"


LONG, SHORT = "np.linspace(0, 0.2, 6)", "np.linspace(0, 0.2, 2)"
"""The path of the page, and a path of two configurations, whose film takes a third of the time."""


def test_drawing_page_examples_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = PAGE.read_text(encoding="utf-8")
    examples = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert len(examples) == 4
    names = {}
    assert sum(LONG in example for example in examples) == 1
    for example in examples:
        exec(compile(example.replace(LONG, SHORT), str(PAGE), "exec"), names)
    assert {path.name for path in tmp_path.iterdir()} == {
        *("ur5e.pdf", "ur5e_branches.svg", "four_bar.pdf", "boom.png", "boom.gif"),
    }
    assert (tmp_path / "ur5e.pdf").read_bytes().startswith(b"%PDF")
    for picture in re.findall(r"\]\((\w+\.png)\)", text):
        assert PAGE.with_name(picture).is_file()
