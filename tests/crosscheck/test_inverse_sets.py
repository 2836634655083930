"""Inverses agree with independent code and other solvers on difficult poses."""

import numpy as np
import pytest

from tests.support.generators.poses import CASES, SINGULAR, Case, PoseSet, Sizes, sets
from tests.support.oracles.verdict import VALID, counts, judged, newton, regular
from tests.support.peers.case_answers import own_answers, peer_answers
from tests.support.peers.interface import INSTALL, Answers, Unsolved, absent, answers
from tests.support.tolerances import ORACLE, WORST_INVERSE

SMALL = Sizes(random=500, singular=50, grid=512)
TARGETS = 1
"""Number of target poses for which Newton's method counts the solutions."""
SIX = ("ur5e", "puma560", "irb6640")
LOCKED = ("iiwa14", "panda")
COUNTED = 100
UR5E = CASES[0]


@pytest.fixture(params=CASES, ids=lambda case: case.name)
def case(request) -> Case:
    if request.param.function not in request.param.robot.functions:
        pytest.skip(f"{request.param.name} has no {request.param.function}")
    return request.param


def named(name):
    return next(case for case in CASES if case.name == name)


def some(case, count, seed=1):
    return case.random(np.random.default_rng(seed), count)


def test_screw_poses_match_generated_fk(case):
    q = some(case, 200)
    assert np.abs(case.pose(q) - case.robot.fk(q)).max() <= ORACLE


def test_no_reachable_configuration_is_missed(case):
    checked = 0
    for poses in sets(case, SMALL):
        verdict = judged(case, poses, lambda q: own_answers(case, q))
        assert (verdict.missed, verdict.wrong, verdict.lost or 0) == (0, 0, 0), poses.name
        # Close to a dead point, the loops determine only half of the digits of the actuator values.
        if poses.name == "random" and not case.robot.loops:
            assert verdict.worst <= WORST_INVERSE
        checked += 1
    assert checked == 2 * len(case.singular) + (1 if case.robot.loops else 3)


def test_solution_count_matches_multi_start_newton(case):
    if case.robot.loops:
        pytest.skip("only Newton's method respects the limits of loops")
    rng = np.random.default_rng(2)
    q = some(case, TARGETS)
    assert counts(case, own_answers(case, q)).tolist() == [len(newton(case, row, rng)) for row in q]


def test_singular_test_sets_are_singular():
    checked = 0
    for case in CASES:
        of = {poses.name: poses.q for poses in sets(case, Sizes(1, 20, 1))}
        for kind, singularity in case.singular.items():
            square = case.square(singularity, of[kind])
            assert np.linalg.svd(square, compute_uv=False)[:, -1].max() < SINGULAR
            assert len(of[f"near {kind}"]) == 10 * len(of[kind])
            checked += 1
    assert checked == sum(len(case.singular) for case in CASES) > 20


@pytest.mark.parametrize("peer", INSTALL)
@pytest.mark.parametrize("name", SIX + LOCKED)
def test_peer_solvers_model_same_robots(name, peer):
    if peer in absent():
        pytest.skip(f"missing package: {INSTALL[peer]} (make test installs it)")
    case = named(name)
    q = some(case, 5)
    verdict = judged(case, PoseSet("random", q), lambda q: peer_answers(peer, case, q))
    assert (verdict.missed, verdict.unfound) == (0, 0)


@pytest.mark.parametrize("peer", ["eaik", "ik_geo"])
@pytest.mark.parametrize("name", SIX)
def test_solution_count_matches_peer_solvers(name, peer):
    if peer in absent():
        pytest.skip(f"missing package: {INSTALL[peer]} (make test installs it)")
    case = named(name)
    q = some(case, COUNTED)
    ours, theirs = (counts(case, found(q)) for found in solvers(case, peer))
    assert np.array_equal(ours, theirs)
    assert ours.max() == 8


def solvers(case, peer):
    return lambda q: own_answers(case, q), lambda q: peer_answers(peer, case, q)


def test_peer_solvers_raise_for_unsupported_robot():
    case = named("stanford")
    q = some(case, 1)
    for peer in INSTALL.keys() - absent().keys():
        with pytest.raises(Unsolved):
            answers(peer, case.screws, case.targets(q), -1, q[:, -1])


def regular_ones(count):
    q = some(UR5E, 2 * count)
    return q[regular(UR5E, q)][:count]


@pytest.mark.parametrize(
    ("shift", "claimed", "expected"),
    [
        (0.0, True, (0, 0, 0, 0)),
        (0.0, False, (50, 0, 0, 50)),
        (10 * VALID, True, (50, 50, 50, 50)),
        (10 * VALID, False, (50, 50, 0, 50)),
        (2 * np.pi, True, (0, 0, 0, 0)),
    ],
    ids=["right", "not claimed", "wrong", "wrong and not claimed", "full turn"],
)
def test_verdict_detects_wrong_and_unclaimed_answers(shift, claimed, expected):
    q = regular_ones(50)
    answer = Answers((q + shift)[:, None], np.full((50, 1), claimed))
    verdict = judged(UR5E, PoseSet("random", q, regular=True), lambda q: answer)
    assert (verdict.missed, verdict.unfound, verdict.wrong, verdict.lost) == expected


def test_verdict_detects_missing_branch():
    q = regular_ones(50)
    found = own_answers(UR5E, q)
    others = np.abs(found.q - q[:, None]).max(axis=-1) > 1e-6
    kept = Answers(found.q, found.claimed & others)
    verdict = judged(UR5E, PoseSet("random", q, regular=True), lambda q: kept)
    assert verdict.lost == np.sum(counts(UR5E, kept) < counts(UR5E, found)) == 50
