"""Tests the verdicts in the tables that compare chasles with papers.

A changed digit of the printed value is detected.
"""

import importlib
import re
from dataclasses import replace
from decimal import Decimal

import mutations
import numpy as np
import pages
import pytest
from report import Finding, Printed, Row, agrees, at, consistent, erratum, read

NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
CHANGED_DIGITS = 50
"""Number of printed digits that the test changes in each paper. Each trial changes one digit."""

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
    assert len({(row.item, row.where) for row in rows}) == len(rows), "duplicate items"
    for row in rows:
        assert borne_out(row), f"the displayed numbers contradict the verdict: {row}"
    hint = "run python docs/papers/report.py --write"
    assert pages.page_of(paper).read_text(encoding="utf-8") == pages.section(paper, rows), hint
    for line in pages.counted(paper, rows):
        assert line in pages.PAGE.read_text(encoding="utf-8"), hint
    for row, digit in sampled_digits(rows):
        assert not mutations.survives(row, digit), (
            f"{row} also agrees with a changed digit at {digit}"
        )


def sampled_digits(rows):
    """Select random pairs (row, printed digit) in which the digit affects the verdict."""
    digits = [
        (row, digit)
        for row in rows
        if not mutations.exemption(row)
        for digit in mutations.digits(row)
    ]
    chosen = np.random.default_rng(0).choice(len(digits), CHANGED_DIGITS, replace=False)
    return [digits[k] for k in chosen]


def survivors(row):
    return [digit for digit in mutations.digits(row) if mutations.survives(row, digit)]


def test_changed_digits_refute_numbers_equations_and_causes():
    angle = Printed("angle", "1.36", "rad", "table 4")
    about = Printed("height", "12", "mm", "page 3", "2", "about 12 mm high")
    equation = Printed("square", "2*t2**2 + 1", "", "(1)")
    rows = (
        agrees(angle, 1.3551),
        agrees(about, 0.0139),
        consistent(replace(angle, value=("1.36", "-0.5"), is_evaluated=True), [1.3649, -0.55]),
        agrees(equation, 9.0, evaluated=at(t2=2.0)),
        agrees(replace(equation, value="sqrt(9 - x)"), 8**0.5, evaluated=at(x=1.0)),
        erratum(angle, 1.2, "1.20", cause=("1.36 is 78 deg", np.radians(78))),
    )
    for row in rows:
        assert mutations.exemption(row) == ""
        assert mutations.digits(row)
        assert survivors(row) == []
    assert len(mutations.digits(rows[3])) == 3, "the 2 of the symbol t2 is not changed"
    tolerant = replace(rows[0], judge=lambda other: agrees(replace(other, about="9"), 1.3551))
    assert survivors(tolerant)


def test_rows_without_a_refuting_digit_name_the_reason():
    angle = Printed("angle", "1.36", "rad", "table 4")
    words = Printed("motion", "in 3 phases", "", "page 2")
    reasons = {
        erratum(angle, 1.2, "1.20"): mutations.WRONG,
        agrees(words, Finding(True, "3")): mutations.WORDS,
        Row("length", None, 0.2, "m", "lost", "table 1"): mutations.NOTHING,
    }
    assert {row: mutations.exemption(row) for row in reasons} == reasons


def borne_out(row):
    """Test whether the displayed numbers of a row agree or differ as the verdict states."""
    printed, ours = (numbers(text) for text in row.shown)
    if not printed or not ours or row.verdict in {"assumed", "lost", "not printed"}:
        return True
    about = re.search(r"the tolerance is ± ([\d.]+).*, .*about", row.note)
    agree = len(printed) == len(ours) and all(
        abs(own - value) <= (Decimal(about[1]) if about else half_unit(value))
        for value, own in zip(printed, ours, strict=True)
    )
    return agree == (row.verdict in {"agrees", "one reading", "consistency"})


def numbers(text):
    """Return the numbers of a table cell, or an empty list if the cell contains anything else."""
    parts = re.sub(r"[()[\]]", "", text).split(", ")
    return [Decimal(part) for part in parts] if all(map(NUMBER.fullmatch, parts)) else []


def half_unit(value):
    """Return half a unit of the last digit of a printed number."""
    return Decimal(5).scaleb(value.as_tuple().exponent - 1)


def test_wrong_verdicts_are_detected_from_shown_numbers():
    row = Row("length", "302", "302.7", "mm", "agrees", "figure 9")
    assert not borne_out(row)
    assert borne_out(replace(row, verdict="not reproducible"))
    assert borne_out(
        replace(row, note="the tolerance is ± 3.02 mm, because the paper says “about 302 mm”")
    )
    assert not borne_out(replace(row, verdict="erratum", ours="302.5"))


def test_papers_page_links_a_page_per_paper():
    text = pages.PAGE.read_text(encoding="utf-8")
    assert text.startswith(pages.INTRODUCTION)
    assert re.findall(r"\]\(papers/(\w+)\.md\)", text) == pages.present()
