"""If a loop outside the main chain is open, every function returns NaN."""

import numpy as np
import pytest

import chasles
from chasles.derive import casadi_function, read
from tests.support.compiling import compiled
from tests.support.oracles.multi_start import Multistart

LANDING_GEAR = """
name = "landing_gear"
convention = "urdf"
actuated = ["retract"]
units = { length = "mm", angle = "deg" }
tool = { body = "leg", xyz = [0, 0, -1500] }
joints = [
  { name = "leg", link = "leg", parent = "0", axis = [0, 1, 0] },
  { name = "brace_u", link = "brace_u", parent = "0", xyz = [900, 0, 50], axis = [0, 1, 0] },
  { name = "brace_l", link = "brace_l", parent = "brace_u", xyz = [0, 0, -620], axis = [0, 1, 0] },
]

[[closures]]
name = "knee"
kind = "pin"
a = { body = "brace_l", xyz = [0, 0, -640], rpy = [90, 0, 0] }
b = { body = "leg", xyz = [60, 0, -800], rpy = [90, 0, 0] }

[[cylinders]]
name = "retract"
retracted = 350
limits = [0, 300]
a = { body = "0", xyz = [-350, 0, 60] }
b = { body = "leg", xyz = [90, 0, -300] }

[reference]
retract = 218
leg = 0
brace_u = 55
brace_l = -21
"""
OPEN = 0.184935
"""Stroke [m] at which the brace is too short, although the stroke is within its limits."""
FUNCTIONS = ("fk", "link_poses", "jacobian_mixed", "chain", "chain_D_q", "passive", "margin", "ik")


@pytest.fixture(scope="module")
def description(tmp_path_factory):
    path = tmp_path_factory.mktemp("gear") / "landing_gear.toml"
    path.write_text(LANDING_GEAR)
    return read(path)


@pytest.fixture(scope="module")
def gear(description, tmp_path_factory):
    return compiled(description, tmp_path_factory.mktemp("derived") / "landing_gear", FUNCTIONS)


@pytest.mark.parametrize("name", ["fk", "link_poses", "jacobian_mixed", "chain", "passive"])
def test_open_brace_raises_for_one_pose_and_is_nan_in_a_batch(gear, name):
    function = getattr(gear, name)
    with pytest.raises(chasles.OutOfReachError, match="knee: the loop does not close"):
        function(np.array([OPEN]))
    closed, opened = (np.asarray(function(np.array([[q]]))).ravel() for q in (0.25, OPEN))
    varies = closed != np.asarray(function(np.array([[0.24]]))).ravel()
    assert np.isfinite(closed).all()
    assert varies.any()
    assert np.isnan(opened[varies]).all()
    assert np.array_equal(opened[~varies], closed[~varies])


def test_finite_poses_are_exactly_those_that_newton_closes(gear, description):
    numbers = Multistart(description)
    q = np.linspace(0.005, 0.295, 30)[:, None]
    theta = gear.chain(q)
    finite = np.isfinite(theta[:, 0])
    modes = numbers.modes(q, numbers.actuated)
    assert 5 < finite.sum() < 25
    assert np.array_equal(finite, gear.loops_close(q))
    for k in np.flatnonzero(finite):
        assert min(abs(mode["leg"] - theta[k, 0]) for mode in modes[k]) < 1e-9
    # At inputs where the results are NaN, the loop cannot close on the reference branch of the leg.
    leg = np.arccos(gear.fk(q)[:, 2, 2])
    for k in np.flatnonzero(~finite):
        assert np.isnan(leg[k])
        assert all(abs(np.degrees(mode["leg"])) > 90 for mode in modes[k])


def test_slot_of_ik_at_which_a_brace_is_open_is_not_valid(gear):
    c, s = np.cos(0.17898153), np.sin(0.17898153)
    T = np.array([[c, 0, s, -1.5 * s], [0, 1, 0, 0], [-s, 0, c, -1.5 * c], [0, 0, 0, 1]])
    slots = gear.ik(T)
    assert slots.q[0, 0] == pytest.approx(OPEN, abs=1e-7)
    assert not slots.valid.any()
    assert gear.ik(gear.fk(np.array([0.25]))).valid.all()


def test_casadi_function_is_nan_where_a_brace_is_open(gear):
    fk = casadi_function(gear.folder, "fk")
    assert np.isfinite(np.array(fk(0.25))).all()
    varies = np.array(fk(0.25)) != np.array(fk(0.24))
    assert np.isnan(np.array(fk(OPEN))[varies]).all()
