"""The rows of every paper hold, and docs/papers.md shows them."""

import importlib

import pages
import pytest
from report import read

pytest.importorskip("coal", reason="coal comes with pin")


@pytest.mark.parametrize("paper", pages.present())
def test_every_row_holds_and_every_printed_item_has_one(paper):
    rows = importlib.import_module(paper).rows()
    assert {row.verdict for row in rows} <= set(pages.VERDICTS)
    assert all(row.note for row in rows if row.verdict != "agrees")
    begins = {row.item.partition(":")[0] for row in rows} | {row.item for row in rows}
    assert {item.item for item in read(paper).values()} <= begins
    assert len({(row.item, row.where) for row in rows}) == len(rows), "items are named twice"
    page = pages.PAGE.read_text(encoding="utf-8")
    for part in (pages.section(paper, rows), pages.counted(paper, rows)):
        assert part in page, "run python docs/papers/report.py --write"


def test_the_page_holds_all_papers():
    page = pages.PAGE.read_text(encoding="utf-8")
    assert page.startswith(pages.INTRODUCTION)
    titles = [pages.words(importlib.import_module(paper))[0] for paper in pages.present()]
    assert [f"## {title}" for title in titles] == [
        line for line in page.splitlines() if line.startswith("## ")
    ]
