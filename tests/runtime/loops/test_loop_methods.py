"""An open loop raises an error for a single pose, and gives NaN in a batch."""

import pickle

import numpy as np
import pytest

import chasles
from chasles.cli.app import run as main
from tests.support.handwritten import lift

OPEN = np.array([0.25, 2.5])
DEAD = np.array([0.25, 2.0])


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    return chasles.load(lift.write(tmp_path_factory.mktemp("lift") / "lift"))


def test_loop_robot_exposes_manifest_facts(robot):
    assert [joint.name for joint in robot.chain_joints] == ["theta1", "theta2"]
    assert [(joint.name, joint.unit) for joint in robot.passive_joints] == [("swing", "rad")]
    assert robot.loops == ("boom_cylinder",)
    assert robot.loop_solution == "closed form"
    assert robot.reference.q == (0, 1)
    assert [v.name for v in robot.configuration_variables] == ["theta1", "theta2", "boom_cylinder"]


def test_info_command_lists_loops_and_passive_joints(tmp_path, cache, capsys):
    assert main(["info", str(lift.write(tmp_path / "lift"))]) == 0
    text = capsys.readouterr().out
    assert "loops (closed form): boom_cylinder" in text
    assert "main chain (theta): theta1 [deg], theta2 [deg]\n    passive: swing [deg]" in text


def test_serial_robots_have_no_loops():
    robot = chasles.load("ur5e")
    assert (robot.loops, robot.loop_solution, robot.passive_joints) == ((), "", ())
    assert robot.chain_joints == robot.coordinates
    for name in ("loops_close", "chain_branches", "fk_planar_all", "ik_planar", "singularity"):
        assert not hasattr(robot, name)
    with pytest.raises(
        AttributeError, match=r"'ur5e' has no 'loops_close': its q are its joints, since"
    ):
        robot.loops_close(np.zeros(6))


def test_always_closing_loops_are_valid_for_finite_input():
    gantry = chasles.load("bricklaying_gantry")
    assert not hasattr(gantry, "margin")
    q = np.zeros((2, 3, gantry.n))
    q[1, 2, 0], q[0, 1, -1] = np.nan, np.inf
    np.testing.assert_array_equal(gantry.loops_close(q), np.isfinite(q).all(-1))
    with pytest.raises(chasles.ShapeError):
        gantry.loops_close(q[..., 1:])


def test_missing_passive_joints_are_explained():
    hexapod = chasles.load("stewart_gough")
    with pytest.raises(AttributeError, match="'passive': all its joints are in the main chain"):
        hexapod.passive(np.zeros(6))


def test_open_loop_error_names_loop_and_coordinates(robot):
    with pytest.raises(chasles.OutOfReachError) as caught:
        robot.chain(OPEN)
    assert str(caught.value) == (
        "lift.chain: boom_cylinder: the loop does not close at waist = 0.25 rad, "
        "boom_cylinder = 2.5 m: margin -3.516 (a dead point has margin 0)"
    )
    assert isinstance(caught.value, chasles.ChaslesError)
    assert isinstance(caught.value, ValueError)


def test_open_loop_error_from_chain_names_joints(robot):
    with pytest.raises(
        chasles.OutOfReachError, match=r"lift.actuators: .* at theta1 = 0 rad, theta2 = -1 rad"
    ):
        robot.actuators([0.0, -1.0])


def strided(q):
    """Return a single pose whose entries are not contiguous in memory."""
    return np.repeat(q, 3)[::3]


@pytest.mark.parametrize(
    "form",
    [np.array, list, strided, lambda q: q.astype(np.float32)],
    ids=["array", "list", "strided", "float32"],
)
def test_open_loop_raises_for_every_call_form(robot, form):
    with pytest.raises(chasles.OutOfReachError, match="boom_cylinder: the loop does not close"):
        robot.chain(form(OPEN))
    with pytest.raises(chasles.OutOfReachError, match="boom_cylinder: the loop does not close"):
        robot.reach(q=form(OPEN), threads="all")
    assert np.isfinite(robot.reach(form(DEAD))).all()


@pytest.mark.parametrize("out", [np.zeros(2), np.zeros(4)[::2]], ids=["plain", "strided"])
def test_out_receives_nan_if_loop_is_open(robot, out):
    with pytest.raises(chasles.OutOfReachError):
        robot.chain(OPEN, out=out)
    np.testing.assert_array_equal(out, [0.25, np.nan])


def test_dead_point_raises_singularity_error_for_rates(robot):
    np.testing.assert_allclose(robot.chain(DEAD), [0.25, np.pi])
    with pytest.raises(chasles.SingularityError) as caught:
        robot.chain_rates(DEAD, [0.0, 1.0])
    assert str(caught.value) == (
        "lift.chain_rates: boom_cylinder: the loop is at a dead point: waist = 0.25 rad, "
        "boom_cylinder = 2 m, margin 0; rates are not defined"
    )
    assert isinstance(caught.value, chasles.OutOfReachError)


def test_batches_give_nan_instead_of_raising(robot):
    q = np.stack([OPEN, DEAD, [0.0, 1.0]])
    for batch in (q, q[:, None], q[:1], q.tolist(), q[::2], q[:0]):
        np.testing.assert_array_equal(
            np.isfinite(robot.chain(batch)[..., 1]), np.asarray(batch)[..., 1] <= 2
        )
    assert np.isinf(robot.chain_rates(q, [0.0, 1.0])[1, 1])


def test_non_finite_coordinates_propagate_as_nan(robot):
    assert np.isnan(robot.chain([0.0, np.nan])[1])
    assert np.isnan(robot.chain([np.inf, 1.0])).sum() == 0
    assert np.isnan(robot.chain_rates([0.0, 1.0], [np.nan, 0.0])[0])
    # A function without a margin does not check the loops, and never raises an error.
    assert np.isnan(robot.plain(OPEN)[1])
    assert robot.margin(OPEN)[1] < 0


def test_docstring_documents_out_of_reach_error(robot):
    assert "OutOfReachError: If a loop does not close at a single pose" in robot.chain.__doc__
    assert "OutOfReachError" not in robot.plain.__doc__


def test_pickled_function_raises_for_open_loop(robot):
    chain = pickle.loads(pickle.dumps(robot.chain))
    with pytest.raises(chasles.OutOfReachError):
        chain(OPEN)


def test_valid_is_true_only_for_closed_loops(robot):
    q = np.array([[OPEN, DEAD], [[0.0, 1.0], [0.0, np.nan]]])
    np.testing.assert_array_equal(robot.loops_close(q), [[False, True], [True, False]])
    assert robot.loops_close([0.0, 1.0])
    assert pickle.loads(pickle.dumps(robot.loops_close))([0.0, 1.0])
    np.testing.assert_array_equal(
        robot.chain_closes([[0.0, 1.0], [0.0, -1.0], [np.nan, 1.0]]), [True, False, False]
    )


def test_chain_branches_return_all_closed_branches(robot):
    theta, valid, margin = robot.chain_branches(np.stack([OPEN, [0.1, 1.0]]))
    np.testing.assert_array_equal(valid, [[False, False], [True, True]])
    np.testing.assert_allclose(theta[1], [[0.1, np.pi / 3], [0.1, -np.pi / 3]])
    assert margin.shape == (2, 2)
    assert not hasattr(robot, "actuator_branches")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda m: m.update(solution="newton"),
            r"solution: got 'newton', expected 'closed form', since the kind is 'hybrid'",
        ),
        (lambda m: m["chain"][0].pop("unit"), r"chain\[0\]: has no 'unit'"),
        (
            lambda m: m["reference"].update(z=[0]),
            r"reference: .* expected 2 values of q and 3 of z",
        ),
        (lambda m: m["actuated_in_z"].pop(), r"actuated_in_z: .* expected 2 entries"),
        (lambda m: m["actuated_in_z"][0].update(index=3), r"actuated_in_z: .* indices below 3"),
        (lambda m: m["functions"][0].update(margin="no"), r"functions\[0\].margin: got 'no'"),
        (
            lambda m: m["functions"][4].update(margin="margin"),
            r"functions\[4\].margin: .* a function of theta alone",
        ),
        (lambda m: m["functions"][2]["steps"].pop(), r"functions\[2\].steps: .* one name for each"),
    ],
    ids=[
        "unknown solution",
        "unit missing",
        "short reference",
        "short actuated_in_z",
        "index out of range",
        "unknown margin",
        "margin of other domain",
        "short steps",
    ],
)
def test_invalid_loop_manifest_is_rejected(tmp_path, cache, change, message):
    content = lift.manifest()
    change(content)
    with pytest.raises(chasles.ManifestError, match=rf"manifest\.json: {message}"):
        chasles.load(lift.write(tmp_path / "lift", content))


@pytest.mark.parametrize("name", ["board_installer", "well_manipulator", "excavator", "delta"])
def test_actuators_valid_rejects_joints_that_violate_loops(name):
    robot = chasles.load(name)
    theta = robot.chain(robot.reference.q)
    assert robot.chain_closes(theta)
    off = theta + np.where(
        [joint.name in ("elbow", "yaw") for joint in robot.chain_joints], 0.01, 0
    )
    assert robot.chain_closes(off) == (name in ("well_manipulator", "excavator"))
    assert robot.chain_closes(np.stack([theta, off])).shape == (2,)


def test_chain_and_actuators_of_a_plain_arm_are_identities():
    arm, q = chasles.load("ur5e"), np.arange(12.0).reshape(2, 6)
    for same in (arm.chain(q), arm.actuators(theta=q), arm.chain(q.tolist())):
        np.testing.assert_array_equal(same, q)
        assert not np.shares_memory(same, q)
    with pytest.raises(chasles.ShapeError, match=r"ur5e\.chain: expected q of shape \(\.\.\., 6\)"):
        arm.chain(np.zeros(5))
    with pytest.raises(chasles.InputTypeError, match=r"ur5e\.actuators: theta must hold real"):
        arm.actuators(np.zeros(6, complex))


def test_intermediate_functions_are_no_attributes_and_pickle():
    robot = chasles.load("planar_3rrr")
    for name in ("modes", "rods", "velocity_relation", "actuators_all", "closure"):
        assert not hasattr(robot, name)
        function = robot.functions[name]
        assert pickle.loads(pickle.dumps(function)).__qualname__ == function.__qualname__
