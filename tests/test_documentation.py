"""The examples of README.md and of the pages in docs run as printed."""

import re
from pathlib import Path

import numpy as np
import pytest

import chasles
import chasles.derive
from tests.support.compiling import deriving_only
from tests.support.pages import PAGES, ROOT, examples, run, text

README = "../README.md"
LANGUAGE = re.compile(r"^```(\w+)$", re.MULTILINE)
SINGLE_FIELDS = {("how-to/loops-as-built.md", "toml")}
"""Pages and languages of code blocks that are not run, because they show only one field of a
file."""


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    """A separate folder for the examples, because they read and write files."""
    monkeypatch.chdir(tmp_path)
    with deriving_only():
        yield


def test_every_page_with_examples_has_a_test():
    tests = "".join(sources())
    for page in PAGES:
        if examples(page):
            assert f'run("{page}"' in tests or f'PAGE = "{page}"' in tests, page


def test_examples_in_other_languages_are_read_by_a_test_of_their_page():
    """Blocks without a language are commands, and outputs of programs."""
    tests = sources()
    found = {
        (page, language)
        for page in PAGES
        for language in set(LANGUAGE.findall(text(page))) - {"python", "sh"}
    }
    assert len(found) >= 12
    for page, language in found - SINGLE_FIELDS:
        call = re.compile(rf'examples\([^()]*, "{language}"\)')
        assert any(f'"{page}"' in test and call.search(test) for test in tests), (page, language)


def sources():
    """Return the texts of all test files."""
    files = Path(__file__).parent.rglob("test_*.py")
    return [file.read_text(encoding="utf-8") for file in files]


def test_readme_examples_run_one_by_one(tmp_path, capsys):
    (description,) = examples(README, "toml")
    (tmp_path / "planar_arm.toml").write_text(description)
    first, boom, own = map(block_names, examples(README))
    printed = capsys.readouterr().out
    assert f"```\n{printed}```" in text(README)
    assert first["T"].shape == (4, 4)
    np.testing.assert_allclose(boom["lengths"], boom["q"], atol=1e-12)
    assert own["arm"].n == 3


def block_names(block):
    """Return the names that a block defines."""
    names = {}
    exec(compile(block, README, "exec"), names)
    return names


def test_five_minutes_page_prints_as_documented(capsys):
    run("start/five-minutes.md")
    assert capsys.readouterr().out == "".join(examples("start/five-minutes.md", ""))


def test_your_robot_page_prints_as_documented(tmp_path, capsys):
    page = "start/your-robot.md"
    for description in examples(page, "toml"):
        name = description.splitlines()[0].removeprefix("# ")
        (tmp_path / name).write_text(description)
    (tmp_path / "arm.urdf").write_text(URDF)
    run("start/your-robot.md")
    assert capsys.readouterr().out == "".join(examples(page, ""))


URDF = """\
<robot name="arm"><link name="base_link"/><link name="tool0"/>
<joint name="turn" type="continuous"><parent link="base_link"/><child link="tool0"/></joint></robot>
"""


def test_python_page_examples_run(tmp_path):
    (description,) = examples(README, "toml")
    (tmp_path / "planar_arm.toml").write_text(description)
    assert run("reference/python.md")["arm"].n == 3


def test_casadi_page_examples_run(tmp_path):
    (tmp_path / "generated").symlink_to(ROOT / "generated")
    names = run("how-to/casadi.md")
    assert names["p_D_q"].shape == (3, 7)
    found = chasles.load("panda").fk(np.array(names["q_goal"])[:, 0])[:3, 3]
    np.testing.assert_allclose(found, names["goal"], atol=1e-6)


def test_latex_page_prints_as_documented(capsys):
    run("how-to/latex.md")
    assert capsys.readouterr().out in examples("how-to/latex.md", "")


def test_extend_page_examples_run(tmp_path, capsys):
    (description,) = examples("how-to/extend.md", "toml")
    (tmp_path / "arm.toml").write_text(description)
    names = run("how-to/extend.md")
    assert names["robot"].joints[0].before
    assert "Structure: a column with a lift." in capsys.readouterr().out


def test_page_of_errors_prints_the_shapes(capsys):
    run("reference/errors.md")
    printed = capsys.readouterr().out
    assert f"# {printed}" in examples("reference/errors.md")[0]


def test_robot_files_page_examples_run():
    run("reference/robot-files.md")
    assert chasles.load("./robots/planar").n == 2


def test_loops_page_examples_run():
    names = run("how-to/loops.md")
    assert names["near"].valid
    assert np.all(names["path"].valid)


def test_conventions_page_examples_run():
    names = run("reference/conventions.md")
    assert {joint.convention.name for joint in names["standard"].joints} == {"dh"}


def test_platforms_page_examples_run():
    names = run("how-to/platforms.md")
    assert names["legs"].valid.all()
    assert names["modes"].complete


def test_view_page_examples_run(tmp_path):
    pytest.importorskip("viser")
    run("how-to/view.md")
    assert (tmp_path / "ur5e.html").stat().st_size > 100_000


def test_tolerances_page_examples_run():
    pytest.importorskip("scipy")
    names = run("how-to/tolerances.md")
    assert names["first"].covariance.shape == (200, 6, 6)


def test_joint_errors_page_examples_run(tmp_path):
    page = "reference/joint-errors.md"
    (drives,) = (block for block in examples(page, "toml") if "[[transmissions]]" in block)
    (tmp_path / "mine.toml").write_text(
        'name = "mine"\nconvention = "dh"\nunits = { length = "mm", angle = "deg" }\n'
        f'joints = [{{ name = "shoulder", a = 300 }}, {{ name = "elbow", a = 200 }}]\n{drives}'
    )
    shown = np.array([0.3, 0.5])
    names = run("reference/joint-errors.md", {"chasles": chasles, "r": shown})
    assert np.abs(names["r"] - shown).max(-1).min() < 1e-12
