"""Tests the tables of docs/robots.md: one arm of each kind, and all robots with loops."""

import runpy
from pathlib import Path

from chasles.derive import SerialRobot, read
from tests.support.derivations import MECHANISMS, NAMES, ROBOTS

PAGE = Path(__file__).parents[2] / "docs" / "robots.py"


CLASSIFIED = ("cr5", "fr3", "gen3_6dof", "gp7", "crx10", "so101", "photo_robot", "scara", "iiwa14")
"""Names of arms that together have every kind of inverse kinematics function. `python
docs/robots.py` takes twenty seconds for all arms."""


def test_robots_page_matches_robot_descriptions():
    script, page = runpy.run_path(str(PAGE)), PAGE.with_suffix(".md").read_text(encoding="utf-8")
    shelf = [read(file) for file in sorted((ROBOTS / "shelf").glob("*.toml"))]
    arms = [robot for robot in shelf if isinstance(robot, SerialRobot)]
    arms += [read(ROBOTS / f"{name}.toml") for name in NAMES]
    mechanisms = script["_mechanisms"]([read(ROBOTS / f"{name}.toml") for name in MECHANISMS])
    assert mechanisms.count("\n| `") == len(MECHANISMS)
    rows = [line for line in page.split(mechanisms)[0].splitlines() if line.startswith("| `")]
    assert len(rows) == len(arms)
    for row, arm in zip(rows, arms, strict=True):
        axes = "" if "axes" in arm.title else f" ({len(arm.coordinates)} axes)"
        assert row.startswith(f"| `{arm.name}` | {arm.title}{axes}. | "), (
            "run python docs/robots.py"
        )
        if arm.name in CLASSIFIED:
            assert row == script["_row"](arm), "run python docs/robots.py"
    assert {arm.name for arm in arms} > set(CLASSIFIED)
    head = "| name | arm | inverse |\n|---|---|---|\n"
    shelf, arms = ("\n".join(of) for of in (rows[: -len(NAMES)], rows[-len(NAMES) :]))
    of = {"shelf": head + shelf, "arms": head + arms, "mechanisms": mechanisms}
    assert page == script["TEXT"].format(**of), "run python docs/robots.py"
