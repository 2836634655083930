"""Identification Jacobians against Pinocchio's kinematic regressors."""

import numpy as np
import pytest
from derivations import NAMES, ROBOTS
from regressors import regressor_jacobian

from chasles.derive import derive, load
from chasles.derive.terms.casadi_graph import lower

pin = pytest.importorskip("pinocchio", reason="Pinocchio, the oracle of this file, is not there")

SHELF = sorted(
    path.stem
    for path in (ROBOTS / "shelf").glob("*.toml")
    if not {"actuated", "extends"} & set(path.read_text().split())
)
"""The serial arms of the shelf."""
FRAMES = {
    "identification_jacobian": "LOCAL_WORLD_ALIGNED",
    "identification_jacobian_space": "WORLD",
    "identification_jacobian_body": "LOCAL",
}


def largest_difference(path, random, names=("identification_jacobian",)):
    """Over all parameters, in a random geometry near the robot's and at random coordinates."""
    robot = load(path)
    derived = derive(robot, names)
    functions = lower(derived.functions, robot.name)
    p = np.array([float(derived.terms.value(g.value)) for g in derived.geometry.parameters])
    p += random.normal(size=len(p)) * 0.05
    q = random.uniform(-2, 2, len(robot.coordinates))
    worst = 0.0
    for name, found in zip(names, functions, strict=True):
        ours = np.array(found(q, p)).reshape(6, -1)
        theirs = regressor_jacobian(pin, derived.geometry, q, p, FRAMES[name])
        assert ours.shape == theirs.shape
        worst = max(worst, np.abs(ours - theirs).max())
    return worst


@pytest.mark.parametrize("name", NAMES)
def test_shipped_robots(name):
    assert largest_difference(ROBOTS / f"{name}.toml", np.random.default_rng(7)) <= 1e-10


@pytest.mark.parametrize("name", ["stanford", "scara"])
def test_every_frame(name):
    path = ROBOTS / f"{name}.toml"
    assert largest_difference(path, np.random.default_rng(8), FRAMES) <= 1e-10


@pytest.mark.parametrize("name", np.random.default_rng(8).choice(SHELF, 2, replace=False))
def test_some_of_the_shelf(name):
    path = ROBOTS / "shelf" / f"{name}.toml"
    assert largest_difference(path, np.random.default_rng(9)) <= 1e-10
