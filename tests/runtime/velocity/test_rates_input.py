"""An error of joint_rates names the argument that is wrong."""

import re

import numpy as np
import pytest

import chasles
from tests.support.pages import run, text
from tests.support.rate_inputs import CLOSURE, inside, twists

# ---------------------------------------------------------------- input


def test_invalid_joint_rates_arguments_are_rejected(ur5e):
    q, V = np.zeros(6), np.zeros(6)
    cases = [
        (chasles.ShapeError, r"ur5e\.joint_rates: expected V of shape \(\.\.\., 6\), got \(3,\)",
         {"V": np.zeros(3)}),
        (chasles.InputError, r"V must hold real numbers, got dtype complex128", {"V": V + 1j}),
        (chasles.InputError, r"representation must be .*, got 'tool'", {"representation": "tool"}),
        (chasles.InputError, r"components must be .*, got 'trans'", {"components": "trans"}),
        (chasles.InputError, r"redundancy must be .*, got 'fast'", {"redundancy": "fast"}),
        (chasles.ShapeError, r"expected redundancy of shape \(\.\.\., 6\)", {"redundancy": V[:5]}),
        (chasles.InputError, r"damping_threshold must be positive, got 0",
         {"damping_threshold": 0}),
        (chasles.InputError, r"characteristic_length must be positive, got -1",
         {"characteristic_length": -1}),
        (chasles.ShapeError, r"expected V of shape \(\.\.\., 6\), got \(3,\)",
         {"V": V[:3], "components": "linear", "representation": "space"}),
        (chasles.InputTypeError, r"fixed expects names and indices of coordinates, without values",
         {"fixed": {"elbow": 0.5}}),
        (chasles.InputError, r"expected rate_limits >= 0", {"rate_limits": -1.0}),
        (chasles.InputError, r"expected rate_limits >= 0", {"rate_limits": np.nan}),
        (chasles.ShapeError, r"expected rate_limits of shape", {"rate_limits": [1.0, 2.0]}),
        (chasles.InputError, r"acceleration_limits also require qd_previous and dt",
         {"acceleration_limits": 1.0, "dt": 1e-3}),
        (chasles.InputError, r"dt must be positive, got 0", {"dt": 0}),
        (chasles.ShapeError, r"leading dimensions do not broadcast: q \(2, 6\), V \(3, 6\)",
         {"q": np.zeros((2, 6)), "V": np.zeros((3, 6))}),
    ]  # fmt: skip
    for error, message, changed in cases:
        with pytest.raises(error, match=message):
            ur5e.joint_rates(**({"q": q, "V": V} | changed))
    with pytest.raises(chasles.ShapeError):
        ur5e.joint_rates(np.zeros(5), V)


def test_non_finite_input_gives_nan_rates(ur5e):
    q = inside(ur5e, 3)
    V = twists(3)
    q[0, 2], V[1, 3] = np.nan, np.inf
    found = ur5e.joint_rates(q, V, rate_limits=1.0, redundancy="limits")
    assert np.isnan(found.qd).all(-1).tolist() == [True, True, False]
    assert np.isnan(found.scale).tolist() == [True, True, False]
    assert not found.limited[:2].any()


@pytest.mark.parametrize("name", ["stewart_gough", "planar_3rrr"])
@pytest.mark.parametrize("representation", ["mixed", "body", "space"])
def test_platform_rates_reproduce_commanded_actuator_rates(name, representation):
    robot = chasles.load(name)
    q = np.array(robot.reference.q) + 0.01
    V = getattr(robot, f"jacobian_{representation}")(q) @ np.linspace(-0.1, 0.2, robot.n)
    rates = robot.joint_rates(q, V, representation=representation)
    np.testing.assert_allclose(rates.qd, np.linspace(-0.1, 0.2, robot.n), atol=1e-12)
    np.testing.assert_allclose(rates.twist, V, atol=CLOSURE)
    step = 1e-6
    here, there = robot.fk(q), robot.fk(q + step * rates.qd)
    moved = chasles.se3.log(chasles.se3.inverse(here) @ there) / step
    body = robot.joint_rates(q, moved, representation="body")
    np.testing.assert_allclose(body.qd, rates.qd, atol=1e-5)


def test_platforms_support_gradient_and_accelerations():
    platform = chasles.load("stewart_gough")
    q = np.array(platform.reference.q)
    rates = platform.joint_rates(q, np.zeros(6), redundancy="manipulability")
    np.testing.assert_allclose(rates.twist, np.zeros(6), atol=CLOSURE)
    qd, A = np.linspace(-0.1, 0.2, 6), np.linspace(0.3, -0.2, 6)
    found = platform.joint_accelerations(q, qd, A)
    np.testing.assert_allclose(platform.acceleration_mixed(q, qd, found.qdd), A, atol=1e-9)


def test_velocity_page_examples_run_as_documented():
    """The examples of docs/how-to/velocity.md run, and their comments are true."""
    names = run("how-to/velocity.md")
    (scale,) = re.findall(r"fast\.scale  # (\S+):", text("how-to/velocity.md"))
    np.testing.assert_allclose(names["rates"].twist, names["V"], rtol=0, atol=1e-14)
    wrist, fast = names["wrist"], names["fast"]
    assert wrist.min_singular_value < 1e-15
    assert abs(wrist.damping_squared - 0.0016) < 1e-15
    assert abs(fast.scale - float(scale)) < 0.005
    assert fast.limited.any()
    assert (names["stiff"].qd[[2, 5]] == 0).all()
    for other in ("away", "better", "home"):
        np.testing.assert_allclose(names[other].twist, names["V"], rtol=0, atol=1e-13)
    np.testing.assert_allclose(names["still"].acceleration, np.zeros(6), rtol=0, atol=1e-13)
    assert names["ellipsoid"].axes.shape == (3, 3)


def test_correct_joint_saturates_if_two_are_at_limits(panda):
    """Of two joints at their limits, only joint 7 must saturate.

    Stopping joint 1 first would give wrong joint rates.
    """
    q = np.array([panda.lower[0], 0.5305, 1.092, -1.9043, -2.1145, 2.7025, panda.lower[6]])
    V = np.array([0.0731, -0.0319, 0.3186, 0.1264, -0.2971, -0.0264])
    found = panda.joint_rates(q, V)
    assert found.scale == 1
    np.testing.assert_allclose(found.twist, V, atol=CLOSURE)
    assert found.qd[0] > 0
    assert found.qd[6] == 0
    assert found.limited.tolist() == [False] * 6 + [True]


@pytest.mark.parametrize("gain", [-1.0, np.nan, np.inf, "a"])
def test_invalid_gain_is_rejected(panda, gain):
    with pytest.raises(chasles.InputError, match=r"^panda\.joint_rates: gain must be"):
        panda.joint_rates(np.zeros(7), np.zeros(6), redundancy="limits", gain=gain)


def test_broadcast_error_reports_original_shapes(ur5e):
    message = r"^ur5e\.joint_rates: leading dimensions do not broadcast: q \(3, 6\), V \(2, 6\)$"
    with pytest.raises(chasles.ShapeError, match=message):
        ur5e.joint_rates(np.zeros((3, 6)), np.zeros((2, 6)))
