"""The examples of docs/how-to/drawing.md run."""

from tests.support.optional import requires
from tests.support.pages import examples

pytestmark = requires("matplotlib")
PAGE = "how-to/drawing.md"


LONG, SHORT = "np.linspace(0, 0.2, 6)", "np.linspace(0, 0.2, 2)"
"""The path in the example of the page, and a shorter path.

The animation of the shorter path is drawn in a third of the time.
"""


def test_drawing_page_examples_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {}
    blocks = examples(PAGE)
    assert sum(LONG in example for example in blocks) == 1
    for example in blocks:
        exec(compile(example.replace(LONG, SHORT), PAGE, "exec"), names)
    assert {path.name for path in tmp_path.iterdir()} == {
        *("ur5e.pdf", "ur5e_branches.svg", "four_bar.pdf", "boom.png", "boom.gif"),
    }
    assert (tmp_path / "ur5e.pdf").read_bytes().startswith(b"%PDF")
