"""Manipulability in meter and radian agrees with the Robotics Toolbox."""

import numpy as np
import pytest

import chasles
from tests.support.optional import OptionalPackage
from tests.support.tolerances import ORACLE

rtb = OptionalPackage("roboticstoolbox")

POSES = 50
PARTS = {"all": "all", "linear": "trans", "angular": "rot"}


def models():
    """Return the arms of the Robotics Toolbox.

    The toolbox model of panda is used without a tool.
    """
    panda = rtb.models.DH.Panda()
    panda.tool = np.eye(4)
    return {"puma560": rtb.models.DH.Puma560(), "panda": panda}


@pytest.mark.parametrize("components", PARTS)
@pytest.mark.parametrize("name", ["puma560", "panda"])
def test_manipulability_measures_match_robotics_toolbox(name, components):
    oracle, robot = models()[name], chasles.load(name)
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (POSES, robot.n))
    # Both programs get the Jacobian of `panda` from chasles, because only the `panda` of chasles
    # includes a hand.
    given = [{"J": robot.jacobian_mixed(at)} if name == "panda" else {"q": at} for at in q]
    found = robot.manipulability(q, components=components, characteristic_length=1.0)
    for field, method in (("measure", "yoshikawa"), ("min_singular_value", "minsingular")):
        expected = [
            oracle.manipulability(**g, method=method, axes=PARTS[components]) for g in given
        ]
        assert np.abs(getattr(found, field) - expected).max() <= ORACLE
    expected = [
        oracle.manipulability(**g, method="invcondition", axes=PARTS[components]) for g in given
    ]
    assert np.abs(1 / found.condition - expected).max() <= ORACLE


def test_manipulability_gradient_matches_robotics_toolbox():
    """`jacobm` of the toolbox uses all six twist components and needs a regular matrix J J^T."""
    oracle, robot = models()["puma560"], chasles.load("puma560")
    checked = 0
    for q in np.random.default_rng(1).uniform(-np.pi, np.pi, (POSES, 6)):
        if robot.manipulability(q).min_singular_value > 0.01:
            expected = oracle.jacobm(q).ravel()
            found = robot.manipulability_gradient(q, characteristic_length=1.0)
            assert np.abs(found - expected).max() <= ORACLE
            checked += 1
    assert checked > POSES / 2
