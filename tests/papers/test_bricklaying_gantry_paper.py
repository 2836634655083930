"""The bricklaying gantry paper: table cells, a triangle by the law of cosines, and the wall."""

from collections import Counter
from functools import cache

import bricklaying_gantry as paper
import bricklaying_wall
import numpy as np
import pytest
from printed_items import UNITS
from report import Refuted, read

import chasles


@cache
def rows():
    return paper.rows()


def test_every_cell_of_the_tables_has_a_row():
    where = Counter(row.where.partition(",")[0] for row in rows())
    assert where["table 1"] == where["table 2"] == 2 * 5
    # Each column x or y of tables 4 and 5 has only one row in the comparison.
    assert where["table 4"] == where["table 5"] == 5 * 5 + 3


def test_known_misprints_are_marked_as_errata():
    wrong = {row.where + ", " + row.item for row in rows() if row.verdict == "erratum"}
    for where in (
        "table 4, row 5, theta in rad of spot 5, set-up 1",
        "section 2.2, text, numerator of tan theta of spot 2, set-up 1",
        "abstract, largest difference of theta, set-up 1",
        "section 2.3, (17), larger root of equation (16)",
        "table 4, row 1, r of spot 1, set-up 1",
        "table 4, row 5, r of spot 5, set-up 1",
        "abstract, lengths of wrist and shoulder, A and C",
    ):
        assert where in wrong
    for item in (
        "sum of the constants of equations (13) and (14)",
        "cosine of the angle at the shoulder",
    ):
        assert any(where.endswith(item) for where in wrong)
    # Each of the equations (13) to (17) has two table rows.
    assert len(wrong) == len(paper.CORRECTED) + 9


@pytest.mark.parametrize("key", paper.CORRECTED)
def test_printed_misprints_are_refuted(key):
    printed = read("bricklaying_gantry")[key]
    (row,) = (row for row in rows() if (row.item, row.where) == (printed.item, printed.where))
    assert row.note.startswith(f"the correct value is {paper.CORRECTED[key][0]}")
    with pytest.raises(Refuted):
        paper.agrees(printed, row.ours * UNITS[printed.unit])


def test_spots_match_their_polar_coordinates():
    for setup in (1, 2):
        for spot in paper.spots(setup):
            theta = np.arctan2(spot.xy[1], spot.xy[0])
            assert spot.theta == pytest.approx(theta, abs=1e-14)
            assert spot.r == pytest.approx(np.hypot(*spot.xy), abs=1e-15)
            assert spot.omega == pytest.approx(theta / 20, abs=1e-15)


def test_planar_ik_matches_law_of_cosines():
    found = paper.triangle()
    distance = np.sqrt(185) - 5
    sides = {"A": (5, distance, 7), "B": (distance, 5, 7), "C": (7, 5, distance)}
    angles = {
        name: np.arccos((b**2 + c**2 - a**2) / (2 * b * c)) for name, (a, b, c) in sides.items()
    }
    shoulder, elbow, wrist = found.q[0]
    ours = shoulder - found.line, np.pi + elbow, wrist
    assert ours == pytest.approx([angles[name] for name in "ABC"], abs=1e-12)
    # The other elbow configuration is the mirror image about the line from shoulder to wrist.
    mirrored = [2 * found.line - shoulder, -elbow, -wrist]
    assert found.q[1] == pytest.approx(mirrored, abs=1e-12)
    for q in found.q:
        T = chasles.load("bricklaying_planar").fk(q)
        assert T[:2, 3] / paper.INCH == pytest.approx([11, 8], abs=1e-12)
        assert np.arctan2(T[1, 0], T[0, 0]) == pytest.approx(found.line, abs=1e-12)


def test_bricks_are_released_in_place_and_carried_above_the_wall():
    built = paper.wall()
    np.testing.assert_allclose(built.released, built.places, atol=1e-12)
    tops = built.places[:, 2]
    for place in built.places[tops > tops.min() + 1e-9]:
        below = built.places[np.isclose(tops, place[2] - bricklaying_wall.BRICK[2])]
        assert np.sum(np.isclose(abs(below[:, 0] - place[0]), bricklaying_wall.BRICK[0] / 2)) == 2
    # The gantry carries each brick above all bricks that are already laid.
    at, stage = built.sampled.T[:, :3, 3], built.sampled.stage
    over_the_wall = at[:, 1] > 0.4 - bricklaying_wall.BRICK[1]
    travelling = np.linalg.norm(built.sampled.V[:, :2], axis=1) > 1e-9
    for k, place in enumerate(built.places):
        own = (stage >= 8 * k) & (stage < 8 * (k + 1)) & over_the_wall & travelling
        assert own.any()
        assert at[own, 2].min() - bricklaying_wall.BRICK[2] >= place[2] - 1e-12


def test_motor_rates_match_finite_differences_and_speed_limit():
    sampled = paper.wall().sampled
    middle = np.gradient(sampled.q, sampled.t, axis=0)
    smooth = np.r_[False, np.diff(sampled.stage) == 0] & np.r_[np.diff(sampled.stage) == 0, False]
    assert smooth.mean() > 0.9
    # The jerk of the guide is at most 4 m/s^3. At a pulley radius of 10 mm, this is 400 rad/s^3.
    # The time step of the differences is 0.02 s.
    np.testing.assert_allclose(middle[smooth], sampled.qd[smooth], atol=400 * 0.02**2)
    assert (
        np.linalg.norm(sampled.V[:, :3], axis=1) <= bricklaying_wall.SPEED["speed"] + 1e-12
    ).all()
