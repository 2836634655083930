"""Reports of the benchmarks from times, counts and baselines."""

import pytest

from bench import check, count
from bench.report import Limit, Ratio, alternated, paced, ratio


def test_works_alternate_after_one_unseen_run():
    order = []
    works = {"a": lambda: order.append("a"), "b": lambda: order.append("b")}
    times = alternated(works, rounds=2)
    assert order == ["a", "b"] * 3
    assert [len(of) for of in times.values()] == [2, 2]


def test_ratio_is_of_each_round():
    times = {"own": [1.0, 2.0, 4.0], "peer": [3.0, 4.0, 20.0]}
    found = ratio("x", times, ("own", "peer"), count=2, bar=3.0)
    assert found == Ratio("x", own=0.5e9, peer=1.5e9, median=3.0, least=2.0, bar=3.0)
    assert found.holds


@pytest.mark.parametrize(
    ("row", "holds"),
    [
        (Ratio("x", 1.0, 2.0, 2.0, 1.9), True),
        (Ratio("x", 1.0, 2.0, 2.0, 1.9, bar=2.1), False),
        (Limit("x", 99.0, "ns", 100), True),
        (Limit("x", 101.0, "ns", 100), False),
        (Limit("x", 101.0, "ns"), True),
    ],
)
def test_bars(row, holds):
    assert row.holds is holds


def test_check_names_what_lost_more_than_the_margin():
    expected = {"kept": 2.0, "lost": 2.0, "not measured": 2.0}
    found = {"kept": 1.6, "lost": 1.4, "new": 0.1}
    assert check.slower(expected, found, margin=0.25) == ["lost"]


def test_margin_is_wider_on_another_machine():
    here = {"processor": "A", "compiler": "gcc 12", "python": "3.11"}
    assert check.margin_between(here, {**here, "python": "3.12"}) == check.MARGIN
    assert check.margin_between(here, {**here, "processor": "B"}) == check.MARGIN_ELSEWHERE


def test_rise_of_instructions():
    assert count.rises({"a": 1000, "b": 1000, "c": 1}, {"a": 1020, "b": 1021, "new": 5}) == [
        "b: 1021, were 1000"
    ]


def test_instructions_of_callees_are_left_out():
    profile = "\n".join(
        (
            *("fn=main", "0 50", "cfn=ur5e_fk", "calls=1 7", "0 900"),
            *("fn=ur5e_fk", "0 10", "+3 20", "cfn=sincos", "calls=2 5", "* 600", "-1 7"),
            *("fn=sincos", "0 600", "summary: 1234"),
        )
    )
    assert count.own_instructions(profile, ("ur5e_",)) == 37


def test_long_benchmarks_tell_how_far_they_are(capsys):
    times = iter([0.0, 10.0, 31.0, 40.0, 70.0])
    found = paced([1, 0, 2, 0], 4, lambda so_far: f"{sum(so_far)} missed", lambda: next(times))
    assert found == [1, 0, 2, 0]
    assert capsys.readouterr().out == "2 of 4 in 31 s: 1 missed\n"
