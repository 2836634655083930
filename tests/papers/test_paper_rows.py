"""The rows of every paper hold, and docs/papers.md shows them."""

import importlib
import re
from dataclasses import replace
from decimal import Decimal
from functools import cache

import lynxmotion_arm
import numpy as np
import pages
import pytest
import roadmaps
from report import Row, read

from chasles.study.planning import Trial, Trials, roadmap

NUMBER = re.compile(r"-?\d+(?:\.\d+)?")

pytest.importorskip("coal", reason="coal comes with pin")


FOUND = {
    (50, 10): "00000000000000000000",
    (50, 20): "00000010000010001000",
    (100, 10): "00000000000000000000",
    (100, 20): "10011111111110101100",
    (200, 10): "01000000000001000000",
    (200, 20): "11111111111111111111",
    (400, 10): "11111111111111111111",
    (400, 20): "11111111111111111111",
}
"""Whether the roadmap of each key finds a path, by points and step: 160 plans take 20 s."""
SPREAD_FOUND = dict.fromkeys(roadmaps.CASES.values(), "1111")
"""The same with the step as the least distance between points."""


@pytest.fixture
def stored_plans(monkeypatch):
    """Take the outcomes of the roadmaps from the tables, and load the arm once.

    The number of points stands for the seconds of a plan: no test asserts a time.
    """
    rows = tuple(
        Trial(points, step, len(found), found.count("1") / len(found), 0, 1, np.nan, points)
        for (points, step), found in FOUND.items()
    )
    assert {len(found) for found in FOUND.values()} == {roadmaps.RUNS}
    assert {len(found) for found in SPREAD_FOUND.values()} == {roadmaps.SPREAD_RUNS}
    monkeypatch.setattr(roadmaps, "trials", lambda: Trials(rows))
    monkeypatch.setattr(
        roadmaps, "spread_rate", lambda *case: SPREAD_FOUND[case].count("1") / roadmaps.SPREAD_RUNS
    )
    monkeypatch.setattr(lynxmotion_arm, "arm", cache(lynxmotion_arm.arm))


@pytest.mark.parametrize(("case", "key"), [((50, 20), 6), ((100, 20), 1), ((200, 10), 1)])
def test_roadmaps_of_single_keys_match_the_stored_outcomes(case, key):
    points, step = case
    made = roadmap(roadmaps.workshop(), points, neighbours=10, step=step, key=key)
    plan = made.plan(roadmaps.START, roadmaps.GOAL)
    assert plan.found == (FOUND[case][key] == "1")


def test_a_spread_roadmap_matches_the_stored_outcome():
    made = roadmap(roadmaps.workshop(), 100, dispersion=10, key=0)
    assert made.plan(roadmaps.START, roadmaps.GOAL, "dijkstra").found
    assert SPREAD_FOUND[100, 10][0] == "1"


@pytest.mark.usefixtures("stored_plans")
@pytest.mark.parametrize("paper", pages.present())
def test_paper_rows_are_consistent_and_cover_printed_items(paper):
    rows = importlib.import_module(paper).rows()
    assert {row.verdict for row in rows} <= set(pages.VERDICTS)
    assert all(row.note for row in rows if row.verdict != "agrees")
    begins = {row.item.partition(":")[0] for row in rows} | {row.item for row in rows}
    assert {item.item for item in read(paper).values()} <= begins
    assert len({(row.item, row.where) for row in rows}) == len(rows), "items are named twice"
    for row in rows:
        assert borne_out(row), f"a reader with a calculator refutes {row}"
    page = pages.PAGE.read_text(encoding="utf-8")
    for part in (pages.section(paper, rows), pages.counted(paper, rows)):
        assert part in page, "run python docs/papers/report.py --write"


def borne_out(row):
    """Whether the numbers of a row, as they are shown, bear out its verdict."""
    printed, ours = (numbers(text) for text in row.shown)
    if not printed or not ours or row.verdict in {"assumed", "lost"}:
        return True
    about = re.search(r"“.*about.*”: ± ([\d.]+)", row.note)
    agree = len(printed) == len(ours) and all(
        abs(own - value) <= (Decimal(about[1]) if about else half_unit(value))
        for value, own in zip(printed, ours, strict=True)
    )
    return agree == (row.verdict == "agrees")


def numbers(text):
    """The numbers of a cell; none where it holds words or an equation."""
    parts = re.sub(r"[()]", "", text).split(", ")
    return [Decimal(part) for part in parts] if all(map(NUMBER.fullmatch, parts)) else []


def half_unit(value):
    """Half a unit of the last digit of a printed number."""
    return Decimal(5).scaleb(value.as_tuple().exponent - 1)


def test_wrong_verdicts_are_detected_from_shown_numbers():
    row = Row("length", "302", "302.7", "mm", "agrees", "figure 9")
    assert not borne_out(row)
    assert borne_out(replace(row, verdict="not reproducible"))
    assert borne_out(replace(row, note="“about 302 mm”: ± 3.02"))
    assert not borne_out(replace(row, verdict="erratum", ours="302.5"))


def test_papers_page_has_a_section_per_paper():
    page = pages.PAGE.read_text(encoding="utf-8")
    assert page.startswith(pages.INTRODUCTION)
    titles = [pages.words(importlib.import_module(paper))[0] for paper in pages.present()]
    assert [f"## {title}" for title in titles] == [
        line for line in page.splitlines() if line.startswith("## ")
    ]
