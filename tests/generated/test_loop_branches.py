"""Solutions of loops are correct and complete.

The tests cover all branches, dead points, and unreachable inputs of loops.
"""

from contextlib import suppress
from functools import partial

import numpy as np
import pytest

import chasles
from tests.support.loops.closures import model, wrapped
from tests.support.loops.loop_robots import (
    CLOSED,
    INVERTIBLE,
    LOOPED,
    far_from_dead_points,
    random_q,
    robot,
)

# --- loops that cannot close ---


@pytest.mark.parametrize("name", LOOPED)
def test_results_far_outside_limits_are_closed_or_nan(name):
    r, m = robot(name), model(name)
    q = random_q(name, 4000, seed=41, wider=2.0)
    z, valid, margin = r.configuration(q), r.loops_close(q), r.margin(q)
    finite = np.isfinite(z).all(-1)
    np.testing.assert_array_equal(finite, valid)
    # If a loop is open, the margins of later solution steps are NaN.
    assert (finite == (np.nan_to_num(margin, nan=-1.0) >= 0).all(-1)).all()
    # The cranks of the four-bar, slider-crank and five-bar have no dead points, so all samples of
    # these robots are valid.
    assert (~valid).any() == (name not in ("four_bar", "slider_crank", "five_bar"))
    assert m.gap(z[finite]).max() < 1e-9
    for function in ("fk", "chain", "jacobian_mixed", "chain_D_q"):
        found = getattr(r, function)(q)
        found = found.reshape(len(q), -1)
        assert np.isfinite(found[valid & (margin > 1e-9).all(-1)]).all()
        if function == "chain":
            assert np.isnan(found[~valid]).any(-1).all()


@pytest.mark.parametrize("name", LOOPED)
def test_fk_is_correct_or_nan_outside_limits(name):
    r, m = robot(name), model(name)
    q = random_q(name, 2000, seed=42, wider=2.0)
    T = r.fk(q)
    finite = np.isfinite(T).all((-2, -1))
    closed = r.loops_close(q)
    np.testing.assert_allclose(T[closed], m.tip(r.configuration(q[closed])), atol=1e-9)
    # If the loops are open, at least one entry of the pose T is NaN. Pose entries that do not
    # depend on the loops may be finite.
    assert not (finite & ~closed).any()


def random_chains(name, n, seed):
    """Return random main-chain joint values around the reference, including unreachable values."""
    r = robot(name)
    start = r.chain(r.reference.q)
    turning = np.array([joint.kind == "revolute" for joint in r.chain_joints])
    # The platform of a delta robot keeps its orientation.
    reach = np.where(turning, 0.0 if name == "delta" else 3.0, 1.0)
    return start + np.random.default_rng(seed).uniform(-reach, reach, (n, len(start)))


def reaches(r, theta):
    """Return whether actuator values exist for the main-chain joint values theta."""
    margin = r.actuator_margin(theta)
    return (np.isfinite(margin) & (margin >= 0)).all(-1)


@pytest.mark.parametrize("name", INVERTIBLE)
def test_unreachable_chain_has_nan_actuators(name):
    r, m = robot(name), model(name)
    theta = random_chains(name, 5000, 43)
    q, reached, margin = r.actuators(theta), reaches(r, theta), r.actuator_margin(theta)
    np.testing.assert_array_equal(np.isfinite(q).all(-1), reached)
    assert 0.01 < reached.mean() < 0.999
    assert (margin[reached] <= 1 + 1e-12).all()
    # `actuators` may return a solution on any loop branch, and loop branches differ in their
    # main-chain joint values.
    np.testing.assert_array_equal(r.actuator_branches(theta).valid.any(-1), reached)
    apart = np.abs(wrapped(r.chain(q) - theta)).max(-1)
    np.testing.assert_array_equal(r.chain_closes(theta), reached & (apart < 1e-6))
    assert (reached & (apart > 1e-3)).mean() > 0.01
    z = np.zeros((reached.sum(), len(m.names)))
    z[:, m.chain], z[:, m.actuated] = theta[reached], q[reached]
    known = sorted({*m.chain, *m.actuated})
    assert closest(m, z[:20], known).max() < 1e-9


BROKEN = {
    ("well_manipulator", 1, 1.4): "cylinder_1",
    ("well_manipulator", 2, 0.3): "cylinder_2",
    ("well_manipulator", 4, 1.2): "cylinder_3",
    ("well_manipulator", 6, 1.1): "cylinder_4",
    ("board_installer", 1, -0.4): "rod_KH",
    ("board_installer", 4, 0.2): "push_rod",
    ("excavator", 1, 3.5): "boom_cylinder",
    ("excavator", 2, -1.5): "stick_cylinder",
    ("excavator", 3, 2.0): "bucket_cylinder",
    ("delta", 0, -1.5): "rod_1_left and",
}


@pytest.mark.parametrize(
    ("name", "k", "value"),
    BROKEN,
    ids=[f"{name} {BROKEN[name, k, value]}" for name, k, value in BROKEN],
)
def test_open_loop_error_names_loop_and_coordinate(name, k, value):
    r = robot(name)
    q = np.array(r.reference.q)
    r.chain(q)
    q[k] = value
    if name == "delta":
        q[1:] = 2.7, 1.7
    assert np.isnan(r.chain(q[None])).any()
    assert not r.loops_close(q[None])[0]
    for function in (r.chain, r.configuration, r.chain_D_q):
        with pytest.raises(chasles.OutOfReachError, match=BROKEN[name, k, value]) as caught:
            function(q)
        assert f"{r.coordinates[k].name} = {value:.6g}" in str(caught.value)
        assert "does not close" in str(caught.value)


# --- dead points of loops ---


def crossing(closes, start, goals):
    """Return two fractions of each segment, between which the loops open.

    The loops close at the first fraction, and are open at the second fraction.
    """
    inside, outside = np.zeros(len(goals)), np.ones(len(goals))
    parts = np.linspace(0, 1, 400)
    way = start + parts[:, None, None] * (goals - start)
    open_ = ~closes(way)
    first = np.argmax(open_, axis=0)
    assert (first > 0).all()
    inside, outside = parts[first - 1], parts[first]
    for _ in range(60):
        middle = (inside + outside) / 2
        good = closes(start + middle[:, None] * (goals - start))
        inside, outside = np.where(good, middle, inside), np.where(good, outside, middle)
    return inside, outside


def check_dead_points(start, goals, closes, margin, values, slopes):
    inside, outside = crossing(closes, start, goals)
    at = lambda part: start + part[:, None] * (goals - start)  # noqa: E731
    beyond = margin(at(outside))
    step = np.nanargmin(np.where(beyond < 0, beyond, np.inf), axis=1)
    rows = np.arange(len(goals))
    near = np.array([1e-3, 1e-5, 1e-7])
    margins = np.stack([margin(at(inside - s))[rows, step] for s in near])
    assert (margins > 0).all()
    ratio = margins / near[:, None]
    assert np.abs(ratio[2] / ratio[1] - 1).max() < 0.02
    past = margin(at(outside + 1e-7))[rows, step]
    assert np.abs(past / margins[2] + 1).max() < 0.02
    assert (np.abs(margin(at(inside))[rows, step]) < 1e-9).all()
    # Positions are finite until the dead point is reached.
    assert np.isfinite(values(at(inside - 1e-12))).all()
    rates = [np.abs(slopes(at(inside - s))).reshape(len(goals), -1).max(-1) for s in (1e-8, 1e-10)]
    assert np.abs(rates[1] / rates[0] / 10 - 1).max() < 0.2
    assert np.isnan(values(at(outside + 1e-9))).any(-1).all()
    for point in at(inside):
        # At the dead point, rounding decides whether the loop still closes.
        with suppress(chasles.OutOfReachError):
            assert np.abs(slopes(point)).max() > 1e5


@pytest.mark.parametrize("name", ["well_manipulator", "board_installer", "excavator", "delta"])
def test_margin_vanishes_at_dead_points_of_chain(name):
    r = robot(name)
    goals = random_q(name, 5000, seed=51, wider=2.0)
    goals = goals[~r.loops_close(goals)][:40]
    assert len(goals) > 10
    start = np.array(r.reference.q)
    check_dead_points(start, goals, r.loops_close, r.margin, r.chain, r.chain_D_q)


@pytest.mark.parametrize("name", INVERTIBLE)
def test_margin_vanishes_at_dead_points_of_actuators(name):
    r = robot(name)
    start = r.chain(r.reference.q)
    goals = random_chains(name, 20_000, 52)
    goals = goals[~reaches(r, goals)][:40]
    assert len(goals) > 10
    closes = partial(reaches, r)
    check_dead_points(start, goals, closes, r.actuator_margin, r.actuators, r.actuators_D_chain)
    for theta in goals[:5]:
        with pytest.raises(chasles.OutOfReachError, match=r"does not close at \w+ = "):
            r.actuators(theta)


# --- all branches of loops ---


@pytest.mark.parametrize("name", LOOPED)
def test_chain_branches_close_and_start_with_reference_branch(name):
    r, m = robot(name), model(name)
    q = random_q(name, 1 if name == "board_installer" else 2, seed=61)
    theta, valid, margin = r.chain_branches(q)
    np.testing.assert_allclose(theta[:, 0], r.chain(q), atol=CLOSED)
    assert valid[:, 0].all()
    assert (np.isfinite(theta).all(-1) == valid).all()
    row, slot = np.nonzero(valid)
    z = np.zeros((len(row), len(m.names)))
    z[:, m.chain] = theta[row, slot]
    z[:, m.actuated] = q[row] * m.ratio
    assert closest(m, z, sorted({*m.chain, *m.actuated})).max() < CLOSED
    for branches in theta:
        good = branches[np.isfinite(branches).all(-1)]
        apart = np.abs(wrapped(good[:, None] - good[None])).max(-1) + np.eye(len(good))
        # Branches that differ only in passive joints have equal main-chain joints.
        assert apart.min() > 1e-6 or name in ("excavator", "board_installer")
    assert margin.shape[:2] == valid.shape


def closest(m, z, known):
    """Return the smallest loop residual that Newton's method reaches from many start values."""
    if len(known) == len(m.names):
        return m.gap(z)
    free = [k for k in range(len(m.names)) if k not in known]
    generator, best = np.random.default_rng(62), np.full(len(z), np.inf)
    for _ in range(25):
        left = np.flatnonzero(best > CLOSED)
        if not left.size:
            break
        start = z[left]
        start[:, free] = generator.uniform(-np.pi, np.pi, (len(left), len(free)))
        best[left] = np.minimum(best[left], m.gap(m.newton(start, known)))
    return best


@pytest.mark.parametrize("name", INVERTIBLE)
def test_actuator_branches_close(name):
    r, m = robot(name), model(name)
    q, z = far_from_dead_points(name, 5, seed=63)
    theta = z[:, m.chain]
    found, valid, _ = r.actuator_branches(theta)
    np.testing.assert_allclose(found[:, 0], r.actuators(theta), atol=CLOSED)
    row, slot = np.nonzero(valid)
    assert len(row) > len(q)
    z = z[row]
    z[:, m.actuated] = found[row, slot]
    assert closest(m, z, sorted({*m.chain, *m.actuated})).max() < CLOSED


def roots(f, points=20_001):
    x = np.linspace(-np.pi, np.pi, points)
    y = f(x)
    found = []
    for k in np.flatnonzero(np.sign(y[:-1]) != np.sign(y[1:])):
        low, high, sign = x[k], x[k + 1], np.sign(y[k])
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if np.sign(f(middle)[()]) == sign else (low, middle)
        found.append((low + high) / 2)
    return np.array(found)


def left_over(name, known):
    """Return a function that computes the residual of a planar loop with one unknown."""
    e = lambda angle: np.exp(1j * angle)  # noqa: E731
    return {
        "four_bar": lambda x: abs(0.1 * e(known) + 0.3 * e(known + x) - 0.35) - 0.25,
        "five_bar": lambda x: (
            abs(-0.1 + 0.2 * e(known[0]) + 0.3 * e(known[0] + x) - 0.1 - 0.2 * e(known[1])) - 0.3
        ),
        # The sine maps an unbounded variable to slider positions of at most half a meter.
        "slider_crank": lambda x: abs(0.5 * np.sin(x / 2) - 0.05 * e(known)) - 0.18,
    }[name]


@pytest.mark.parametrize("name", ["four_bar", "five_bar", "slider_crank"])
def test_chain_branches_match_exhaustive_root_scan(name):
    r = robot(name)
    q = np.random.default_rng(64).uniform(-np.pi, np.pi, (20, r.n))
    theta, valid, _ = r.chain_branches(q)
    counts = []
    for row, branches, good in zip(q, theta, valid, strict=True):
        scanned = roots(left_over(name, row if name == "five_bar" else row[0]))
        if name == "slider_crank":
            scanned = 0.5 * np.sin(scanned / 2)
        np.testing.assert_allclose(np.sort(branches[good][:, -1]), np.sort(scanned), atol=1e-9)
        counts.append(len(scanned))
    assert set(counts) == {2}


@pytest.mark.parametrize("name", ["five_bar", "slider_crank"])
def test_actuator_branches_match_exhaustive_root_scan(name):
    r = robot(name)
    generator = np.random.default_rng(65)
    if name == "five_bar":
        theta = generator.uniform(-np.pi, np.pi, (30, 2))
    else:
        theta = generator.uniform(-0.3, 0.3, (30, 1))
    q, valid, _ = r.actuator_branches(theta)
    counts = []
    for row, branches, good in zip(theta, q, valid, strict=True):
        if name == "five_bar":
            tip = -0.1 + 0.2 * np.exp(1j * row[0]) + 0.3 * np.exp(1j * row.sum())
            scanned = roots(lambda x, tip=tip: abs(tip - 0.1 - 0.2 * np.exp(1j * x)) - 0.3)
        else:
            scanned = roots(lambda x, row=row: abs(row[0] - 0.05 * np.exp(1j * x)) - 0.18)
        np.testing.assert_allclose(np.sort(branches[good][:, -1]), np.sort(scanned), atol=1e-9)
        counts.append(len(scanned))
    assert set(counts) == {0, 2}


def test_actuators_beyond_dead_point_belong_to_other_branch():
    r = robot("well_manipulator")
    theta = r.chain(r.reference.q)
    last = [joint.name for joint in r.chain_joints].index("theta7")
    for angle, is_own in ((-40.62, True), (46.4953, False)):
        theta[last] = np.deg2rad(angle)
        q = r.actuators(theta)
        assert (np.abs(r.chain(q) - theta).max() < 1e-9) == is_own
        assert r.chain_closes(theta) == is_own
        found, valid, _ = r.actuator_branches(theta)
        np.testing.assert_allclose(found[valid], [q], atol=1e-12)
        every, closes, _ = r.chain_branches(q)
        apart = np.abs(wrapped(every[closes] - theta)).max(-1)
        assert (apart < 1e-9).sum() == 1
        assert closes.sum() == 16


def test_cylinder_lengths_are_never_negative():
    r = robot("excavator")
    theta = r.chain(r.reference.q)
    found, valid, _ = r.actuator_branches(theta)
    retracted = np.array([1.98, 2.4, 1.6])
    assert valid.tolist() == [True, True]
    assert (found[:, 1:] + retracted > 0).all()
    # A negative cylinder length gives the same triangles as the positive length, but negative
    # lengths are not valid.
    q = np.array(r.reference.q)
    q[1:] = -q[1:] - 2 * retracted
    for k in range(1, 4):
        inside_out = np.array(r.reference.q)
        inside_out[k] = q[k]
        assert not r.loops_close(inside_out)
        assert not r.chain_branches(inside_out).valid.any()
        assert np.isnan(r.chain(inside_out[None])).any()


def test_every_parallelogram_assembly_is_a_branch():
    r = robot("board_installer")
    q = random_q("board_installer", 4, seed=66)
    theta, valid, _ = r.chain_branches(q)
    assert valid.all()
    assert theta.shape[1] == 32
    labels = r.labels["chain_branches"]
    assert sum("crossed" not in label for label in labels) == 4
    # The wrist stays level only if both parallelograms are assembled parallel, not crossed.
    level = np.abs(wrapped(theta[..., 2:5].sum(-1) - theta[:, :1, 2:5].sum(-1))) < 1e-9
    parallel = ["greater_rod parallel, smaller_rod parallel" in label for label in labels]
    assert level[:, parallel].all()
    assert not level[:, ~np.array(parallel)].any()
