"""Robots with loops and as-built dimensions agree with another loop solver."""

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from chasles.derive import DescriptionError, derive, read, write
from chasles.derive.inverse.arms import arm_step
from chasles.derive.inverse.mechanisms.hybrid_inverse import hybrid_inverses
from chasles.derive.model.robot import Rotation
from tests.support.compiling import compiled, loaded
from tests.support.derivations import ROBOTS
from tests.support.generators.as_built import BOARD_INSTALLER, as_built
from tests.support.loops.closures import Model
from tests.support.loops.solved import solved

POSES = 100
FUNCTIONS = ("fk", "fk_jacobian_mixed", "configuration", "constraint", "margin")
DESIGN = read(ROBOTS / "board_installer.toml")


def tilted(mechanism, name):
    """Return a copy of a mechanism with one joint axis tilted by 0.1 degrees out of the plane."""
    joints = tuple(
        replace(joint, before=(*joint.before, Rotation("x", sp.pi / 1800)))
        if joint.name == name
        else joint
        for joint in mechanism.joints
    )
    return replace(mechanism, joints=joints)


def drawn(seed):
    return as_built(DESIGN, BOARD_INSTALLER, 5e-4, np.random.default_rng(seed))


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Return an as-built robot and its numeric loop model.

    The test campaign `as_built` tests robots with an error of a single length or axis, and with
    errors of all lengths and axes.
    """
    robot = drawn(94)
    folder = tmp_path_factory.mktemp("built")
    return compiled(robot, folder, [*FUNCTIONS, "ik"], ["c"]), Model(solved(robot).mechanism)


def coordinates(robot):
    return np.random.default_rng(0).uniform(robot.lower, robot.upper, (POSES, robot.n))


def test_as_built_loops_are_closed(built):
    robot, model = built
    q = coordinates(robot)
    z = robot.configuration(q)
    assert robot.loops_close(q).all()
    assert model.gap(z).max() < 1e-12
    np.testing.assert_allclose(robot.fk(q), model.tip(z), atol=1e-12)


def test_configuration_stays_on_reference_branch(built):
    robot, model = built
    q = coordinates(robot)[:5]
    z = np.repeat(np.array([robot.reference.z]), len(q), 0)
    start = np.array(robot.reference.q)
    for part in np.linspace(0, 1, 13):
        z[:, model.actuated] = (start + part * (q - start)) * model.ratio
        z = model.newton(z, model.actuated)
    np.testing.assert_allclose(robot.fk(q), model.tip(z), atol=1e-9)


def test_jacobian_matches_finite_differences(built):
    robot, model = built
    q = coordinates(robot)[:20]
    z = robot.configuration(q)
    D, step = model.z_D_q(z), 1e-7
    _, J = robot.fk_jacobian_mixed(q)
    for k in range(robot.n):
        moved = model.tip(z + step * D[..., k]) - model.tip(z - step * D[..., k])
        np.testing.assert_allclose(J[:, :3, k], moved[:, :3, 3] / (2 * step), atol=1e-7)


def test_ik_recovers_generating_configuration(built):
    robot, _ = built
    q = coordinates(robot)
    T = robot.fk(q)
    found = robot.ik(T)
    assert found.valid.any(-1).all()
    apart = np.where(found.valid[..., None], np.abs(found.q - q[:, None]), np.inf).max(-1)
    assert apart.min(-1).max() < 1e-9
    again = robot.fk(found.q[found.valid])
    np.testing.assert_allclose(again, np.repeat(T, found.valid.sum(-1), 0), atol=1e-11)
    # Some valid solutions differ from the generating configuration.
    assert (found.valid.sum(-1) > 1).mean() > 0.5


def test_requirements_note_nominal_loop_lengths():
    notes = derive(drawn(7), functions=["fk", "ik"]).inverse.classification.found.requirements
    assert notes[-1].text == "the loops have the lengths of the nominal robot"
    assert 0 < notes[-1].deviation < 1e-3


def test_loops_with_tilted_joint_use_refined_nominal_inverse():
    """The solution steps for spatial loops also solve loops with a tilted joint.

    Newton's method refines the solutions of the nominal inverse kinematics function.
    """
    hybrid = solved(replace(tilted(DESIGN, "shoulder"), closure="least squares"))
    assert not hybrid.forward.open
    assert {"SlidingLeg", "TurningLeg"} & {type(step).__name__ for step in hybrid.forward.steps}
    found = hybrid_inverses(hybrid)
    assert found.polished is not None
    assert list(found.solved) == ["ik_nominal"]


def test_solution_near_dead_point_is_found(built):
    robot, _ = built
    q = np.array([-0.82292224, -0.47466385, -3.10882504, 0.70505359, 0.0415733, 0.11240639])
    assert 1e-5 < robot.margin(q).min() < 2e-5
    found = robot.ik(robot.fk(q))
    assert np.abs(found.q[found.valid] - q).max(-1).min() < 1e-9


def test_solution_far_from_its_nominal_start_is_found(built):
    robot, _ = built
    q = np.array([2.29786829, 0.16273365, 2.7802815, -2.92592716, 0.09005807, -0.25962023])
    assert robot.margin(q).min() < 0.02
    found = robot.ik(robot.fk(q))
    assert np.abs(found.q[found.valid] - q).max(-1).min() < 1e-9


def test_fixed_joints_keep_their_values(tmp_path):
    """Every length has an error of up to 0.5 mm, and two axes are tilted by 0.1 degrees.

    With the nominal dimensions, three joints must be fixed to obtain a finite number of solutions.
    With tilted axes, one fixed joint is sufficient.
    """
    design = read(ROBOTS / "well_manipulator.toml")
    members = frozenset(one.name for one in (*design.joints, *design.struts))
    spoilt = as_built(design, members, 5e-4, np.random.default_rng(1))
    spoilt = replace(tilted(tilted(spoilt, "theta3"), "theta7"), closure="least squares")
    robot = compiled(spoilt, tmp_path, ["fk", "chain", "ik"], ["c"])
    q = coordinates(robot)
    T, theta = robot.fk(q), robot.chain(q)
    places = {"l_MN": 5}
    found = robot.ik(T, fixed={name: theta[:, k] for name, k in places.items()})
    apart = np.where(found.valid[..., None], np.abs(found.q - q[:, None]), np.inf).max(-1)
    assert apart.min(-1).max() < 1e-9
    of, slot = np.nonzero(found.valid)
    held = robot.chain(found.q[of, slot])[:, list(places.values())]
    np.testing.assert_allclose(held, theta[of][:, list(places.values())], atol=1e-12)


def test_non_parallel_pins_are_rejected_with_deviation():
    with pytest.raises(
        DescriptionError, match=r"'rod_FH': the pins allow only planar.*'elbow' is 1.75 mrad out"
    ) as message:
        derive(tilted(DESIGN, "elbow"))
    assert 'closure = "least squares"' in str(message.value)
    with pytest.raises(DescriptionError, match=r"'push_rod' are 0.363 mm apart"):
        derive(tilted(DESIGN, "pitch"))
    far = replace(DESIGN.joint_of["greater_arm"], before=(Rotation("x", sp.pi / 30),))
    joints = tuple(far if joint.name == far.name else joint for joint in DESIGN.joints)
    wrong = replace(DESIGN, joints=joints, closure="least squares")
    with pytest.raises(DescriptionError, match=r'expected parallel axes, or ends = "ball"$'):
        derive(wrong)


def test_following_motor_is_not_a_loop_joint(tmp_path, monkeypatch):
    monkeypatch.setattr(arm_step, "with_arms", lambda loops: loops)
    gantry = tilted(read(ROBOTS / "bricklaying_gantry.toml"), "y_second")
    write(gantry, tmp_path, functions=["fk", "passive", "configuration"], languages=["c"])
    robot = loaded(tmp_path)
    assert robot.manifest.is_iterated
    q = np.array(robot.reference.q)
    names = [variable.name for variable in robot.configuration_variables]
    expected = robot.configuration(q)[[names.index(v.name) for v in robot.passive_joints]]
    np.testing.assert_array_equal(robot.passive(q), expected)
    assert "motor_y_second" not in names
