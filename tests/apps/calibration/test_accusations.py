"""Correct measurements cause no warning. Wrong measurements cause a warning."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chasles import se3
from chasles.calibration import Distances, PlaneContacts, SphereContacts, identify
from chasles.calibration.diagnostics import diagnose
from chasles.calibration.fitting.noise import OUTLYING, Linearized, limit
from tests.support.calibration_verdicts import verdict
from tests.support.compiling import compiled
from tests.support.generators.linear_delta import (
    END_STOPS,
    LINEAR_DELTA,
    bed_contacts,
    description_of,
)
from tests.support.generators.simulated_measurements import (
    DEVICES,
    in_degrees,
    simulated,
    with_exchanged_columns,
)

SIGMA = 2e-5
MODELS = {
    "offsets": {"vary": ("offset",)},
    "offsets with tolerances": {"vary": ("offset",), "parameter_std": {"offset": 5e-4}},
    "all with tolerances": {
        "vary": ("offset", "loop", "axis"),
        "parameter_std": {"offset": 5e-4, "loop": 3e-4, "axis": 1e-3},
    },
}


@pytest.fixture(scope="module")
def linear_delta(tmp_path_factory):
    """A delta printer with three carriages, six rods and a level platform."""
    functions = ["fk", "fk_p", "identification_jacobian"]
    folder = tmp_path_factory.mktemp("linear") / LINEAR_DELTA
    return compiled(description_of(LINEAR_DELTA), folder, functions, ["c"])


def end_stops(robot, found):
    """Return the end stop errors minus their mean.

    An equal error of all end stops has the same effect as a shift of the bed height.
    """
    offsets = [k for k, item in enumerate(robot.geometry) if item.part == "offset"]
    errors = found.p[offsets] - np.array([robot.geometry[k].value for k in offsets])
    return errors - errors.mean()


@pytest.mark.parametrize(
    ("model", "count"),
    [("offsets", 25), ("offsets with tolerances", 61), ("all with tolerances", 25)],
)
def test_bed_contacts_of_linear_delta_are_explained_to_noise(linear_delta, model, count):
    q = bed_contacts(count, 0, SIGMA)
    found = identify(linear_delta, q, PlaneContacts(np.zeros(count), SIGMA), **MODELS[model])
    assert 0.4 < found.noise < 1.5
    assert not any("another" in text for text in found.warnings)
    assert found.outliers == ()
    assert np.isfinite(found.std).all()
    if model != "all with tolerances":
        true = np.array(END_STOPS) - np.mean(END_STOPS)
        assert_allclose(end_stops(linear_delta, found), true, atol=2e-4)


@pytest.mark.parametrize("model", MODELS)
def test_exact_bed_contacts_give_end_stops(linear_delta, model):
    q = bed_contacts(61, 0, 0.0)
    found = identify(linear_delta, q, PlaneContacts(np.zeros(61), SIGMA), **MODELS[model])
    assert found.outliers == ()
    assert not any("another" in text for text in found.warnings)
    if model != "all with tolerances":
        true = np.array(END_STOPS) - np.mean(END_STOPS)
        assert_allclose(end_stops(linear_delta, found), true, atol=1e-7)


def test_unknowns_that_measurements_leave_open_are_redundant(linear_delta):
    """The nozzle does not rotate, so its offset has the same effect as the position of the bed."""
    q = bed_contacts(25, 0, SIGMA)
    found = identify(linear_delta, q, PlaneContacts(np.zeros(25), SIGMA), vary=("offset",))
    undetermined = {item.name for item in found.unidentifiable}
    assert {"target_x", "target_y"} <= undetermined
    assert len({"target_z", "plane_height"} & undetermined) == 1
    assert len(found.unknowns) == 6


@pytest.mark.parametrize("device", DEVICES)
def test_correct_measurements_get_no_accusation(arm, device):
    """Random samples with too few measurements are skipped."""
    for seed in range(4):
        said = verdict(arm, simulated(arm, seed, device=device))
        if not said.is_too_few:
            break
    assert said.is_clean, said.text


@pytest.mark.parametrize(("name", "seed"), [("ur5e", 496852550), ("irb120", 3276006344)])
def test_few_correct_distances_fit_beyond_the_first_local_minimum(loaded, name, seed):
    """A fit that starts at the tool origin ends at a local minimum with errors of millimeters."""
    arm = loaded(name)
    said = verdict(arm, simulated(arm, seed))
    assert said.is_clean, said.text


def test_few_contacts_suggest_no_correction_of_the_table(loaded):
    arm = loaded("irb120")
    right = simulated(arm, 3276006344)
    draw = with_exchanged_columns(right, 3)
    assert isinstance(draw.measurements, SphereContacts)
    assert draw.measurements._surplus == 2
    said = verdict(arm, draw)
    assert said.accusations
    assert "they fit" not in said.text


@pytest.mark.parametrize("device", DEVICES)
def test_surplus_is_residual_degrees_of_freedom_without_parameters(arm, device):
    draw = simulated(arm, 5, device=device)
    start = draw.measurements._start(arm.fk(draw.q))
    n_variables = len(start.unknowns) + draw.measurements._n_frame_unknowns
    errors = draw.measurements._errors(start.T_W_base @ arm.fk(draw.q), start.unknowns)
    assert draw.measurements._surplus == len(errors) - n_variables


def test_measurements_of_other_robots_get_a_doubt(arm):
    right = simulated(arm, 0)
    for wrong in (
        simulated(arm, 0, another=True),
        with_exchanged_columns(right, 0),
        in_degrees(arm, right),
    ):
        assert verdict(arm, wrong).accusations, str(wrong)


def test_length_that_tolerances_exclude_gets_a_doubt(arm):
    """The fit of all parameters changes the length of the wrong link by forty standard
    deviations."""
    draw = simulated(arm, 24, another=True)
    assert draw.parameter_std
    assert "times its standard deviation" in verdict(arm, draw).text


def test_many_errors_of_three_tolerances_get_a_doubt(arm):
    draw = next(d for d in (simulated(arm, seed) for seed in range(40)) if d.parameter_std)
    found = identify(
        arm, draw.q, draw.measurements, vary=draw.vary, parameter_std=draw.parameter_std
    )

    def doubts(size):
        signs = np.resize([1, -1], len(found.deviations))
        return diagnose(replace(found, deviations=size * signs * found.parameter_std))

    assert any("3 times their standard deviations" in text for text in doubts(3.0))
    assert not any("standard deviations" in text for text in doubts(1.0))


@pytest.mark.parametrize("seed", [0, 1, 24, 34, 70])
def test_ball_bar_start_explains_tool_that_moves_in_a_plane(seed):
    """The linear sphere equations do not determine the height of the center."""
    random = np.random.default_rng(seed)
    T = se3.exp(random.uniform(-1, 1, (60, 6)) * [0.2, 0.2, 0, 0, 0, 1.5])
    target, center = random.uniform(-0.1, 0.1, 3), random.uniform(-0.4, 0.4, 3)
    if seed % 2:
        center[2] = target[2]
    points = T[:, :3, 3] + T[:, :3, :3] @ target
    start = Distances(np.linalg.norm(points - center, axis=-1), SIGMA)._start(T)
    assert start.misfit < 1e-5


def linearized(random, noise, few=12, parameters=30):
    J = random.normal(size=(few, parameters))
    D = np.eye(parameters) * 2.0
    true = random.normal(size=parameters) / 2.0
    return Linearized(J @ -true + noise * random.normal(size=few), J, np.zeros(parameters), D)


def test_noise_estimate_with_tolerances_equals_noise_of_random_measurements():
    many = [linearized(np.random.default_rng(s), 3.0, few=200).noise() for s in range(10)]
    assert np.median(many) == pytest.approx(3.0, rel=0.1)
    few = [linearized(np.random.default_rng(s), 1.0).noise() for s in range(50)]
    assert 0.1 < min(few) < max(few) < 10


def least_squares_errors(random, count, variables, noise=1.0):
    J, e = random.normal(size=(count, variables)), noise * random.normal(size=count)
    return Linearized(e - J @ np.linalg.lstsq(J, e)[0], J, np.zeros(0), np.zeros((0, variables)))


def test_few_surplus_numbers_leave_no_row_out():
    """With three degrees of freedom, the median of the errors may be small by chance."""
    every = np.ones(14, dtype=bool)
    for seed in range(200):
        at = least_squares_errors(np.random.default_rng(seed), 14, 11)
        assert not at.contradicting(at, every, 1.0).any()


def test_rounding_errors_leave_no_row_out():
    at = least_squares_errors(np.random.default_rng(0), 200, 5, noise=1e-12)
    at.e[7] = 1e-9
    assert not at.contradicting(at, np.ones(200, dtype=bool), 1.0).any()


def test_limit_of_rows_is_five_deviations_of_many_numbers():
    from scipy import stats

    assert limit(1e6) == pytest.approx(OUTLYING, rel=1e-3)
    assert limit(30) > stats.t.ppf(1 - 1e-6, 30)
    assert limit(0.1) > 1e3 or math.isinf(limit(0.1))


def test_gross_error_among_few_measurements_is_left_out(arm):
    draw = simulated(arm, 3, device="three targets")
    draw.measurements.points[2, 1] += 5e-3
    found = identify(arm, draw.q, draw.measurements, vary=("offset",))
    assert found.outliers == ("measurement 3, target 2",)
