"""The examples of README.md and docs/*.md run as they stand, page by page."""

import re
from pathlib import Path

import numpy as np
import pytest

import chasles
import chasles.derive
from tests.support.compiling import BOARD, compiled_quickly, own_robots_compiled_quickly
from tests.support.locking import locked

ROOT = Path(__file__).parents[1]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").glob("*.md")])
TESTED = {
    "drawing.md": "apps/drawing/test_drawing_page.py",
    "inverse.md": "runtime/closed_form/test_inverse_page.py",
    "numeric.md": "runtime/iterative/test_numeric.py",
    "studies.md": "apps/study/test_studies_page.py",
    "tracking.md": "runtime/velocity/test_tracking_page.py",
    "velocity.md": "runtime/velocity/test_rates_input.py",
}
"""Pages whose examples a test of their own runs, with what their comments promise."""
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def examples(page, language="python"):
    """The blocks of a language on a page, in order."""
    found = BLOCK.findall(page.read_text(encoding="utf-8"))
    return [block for name, block in found if name == language]


def run(page, names):
    """Runs the Python blocks of a page one after the other; their names at the end."""
    blocks = examples(page)
    assert blocks
    for block in blocks:
        exec(compile(block, str(page), "exec"), names)
    return names


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    """A folder of its own: examples read and write files."""
    monkeypatch.chdir(tmp_path)
    with own_robots_compiled_quickly():
        yield


def test_every_page_with_examples_has_a_test():
    here = Path(__file__).read_text(encoding="utf-8")
    for page in PAGES:
        if not examples(page):
            continue
        if page.name in TESTED:
            test = Path(__file__).parent / TESTED[page.name]
            assert f'"{page.name}"' in test.read_text(encoding="utf-8")
        else:
            assert f'"{page.name}"' in here.partition("BLOCK =")[2], page.name


def test_readme_examples_run_one_by_one(tmp_path, capsys):
    page = ROOT / "README.md"
    (description,) = examples(page, "toml")
    (tmp_path / "planar_arm.toml").write_text(description)
    first, boom, own = [block_names(page, block) for block in examples(page)]
    printed = capsys.readouterr().out
    assert f"```\n{printed}```" in page.read_text(encoding="utf-8")
    assert first["T"].shape == (4, 4)
    np.testing.assert_allclose(boom["lengths"], boom["q"], atol=1e-12)
    assert own["arm"].n == 3


def block_names(page, block):
    """The names that a block defines on its own."""
    names = {}
    exec(compile(block, str(page), "exec"), names)
    return names


def test_python_page_examples_run(tmp_path):
    (tmp_path / "generated").symlink_to(ROOT / "generated")
    (tmp_path / "my_arm.toml").write_text(
        'name = "my_arm"\nconvention = "dh"\nparameters = { d1 = 0.2 }\n'
        'joints = [{ a = 0.3, d = "d1" }, { a = 0.2 }]\n'
    )
    names = run(ROOT / "docs" / "python.md", {})
    assert names["p_D_q"].shape == (3, 7)


def test_conventions_page_examples_run(tmp_path):
    (tmp_path / "arm.toml").write_text(
        'name = "arm"\nconvention = "mine"\njoints = [{ a = 0.3 }, { a = 0.2, d = 0.1 }]\n'
    )
    names = run(ROOT / "docs" / "conventions.md", {})
    assert names["robot"].joints[0].before


def test_robot_files_page_examples_run():
    run(ROOT / "docs" / "robot-files.md", {})
    assert chasles.load("./robots/planar").n == 2


def test_loops_page_examples_run():
    names = run(ROOT / "docs" / "loops.md", {})
    assert names["near"].valid
    assert np.all(names["walked"].valid)
    assert names["legs"].valid.all()


def test_view_page_examples_run(tmp_path):
    pytest.importorskip("viser")
    run(ROOT / "docs" / "view.md", {})
    assert (tmp_path / "ur5e.html").stat().st_size > 100_000


def test_calibration_page_examples_run(tmp_path):
    pytest.importorskip("scipy")
    (tmp_path / "tracker.csv").write_text(measured(chasles.load("ur5e")))
    page = ROOT / "docs" / "calibration.md"
    (drives,) = (block for block in examples(page, "toml") if "[[transmissions]]" in block)
    (tmp_path / "mine.toml").write_text(
        'name = "mine"\nconvention = "dh"\nunits = { length = "mm", angle = "deg" }\n'
        f'joints = [{{ name = "shoulder", a = 300 }}, {{ name = "elbow", a = 200 }}]\n{drives}'
    )
    shown = np.array([0.3, 0.5])
    with compiled_quickly(), locked(BOARD):
        names = run(page, {"m": shown})
    assert not names["found"].outliers
    assert np.abs(names["m"] - shown).max(-1).min() < 1e-12


def measured(robot):
    """A table of 36 positions of a target on the tool, measured to 20 micrometres."""
    dice = np.random.default_rng(5)
    q = dice.uniform(-2, 2, (36, robot.n))
    target = np.array([0.05, 0.02, 0.1, 1.0])
    points = (robot.fk(q) @ target)[:, :3] + dice.normal(0, 2e-5, (36, 3))
    header = [*(f"q{k} [rad]" for k in range(1, robot.n + 1)), "x [m]", "y [m]", "z [m]"]
    rows = [",".join(map(repr, map(float, row))) for row in np.hstack([q, points])]
    return "\n".join([",".join(header), *rows])
