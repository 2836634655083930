"""The rows of every paper hold, and docs/papers.md shows them."""

import importlib

import pages
import pytest
from report import Row, read

ROWS: dict[str, list[Row]] = {}


def rows_of(paper: str) -> list[Row]:
    """The rows of a paper, computed once."""
    if paper not in ROWS:
        ROWS[paper] = importlib.import_module(paper).rows()
    return ROWS[paper]


@pytest.mark.parametrize("paper", pages.present())
def test_every_row_holds_and_every_printed_item_has_one(paper):
    rows = rows_of(paper)
    assert {row.verdict for row in rows} <= set(pages.VERDICTS)
    assert all(row.note for row in rows if row.verdict != "agrees")
    begins = {row.item.partition(":")[0] for row in rows} | {row.item for row in rows}
    assert {item.item for item in read(paper).values()} <= begins
    assert len({(row.item, row.where) for row in rows}) == len(rows), "items are named twice"


def test_the_page_is_current():
    text = pages.summary({paper: rows_of(paper) for paper in pages.present()})
    assert text == pages.PAGE.read_text(encoding="utf-8"), (
        "run python docs/papers/report.py --write"
    )
