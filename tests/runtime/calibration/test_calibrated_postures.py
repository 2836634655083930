"""Maps of calibrated mechanisms in all postures: to the joints of the main chain, and back.

`python test_calibrated_postures.py 50` draws so many calibrations of each mechanism.
"""

import sys
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from derivations import ROBOTS

import chasles
from chasles.calibration import robot_file
from chasles.derive import load, loads, write
from chasles.derive.emit.languages import EMITTERS
from chasles.derive.loops.hybrid import Hybrid
from chasles.derive.loops.maps import actuator_margin, actuators, chain
from chasles.derive.terms.casadi_graph import lower

MECHANISMS = ("board_installer", "excavator")
POSTURES = 300
DRAWN = 5e-4
"""Metre and radian: what axes, rods and tool of a drawn robot are off by at most."""
SAME = 1e-10
"""Metre or radian, for coordinates."""
CALLED = tuple(emitter for emitter in EMITTERS if emitter.language != "latex")


@cache
def designed(name):
    """A robot as designed, with its parameters."""
    folder = Path(tempfile.mkdtemp()) / name
    write(load(ROBOTS / f"{name}.toml"), folder, ["fk", "fk_p", "parts_p"], emitters=CALLED)
    return chasles.load(folder)


def calibrated(name, seed):
    """A drawn robot that its design leads, as its file describes it."""
    robot, random = designed(name), np.random.default_rng(seed)
    p = np.array([item.value for item in robot.geometry])
    moved = np.array([item.part in ("axis", "loop", "tool") for item in robot.geometry])
    p[moved] += random.uniform(-DRAWN, DRAWN, moved.sum())
    text = robot_file(robot, p, f"mine_{seed}", "a test", name)
    return loads(text, f"{name}_{seed}.toml")


def postures(name, seed):
    """Coordinates within the limits of the design."""
    robot = designed(name)
    return np.random.default_rng(seed).uniform(robot.lower, robot.upper, (POSTURES, robot.n))


def check_maps(name, seed):
    """Finds the coordinates again in every posture whose loops close."""
    hybrid = Hybrid(calibrated(name, seed))
    to_chain, back, margin = lower([f(hybrid) for f in (chain, actuators, actuator_margin)], "maps")
    q = postures(name, seed)
    theta = np.array(to_chain(q.T))
    closed = np.isfinite(theta).all(0)
    assert closed.mean() > 0.9
    found, margins = np.array(back(theta)).T[closed], np.array(margin(theta))[:, closed]
    np.testing.assert_allclose(found, q[closed], rtol=0, atol=SAME)
    assert margins.min() > 0


@pytest.mark.parametrize("name", MECHANISMS)
def test_actuators_are_found_again_in_all_postures(name):
    check_maps(name, 5)


def test_joints_of_another_branch_are_not_valid(tmp_path):
    """The pantograph as its mirror image about a line through the pins of a rod's ends."""
    functions = ["chain", "actuators", "chain_all", "actuator_margin"]
    write(calibrated("board_installer", 5), tmp_path, functions, emitters=CALLED)
    robot, q = chasles.load(tmp_path), postures("board_installer", 5)
    assert robot.actuators_valid(robot.chain(q)).all()
    every = robot.chain_branches(q)
    assert every.valid[:, 1:].any()
    for k in range(1, every.theta.shape[1]):
        theta = every.theta[every.valid[:, k], k]
        led = robot.chain(robot.actuators(theta))
        apart = np.abs(np.angle(np.exp(1j * (led - theta)))).max(-1) > SAME
        assert not (robot.actuators_valid(theta) & apart).any()


if __name__ == "__main__":
    for mechanism in MECHANISMS:
        for drawn in range(int(sys.argv[1])):
            check_maps(mechanism, drawn)
        print(mechanism, sys.argv[1], "calibrations, all postures found again")
