"""Static loads agree with MuJoCo's inverse dynamics and with virtual work."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import sympy as sp

import chasles
from chasles.contract import Body, Span
from chasles.derive import DescriptionError, read_text
from chasles.drawing import skeleton
from chasles.errors import InputValueError, OutOfReachError, ShapeError
from chasles.study import PointMass, StaticLoads, gravity_forces, static_loads
from tests.support.compiling import compiled
from tests.support.derivations import description
from tests.support.generators.convertible_arms import convertible_arm
from tests.support.generators.leg_platforms import drawn_legs
from tests.support.loops.closed_in_numbers import Model
from tests.support.oracles.mujoco_statics import mujoco_loads, random_masses
from tests.support.pages import examples, run
from tests.support.robot_stand_in import RobotStandIn
from tests.support.skeletons import described_skeleton

RIGHT = 1e-9
"""Largest difference from MuJoCo, relative to the largest load."""
GRAVITY = np.array([1.2, -5.0, -8.0])
STEP = 1e-5


@pytest.mark.parametrize(
    "name", ["excavator", "stewart_gough", "delta", "planar_3rrr", "bricklaying_gantry", "panda"]
)
def test_loads_equal_inverse_dynamics_of_mujoco_at_rest(name):
    robot, rng = chasles.load(name), np.random.default_rng(1)
    masses = random_masses(robot, rng)
    q, wrench = robot.random_q(3, rng=1), rng.normal(size=(3, 6)) * 50
    found = static_loads(robot, q, masses, wrench=wrench, gravity=GRAVITY)
    for k in range(len(q)):
        wanted = mujoco_loads(robot, q[k], masses, wrench[k], GRAVITY)
        size = max(np.abs(wanted.joints).max(), np.abs(wanted.struts).max(initial=0.0))
        assert wanted.residual <= RIGHT * size
        for own, theirs in zip(
            (found.actuator_forces, found.joint_wrenches, found.strut_forces), wanted, strict=False
        ):
            np.testing.assert_allclose(own[k], theirs, rtol=0, atol=RIGHT * size)
    gravity = gravity_forces(robot, q, masses, gravity=GRAVITY)
    held = -(gravity + robot.actuator_forces(q, wrench))
    np.testing.assert_allclose(found.actuator_forces, held, atol=RIGHT * np.abs(held).max())


def potential(bodies, masses, q):
    poses, index = bodies.poses(q), {body.name: k for k, body in enumerate(bodies.bodies)}
    return -sum(
        mass.mass * GRAVITY @ (poses[index[mass.link]] @ [*mass.at, 1])[:3] for mass in masses
    )


@pytest.mark.parametrize("number", range(6))
def test_gravity_forces_are_the_gradient_of_the_potential_energy(number):
    # The arms have coupled, helical and reversed joints.
    bodies = described_skeleton(convertible_arm(number))
    rng = np.random.default_rng(number)
    masses = [PointMass(b.name, rng.uniform(1, 5), rng.normal(size=3)) for b in bodies.bodies[1:]]
    q = rng.normal(size=bodies.robot.n)
    found = gravity_forces(bodies.robot, q, masses, gravity=GRAVITY)
    steps = STEP * np.eye(len(q))
    rising = [potential(bodies, masses, q + d) - potential(bodies, masses, q - d) for d in steps]
    np.testing.assert_allclose(found, -np.array(rising) / (2 * STEP), rtol=1e-6, atol=1e-6)


def test_gravity_forces_of_an_exechon_are_the_gradient_of_its_potential_energy():
    """NumPy computes the potential energy from loops that Newton's method closes.

    An Exechon is overconstrained.

    A skeleton shows the reference configuration of a description. The test therefore makes a
    description for each configuration, with this configuration as the reference.
    """
    rng = np.random.default_rng(3)
    drawn = drawn_legs("exechon", 1)
    oracle = Model(drawn)
    links = [joint.link for joint in drawn.joints]
    masses = [PointMass(link, rng.uniform(1, 50), 0.2 * rng.normal(size=3)) for link in links]
    at = oracle.u
    for q in oracle.q + 0.04 * rng.uniform(-1, 1, (2, len(oracle.q))):
        at = oracle.closed(q, at)
        values = oracle.values(q, at)
        reference = tuple((name, sp.Rational(repr(float(x)))) for name, x in values.items())
        bodies = described_skeleton(replace(drawn, reference=reference))
        found = gravity_forces(bodies.robot, q, masses, gravity=GRAVITY)
        expected = [
            (lifted(oracle, masses, q + d, at) - lifted(oracle, masses, q - d, at)) / (2 * STEP)
            for d in STEP * np.eye(len(q))
        ]
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-5)


def lifted(model, masses, q, u):
    """Return the work done by the weights.

    Newton's method in NumPy closes the loops of the description.
    """
    poses = model.poses(q, model.closed(q, u))
    return sum(mass.mass * GRAVITY @ (poses[mass.link] @ [*mass.at, 1])[:3] for mass in masses)


def test_legs_of_a_hexapod_share_its_weight():
    robot = chasles.load("stewart_gough")
    loads = static_loads(robot, robot.q_reference, [PointMass("platform", 60.0)])
    # The platform joints are virtual and bear no load.
    np.testing.assert_allclose(loads.joints["roll"], 0, atol=1e-9)
    np.testing.assert_allclose(loads.strut_forces, loads.actuator_forces)
    legs = [b for b in skeleton(robot).bodies if b.span and not b.span.from_end]
    poses = skeleton(robot).poses(robot.q_reference)
    up = [poses[skeleton(robot).bodies.index(leg)][2, 2] for leg in legs]
    np.testing.assert_allclose(loads.strut_forces * up, 60 * 9.81 / 6)


class Changed(RobotStandIn):
    """The hexapod `stewart_gough` with a changed list of bodies."""

    def __init__(self, change, skipped=0):
        self.robot = chasles.load("stewart_gough")
        facts, loops = self.robot.manifest.skeleton, self.robot.manifest.loops
        self.manifest = SimpleNamespace(
            skeleton=replace(facts, bodies=tuple(change(facts.bodies))),
            load=self.robot.manifest.load,
            loops=replace(loops, actuated_in_z=loops.actuated_in_z[skipped:]),
        )

    def __getattr__(self, name):
        return getattr(self.robot, name)


def test_statically_indeterminate_robot_is_refused_by_the_names_of_its_struts():
    ends = (0.0, 0.0, 0.0), (0.1, 0.0, 0.0)
    brace = Body("brace", span=Span("brace", (0, 6), ends, (0.0, 1.0, 0.0)))
    robot = Changed(lambda bodies: (*bodies, brace))
    q = robot.q_reference
    with pytest.raises(
        InputValueError, match=r"even without a load, forces are possible at leg_1, .*, brace"
    ):
        static_loads(robot, q)
    with pytest.raises(InputValueError, match="indeterminate"):
        static_loads(robot, [q, q])


def test_weight_that_no_actuator_holds_is_refused_and_nan_in_a_batch():
    robot = Changed(lambda b: (x for x in b if not x.span or x.span.name != "leg_1"), skipped=1)
    weight = [PointMass("platform", 60.0)]
    with pytest.raises(
        InputValueError,
        match=r"no actuator can balance the load in this configuration; the load moves .*z",
    ):
        gravity_forces(robot, robot.q_reference, weight)
    assert np.isnan(gravity_forces(robot, robot.q_reference[None], weight)).all()


PENDULUM = """
name = "pendulum"
convention = "urdf"
gravity = [0, 0, -5]
joints = [{ name = "swing", axis = [0, 1, 0] }]
masses = [{ link = "link1", mass = 2, at = [0.5, 0, 0] }]
"""
BOOM = """
name = "boom"
convention = "urdf"
actuated = ["jack"]
[parameters]
m = { value = 40, unit = "kg" }
[[joints]]
name = "boom"
link = "boom"
axis = [0, 1, 0]
[[cylinders]]
name = "jack"
retracted = 0.6
limits = [0, 0.4]
a = { body = "0", xyz = [0.2, 0, -0.3] }
b = { body = "boom", xyz = [0.8, 0, 0.1] }
[[masses]]
link = "boom"
mass = "m"
at = [1.5, 0, 0.2]
[[masses]]
link = "jack_piston"
mass = 3
at = [0, 0, -0.1]
[reference]
boom = -0.35
"""


def test_masses_of_the_robot_file_are_the_default(tmp_path):
    arm = compiled(read_text(PENDULUM), tmp_path / "arm", ["fk"], ["c"])
    angles = np.array([[0.0], [0.4]])
    wanted = 2 * 5 * 0.5 * np.cos(angles)
    np.testing.assert_allclose(gravity_forces(arm, angles), wanted, rtol=1e-14)
    np.testing.assert_allclose(gravity_forces(arm, angles, gravity=[0, 0, -10]), 2 * wanted)
    boom = compiled(read_text(BOOM), tmp_path / "boom", None, ["c"])
    q = boom.random_q(4, rng=1)
    found = static_loads(boom, q, wrench=[0, 0, -100.0, 0, 0, 0])
    masses = [PointMass("boom", 40.0, [1.5, 0, 0.2]), PointMass("jack_piston", 3.0, [0, 0, -0.1])]
    for k in range(len(q)):
        theirs = mujoco_loads(boom, q[k], masses, [0, 0, -100.0, 0, 0, 0], [0, 0, -9.81])
        np.testing.assert_allclose(found.actuator_forces[k], theirs.actuators, rtol=RIGHT)
        np.testing.assert_allclose(found.strut_forces[k], theirs.struts, rtol=RIGHT)
    without = static_loads(boom, q, [], wrench=[0, 0, -100.0, 0, 0, 0])
    gravity = gravity_forces(boom, q)
    np.testing.assert_allclose(without.actuator_forces - gravity, found.actuator_forces)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('link = "jack_piston"', 'link = "jack"', "one of the links boom, jack_barrel, jack_pis"),
        (
            "at = [0, 0, -0.1]",
            "at = [0.1, 0, 0]",
            "'jack_piston': the mass of a strut section must be on the z axis",
        ),
        ("mass = 3", "mass = -3", r"masses\[2\]\.mass: expected a mass of at least 0, found -3"),
    ],
)
def test_wrong_masses_in_a_robot_file_are_refused(old, new, expected):
    with pytest.raises(DescriptionError, match=expected):
        read_text(BOOM.replace(old, new))


def test_missing_masses_are_refused():
    robot = chasles.load("four_bar")
    with pytest.raises(InputValueError, match=r"no \[\[masses\]\]; pass masses="):
        gravity_forces(robot, robot.q_reference)


def test_open_loop_raises_or_is_nan_in_a_batch():
    robot = chasles.load("excavator")
    closed, open_loop = robot.q_reference, robot.q_reference + np.array([0, 9, 0, 0])
    masses = [PointMass("boom", 1600.0, (2.6, 0.0, 0.4))]
    with pytest.raises(OutOfReachError):
        static_loads(robot, open_loop, masses)
    found = static_loads(robot, [closed, open_loop], masses)
    assert np.isfinite(found.joint_wrenches[0]).all()
    assert np.isnan(found.joint_wrenches[1]).all()
    assert np.isnan(found.strut_forces[1]).all()


def test_wrong_masses_and_shapes_are_refused():
    robot = chasles.load("excavator")
    q = robot.q_reference
    with pytest.raises(InputValueError, match="unknown body 'arm'; bodies of excavator: 0"):
        gravity_forces(robot, q, [PointMass("arm", 1.0)])
    with pytest.raises(InputValueError, match="mass of at least 0, got -1"):
        gravity_forces(robot, q, [PointMass("boom", -1.0)])
    with pytest.raises(InputValueError, match="must be on its z axis"):
        gravity_forces(robot, q, [PointMass("bucket_link", 1.0, (0.1, 0.0, 0.0))])
    with pytest.raises(ShapeError, match=r"expected q \(\.\.\., 4\)"):
        static_loads(robot, q[:3])


def test_loads_of_a_batch_broadcast_and_are_saved(tmp_path):
    robot = chasles.load("four_bar")
    q, wrench = robot.random_q((3, 1), rng=1), np.ones((4, 6))
    found = static_loads(robot, q, wrench=wrench)
    assert found.actuator_forces.shape == (3, 4, 1)
    (name,) = found.closures
    assert found.closures[name].shape == (3, 4, 6)
    found.save(tmp_path / "loads.npz")
    again = StaticLoads.load(tmp_path / "loads.npz")
    np.testing.assert_array_equal(again.joint_wrenches, found.joint_wrenches)
    assert "3 joints, 0 struts, 1 closures" in repr(again)


def test_static_loads_page_examples_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = run("how-to/static-loads.md")
    assert names["loads"].struts["boom_cylinder"] > 0
    (masses,) = examples("how-to/static-loads.md", "toml")
    head, joints, rest = description("excavator").read_text().partition("[[joints]]")
    load = read_text("".join((head, masses, joints, rest))).load
    assert [(m.link, m.mass, [*map(float, m.at)]) for m in load.masses] == [
        (m.link, m.mass, [*map(float, m.at)]) for m in (names["masses"][0], names["masses"][3])
    ]
