"""Inverse kinematics of platforms on legs, with joints between base and legs or on the platform.

Each leg constrains one ball joint of the platform to a plane.
"""

from dataclasses import replace

import numpy as np
import pytest

from chasles.derive import explain
from chasles.derive.inverse.mechanisms.backward_inverse import missing
from chasles.derive.loops.closing.loop_model import loop_model
from chasles.derive.loops.solve.solved_loops import solved_loops
from tests.support.compiling import compiled
from tests.support.generators.carried_planes import carrying, moved
from tests.support.loops.closures import Model
from tests.support.loops.legs_of_joints import drawn, driven_by_a_leg

POSES, CLOSED, SAME = 20, 1e-12, 1e-9
REACH = {"m": 0.08, "rad": 2.0}
"""Maximum deviation of a coordinate from its reference value (meter or radian)."""
AXES = [
    ((0, 0, 1), ("0.1", "0.05", "0.1")),
    ((0, 1, 0), ("0.05", "0.03", "0.02")),
    ((1, 0, 0), ("0.02", "-0.04", "0.1")),
]
"""Axis direction and origin (meter) of each joint on the platform. The joint axes do not meet in
one point."""
PARALLEL = [AXES[0], ((0, 0, 1), AXES[1][1]), AXES[2]]
"""Axis direction and origin (meter) of three joints on the platform. The first two joint axes are
parallel, so that the derivation does not eliminate both joint angles together."""
RAIL, SPIN = ("rail", (1, 0, 0), ("0.1", 0, 0)), ("turntable", (0, 0, 1), (0, "0.1", 0))
ROBOTS = {
    "three offset axes": (lambda: carrying(drawn(2, ("RPS",) * 3), PARALLEL), ()),
    "rail": (lambda: moved(drawn(1, ("RPS", "PRS", "RRS")), *RAIL), ()),
    "turntable, axis and slide": (
        lambda: moved(carrying(driven_by_a_leg(), AXES[:2], ("revolute", "prismatic")), *SPIN),
        (),
    ),
    "rail along all planes": (
        lambda: moved(driven_by_a_leg(), "rail", (0, 0, 1), (0, 0, "0.1")),
        ("rail",),
    ),
}
"""For each test robot, a function that builds the robot, and the joints that its inverse kinematics
function fixes."""


@pytest.fixture(scope="module", params=ROBOTS)
def loaded(request, tmp_path_factory):
    """Return a robot, its fixed joints, its NumPy model, and closed configurations (N, n_z)."""
    make, fixed = ROBOTS[request.param]
    mechanism, rng = make(), np.random.default_rng(3)
    folder = tmp_path_factory.mktemp("arm")
    robot = compiled(mechanism, folder, ["ik", "fk", "configuration"], ["c"])
    model, at = Model(mechanism), dict(mechanism.reference)
    z = np.repeat([[float(at.get(name, 0)) for name in model.names]], POSES, 0)
    reach = [
        REACH["m"] if c.name in mechanism.actuated[-9:] and _is_leg(c) else REACH[c.unit]
        for c in robot.coordinates
    ]
    z[:, model.actuated] += rng.uniform(-1, 1, (POSES, len(reach))) * reach
    z = model.newton(z, model.actuated)
    z = z[model.gap(z) < CLOSED]
    assert len(z) > POSES / 3
    return robot, fixed, model, z


def _is_leg(coordinate):
    return not coordinate.name.startswith(("axis", "rail", "turntable"))


def test_solutions_contain_the_generating_coordinates_and_reach_the_pose(loaded):
    robot, fixed, model, z = loaded
    names = [c.name for c in robot.coordinates]
    angular = [c.unit == "rad" for c in robot.coordinates]
    for T, q in zip(model.tip(z), z[:, model.actuated], strict=True):
        found = robot.ik(T, fixed={name: q[names.index(name)] for name in fixed} or None)
        apart = found.q[found.valid] - q
        apart[:, angular] = np.remainder(apart[:, angular] + np.pi, 2 * np.pi) - np.pi
        assert np.abs(apart).max(-1).min() < SAME
        own = np.array([robot.configuration(other) for other in found.q[found.valid]])
        assert model.gap(own).max() < SAME
        assert np.abs(model.tip(own) - T).max() < SAME


def half_flat():
    """Return a platform with four degrees of freedom on two RPS legs and a UPS leg."""
    mechanism = drawn(1, ("RPS", "RPS", "UPS"))
    return replace(mechanism, actuated=(*mechanism.actuated, "u0_2"))


@pytest.mark.parametrize(
    ("make", "axes", "kinds", "reason"),
    [
        (
            driven_by_a_leg,
            [((0, 0, 1), xyz) for _, xyz in AXES],
            (),
            "any two of axis_0, axis_1 and axis_2 have a resultant of zero, for example because "
            "their axes are parallel",
        ),
        (
            half_flat,
            AXES[:2],
            (),
            "each leg must keep a ball joint in a plane, unlike the leg that ends at ball_2",
        ),
    ],
)
def test_reason_states_the_condition_that_fails(make, axes, kinds, reason):
    found = missing(solved_loops(loop_model(carrying(make(), axes, kinds))))
    assert reason in found
    assert found.startswith("the loops couple ")


def test_explanation_names_the_joints_that_the_planes_determine():
    text = str(explain(ROBOTS["rail along all planes"][0]()))
    assert "the three equations of the planes hold with rail fixed" in text
    text = str(explain(moved(carrying(driven_by_a_leg(), AXES), *RAIL)))
    assert "determine axis_0, axis_1 and axis_2 with rail fixed, in up to 32 ways" in text
