"""Newton's method in C closes loops on the branch of the reference."""

import pickle
import tomllib

import numpy as np
import pytest

import chasles
from chasles.derive import casadi_function, read
from tests.support.compiling import compiled, compiled_quickly
from tests.support.derivations import ROBOTS
from tests.support.rate_inputs import sampling_limits

REDUNDANT = """
[[joints]]
name = "bar_pin"
parent = "crank_1"
link = "bar"
xyz = ["S_A", 0, 0]
axis = [0, 0, 1]

[[rods]]
name = "upper"
length = "S_A"
a = { body = "0", xyz = ["r_b*cos(210) + 50", "r_b*sin(210)", 0] }
b = { body = "bar", xyz = [50, 0, 0] }
swing = "upper_swing"

[[rods]]
name = "lower"
length = "S_A"
a = { body = "0", xyz = ["r_b*cos(210) - 70", "r_b*sin(210)", 0] }
b = { body = "bar", xyz = [-70, 0, 0] }
swing = "lower_swing"

[reference]
bar_pin = -76
upper_swing = 76
lower_swing = 76
"""
"""Joints and rods that the tests add to a robot: a bar on three parallel cranks, with one redundant
loop equation."""
NAMES = ("stewart_gough", "redundant")


def description(folder, name):
    if name != "redundant":
        return ROBOTS / f"{name}.toml"
    text = (ROBOTS / "planar_3rrr.toml").read_text().replace('"planar_3rrr"', '"redundant"')
    parts, reference = text.split("[reference]")
    file = folder / "redundant.toml"
    file.write_text(f"{parts}{REDUNDANT}{reference}")
    tomllib.loads(file.read_text())
    return file


@pytest.fixture(scope="module", params=NAMES)
def robot(request, tmp_path_factory):
    above = tmp_path_factory.mktemp(request.param)
    folder = above / request.param
    described = read(description(above, request.param))
    wanted = [name for name in WANTED if described.passive or not name.startswith("passive")]
    robot = compiled(described, folder, wanted, ["c", "casadi"])
    # Unpickling loads a robot again, so the compiler settings must remain during the tests.
    with compiled_quickly():
        yield robot


WANTED = (
    *("fk", "jacobian_mixed", "fk_jacobian_mixed", "jacobian_body_dot", "jacobian_mixed_dot"),
    *("hessian_mixed", "twist_mixed", "acceleration_mixed", "link_poses", "margin", "fk_near"),
    *("chain", "chain_D_q", "chain_rates", "chain_accelerations", "passive", "passive_D_q"),
    *("configuration", "configuration_D_q", "configuration_near", "constraint", "closure"),
    *("actuators", "constraint_D_z"),
)


def coordinates(robot, n, wide=1.0, seed=0):
    """Return random coordinates around mid-range.

    If ``wide`` exceeds 1, the coordinates may be near singularities of the cranks.
    """
    lower, upper = sampling_limits(robot)
    middle, half = (lower + upper) / 2, (upper - lower) / 2
    return middle + half * wide * np.random.default_rng(seed).uniform(-1, 1, (n, robot.n))


def difference(function, x, step=1e-6):
    """Differentiate a function of rows x (N, n) by central differences.

    The array of derivatives has the shape (..., n).
    """
    slopes = [(function(x + h) - function(x - h)) / (2 * step) for h in step * np.eye(x.shape[-1])]
    return np.stack(slopes, axis=-1)


def test_loops_close_everywhere_within_limits(robot):
    q = coordinates(robot, 1000)
    found = robot.solve_loops(q)
    assert found.valid.all()
    assert found.n_failed == 0
    assert found.residual.max() < 1e-12
    assert robot.loops_close(q).all()
    if "actuators" in robot.functions:
        np.testing.assert_allclose(robot.actuators(robot.chain(q)), q, atol=1e-12)


def followed(robot, q, steps):
    """Return the configurations w at coordinates q, by Newton's method in small steps."""
    names = [v.name for v in robot.configuration_variables]
    own = [k for k, name in enumerate(names) if not name.startswith("psi")]
    moved = [c.name for c in robot.coordinates]
    actuated = [own.index(names.index(name)) for name in moved]
    unknown = np.setdiff1d(np.arange(len(own)), actuated)
    q_0, w = np.array(robot.reference.q), np.tile(np.array(robot.reference.z)[own], (len(q), 1))
    sense = None
    for part in np.linspace(0, 1, steps + 1):
        w[:, actuated] = q_0 + part * (q - q_0)
        for _ in range(3):
            c, D = robot.functions["closure"](w)
            J = np.where(np.isfinite(c).all(-1)[:, None, None], D[..., unknown], unknown.size)
            J += np.eye(len(unknown)) * ~np.isfinite(c).all(-1)[:, None, None]
            w[:, unknown] -= np.linalg.solve(J, c[..., None])[..., 0]
        sign = np.sign(np.linalg.det(J))
        sense = sign if sense is None else sense
        w[(sign != sense) | (np.abs(c).max(-1) > 1e-6)] = np.nan
    return w, own


def test_newton_keeps_branch_far_outside_limits(robot):
    if robot.name == "redundant":
        pytest.skip("the robot has no determinant")
    q = coordinates(robot, 60, wide=3.0)
    expected, own = followed(robot, q, 1000)
    z = robot.solve_loops(q).z[:, own]
    reached = np.isfinite(expected).all(-1)
    assert 15 < reached.sum() < 60
    np.testing.assert_allclose(z[reached], expected[reached], atol=1e-9)
    # Newton's method finds no solution beyond a singularity.
    assert np.isfinite(z[~reached]).all(-1).sum() <= 1


def test_newton_never_crosses_singularity(robot):
    """Many targets are near a singularity, where Newton's method may reach a different branch."""
    if robot.name == "redundant":
        pytest.skip("the robot has no determinant")
    names = [v.name for v in robot.configuration_variables]
    actuated = [names.index(c.name) for c in robot.coordinates]
    unknown = np.setdiff1d(np.arange(len(names)), actuated)

    def sense(q):
        z = robot.configuration(q)
        D = robot.constraint_D_z(z[np.isfinite(z).all(-1)])
        return np.sign(np.linalg.det(D[..., unknown]))

    found = sense(coordinates(robot, 5000, wide=5.0))
    assert 200 < len(found) < 5000
    assert (found == sense(np.array(robot.reference.q)[None])).all()


def test_loop_derivatives_match_finite_differences(robot):
    q = coordinates(robot, 20)
    qd, qdd = np.random.default_rng(1).normal(size=(2, *q.shape))
    for name in ("chain", "passive", "configuration"):
        slope = difference(robot.functions[name], q) if name in robot.functions else None
        if slope is not None:
            np.testing.assert_allclose(robot.functions[f"{name}_D_q"](q), slope, atol=1e-7)
    D, J, H = robot.chain_D_q(q), robot.jacobian_mixed(q), robot.hessian_mixed(q)
    D_dot = np.einsum("nijk,nk->nij", difference(robot.chain_D_q, q), qd)
    np.testing.assert_allclose(robot.chain_rates(q, qd), np.einsum("nij,nj->ni", D, qd), atol=1e-12)
    expected = np.einsum("nij,nj->ni", D, qdd) + np.einsum("nij,nj->ni", D_dot, qd)
    np.testing.assert_allclose(robot.chain_accelerations(q, qd, qdd), expected, atol=2e-6)
    np.testing.assert_allclose(J[:, :3], difference(lambda x: robot.fk(x)[:, :3, 3], q), atol=1e-7)
    np.testing.assert_allclose(H, difference(robot.jacobian_mixed, q), atol=2e-6)
    J_dot = np.einsum("nijk,nk->nij", H, qd)
    np.testing.assert_allclose(robot.jacobian_mixed_dot(q, qd), J_dot, atol=1e-10)
    of_body = np.einsum("nijk,nk->nij", difference(_of_body(robot), q), qd)
    np.testing.assert_allclose(robot.jacobian_body_dot(q, qd), of_body, atol=2e-6)
    V, A = robot.twist_mixed(q, qd), robot.acceleration_mixed(q, qd, qdd)
    np.testing.assert_allclose(V, np.einsum("nij,nj->ni", J, qd), atol=1e-12)
    expected = np.einsum("nij,nj->ni", J, qdd) + np.einsum("nij,nj->ni", J_dot, qd)
    np.testing.assert_allclose(A, expected, atol=1e-10)
    T, both = robot.fk_jacobian_mixed(q)
    np.testing.assert_array_equal(T, robot.fk(q))
    np.testing.assert_array_equal(both, J)
    np.testing.assert_allclose(robot.link_poses(q)[:, -1], T, atol=1e-12)


def _of_body(robot):
    def J(q):
        R = np.swapaxes(robot.fk(q)[:, :3, :3], -1, -2)
        mixed = robot.jacobian_mixed(q)
        return np.concatenate([R @ mixed[:, :3], R @ mixed[:, 3:]], axis=1)

    return J


def test_follow_from_seed_matches_direct_solution(robot):
    q = coordinates(robot, 200)
    z = robot.configuration(q)
    near = q + np.random.default_rng(2).normal(scale=1e-3, size=q.shape)
    found = robot.solve_loops(near, z_seed=z)
    assert found.valid.all()
    np.testing.assert_allclose(found.z, robot.configuration(near), atol=1e-11)
    T, again = robot.fk_near(near, z)
    np.testing.assert_allclose(T, robot.fk(near), atol=1e-11)
    np.testing.assert_array_equal(again, found.z)
    path = np.linspace(q[0], q[1], 40)
    walked = robot.solve_loops_along(path)
    np.testing.assert_allclose(walked.z[-1], z[1], atol=1e-11)
    assert walked.valid.all()
    assert not robot.solve_loops(q[0], z_seed=z[0] + 5.0).valid


def unreachable(robot):
    """Return coordinates at which the first leg cannot reach the platform."""
    return np.array(robot.reference.q) + 2.5 * np.eye(robot.n)[0]


def test_unreachable_coordinates_are_invalid_or_raise(robot):
    far = unreachable(robot)
    q = np.stack([far, robot.reference.q, np.full(robot.n, np.nan)])
    found = robot.solve_loops(q)
    np.testing.assert_array_equal(found.valid, [False, True, False])
    assert found.n_failed == 2
    np.testing.assert_array_equal(np.isnan(found.z).all(-1), [True, False, True])
    np.testing.assert_array_equal(robot.loops_close(q), [False, True, False])
    np.testing.assert_array_equal(np.isnan(robot.fk(q)).any((-2, -1)), [True, False, True])
    with pytest.raises(chasles.OutOfReachError, match=r"fk: .* does not close at .*singularity"):
        robot.fk(far)
    out = np.zeros(len(robot.chain_joints))
    with pytest.raises(chasles.OutOfReachError):
        robot.chain(far, out=out)
    assert np.isnan(out).all()
    assert np.isnan(robot.chain(q[2])).all()


def test_newton_functions_accept_batches_out_and_pickle(robot):
    q = coordinates(robot, 4).reshape(2, 2, -1)
    out = np.empty((2, 2, 4, 4))
    assert robot.fk(q, out=out, threads="all") is out
    np.testing.assert_array_equal(out, robot.fk(q=q))
    np.testing.assert_array_equal(robot.fk(q[0, 0].tolist()), out[0, 0])
    assert robot.fk(q[:0]).shape == (0, 2, 4, 4)
    assert list(robot.fk.__signature__.parameters) == ["q", "out", "threads"]
    assert robot.functions["fk"] is robot.fk
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(robot.fk))(q), out)
    assert pickle.loads(pickle.dumps(robot)) == robot


def test_margin_is_zero_at_a_singularity(robot):
    # The margin is proportional to the square root of the distance to the singularity.
    near, far = np.array(robot.reference.q), unreachable(robot)
    assert robot.margin(near)[0] == pytest.approx(1.0, abs=1e-4)
    for _ in range(60):
        middle = (near + far) / 2
        near, far = (middle, far) if robot.loops_close(middle) else (near, middle)
    assert robot.margin(near)[0] < 1e-3


def test_casadi_agrees_with_runtime_values_and_jacobian(robot):
    ca = pytest.importorskip("casadi")
    q = coordinates(robot, 10)
    fk = casadi_function(robot.folder, "fk")
    for row in q:
        np.testing.assert_allclose(np.array(fk(row)), robot.fk(row), atol=1e-11)
    x = ca.MX.sym("q", robot.n)
    J = ca.Function("J", [x], [ca.jacobian(fk(x)[:3, 3], x)])
    np.testing.assert_allclose(np.array(J(q[0])), robot.jacobian_mixed(q[0])[:3], atol=1e-9)
    z = casadi_function(robot.folder, "configuration")
    np.testing.assert_allclose(np.array(z(q[1])).ravel(), robot.configuration(q[1]), atol=1e-11)
    assert np.isnan(np.array(fk(unreachable(robot)))).any()
