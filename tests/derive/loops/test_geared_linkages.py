"""Linkages with gears, racks and planetary stages agree with a model closed by Newton's method."""

import numpy as np
import pytest

import chasles
from chasles.derive import write
from chasles.study import PointMass, gravity_forces, static_loads
from tests.campaigns.geared import BARS
from tests.support.compiling import compiled_quickly
from tests.support.generators.geared_linkages import geared_linkage
from tests.support.loops.closed_in_numbers import Model
from tests.support.loops.geared import errors_of

FUNCTIONS = (
    "fk",
    "jacobian_mixed",
    "acceleration_mixed",
    "chain",
    "configuration",
    "actuators",
    "constraint",
    "constraint_D_z",
    "ik",
)
SEEDS = {
    4: "rack",
    6: "cylinders_in_unison",
    37: "gears_between_passive_joints",
    548: "gears_between_passive_joints",
}
"""Families by seed: two linkages with a closed form, and two linkages without a closed form.

In the linkage of seed 548, a coupled joint passes half a turn."""


def compare_gravity(robot, linkage):
    """Compares gravity forces with differences of the potential energy at closed configurations."""
    model, gravity = Model(linkage.mechanism), np.array([1.0, -9.0, 3.0])
    masses = [
        PointMass(joint.link, 0.5 + k, [0.1 * k, -0.2, 0.05])
        for k, joint in enumerate(linkage.mechanism.joints)
    ]

    def work(q):
        poses = model.poses(q, model.closed(q, model.u))
        return sum(m.mass * gravity @ (poses[m.link] @ [*m.at, 1.0])[:3] for m in masses)

    steps = 1e-5 * np.eye(robot.n)
    expected = [(work(model.q + e) - work(model.q - e)) / 2e-5 for e in steps]
    found = gravity_forces(robot, model.q, masses, gravity=gravity)
    assert np.allclose(found, expected, rtol=1e-7, atol=1e-7)
    loads = static_loads(robot, model.q, masses, gravity=gravity)
    assert np.allclose(loads.actuator_forces, -found, rtol=0, atol=1e-10)


@pytest.mark.parametrize("seed", SEEDS)
def test_geared_linkage_matches_newton_closures(tmp_path, seed):
    linkage = geared_linkage(seed)
    assert linkage.family == SEEDS[seed]
    write(linkage.mechanism, tmp_path / "r", functions=FUNCTIONS, languages=("c",))
    with compiled_quickly():
        robot = chasles.load(tmp_path / "r")
        found = errors_of(robot, linkage, np.random.default_rng(0), 3)
        if not linkage.mechanism.struts:
            compare_gravity(robot, linkage)
    assert found.configurations == 3
    assert {name: vars(found)[name] for name in BARS if not vars(found)[name] <= BARS[name]} == {}
