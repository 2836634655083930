"""Calibration of robots with loops: derivatives, identification and robot files."""

import tempfile
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
import scipy.optimize
from numpy.testing import assert_allclose

from chasles import se3
from chasles.calibration import (
    Poses,
    Positions,
    first_order_errors,
    identify,
    monte_carlo,
)
from chasles.calibration.calibrated_file import robot_file
from chasles.calibration.fitting.noise import OUTLYING
from chasles.calibration.fitting.problem import Fit, problem_at
from chasles.derive import DescriptionError, casadi_function, derive, read, read_text
from chasles.derive.chain.parametric import PARAMETRIC
from chasles.derive.inverse import nominal_mechanism
from chasles.derive.latex.inverse.inverse_of_loops import inverse_of_loops
from chasles.derive.latex.loops.loop_page import LoopPage
from tests.support.compiling import compiled
from tests.support.derivations import ROBOTS

STEP = 1e-5
SIGMA = (2e-5, 5e-5)
MIN = 20.0
"""Minimum factor by which calibration reduces the error of validation poses."""
CONFIGURATIONS = 100
DRAWN = 5e-4
"""Largest error (meter or radian) of axes, rods and tool of a random robot."""
SAME = 1e-10
"""Tolerance for coordinates (meter or radian)."""


IDENTIFIED = ("fk", "fk_p", "identification_jacobian", "parts_p")
FUNCTIONS = {
    "four_bar": ("jacobian_mixed", *IDENTIFIED, *PARAMETRIC),
    "delta": ("jacobian_mixed", "jacobian_p", *IDENTIFIED),
    "slider_crank": IDENTIFIED,
    "well_manipulator": ("identification_jacobian", "parts_p"),
}
"""Names of the functions of the nominal robots."""


@cache
def parametric(name):
    folder = Path(tempfile.mkdtemp()) / name
    functions = sorted(set(FUNCTIONS[name]))
    languages = ["c", "casadi"] if name == "four_bar" else ["c"]
    return compiled(read(ROBOTS / f"{name}.toml"), folder, functions, languages)


def drawn(robot, random, error):
    """Return a geometry with random errors in axes, rods and tool."""
    p = np.array([item.value for item in robot.geometry])
    moved = np.array([item.part in ("axis", "loop", "tool") for item in robot.geometry])
    p[moved] += random.uniform(-error, error, moved.sum())
    return p


def around(robot, random, count):
    """Return random coordinates near the reference configuration."""
    step = np.array([0.02 if c.unit == "m" else 0.5 for c in robot.coordinates])
    return np.array(robot.reference.q) + random.uniform(-1, 1, (count, robot.n)) * step


def everywhere(robot, random, count):
    """Return coordinates within the limits.

    All coordinates are between -3 and 3, so a crank without limits rotates almost a full turn.
    """
    low, high = np.maximum(robot.lower, -3), np.minimum(robot.upper, 3)
    return random.uniform(low, high, (count, robot.n))


def differences(function, x, T):
    """Differentiate the tool pose by central differences, as twists in base axes."""
    columns = []
    for unit in np.eye(len(x)) * STEP:
        near, far = (function(x + k * unit) - function(x - k * unit) for k in (1, 2))
        rate = (8 * near - far) / (12 * STEP)
        omega = rate[:, :3, :3] @ T[:, :3, :3].swapaxes(1, 2)
        turned = (omega[:, 2, 1], omega[:, 0, 2], omega[:, 1, 0])
        columns.append(np.concatenate([rate[:, :3, 3], np.stack(turned, -1)], -1))
    return np.stack(columns, -1)


@pytest.mark.parametrize("name", ["four_bar", "delta"])
def test_parametric_loop_functions_match_fk_and_finite_differences(name):
    robot, random = parametric(name), np.random.default_rng(1)
    q, p = around(robot, random, 8), np.array([item.value for item in robot.geometry])
    assert_allclose(robot.fk_p(q, p), robot.fk(q), atol=1e-13)
    assert_allclose(robot.jacobian_p(q, p), robot.jacobian_mixed(q), atol=1e-11)
    p = drawn(robot, random, 1e-3)
    T, J = robot.fk_p(q, p), robot.identification_jacobian(q, p)
    assert np.isfinite(T).all()
    assert_allclose(J, differences(lambda x: robot.fk_p(q, x), p, T), atol=1e-8)
    by_q = [
        differences(lambda x: robot.fk_p(x[None], p), at, t[None])[0]
        for at, t in zip(q, T, strict=True)
    ]
    assert_allclose(robot.jacobian_p(q, p), by_q, atol=1e-8)


def test_identification_jacobians_of_loops_differ_by_change_of_frame():
    robot, random = parametric("four_bar"), np.random.default_rng(1)
    q, p = around(robot, random, 20), drawn(robot, random, 1e-3)
    T, J = robot.fk_p(q, p), robot.identification_jacobian(q, p)
    space, body = (getattr(robot, f"identification_jacobian_{k}")(q, p) for k in ("space", "body"))
    shifted = J[:, :3] - np.cross(J[:, 3:], T[:, :3, 3, None], axis=1)
    assert_allclose(space, np.concatenate([shifted, J[:, 3:]], 1), atol=1e-13)
    R = T[:, :3, :3].swapaxes(1, 2)
    assert_allclose(body, np.concatenate([R @ J[:, :3], R @ J[:, 3:]], 1), atol=1e-13)


def test_geometry_with_open_loops_gives_nan():
    robot = parametric("slider_crank")
    p = np.array([item.value for item in robot.geometry])
    p[[item.name for item in robot.geometry].index("connecting_rod_length")] = 2.0
    assert np.isnan(robot.fk_p(np.array([robot.reference.q] * 2), p)[:, :3, 3]).all()


@pytest.mark.parametrize("seed", [4, 6])
def test_identification_explains_randomly_perturbed_loop_robot(seed):
    robot, random = parametric("four_bar"), np.random.default_rng(seed)
    p, T_W_base = drawn(robot, random, 1e-3), se3.exp(random.normal(size=6))
    q, validation = everywhere(robot, random, 60), everywhere(robot, random, 500)
    noise = se3.exp(random.normal(size=(60, 6)) * np.repeat(SIGMA, 3))
    T = T_W_base @ robot.fk_p(q, p)
    measured = Poses(T @ noise, SIGMA)
    found = identify(robot, q, measured)
    probe = found.measurements.T_tool_probe
    true, calibrated = T_W_base @ robot.fk_p(validation, p), found.poses(validation) @ probe
    nominal = found.T_W_base @ robot.fk(validation) @ probe
    before, after = (
        np.sqrt(((T - true)[:, :3, 3] ** 2).sum(-1).mean()) for T in (nominal, calibrated)
    )
    assert before / after > MIN
    assert 0.8 < found.noise < 1.2
    # Random noise may exceed the outlier limit in a few rows.
    drawn_noise = np.abs(measured._errors(T, np.zeros(0))).reshape(-1, 6).max(1)
    beyond = np.array(measured.labels)[drawn_noise > OUTLYING]
    assert found.outliers == tuple(beyond)


def test_rows_whose_loops_do_not_close_are_left_out_of_the_fit():
    robot, random = parametric("four_bar"), np.random.default_rng(5)
    q = everywhere(robot, random, 60)
    start = Poses(robot.fk(q), SIGMA)._start(robot.fk(q))
    problem = problem_at(robot, q, start, ("loop",))
    starts = [problem.x0.copy() for _ in range(7)]
    for k, x in enumerate(starts):
        x[problem.names.index("rocker_pin_a_x")] = 0.24 + k * 1e-9
    closed = np.isfinite(robot.fk_p(q, problem.geometry(x))).all((1, 2))
    assert 0 < closed.sum() < len(q)
    assert not problem.within(Fit(x, problem.everything, 1.0))[~closed].any()
    found = [problem.solve(x, problem.everything, 1.0, robust=True) for x in starts]
    assert np.median([problem.spread(fit) for fit in found]) < problem.spread(x) / 2


def test_identify_converges_for_tool_that_hardly_rotates():
    robot, random = parametric("delta"), np.random.default_rng(3)
    p, q = drawn(robot, random, 5e-4), everywhere(robot, random, 60)
    T = se3.exp(random.normal(size=6)) @ robot.fk_p(q, p)
    targets = np.array([[0.03, 0, 0], [0, 0.03, 0.01], [0, 0, -0.05]])
    points = T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], targets)
    found = identify(robot, q, Positions(points + 2e-5 * random.normal(size=points.shape), 2e-5))
    assert 0.8 < found.noise < 1.2
    assert found.outliers == ()


def test_identify_explains_delta_whose_probe_is_decimeters_from_its_start():
    robot, random = parametric("delta"), np.random.default_rng(6)
    p, q = drawn(robot, random, 5e-4), around(robot, random, 60)
    noise = se3.exp(random.normal(size=(60, 6)) * np.repeat(SIGMA, 3))
    T = se3.exp(random.normal(size=6)) @ robot.fk_p(q, p) @ noise
    found = identify(robot, q, Poses(T, SIGMA))
    assert 0.8 < found.noise < 1.2
    assert found.warnings == ()


def test_unobservable_mechanism_scale_is_reported_redundant(tmp_path):
    """The rocker angle of a four-bar does not depend on the size of the mechanism."""
    text = (ROBOTS / "four_bar.toml").read_text()
    tool = 'tool = { body = "coupler", xyz = ["b / 2", "h", 0] }'
    assert tool in text
    path = tmp_path / "rocker.toml"
    path.write_text(text.replace(tool, 'tool = { body = "rocker" }'))
    functions = ["fk", "fk_p", "identification_jacobian"]
    robot = compiled(read(path), tmp_path / "rocker", functions, ["c"])
    q = np.linspace(-3, 3, 60)[:, None]
    noise = se3.exp(np.random.default_rng(0).normal(size=(60, 6)) * np.repeat(SIGMA, 3))
    # The link lengths are ground 0.35, crank 0.1, coupler 0.3 and rocker 0.25. A shift of a joint
    # axis moves only the link before this axis.
    sizes = {"crank_shift_x": -0.35, "coupler_shift_x": -0.25}
    sizes |= {"rocker_pin_a_x": 0.05, "rocker_pin_b_x": 0.25}
    measured = Poses(robot.fk(q) @ noise, SIGMA)
    found = identify(robot, q, measured, vary=sizes, T_W_base=np.eye(4))
    (validation,) = (item for item in found.unidentifiable if item.name in sizes)
    assert sizes.keys() - {validation.name} <= dict(validation.combination).keys()
    names = [item.name for item in robot.geometry]
    J = robot.identification_jacobian(q, [item.value for item in robot.geometry])
    larger = sum(size * J[..., names.index(name)] for name, size in sizes.items())
    assert_allclose(larger, 0, atol=1e-13)


def test_robot_file_reproduces_identified_loop_robot(tmp_path):
    robot, random = parametric("slider_crank"), np.random.default_rng(5)
    p = drawn(robot, random, 5e-4)
    drives = np.array([item.part == "transmission" for item in robot.geometry])
    p[drives] += random.uniform(-1e-3, 1e-3, drives.sum())
    path = tmp_path / "mine.toml"
    path.write_text(robot_file(robot, p, "mine", "a test"))
    converted = ["coordinates_from_readings", "readings_from_coordinates"]
    mine = compiled(read(path), tmp_path / "mine", ["fk", "chain", "actuators", *converted], ["c"])
    r = around(robot, random, 200)
    q, T = mine.coordinates_from_readings(r), robot.fk_p(r, p)
    closed = np.isfinite(T).all((-2, -1))
    assert closed.sum() > 150
    assert_allclose(mine.readings_from_coordinates(q), r, rtol=0, atol=1e-14)
    assert_allclose(mine.fk(q)[closed], T[closed], rtol=0, atol=1e-12)
    assert_allclose(mine.actuators(mine.chain(q))[closed], q[closed], rtol=0, atol=1e-12)


def test_robot_file_resolves_its_nominal_robot(tmp_path):
    robot, random = parametric("four_bar"), np.random.default_rng(5)
    text = robot_file(robot, drawn(robot, random, 5e-4), "mine", "a test", "four_bar")
    mine = read_text(text, file=str(tmp_path / "mine.toml"))
    assert mine.nominal == read(ROBOTS / "four_bar.toml")
    with pytest.raises(DescriptionError, match="or a robot file in this folder"):
        read_text(text.replace('nominal = "four_bar"', 'nominal = "no_bar"'))


def test_casadi_fk_p_and_derivatives_match_runtime_for_perturbed_loops():
    robot, random = parametric("four_bar"), np.random.default_rng(6)
    function = casadi_function(robot.folder, "fk_p")
    q, p = (ca.MX.sym(name, size) for name, size in (("q", robot.n), ("p", len(robot.geometry))))
    by_p = ca.Function("by_p", [q, p], [ca.jacobian(function(q, p)[:3, 3], p)])
    for at in around(robot, random, 10):
        geometry = drawn(robot, random, 1e-3)
        assert_allclose(
            np.array(function(at, geometry)), robot.fk_p(at, geometry), rtol=0, atol=1e-14
        )
        J = robot.identification_jacobian(at, geometry)[:3]
        assert_allclose(np.array(by_p(at, geometry)), J, rtol=0, atol=1e-12)


def test_first_order_tool_errors_match_monte_carlo_for_loops():
    robot = parametric("slider_crank")
    parameter_std = {"axis": 1e-5, "loop": 1e-5}
    q = np.array(robot.reference.q)
    first = first_order_errors(robot, q, parameter_std)
    drawn_ = monte_carlo(robot, q, parameter_std, samples=20_000)
    assert_allclose(drawn_.displacement.std(0), np.sqrt(np.diag(first.covariance)[:3]), rtol=0.03)


@pytest.mark.parametrize(
    ("parts", "rank"),
    [(("axis", "tool"), 30), (("axis", "tool", "loop"), 42)],
    ids=["axis and tool", "axis, tool and loop"],
)
def test_identification_rank_matches_paper_formula(parts, rank):
    """The rank is 4 r + 2 t + 6 for r revolute and t telescopic joints, plus 3 per cylinder."""
    robot = parametric("well_manipulator")
    q = np.random.default_rng(0).uniform(robot.lower, robot.upper, (200, robot.n))
    J = robot.identification_jacobian(q, [item.value for item in robot.geometry])
    chosen = [k for k, item in enumerate(robot.geometry) if item.part in parts]
    columns = J[..., chosen].reshape(-1, len(chosen))
    sizes = np.linalg.svd(columns / np.linalg.norm(columns, axis=0))[1]
    assert (sizes > 1e-9 * sizes[0]).sum() == rank


@pytest.mark.parametrize("name", ["slider_crank", "delta"])
def test_vary_keyword_selects_only_its_own_parameter_parts(name):
    """The part "geometry" contains axes and loops."""
    robot, random = parametric(name), np.random.default_rng(4)
    q = around(robot, random, 60)
    measured = Poses(robot.fk(q), SIGMA)
    parts = {item.name: item.part for item in robot.geometry}
    sought = {}
    for word in ("geometry", "axis", "loop"):
        if word == "axis" and word not in parts.values():
            continue
        found = identify(robot, q, measured, vary=word, robust=False)
        sought[word] = {*found.names, *(item.name for item in found.unidentifiable)}
        own = {"axis", "loop"} if word == "geometry" else {word}
        assert {parts[n] for n in sought[word]} == (own & set(parts.values())) | {"base", "tool"}
        assert {n for n, part in parts.items() if part in own} <= sought[word]
    alone = sought.get("axis", set()) | sought["loop"]
    assert sought["geometry"] == alone


def calibrated(name, seed):
    """Load a random calibrated robot that is refined from its nominal design."""
    robot = parametric(name)
    p = drawn(robot, np.random.default_rng(seed), DRAWN)
    text = robot_file(robot, p, f"mine_{seed}", "a test", name)
    return read_text(text, file=f"{name}_{seed}.toml")


def configurations(name, seed):
    robot = parametric(name)
    return np.random.default_rng(seed).uniform(robot.lower, robot.upper, (CONFIGURATIONS, robot.n))


@pytest.fixture(scope="module")
def built_four_bar(tmp_path_factory):
    """Return a calibrated four-bar with actuator maps."""
    folder = tmp_path_factory.mktemp("built") / "four_bar"
    return compiled(calibrated("four_bar", 5), folder, ["chain", "actuators"], ["c"])


def test_calibrated_actuator_maps_recover_all_configurations(built_four_bar):
    q = np.linspace(-3, 3, CONFIGURATIONS)[:, None]
    theta = built_four_bar.chain(q)
    assert_allclose(built_four_bar.actuators(theta), q, rtol=0, atol=SAME)


def test_joint_values_that_violate_loop_closure_are_invalid(built_four_bar):
    robot = built_four_bar
    theta = robot.chain(np.linspace(-3, 3, CONFIGURATIONS)[:, None])
    assert robot.chain_closes(theta).all()
    for joint in range(2):
        moved = theta.copy()
        moved[:, joint] += 1e-3
        assert not robot.chain_closes(moved).any()


@contextmanager
def few_samples():
    """Reduce the test configurations of a derivation from 100 to 20."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(nominal_mechanism, "SAMPLES", 20)
        patch.setattr(nominal_mechanism, "MAX_DRAWN", 120)
        yield


@pytest.fixture(scope="module")
def built_delta(tmp_path_factory):
    """Return a delta robot with unequal rods, which tilt the platform slightly."""
    folder = tmp_path_factory.mktemp("built") / "delta"
    with few_samples():
        return compiled(calibrated("delta", 5), folder, ["fk", "ik", "ik_position"], ["c"])


def test_built_delta_ik_recovers_generating_configuration(built_delta):
    q = configurations("delta", 5)
    T = built_delta.fk(q)
    assert np.abs(T[:, :3, :3] - np.eye(3)).max() > 1e-3
    found = built_delta.ik(T)
    assert found.valid.any(1).all()
    assert_allclose(np.abs(found.q - q[:, None]).max(-1).min(-1), 0, atol=SAME)
    # The built robot cannot reach the nominal orientation.
    T[:, :3, :3] = np.eye(3)
    assert not built_delta.ik(T).valid.any()


def test_built_delta_ik_position_and_ik_path_recover_motors(built_delta):
    q = configurations("delta", 5)
    p = built_delta.fk(q)[:, :3, 3]
    found = built_delta.ik_position(p)
    assert_allclose(np.abs(found.q - q[:, None]).max(-1).min(-1), 0, atol=SAME)
    reached = built_delta.fk(found.q[found.valid])[:, :3, 3]
    assert_allclose(reached, np.repeat(p, found.valid.sum(1), 0), atol=1e-12)
    assert not built_delta.ik_position([0.0, 0.0, 0.5]).valid.any()
    way = np.linspace(q[0], q[0] + 0.1, 20)
    path = built_delta.ik_path(built_delta.fk(way), q_seed=q[0], task="position")
    assert_allclose(path.q, way, atol=SAME)


def test_built_delta_ik_position_finds_all_scipy_solutions(built_delta):
    """SciPy finds the solutions from random start values."""
    random = np.random.default_rng(1)
    p = built_delta.fk(configurations("delta", 5)[:4])[:, :3, 3]
    found = built_delta.ik_position(p)
    for at, q, valid in zip(p, found.q, found.valid, strict=True):

        def missed(x, at=at):
            return np.nan_to_num(built_delta.fk(x[None])[0, :3, 3] - at, nan=1.0)

        starts = random.uniform(-3, 3, (40, 3))
        roots = [scipy.optimize.root(missed, x, tol=1e-13).x for x in starts]
        roots = [x for x in roots if np.abs(missed(x)).max() < 1e-10]
        turns = 2 * np.pi
        apart = [np.abs((x - q[valid] + np.pi) % turns - np.pi).max(-1) for x in roots]
        assert_allclose(np.min(apart, 1), 0, atol=1e-6)
        assert {int(np.argmin(a)) for a in apart} == set(range(valid.sum()))


def test_article_prints_nominal_inverse_of_calibrated_loop_robot():
    with few_samples():
        derivation = derive(calibrated("well_manipulator", 5), functions=["ik"])
    printed = inverse_of_loops(LoopPage.of(derivation))
    given = "$l_{HI}$, $l_{MN}$ and $\\theta_{7}$."
    assert given in printed
    assert "true arm" in printed
    assert "slides" not in printed
