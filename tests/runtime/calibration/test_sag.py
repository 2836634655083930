"""Joints that yield to gravity, identified from an arm in equilibrium."""

import numpy as np
import pytest
from convention_robots import sagging_ur5e

import chasles
from chasles import screws
from chasles.calibration import Positions, identify, robot_file
from chasles.derive import loads, write
from chasles.errors import InputValueError

SIGMA = 2e-5
YIELD = np.array([3e-5, 5e-5, 8e-5, 1e-4, 1e-4, 2e-4])
"""Of the joints [rad/(N m)]: the wrist of a small arm yields the most."""


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sagging") / "ur5e"
    write(loads(sagging_ur5e()), folder, ["fk", "fk_p", "jacobian_p", "identification_jacobian"])
    return chasles.load(folder)


def part(arm, name):
    return np.array([g.part == name for g in arm.geometry])


def torques(arm, q, p):
    """The torques of gravity, from the tool's displacement by a unit of compliance."""
    J, by_compliance = arm.jacobian_p(q, p), arm.identification_jacobian(q, p)
    columns = by_compliance[..., part(arm, "compliance")]
    return (J * columns).sum(-2) / (J**2).sum(-2)


def in_equilibrium(arm, q, p):
    """Poses with the joints where springs and gravity balance, in the arm's true geometry."""
    rigid = np.where(part(arm, "compliance"), 0, p)
    sagged = q
    for _ in range(8):
        sagged = q + YIELD * torques(arm, sagged, rigid)
    return arm.fk_p(sagged, rigid)


@pytest.fixture(scope="module")
def measured(arm):
    random = np.random.default_rng(2)
    p = np.array([g.value for g in arm.geometry])
    p[part(arm, "axis")] += random.uniform(-1e-3, 1e-3, part(arm, "axis").sum())
    q = random.uniform(-2.5, 2.5, (50, 6))
    targets = random.uniform(-0.15, 0.15, (3, 3))
    T = screws.exp(random.normal(size=6)) @ in_equilibrium(arm, q, p)
    points = T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], targets)
    return q, Positions(points + SIGMA * random.normal(size=points.shape), SIGMA)


@pytest.fixture(scope="module")
def found(arm, measured):
    return identify(arm, *measured, vary=("axis", "compliance"), robust=False)


def test_springs_are_found(arm, measured, found):
    rigid = identify(arm, *measured, robust=False)
    assert rigid.noise > 5
    assert found.noise < 1.1
    # The pan's axis is vertical to a milliradian: gravity hardly turns it.
    springs = found.p[part(arm, "compliance")]
    std = dict(zip(found.names, found.std, strict=True))
    for k in range(1, 6):
        name = f"{arm.coordinates[k].name}_compliance"
        assert abs(springs[k] - YIELD[k]) < 4 * std[name]
        assert std[name] < 0.1 * YIELD[k]


def test_a_robot_file_has_no_springs(arm, found):
    with pytest.raises(InputValueError, match="springs"):
        robot_file(arm, found.p, "mine", "simulated")
