"""Linkages with gears, racks and planetary stages agree with a numerical model.

Newton's method closes the loops of the numerical model.
"""

import numpy as np
import pytest

import chasles
from chasles.derive import derive, read_text, write
from chasles.derive.latex import fragments
from chasles.derive.terms.casadi_graph import lower
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
    548: "gears_between_passive_joints",
    5000053: "two_gears_in_a_loop",
}
"""Mechanism family of the random linkage of each seed. Two linkages have a closed form, and two do
not.

In the linkages of seeds 548 and 5000053, the crank and a coupled joint rotate beyond 180 degrees.
"""


def compare_gravity(robot, linkage):
    """Compare gravity forces with potential energy differences, with all loops closed."""
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


DRAG_LINK = """
name = "drag_link"
convention = "urdf"
actuated = ["crank"]
units = { length = "m", angle = "deg" }
tool = { body = "hand", xyz = ["0.2", 0, 0] }
joints = [
  { name = "crank", link = "crank", axis = [0, 0, 1] },
  { name = "coupler", link = "coupler", xyz = ["0.3", 0, 0], axis = [0, 0, 1] },
  { name = "rocker", parent = "0", link = "rocker", xyz = ["0.1", 0, 0], axis = [0, 0, 1] },
  { name = "hand", parent = "0", link = "hand", axis = [0, 0, 1] },
]
reference = { crank = 70, coupler = 80, rocker = 110 }
[[closures]]
name = "pin"
kind = "pin"
a = { body = "coupler", xyz = ["0.25", 0, 0] }
b = { body = "rocker", xyz = ["0.3", 0, 0] }
[couplings]
hand = { rocker = "1/2" }
"""


@pytest.mark.parametrize("limits", [(20, 350), (85, 400), (-700, 700)])
def test_limits_of_coupled_joint_select_its_full_turn(limits):
    own = f'name = "rocker", limits = [{limits[0]}, {limits[1]}]'
    robot = read_text(DRAG_LINK.replace('name = "rocker"', own, 1))
    model, fk = Model(robot), lower([derive(robot, functions=("fk",)).function("fk")], "r")[0]
    for angle in np.radians((70, 150, 200, 230, 290)):
        u, _ = model.followed([angle], steps=40)
        rocker = np.degrees(model.values([angle], u)["rocker"])
        if limits[0] < rocker < min(limits[1], 270 if limits[1] > 500 else np.inf):
            T = np.array(fk([angle])).reshape(4, 4)
            np.testing.assert_allclose(T, model.tip([angle], u), atol=1e-10, rtol=0)
    assert rocker > 280


def test_article_of_a_spindle_names_the_joint_that_turns_it():
    linkage = geared_linkage(60)
    assert linkage.family == "spindle"
    steps = fragments(derive(linkage.mechanism, functions=("fk",)))["solution.tex"]
    assert r"(0.49196 - 0.03 a_{\mathrm{rocker}}) \,\mathrm{e}" in steps
