"""Tests the table of arms in docs/robots.md for one arm of each kind."""

import runpy
from pathlib import Path

from chasles.derive import SerialRobot, read
from tests.support.derivations import NAMES, ROBOTS

PAGE = Path(__file__).parents[2] / "docs" / "robots.py"


CLASSIFIED = ("cr5", "fr3", "gen3_6dof", "gp7", "crx10", "so101", "photo_robot", "scara", "iiwa14")
"""Names of arms with each kind of inverse; `python docs/robots.py` takes twenty seconds for all
arms."""


def test_robots_page_matches_robot_descriptions():
    script, page = runpy.run_path(str(PAGE)), PAGE.with_suffix(".md").read_text(encoding="utf-8")
    shelf = [read(file) for file in sorted((ROBOTS / "shelf").glob("*.toml"))]
    arms = [robot for robot in shelf if isinstance(robot, SerialRobot)]
    arms += [read(ROBOTS / f"{name}.toml") for name in NAMES]
    rows = [line for line in page.splitlines() if line.startswith("| `")]
    assert len(rows) == len(arms)
    for row, arm in zip(rows, arms, strict=True):
        axes = "" if "axes" in arm.title else f" ({len(arm.coordinates)} axes)"
        assert row.startswith(f"| `{arm.name}` | {arm.title}{axes}. | "), (
            "run python docs/robots.py"
        )
        if arm.name in CLASSIFIED:
            assert row == script["_row"](arm), "run python docs/robots.py"
    assert {arm.name for arm in arms} > set(CLASSIFIED)
    tables = ("\n".join(rows[: -len(NAMES)]), "\n".join(rows[-len(NAMES) :]))
    head = "| name | arm | inverse |\n|---|---|---|\n"
    shelf, generated = (head + table for table in tables)
    assert page == script["TEXT"].format(shelf=shelf, generated=generated)
