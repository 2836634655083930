"""A chain of joints whose rotations cancel is replaced by a translation."""

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from chasles.derive import derive, read
from chasles.derive.loops.functions.tool import tool_groups, tool_kinematics
from chasles.derive.model.mechanism import Closure, Frame, Mechanism
from chasles.derive.terms.casadi_graph import lower
from tests.support.derivations import ROBOTS
from tests.support.loops.mechanisms import BASE, at, four_bar, near, parallelogram, pin
from tests.support.loops.solved import solved


def stations(h):
    return [station for group in tool_kinematics(h).forward.groups for station in group.stations]


def solved_terms(h, expressions):
    needed = h.terms.needed(expressions)
    roots = [
        s
        for s in needed
        if h.terms.definitions[s].has(sp.Pow) and h.terms.definitions[s].has(sp.sqrt)
    ]
    angles = [s for s in needed if h.terms.definitions[s].has(sp.atan2)]
    return roots + angles


@pytest.fixture(scope="module")
def board():
    return solved(read(ROBOTS / "board_installer.toml"))


def test_board_installer_collapse_leaves_a_single_solved_angle(board):
    full = [s for group in tool_groups(board) for s in group.stations]
    solved = [s for s in full if board.terms.is_solved(s.angle)]
    kept = [s for s in stations(board) if board.terms.is_solved(s.angle)]
    # The wrist compensates for the angles of the shoulder and the elbow. Of the three angle terms,
    # only the term with the pitch remains.
    assert len(solved) == 3
    assert len(kept) == 1
    (push_rod,) = kept
    pitch = board.forward.values["pitch"]
    assert push_rod.angle.free_symbols <= {*pitch.free_symbols, *board.q}


def test_board_installer_translation_matches_crank_formula(board):
    """The translation is Trans(k r (cos q3 - 1) - (k - 1) q2, 0, k r sin q3) plus a constant."""
    q2, q3 = board.q[1], board.q[2]
    values = tool_kinematics(board).motion.values
    named = [v for v in values if v.free_symbols <= board.terms.definitions.keys()]
    translations = [v for v in named if not board.terms.is_solved(v)]
    # Guard terms make the results NaN if a loop is open. Each guard term is 0 if all loops are
    # closed.
    closed = dict.fromkeys(board.forward.loops.keys() - board.terms.solved.keys(), 0)
    found = []
    for value in translations:
        written = value
        while board.terms.definitions.keys() & written.free_symbols:
            written = written.xreplace(closed).xreplace(board.terms.definitions)
        written = board.terms.spelled(written)
        if written.free_symbols & {q2, q3}:
            found.append(written.xreplace(board.terms.parameters))
    assert len(found) == 2
    k, r = 5, sp.Rational(16, 100)
    expected = {k * r * sp.cos(q3) - k * q2, k * r * sp.sin(q3)}
    for value in found:
        rest = [sp.expand(value - sign * e) for e in expected for sign in (1, -1)]
        assert any(not e.free_symbols for e in rest)
    for value in translations:
        assert not solved_terms(board, [board.terms.definitions[value].xreplace(closed)])


def test_collapsed_chain_matches_full_chain_pose_and_rates(board):
    kinds = ["fk", "jacobian_mixed", "twist_mixed"]
    short = derive(
        read(ROBOTS / "board_installer.toml"), functions=[*kinds, "chain", "chain_rates"]
    )
    names = [f.name for f in short.functions]
    kernels = dict(zip(names, lower(short.functions, "short"), strict=True))
    whole = derive(short.robot.main_chain, functions=kinds)
    oracle = dict(zip(kinds, lower(whole.functions, "whole"), strict=True))
    generator = np.random.default_rng(0)
    for _ in range(20):
        q, qd = generator.uniform(-0.04, 0.05, 6), generator.uniform(-1, 1, 6)
        theta, thetad = np.array(kernels["chain"](q)), np.array(kernels["chain_rates"](q, qd))
        assert np.abs(np.array(kernels["fk"](q)) - np.array(oracle["fk"](theta))).max() < 1e-13
        V = np.array(oracle["jacobian_mixed"](theta)).reshape(6, -1) @ thetad
        J = np.array(kernels["jacobian_mixed"](q)).reshape(6, -1)
        assert np.abs(J @ qd - V.ravel()).max() < 1e-12
        assert np.abs(np.array(kernels["twist_mixed"](q, qd)) - V).max() < 1e-12


def test_a_parallelogram_only_translates():
    h = solved(parallelogram(2))
    assert not any(h.terms.is_solved(s.angle) for s in stations(h))
    assert not h.forward.margins
    (q,) = h.q
    fk = derive(parallelogram(2), functions=["fk"]).functions[0]
    (kernel,) = lower([fk], "test")
    for value in (0.3, 1.0, 2.5):
        T = np.array(kernel(value)).reshape(4, 4)
        np.testing.assert_allclose(T[:3, :3], np.eye(3), atol=1e-15)
        np.testing.assert_allclose(T[:2, 3], [np.cos(value), np.sin(value)], atol=1e-15)
    assert q in h.q


def test_four_bar_is_not_collapsed_to_a_translation():
    h = solved(four_bar())
    kept = stations(h)
    assert [s.joint for s in kept if s.joint is not None] == [0, 1]
    assert not any(s.slides for s in kept)


def test_jacobian_rates_with_wrist_after_parallelogram_are_correct():
    linkage = parallelogram(2)
    wrist = pin("wrist", "coupler", "hand", "1/2")
    mechanism = Mechanism(
        "wrist",
        (*linkage.joints, wrist),
        ("crank0", "wrist"),
        closures=linkage.closures,
        tool_body="hand",
        tool=at("1/4"),
        reference=linkage.reference,
    )
    derived = derive(
        mechanism, functions=["fk", "jacobian_mixed", "jacobian_mixed_dot", "hessian_mixed"]
    )
    _, J, J_dot, H = lower(derived.functions, "test")
    q, qd, step = np.array([0.8, -0.4]), np.array([1.1, 0.7]), 1e-6
    rate = (np.array(J(q + step * qd)) - np.array(J(q - step * qd))) / (2 * step)
    np.testing.assert_allclose(np.array(J_dot(q, qd)), rate, atol=1e-9)
    by_rate = np.array(H(q)).reshape(6, 2, 2) @ qd
    np.testing.assert_allclose(by_rate.ravel(), rate.ravel(), atol=1e-9)
    # The crank only translates the tool, and the wrist rotates the tool.
    columns = np.array(J(q)).reshape(6, 2)
    np.testing.assert_allclose(columns[5], [0, 1], atol=1e-15)


def test_parallelogram_on_turntable_translates_in_turntable_axes():
    table = pin("table", BASE, "table", "1/3")
    cranks = [
        replace(j, parent="table") if j.parent == BASE else j for j in parallelogram(2).joints
    ]
    linkage = parallelogram(2)
    mechanism = replace(linkage, joints=(table, *cranks), actuated=("table", "crank0"))
    derived = derive(mechanism, functions=["fk", "jacobian_mixed"])
    assert not any(derived.hybrid.terms.is_solved(s.angle) for s in stations(derived.hybrid))
    fk, J = lower(derived.functions, "test")
    a, b = q = np.array([0.8, 1.3])
    tip = 1 / 3 + np.exp(1j * a) * np.exp(1j * b)
    T = np.array(fk(q)).reshape(4, 4)
    np.testing.assert_allclose(T[:2, 3], [tip.real, tip.imag], atol=1e-15)
    np.testing.assert_allclose(T[:2, 0], [np.cos(a), np.sin(a)], atol=1e-15)
    speed = 1j * (tip - 1 / 3)
    columns = np.array(J(q)).reshape(6, 2)
    np.testing.assert_allclose(columns[:2].T, [[speed.real, speed.imag]] * 2, atol=1e-15)
    np.testing.assert_allclose(columns[5], [1, 0], atol=0)


def test_consecutive_parallelograms_keep_tool_orientation():
    """The two parallelogram linkages have different arm lengths."""
    joints = (
        pin("a0", BASE, "lower"),
        pin("plate", "lower", "middle", 2),
        pin("a1", BASE, "lower_rod", 0, 1),
        pin("b0", "middle", "upper"),
        pin("hand", "upper", "top", 3),
        pin("b1", "middle", "upper_rod", 1, 1),
    )
    mechanism = Mechanism(
        "lamp",
        joints,
        ("a0", "b0"),
        closures=(
            Closure("p", "pin", Frame("lower_rod", at(2)), Frame("middle", at(0, 1))),
            Closure("r", "pin", Frame("upper_rod", at(3)), Frame("top", at(1, 1))),
        ),
        tool_body="top",
        reference=near(
            ("a0", 1), ("plate", -1), ("a1", 1), ("b0", "-1/2"), ("hand", "1/2"), ("b1", "-1/2")
        ),
    )
    h = solved(mechanism)
    assert not any(h.terms.is_solved(s.angle) for s in stations(h))
    (kernel,) = lower(derive(mechanism, functions=["fk"]).functions, "test")
    T = np.array(kernel([0.9, -0.2])).reshape(4, 4)
    np.testing.assert_allclose(T[:3, :3], np.eye(3), atol=1e-15)
    e = 2 * np.exp(0.9j) + 3 * np.exp(-0.2j)
    np.testing.assert_allclose(T[:2, 3], [e.real, e.imag], atol=1e-14)
