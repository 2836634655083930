"""Robots with closed-form loops agree with independent oracles.

The oracles are Newton's method on body poses computed by NumPy, automatic differentiation, and
finite differences. The derivatives of closures are compared with complex-step derivatives and the
implicit function theorem.
"""

from functools import cache

import casadi as ca
import numpy as np
import pytest

from chasles.derive import casadi_function, derive, read
from chasles.derive.terms.casadi_graph import lower
from tests.support.derivations import GENERATED, ROBOTS, kernels
from tests.support.loops.closures import TINY, model, wrapped
from tests.support.loops.loop_robots import (
    CLOSED,
    DIFFERENCES,
    INVERTIBLE,
    LOOPED,
    NAMES,
    SAME,
    STEP,
    far_from_dead_points,
    random_q,
    random_rates,
    robot,
)
from tests.support.tolerances import DERIVATIVES

# --- positions ---


@pytest.mark.parametrize("name", NAMES)
def test_loops_close_everywhere_within_limits(name):
    q, m = random_q(name, 2000), model(name)
    z = robot(name).configuration(q)
    assert np.isfinite(z).all()
    assert m.gap(z).max() < CLOSED
    if name in LOOPED:
        assert np.abs(robot(name).constraint(z)).max() < CLOSED
        assert robot(name).loops_close(q).all()
    assert np.abs(z[:, m.actuated] - q * m.ratio).max() < CLOSED


@pytest.mark.parametrize("name", NAMES)
def test_fk_and_link_poses_match_independent_model(name):
    q, m = random_q(name, 200), model(name)
    z = robot(name).configuration(q)
    np.testing.assert_allclose(robot(name).fk(q), m.tip(z), atol=CLOSED)
    poses = m.poses(z)
    chain = [joint.link for joint in m.mechanism.path_to(m.mechanism.tool_body)]
    expected = np.stack([poses[link] for link in chain], 1)
    np.testing.assert_allclose(robot(name).link_poses(q), expected, atol=CLOSED)


@pytest.mark.parametrize("name", NAMES)
def test_chain_and_passive_are_parts_of_the_configuration(name):
    q, m = random_q(name, 200), model(name)
    z = robot(name).configuration(q)
    np.testing.assert_allclose(robot(name).chain(q), z[:, m.chain], atol=1e-14)
    assert bool(m.passive) == ("passive" in robot(name).functions)
    if m.passive:
        np.testing.assert_allclose(robot(name).passive(q), z[:, m.passive], atol=1e-14)
    r = robot(name)
    names = [variable.name for variable in r.configuration_variables]
    assert {variable.name for variable in r.passive_joints} <= {*names}


@pytest.mark.parametrize("name", LOOPED)
def test_independent_newton_converges_to_configuration(name):
    _, z = far_from_dead_points(name, 40)
    m = model(name)
    start = z.copy()
    start[:, m.unknown] += np.random.default_rng(3).uniform(-0.01, 0.01, (len(z), len(m.unknown)))
    found = m.newton(start, m.actuated)
    assert m.gap(found).max() < CLOSED
    assert np.abs(found - z).max() < SAME


@pytest.mark.parametrize("name", LOOPED)
def test_configuration_stays_on_reference_branch(name):
    """The oracle is Newton's method in small steps from the reference."""
    m, r = model(name), robot(name)
    z = np.array([r.reference.z])
    goals = random_q(name, 3, seed=5)
    z = np.repeat(z, len(goals), 0)
    start = np.array(r.reference.q)
    for part in np.linspace(0, 1, 13):
        z[:, m.actuated] = (start + part * (goals - start)) * m.ratio
        z = m.newton(z, m.actuated)
    difference = z - r.configuration(goals)
    lengths = [k for k, name in enumerate(m.names) if k in m.actuated]
    difference = np.where(np.isin(np.arange(z.shape[1]), lengths), difference, wrapped(difference))
    assert np.abs(difference).max() < 1e-9


# --- first derivatives of positions ---


def relative(found, expected):
    """Return the largest relative difference between two arrays.

    Each difference is divided by the largest expected entry of its row, or by 1 if all entries are
    smaller.
    """
    axes = tuple(range(1, expected.ndim))
    size = np.maximum(1.0, np.abs(expected).max(axes, keepdims=True))
    return float((np.abs(found - expected) / size).max())


@pytest.mark.parametrize("name", NAMES)
def test_derivatives_match_implicit_function_theorem(name):
    q, z = far_from_dead_points(name, 60)
    m, r = model(name), robot(name)
    z_D_q = m.z_D_q(z)
    assert relative(r.chain_D_q(q), z_D_q[:, m.chain]) < SAME
    if m.passive:
        assert relative(r.passive_D_q(q), z_D_q[:, m.passive]) < SAME
    qd = random_rates(name, len(q))
    rates = (z_D_q @ qd[..., None])[..., 0]
    assert relative(r.chain_rates(q, qd), rates[:, m.chain]) < SAME
    v, omega = tip_rates(m, z, rates)
    assert relative(r.twist_mixed(q, qd), np.concatenate([v, omega], -1)) < SAME


def tip_rates(m, z, rates):
    """Compute the tool twist in base axes by a complex step."""
    T = m.tip(z + TINY * 1j * rates)
    Td = T.imag / TINY
    W = Td[:, :3, :3] @ np.swapaxes(T.real[:, :3, :3], -1, -2)
    return Td[:, :3, 3], np.stack([W[:, 2, 1], W[:, 0, 2], W[:, 1, 0]], -1)


@pytest.mark.parametrize("name", NAMES)
def test_kinematics_equal_the_main_chain_derived_as_a_serial_robot(name):
    """Poses are equal."""
    mechanism = read(ROBOTS / f"{name}.toml")
    kinds = ["jacobian_space", "jacobian_body", "jacobian_mixed"]
    derived = derive(mechanism.main_chain, functions=["fk", *kinds])
    q, _ = far_from_dead_points(name, 40)
    r = robot(name)
    theta, theta_D_q = r.chain(q), r.chain_D_q(q)
    fk, *jacobians = lower(derived.functions, "main")
    poses = np.array([np.array(fk(row)).reshape(4, 4) for row in theta])
    np.testing.assert_allclose(r.fk(q), poses, rtol=0, atol=CLOSED)
    for kind, kernel in zip(kinds, jacobians, strict=True):
        J = np.array([np.array(kernel(row)).reshape(6, -1) for row in theta])
        assert relative(getattr(r, kind)(q), J @ theta_D_q) < DERIVATIVES
    T, J = r.fk_jacobian_mixed(q)
    np.testing.assert_allclose(T, r.fk(q), atol=1e-14)
    np.testing.assert_allclose(J, r.jacobian_mixed(q), atol=1e-13)


# --- second derivatives, by automatic differentiation of the positions ---


def as_casadi(name, function, *symbols):
    """Call a generated CasADi function with those of the symbols q, qd and qdd that it needs."""
    kept = casadi_function(GENERATED / name, function)
    given = dict(zip(["q", "qd", "qdd"], symbols, strict=False))
    return kept(**{key: given[key] for key in kept.name_in()})[function]


def mixed_jacobian(name, q):
    T = as_casadi(name, "fk", q)
    columns = []
    for k in range(q.numel()):
        T_D_qk = ca.reshape(ca.jacobian(ca.vec(T), q[k]), 4, 4)
        omega = ca.inv_skew(T_D_qk[:3, :3] @ T[:3, :3].T)
        columns.append(ca.vertcat(T_D_qk[:3, 3], omega))
    return T, ca.horzcat(*columns)


@pytest.mark.parametrize("name", NAMES)
def test_second_derivatives_match_automatic_differentiation(name):
    r, n = robot(name), robot(name).n
    q, qd, qdd = (ca.SX.sym(s, n) for s in ("q", "qd", "qdd"))
    theta = as_casadi(name, "chain", q)
    theta_d = ca.jtimes(theta, q, qd)
    theta_dd = ca.jtimes(theta_d, ca.vertcat(q, qd), ca.vertcat(qd, qdd))
    T, J = mixed_jacobian(name, q)
    R, p = T[:3, :3], T[:3, 3]
    to_space = ca.blockcat([[ca.SX.eye(3), ca.skew(p)], [ca.SX(3, 3), ca.SX.eye(3)]])
    to_body = ca.diagcat(R.T, R.T)
    outputs = [theta_d, theta_dd, ca.jacobian(theta, q)]
    frames = {"space": to_space, "body": to_body, "mixed": ca.SX.eye(6)}
    for change in frames.values():
        J_frame = change @ J
        J_dot = ca.reshape(ca.jtimes(ca.vec(J_frame), q, qd), 6, n)
        outputs += [J_frame, J_dot, J_frame @ qd, J_dot @ qd + J_frame @ qdd]
    outputs.append(ca.jacobian(ca.vec(J), q))
    oracle = ca.Function("oracle", [q, qd, qdd], outputs)
    x, _ = far_from_dead_points(name, 40, seed=7)
    xd, xdd = random_rates(name, len(x), 8), random_rates(name, len(x), 9)
    rows = [oracle(*row) for row in zip(x, xd, xdd, strict=True)]
    expected = [np.stack([np.array(row[k]) for row in rows]) for k in range(len(outputs))]
    assert relative(r.chain_rates(x, xd), expected[0][..., 0]) < DERIVATIVES
    assert relative(r.chain_accelerations(x, xd, xdd), expected[1][..., 0]) < SAME
    assert relative(r.chain_D_q(x), expected[2]) < DERIVATIVES
    for k, frame in enumerate(frames):
        J_frame, J_dot, twist, change = expected[3 + 4 * k : 7 + 4 * k]
        assert relative(getattr(r, f"jacobian_{frame}")(x), J_frame) < DERIVATIVES
        assert relative(getattr(r, f"jacobian_{frame}_dot")(x, xd), J_dot) < SAME
        assert relative(getattr(r, f"twist_{frame}")(x, xd), twist[..., 0]) < DERIVATIVES
        found = getattr(r, f"acceleration_{frame}")(x, xd, xdd)
        assert relative(found, change[..., 0]) < SAME
    hessian = expected[-1].reshape(len(x), n, 6, n).transpose(0, 2, 1, 3)
    assert relative(r.hessian_mixed(x), hessian) < SAME


@pytest.mark.parametrize("name", NAMES)
def test_derivatives_match_finite_differences(name):
    r = robot(name)
    q, _ = far_from_dead_points(name, 60, seed=11)
    qd, qdd = random_rates(name, len(q), 12), random_rates(name, len(q), 13)

    def along(function, *rates):
        """Return the time derivative of a function of q (and qd) along the motion."""
        there = [q + STEP * qd + STEP**2 / 2 * qdd, qd + STEP * qdd]
        back = [q - STEP * qd + STEP**2 / 2 * qdd, qd - STEP * qdd]
        count = 1 + len(rates)
        return (function(*there[:count]) - function(*back[:count])) / (2 * STEP)

    assert relative(r.chain_rates(q, qd), along(r.chain)) < DIFFERENCES
    found = r.chain_accelerations(q, qd, qdd)
    assert relative(found, along(r.chain_rates, qd)) < DIFFERENCES
    if "passive" in r.functions:
        passive = (r.passive_D_q(q) @ qd[..., None])[..., 0]
        assert relative(passive, along(r.passive)) < DIFFERENCES
    for frame in ("space", "body", "mixed"):
        J, J_dot = getattr(r, f"jacobian_{frame}"), getattr(r, f"jacobian_{frame}_dot")
        assert relative(J_dot(q, qd), along(J)) < DIFFERENCES
        twist, change = getattr(r, f"twist_{frame}"), getattr(r, f"acceleration_{frame}")
        assert relative(change(q, qd, qdd), along(twist, qd)) < DIFFERENCES
    by_rate = np.einsum("...ijk,...k->...ij", r.hessian_mixed(q), qd)
    assert relative(by_rate, along(r.jacobian_mixed)) < DIFFERENCES


@pytest.mark.parametrize("name", LOOPED)
def test_constraint_derivatives_match_finite_differences(name):
    r, m = robot(name), model(name)
    _, z = far_from_dead_points(name, 60, seed=14)
    J = r.constraint_D_z(z)
    assert np.abs(J @ m.z_D_q(z)).max() < 1e-11
    zd = np.random.default_rng(15).uniform(-1, 1, z.shape)
    open_z = z + 0.1 * zd[::-1]
    rate = (r.constraint(open_z + STEP * zd) - r.constraint(open_z - STEP * zd)) / (2 * STEP)
    found = (r.constraint_D_z(open_z) @ zd[..., None])[..., 0]
    assert relative(found, rate) < DIFFERENCES
    rate = (r.constraint_D_z(open_z + STEP * zd) - r.constraint_D_z(open_z - STEP * zd)) / (
        2 * STEP
    )
    assert relative(r.constraint_D_z_dot(open_z, zd), rate) < DIFFERENCES


# --- from the main chain back to the actuators ---


@pytest.mark.parametrize("name", NAMES)
def test_actuator_maps_invert_chain_maps(name):
    r = robot(name)
    q, _ = far_from_dead_points(name, 500, seed=21)
    theta = r.chain(q)
    back = r.actuators(theta)
    keep = on_the_branch(name, q, back)
    assert keep.mean() > 0.3
    q, theta, back = q[keep], theta[keep], back[keep]
    assert np.abs(turned(name, back - q)).max() < CLOSED
    qd, qdd = random_rates(name, len(q), 22), random_rates(name, len(q), 23)
    thetad, thetadd = r.chain_rates(q, qd), r.chain_accelerations(q, qd, qdd)
    D, D_back = r.chain_D_q(q), r.actuators_D_chain(theta)
    size = np.abs(D_back).max((-2, -1)) * np.abs(D).max((-2, -1))
    unit = np.abs(D_back @ D - np.eye(r.n)).max((-2, -1))
    assert (unit / np.maximum(size, 1)).max() < CLOSED
    scale = np.maximum(np.abs(D_back).max((-2, -1)) * np.abs(thetad).max(-1), 1)
    error = np.abs(r.actuator_rates(theta, thetad) - qd).max(-1)
    assert (error / scale).max() < CLOSED
    found = r.actuator_accelerations(theta, thetad, thetadd)
    scale = np.maximum(np.abs(D_back).max((-2, -1)) ** 3 * np.abs(thetadd).max(-1), 1)
    assert (np.abs(found - qdd).max(-1) / scale).max() < SAME


def turned(name, difference):
    """Return coordinate differences, with angle differences between -pi and pi."""
    turning = np.array([c.kind == "revolute" for c in model(name).mechanism.coordinates])
    turning &= name != "bricklaying_gantry"
    return np.where(turning, wrapped(difference), difference)


def on_the_branch(name, q, back):
    """Test whether the actuators are on the reference branch and away from dead points."""
    r = robot(name)
    if name not in INVERTIBLE:
        return np.ones(len(q), dtype=bool)
    far = (r.actuator_margin(r.chain(q)) > 1e-3).all(-1)
    if name == "slider_crank":
        # Each slider position occurs on both halves of the crank circle.
        far &= np.sin(q[:, 0]) * np.sin(r.reference.q[0]) > 0
    return far


@pytest.mark.parametrize("name", [n for n in NAMES if n != "bricklaying_gantry"])
def test_actuator_derivatives_match_finite_differences(name):
    r = robot(name)
    q, _ = far_from_dead_points(name, 60, seed=24)
    q = q[on_the_branch(name, q, q)]
    theta = r.chain(q)
    qd, qdd = random_rates(name, len(q), 25), random_rates(name, len(q), 26)
    thetad, thetadd = r.chain_rates(q, qd), r.chain_accelerations(q, qd, qdd)
    columns = np.eye(theta.shape[1])
    found = r.actuators_D_chain(theta)
    for k, e in enumerate(columns):
        difference = slope(lambda t, e=e: r.actuators(theta + t * e))
        sound = np.isfinite(difference).all(-1) & (np.abs(found).max((-2, -1)) < 30)
        assert sound.sum() > 10
        assert relative(found[sound, :, k], difference[sound]) < DIFFERENCES
    rate = slope(
        lambda t: r.actuator_rates(theta + t * thetad + t**2 / 2 * thetadd, thetad + t * thetadd)
    )
    found = r.actuator_accelerations(theta, thetad, thetadd)
    sound = np.abs(r.actuators_D_chain(theta)).max((-2, -1)) < 30
    assert relative(found[sound], rate[sound]) < DIFFERENCES


def slope(function, step=1e-4):
    """Differentiate a function at 0 by fourth-order differences."""
    near = function(step) - function(-step)
    far = function(2 * step) - function(-2 * step)
    return (8 * near - far) / (12 * step)


# --- one pose, many poses and CasADi ---

COMPARED = ["slider_crank", "five_bar", "well_manipulator", "bricklaying_gantry"]
"""Compared robots: one with a slider, one with two actuators, one with cylinders, and one without
loops."""


def arguments(name, function, n):
    """Return inputs of a function at closed configurations."""
    given = closed_states(name, n)
    return [given[argument.name] for argument in function.inputs]


@cache
def closed_states(name, n):
    """Return the arguments of all robot functions by name, at closed configurations."""
    r, m = robot(name), model(name)
    q, z = far_from_dead_points(name, n, seed=31)
    q, z = q[on_the_branch(name, q, q)], z[on_the_branch(name, q, q)]
    rates, faster = random_rates(name, len(q), 32), random_rates(name, len(q), 33)
    given = {"q": q, "qd": rates, "qdd": faster, "theta": z[:, m.chain], "z": z}
    given["thetad"] = r.chain_rates(q, rates)
    given["thetadd"] = r.chain_accelerations(q, rates, faster)
    given["zd"] = (m.z_D_q(z) @ rates[..., None])[..., 0]
    return given


@pytest.mark.parametrize("name", COMPARED)
def test_single_pose_batch_and_casadi_results_agree(name):
    r, checked = robot(name), 0
    for key, function in r.functions.items():
        if function.solutions or key not in kernels(name):
            continue
        inputs = arguments(name, function, 40)
        batch = function(*inputs)
        outputs = batch if isinstance(batch, tuple) else (batch,)
        assert len(inputs[0]) > 15
        singles = [function(*row) for row in zip(*inputs, strict=True)]
        singles = [s if isinstance(s, tuple) else (s,) for s in singles]
        for k, output in enumerate(outputs):
            single = np.stack([row[k] for row in singles])
            np.testing.assert_array_equal(np.isnan(single), np.isnan(output), err_msg=key)
            assert relative(np.nan_to_num(single), np.nan_to_num(output)) < DERIVATIVES, key
        kept = kernels(name)[key]
        for j in range(0, len(inputs[0]), len(inputs[0]) // 3):
            found = kept.call([x[j] for x in inputs])
            for output, value in zip(outputs, found, strict=True):
                expected = np.array(value).reshape(output[j].shape)
                np.testing.assert_array_equal(np.isnan(output[j]), np.isnan(expected), key)
                there = np.nan_to_num(output[j])[None], np.nan_to_num(expected)[None]
                assert relative(*there) < DERIVATIVES, key
            checked += 1
    assert checked > 2 * len(r.functions)


@pytest.mark.parametrize("name", NAMES)
def test_map_derivatives_match_automatic_differentiation(name):
    r, checked = robot(name), 0
    for key, function in r.functions.items():
        y, _, x = key.partition("_D_")
        if key not in {"passive_D_q", "chain_D_q", "actuators_D_chain", "constraint_D_z"}:
            continue
        (values,) = arguments(name, function, 150)
        symbols = ca.SX.sym(x, values.shape[1])
        position = casadi_function(GENERATED / name, y)(symbols)
        oracle = ca.Function("oracle", [symbols], [ca.jacobian(position, symbols)])
        expected = np.stack([np.array(oracle(row)) for row in values])
        assert len(values) > 40
        assert relative(function(values), expected) < DERIVATIVES, key
        checked += 1
    assert checked >= (3 if name in LOOPED else 2)
