"""A function that creates a table row raises an error if the verdict of this row is wrong."""

import numpy as np
import pytest
from report import (
    Finding,
    Printed,
    Refuted,
    agrees,
    assumed,
    at,
    consistent,
    erratum,
    in_one_reading,
    lost,
    not_printed,
    not_reproducible,
)

ANGLE = Printed("angle", "0.97", "rad", "table 4")
LENGTH = Printed("lengths", ("120", "1.5"), "mm", "figure 2")
NOTHING = Printed("crank", None, "mm", "lost table")


def test_a_value_agrees_to_half_a_unit_of_the_last_digit():
    row = agrees(ANGLE, 0.9749)
    assert (row.verdict, row.printed, row.shown) == ("agrees", "0.97", ("0.97", "0.9749"))
    agrees(ANGLE, 0.975)
    for ours in (0.9751, 0.9649, float("nan")):
        with pytest.raises(Refuted):
            agrees(ANGLE, ours)


def test_numbers_at_agreement_limit_are_shown_with_more_decimals():
    angle = Printed("theta", "1.36", "rad", "table 4")
    assert erratum(angle, 1.35490, "1.35").shown == ("1.36", "1.3549")
    assert agrees(Printed("pair", ("1.36", "2"), "", "table 4"), [1.3550004, 2]).ours == (
        "(1.3550004, 2.0000000)"
    )
    assert agrees(angle, 1.355).shown == ("1.36", "1.355")


def test_printed_units_are_converted():
    row = agrees(LENGTH, np.array([0.1204, 0.00152]))
    assert row.ours == "(120.40, 1.52)"
    for ours in ([0.1206, 0.0015], [0.12, 0.0016], [120, 1.5], [0.12]):
        with pytest.raises(Refuted):
            agrees(LENGTH, np.array(ours))
    agrees(Printed("angle", "45.0", "deg", "page 1"), np.pi / 4)


def test_word_about_widens_the_tolerance_and_is_quoted():
    about = Printed("height", "12", "mm", "page 3", "2", "about 12 mm high")
    assert "about 12 mm high" in agrees(about, 0.0139).note
    with pytest.raises(Refuted):
        agrees(about, 0.0141)


def test_erratum_requires_a_refuted_value_and_its_correction():
    assert (
        erratum(ANGLE, np.pi / 4, "0.79", "45 deg").note == "the correct value is 0.79 rad. 45 deg"
    )
    for ours, corrected in ((0.97, "0.97"), (np.pi / 4, "0.78"), (np.pi / 4, 0.79)):
        with pytest.raises(Refuted):
            erratum(ANGLE, ours, corrected)


def test_correction_of_approximate_value_is_checked_to_last_digit():
    about = Printed("amplitude", "345", "mm", "figure 9", "3.45", "about 345 mm")
    erratum(about, 0.3489, "349")
    with pytest.raises(Refuted):
        erratum(about, 0.3489, "348")


def test_an_erratum_of_an_equation_is_evaluated():
    equation = Printed("third base joint", "2*pi + pi/6", "rad", "table 2.2")
    ours = 2 * np.pi - np.pi / 6
    row = erratum(equation, ours, 11 * np.pi / 6, evaluated=at())
    assert row.printed == "2*pi + pi/6 = 6.806784"
    for corrected, evaluated in ((11.1 * np.pi / 6, at()), (ours, lambda _: ours)):
        with pytest.raises(Refuted):
            erratum(equation, ours, corrected, evaluated=evaluated)


def test_printed_value_cannot_be_marked_missing_or_assumed():
    assert lost(NOTHING, 0.2, "the table is lost").shown == ("-", "200.0000")
    assert assumed(NOTHING, 0.2, "fits the figure").verdict == "assumed"
    assert not_printed(NOTHING, 0.2, "for the reader").verdict == "not printed"
    for verdict in (lost, assumed, not_printed):
        with pytest.raises(Refuted):
            verdict(ANGLE, 0.97, "a reason")
        with pytest.raises(Refuted):
            verdict(NOTHING, 0.2, "")
    with pytest.raises(Refuted):
        agrees(NOTHING, 0.2)


def test_agreeing_value_cannot_be_marked_not_reproducible():
    assert not_reproducible(ANGLE, 0.5, "both elbows").verdict == "not reproducible"
    for ours, tried in ((0.97, "both elbows"), (0.5, "")):
        with pytest.raises(Refuted):
            not_reproducible(ANGLE, ours, tried)


def test_reading_that_agrees_refutes_not_reproducible():
    row = not_reproducible(ANGLE, 0.5, readings={"other elbow": 0.6})
    others = "other interpretations of the paper do not give the printed value either"
    assert row.note == f"{others}: they give 0.600 rad for other elbow"
    with pytest.raises(Refuted):
        not_reproducible(ANGLE, 0.5, readings={"other elbow": 0.6, "in turns": 0.971})
    assert in_one_reading(ANGLE, 0.971, "in turns").verdict == "one reading"
    for ours, reading in ((0.98, "in turns"), (0.971, "")):
        with pytest.raises(Refuted):
            in_one_reading(ANGLE, ours, reading)


def test_evaluated_value_is_consistent_and_never_agrees():
    angle = Printed("angle", "0.97", "rad", "evaluated", is_evaluated=True)
    assert consistent(angle, 0.971).shown == ("[0.97]", "0.971")
    for verdict in (consistent, agrees):
        with pytest.raises(Refuted):
            verdict(angle, 0.98 if verdict is consistent else 0.971)


def test_words_are_compared_with_findings_alone():
    words = Printed("cover", "basically all", "%", "section 1")
    assert agrees(words, Finding(True, "99 %")).shown == ("basically all", "99 %")
    for verdict, ours in (
        (agrees, 0.3),
        (agrees, Finding(False, "30 %")),
        (not_reproducible, 0.3),
        (not_reproducible, Finding(True, "99 %")),
    ):
        with pytest.raises(Refuted):
            verdict(words, ours, "a note")
    with pytest.raises(Refuted):
        agrees(ANGLE, Finding(True, "0.97"))


def test_cause_of_an_erratum_gives_the_printed_value():
    assert "cause: 55.6 deg" in erratum(ANGLE, 0.8, "0.80", cause=("55.6 deg", 0.9704)).note
    for value in (0.98, "0.96"):
        with pytest.raises(Refuted):
            erratum(ANGLE, 0.8, "0.80", cause=("a slip", value))
