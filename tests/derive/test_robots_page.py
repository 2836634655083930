"""The page of the arms that can be loaded by name: all of them are read and classified for it."""

import runpy
from pathlib import Path

from chasles.derive import Robot, load
from tests.support.derivations import NAMES, ROBOTS

PAGE = Path(__file__).parents[2] / "docs" / "robots.py"


def test_robots_page_matches_robot_descriptions():
    page = runpy.run_path(str(PAGE))["page"]()
    assert page == PAGE.with_suffix(".md").read_text(encoding="utf-8"), "run python docs/robots.py"
    rows = [line.split("`")[1] for line in page.splitlines() if line.startswith("| `")]
    shelf = sorted((ROBOTS / "shelf").glob("*.toml"))
    arms = [file.stem for file in shelf if isinstance(load(file), Robot)]
    assert rows == [*arms, *NAMES]
