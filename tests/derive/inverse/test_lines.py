"""Tolerant detection of parallel and intersecting axes."""

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from chasles.derive import read, read_text
from chasles.derive.inverse.classify import classify
from chasles.derive.inverse.given_joints import without
from chasles.derive.inverse.polished_inverse import nearly_meet
from chasles.derive.inverse.serial_inverse import inverses
from chasles.derive.inverse.steps.target import Target
from chasles.derive.inverse.structure import rank
from chasles.derive.inverse.structure.lines import (
    Axis,
    Lines,
    axes_of,
    home_of,
    numbers,
)
from chasles.derive.model.tolerances import EXACT_STRUCTURE, MEASURED_STRUCTURE
from chasles.derive.terms.terms import Terms
from tests.support.derivations import ROBOTS
from tests.support.generators.synthetic import Arm, robot_of, rows_of, screws_of
from tests.support.oracles.screws import Screws

CHAIN = "R/P/R/RxR/P"


def axis(k, direction, point):
    h = np.array(direction, float) / np.linalg.norm(direction)
    exact = [tuple(map(sp.Float, map(float, vector))) for vector in (h, point)]
    return Axis(k, f"j{k + 1}", "revolute", *exact, h, np.array(point, float))


def lines_of(*axes):
    return Lines(Terms({}), tuple(axis(k, *a) for k, a in enumerate(axes)))


@pytest.mark.parametrize(("by", "parallel"), [(0, True), (0.9, True), (1.1, False)])
@pytest.mark.parametrize("sense", [1, -1])
def test_axes_are_parallel_up_to_the_tolerance(by, parallel, sense):
    tilt = np.arcsin(by * EXACT_STRUCTURE)
    lines = lines_of(
        ((0, 0, 1), (0, 0, 0)), ((0, sense * np.sin(tilt), sense * np.cos(tilt)), (1, 0, 0))
    )
    assert lines.parallel(0, 1) == parallel
    assert lines.sense(0, 1) == sense


@pytest.mark.parametrize(("by", "meet"), [(0, True), (0.9, True), (1.1, False)])
def test_axes_meet_up_to_the_tolerance(by, meet):
    # The distance of the midpoint from each line is half the distance between the two lines. The
    # arm is about 2 m long.
    apart = 2 * by * EXACT_STRUCTURE * 2
    lines = lines_of(((0, 0, 1), (0, 0, 0)), ((1, 0, 0), (0, apart, 2)))
    assert lines.meet(0, 1) == meet


def test_fixed_slide_does_not_change_the_unit_of_deviations():
    lines = lines_of(((0, 0, 1), (0, 0, 0)), ((0, 0, 1), (0, 0, 0)), ((1, 0, 0), (0, 0.1, 2)))
    slide = replace(lines.axes[1], kind="prismatic")
    lines = replace(lines, axes=(lines.axes[0], slide, lines.axes[2]))
    left = lines.at_generic([1])
    assert not np.allclose(left.axes[1].origin, lines.axes[2].origin)
    assert left.meeting_deviation((0, 1)) == pytest.approx(lines.meeting_deviation((0, 2)))


def test_meeting_requires_a_point_common_to_all_axes():
    concurrent = lines_of(((0, 0, 1), (1, 2, 5)), ((1, 0, 0), (0, 2, 3)), ((1, 1, 1), (2, 3, 4)))
    assert concurrent.meet(0, 1, 2)
    in_pairs = lines_of(((1, 0, 0), (0, 0, 0)), ((0, 1, 0), (1, 0, 0)), ((1, 1, 0), (0, -2, 0)))
    assert in_pairs.meet(0, 1)
    assert in_pairs.meet(1, 2)
    assert not in_pairs.meet(0, 1, 2)


def test_nearly_parallel_adjacent_axes_have_no_center():
    tilt = 0.5 * MEASURED_STRUCTURE
    lines = lines_of(((0, 0, 1), (0, 0, 0)), ((0, np.sin(tilt), np.cos(tilt)), (0, 0, 0)))
    assert lines.meeting_deviation((0, 1)) == np.inf


def test_meeting_points_are_exact_in_parameters():
    text = """
name = "two"
convention = "dh"
units = { length = "m", angle = "deg" }
[parameters]
d1 = { value = "0.3", meaning = "height" }
a3 = { value = "0.1", meaning = "offset" }
[[joints]]
name = "a"
d = "d1"
alpha = 90
[[joints]]
name = "b"
a = "a3"
"""
    robot = read_text(text)
    terms = Terms({p.symbol: p.value for p in robot.parameters})
    lines = Lines(terms, axes_of(robot, terms))
    assert [terms.spelled(e) for e in lines.meeting(1, 0)] == [0, 0, sp.Symbol("d1", real=True)]


@pytest.mark.parametrize(
    ("name", "meet"), [("ur5e", False), ("puma560", True), ("irb6640", True), ("lynxmotion", False)]
)
def test_nearly_spherical_wrists_are_detected(name, meet):
    robot = read(ROBOTS / f"{name}.toml")
    terms = Terms({p.symbol: p.value for p in robot.parameters})
    assert nearly_meet(Lines(terms, axes_of(robot, terms))) is meet


def matrix(target):
    """Return the displacement (4, 4) of the tool from its home pose to a target pose."""
    T = np.eye(4)
    T[:3, :3] = np.array(target.axes, float).T
    T[:3, 3] = np.array(target.position, float) - T[:3, :3] @ np.array(target.home, float)
    return T


def displacement(lines, q):
    """Return exp(S_1 q_1) ... exp(S_n q_n) numerically."""
    turns = np.array([[a.turns] for a in lines.axes])
    h = np.array([a.direction for a in lines.axes])
    points = np.array([numbers(lines.terms, a.p) for a in lines.axes])
    chain = Screws(np.where(turns, h, 0.0), points, np.where(turns, 0.0, h), np.eye(4))
    return chain.fk(np.asarray(q, float))


@pytest.fixture
def chain():
    robot = robot_of(CHAIN)
    terms = Terms({})
    return Lines(terms, axes_of(robot, terms)), home_of(robot, terms)


def target_of(lines, G):
    home = (0.3, -0.2, 0.7)
    place = G[:3, :3] @ home + G[:3, 3]
    axes = tuple(tuple(map(sp.Float, map(float, column))) for column in G[:3, :3].T)
    as_numbers = [tuple(map(sp.Float, map(float, point))) for point in (home, place)]
    return Target(axes, *as_numbers)


def in_numbers(terms, target):
    parts = [np.array([numbers(terms, v) for v in target.axes])]
    parts += [numbers(terms, v) for v in (target.home, target.position)]
    return Target(*parts)


def test_axes_and_home_pose_match_screws(chain):
    lines, home = chain
    screws = screws_of(rows_of(CHAIN, right=False))
    for k, a in enumerate(lines.axes):
        expected = screws.axes[k] if a.turns else screws.slides[k]
        np.testing.assert_allclose(a.direction, expected, atol=1e-15)
        if a.turns:
            np.testing.assert_allclose(a.origin, screws.points[k], atol=1e-15)
    value = [[float(lines.terms.value(e)) for e in row] for row in home.tolist()]
    np.testing.assert_allclose(value, screws.home, atol=1e-15)


def test_reversed_chain_has_the_inverse_displacement(chain):
    lines, _ = chain
    q = np.random.default_rng(0).normal(size=len(lines.axes))
    G = displacement(lines, q)
    back = displacement(lines.reversed(), q[::-1])
    np.testing.assert_allclose(back @ G, np.eye(4), atol=1e-14)
    target = target_of(lines, G)
    np.testing.assert_allclose(matrix(target.reversed()), back, atol=1e-14)


@pytest.mark.parametrize(
    "given",
    [(0,), (5,), (0, 5), (4, 5), (0, 1), (1,), (0, 1, 5), (1, 4, 5)],
    ids=lambda joints: "-".join(map(str, joints)),
)
def test_removing_fixed_joints_keeps_the_remaining_displacement(chain, given):
    lines, _ = chain
    q = np.random.default_rng(1).normal(size=len(lines.axes))
    target = target_of(lines, displacement(lines, q))
    left, rest = without(lines, target, {k: sp.Float(float(q[k])) for k in given})
    assert [a.joint for a in left.axes] == [k for k in range(6) if k not in given]
    others = [q[k] for k in range(6) if k not in given]
    expected = displacement(left, others)
    np.testing.assert_allclose(matrix(in_numbers(lines.terms, rest)), expected, atol=1e-13)


@pytest.mark.parametrize(
    ("chain", "freedoms"),
    [("R/R/R/RxrxR", 6), ("R=R=R=R", 3), ("P/P=P/P", 3), ("RxrxRxR", 4), ("R=R=R=P", 4)],
)
def test_chain_rank_equals_tool_freedoms(chain, freedoms):
    terms = Terms({})
    assert rank.of_chain(Lines(terms, axes_of(robot_of(chain), terms))) == freedoms


def file(more, tool=""):
    return f"""
name = "arm"
convention = "dh"
units = {{ length = "m", angle = "deg" }}
{tool}
[[joints]]
name = "a"
a = "0.3"
[[joints]]
name = "b"
a = "0.3"
{more}
[[joints]]
name = "c"
a = "0.2"
"""


@pytest.mark.parametrize(
    ("more", "reason"),
    [
        ('mimic = { joint = "a", multiplier = "1/2" }', "b follows other coordinates"),
        ('type = "helical"\npitch = "0.1"', "b is a screw joint"),
    ],
    ids=["fractional mimic", "helical"],
)
def test_fractional_mimic_and_helical_joints_have_no_inverse(more, reason):
    robot = read_text(file(more))
    found = inverses(robot, Terms({}))
    assert found.functions == {}
    assert classify(robot, Terms({})).missing == reason


@pytest.mark.parametrize(
    ("tool", "planar"),
    [("", True), ("tool = { rpy = [0, 90, 0] }", False)],
    ids=["tool in plane", "tool across plane"],
)
def test_planar_ik_exists_only_if_tool_has_a_heading(tool, planar):
    found = inverses(read_text(file("", tool)), Terms({}))
    assert ("ik_planar" in found.functions) == planar


def test_position_ik_depends_on_order_of_three_joints():
    assert Arm("P/R/P").inverses.functions.keys() == {"ik"}
    assert Arm("R/P/P").inverses.functions.keys() == {"ik", "ik_position"}
    assert Arm("P/P/R").inverses.functions.keys() == {"ik", "ik_position"}
