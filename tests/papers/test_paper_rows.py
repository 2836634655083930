"""The rows of every paper hold, and docs/papers.md shows them."""

import importlib
import re
from dataclasses import replace
from decimal import Decimal

import pages
import pytest
from report import Row, read

NUMBER = re.compile(r"-?\d+(?:\.\d+)?")

pytest.importorskip("coal", reason="coal comes with pin")


@pytest.mark.parametrize("paper", pages.present())
def test_paper_rows_are_consistent_and_cover_printed_items(paper, request):
    if paper == "board_installer":
        request.getfixturevalue("length_errors")
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
