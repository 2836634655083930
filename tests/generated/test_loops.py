"""Robots with loops in closed form: closed, and right against oracles that are not the compiler's.

The oracles are the bodies' placements in NumPy with Newton's iteration, complex steps and the
implicit function theorem (closures), automatic differentiation of the CasADi functions, and
differences.
"""

import zlib
from contextlib import suppress
from functools import cache, partial

import casadi as ca
import numpy as np
import pytest
from closures import TINY, model, wrapped
from derivations import GENERATED, ROBOTS, kernels
from tolerances import DERIVATIVES

import chasles
from chasles.derive import casadi_function, derive, load
from chasles.derive.terms.casadi_graph import lower

NAMES = [
    "four_bar",
    "slider_crank",
    "five_bar",
    "well_manipulator",
    "board_installer",
    "excavator",
    "delta",
    "bricklaying_gantry",
]
LOOPED = NAMES[:-1]
INVERTIBLE = ["slider_crank", "five_bar", "excavator", "delta"]
"""Those of which the actuators, too, are held by a loop that can be at a dead point."""
CLOSED = 1e-12
HELD = 0.02
"""Loops are compared with Newton's method where their Jacobian is this far from singular."""
SAME = 1e-11
DIFFERENCES = 1e-7
STEP = 2e-6


@cache
def robot(name):
    return chasles.load(name)


def bounds(name):
    r = robot(name)
    return np.where(np.isinf(r.lower), -np.pi, r.lower), np.where(np.isinf(r.upper), np.pi, r.upper)


def random_q(name, n, seed=0, wider=0.0):
    """Coordinates within limits, or wider by so many times their range."""
    lower, upper = bounds(name)
    span = wider * (upper - lower)
    generator = np.random.default_rng([seed, zlib.crc32(name.encode())])
    return generator.uniform(lower - span, upper + span, (n, len(lower)))


def random_rates(name, n, seed=1):
    return np.random.default_rng(seed).uniform(-1, 1, (n, robot(name).n))


def held(name, z):
    """Which configurations are far from dead points."""
    m = model(name)
    if not m.mechanism.closers:
        return np.ones(len(z), dtype=bool)
    return np.linalg.svd(m.D_z(z)[..., m.unknown], compute_uv=False)[:, -1] > HELD


def far_from_dead_points(name, n, seed=0):
    """Coordinates within limits and configurations that are well held."""
    q = random_q(name, n, seed)
    z = robot(name).configuration(q)
    keep = held(name, z)
    assert keep.mean() > 0.5
    return q[keep], z[keep]


# --- positions ---


@pytest.mark.parametrize("name", NAMES)
def test_loops_close_everywhere_within_limits(name):
    q, m = random_q(name, 10_000), model(name)
    z = robot(name).configuration(q)
    assert np.isfinite(z).all()
    assert m.gap(z).max() < CLOSED
    if name in LOOPED:
        assert np.abs(robot(name).constraint(z)).max() < CLOSED
        assert robot(name).valid(q).all()
    assert np.abs(z[:, m.actuated] - q * m.ratio).max() < CLOSED


@pytest.mark.parametrize("name", NAMES)
def test_the_tool_and_the_links_are_where_the_bodies_are(name):
    q, m = random_q(name, 1000), model(name)
    z = robot(name).configuration(q)
    np.testing.assert_allclose(robot(name).fk(q), m.tip(z), atol=CLOSED)
    poses = m.poses(z)
    chain = [joint.link for joint in m.mechanism.way(m.mechanism.tool_body)]
    expected = np.stack([poses[link] for link in chain], 1)
    np.testing.assert_allclose(robot(name).link_poses(q), expected, atol=CLOSED)


@pytest.mark.parametrize("name", NAMES)
def test_chain_and_passive_are_parts_of_the_configuration(name):
    q, m = random_q(name, 1000), model(name)
    z = robot(name).configuration(q)
    np.testing.assert_allclose(robot(name).chain(q), z[:, m.chain], atol=1e-14)
    assert bool(m.passive) == ("passive" in robot(name).functions)
    if m.passive:
        np.testing.assert_allclose(robot(name).passive(q), z[:, m.passive], atol=1e-14)


@pytest.mark.parametrize("name", LOOPED)
def test_newton_on_the_full_loops_comes_to_the_same(name):
    _, z = far_from_dead_points(name, 500)
    m = model(name)
    start = z.copy()
    start[:, m.unknown] += np.random.default_rng(3).uniform(-0.01, 0.01, (len(z), len(m.unknown)))
    found = m.newton(start, m.actuated)
    assert m.gap(found).max() < CLOSED
    assert np.abs(found - z).max() < SAME


@pytest.mark.parametrize("name", LOOPED)
def test_the_branch_stays_from_the_reference_on(name):
    """Newton's method, in small steps from the reference, never leaves what was derived."""
    m, r = model(name), robot(name)
    z = np.array([r.reference.z])
    goals = random_q(name, 6, seed=5)
    z = np.repeat(z, len(goals), 0)
    start = np.array(r.reference.q)
    for part in np.linspace(0, 1, 41):
        z[:, m.actuated] = (start + part * (goals - start)) * m.ratio
        z = m.newton(z, m.actuated)
    difference = z - r.configuration(goals)
    lengths = [k for k, name in enumerate(m.names) if k in m.actuated]
    difference = np.where(np.isin(np.arange(z.shape[1]), lengths), difference, wrapped(difference))
    assert np.abs(difference).max() < 1e-9


# --- first derivatives ---


def relative(found, expected):
    """Largest difference, as a part of the larger of 1 and the largest entry of its row."""
    axes = tuple(range(1, expected.ndim))
    size = np.maximum(1.0, np.abs(expected).max(axes, keepdims=True))
    return float((np.abs(found - expected) / size).max())


@pytest.mark.parametrize("name", NAMES)
def test_derivatives_by_the_implicit_function_theorem(name):
    q, z = far_from_dead_points(name, 300)
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
    """Velocity of the tool and its angular velocity in base axes, by a complex step."""
    T = m.tip(z + TINY * 1j * rates)
    Td = T.imag / TINY
    W = Td[:, :3, :3] @ np.swapaxes(T.real[:, :3, :3], -1, -2)
    return Td[:, :3, 3], np.stack([W[:, 2, 1], W[:, 0, 2], W[:, 1, 0]], -1)


@pytest.mark.parametrize("name", NAMES)
def test_jacobians_are_those_of_the_main_chain_times_its_derivative(name):
    mechanism = load(ROBOTS / f"{name}.toml")
    kinds = ["jacobian_space", "jacobian_body", "jacobian_mixed"]
    derived = derive(mechanism.main_chain, kinds)
    q, _ = far_from_dead_points(name, 40)
    r = robot(name)
    theta, theta_D_q = r.chain(q), r.chain_D_q(q)
    for kind, kernel in zip(kinds, lower(derived.functions, "main"), strict=True):
        J = np.array([np.array(kernel(row)).reshape(6, -1) for row in theta])
        assert relative(getattr(r, kind)(q), J @ theta_D_q) < DERIVATIVES
    T, J = r.fk_jacobian_mixed(q)
    np.testing.assert_allclose(T, r.fk(q), atol=1e-14)
    np.testing.assert_allclose(J, r.jacobian_mixed(q), atol=1e-13)


# --- second derivatives, by automatic differentiation of the positions ---


def as_casadi(name, function, *symbols):
    """A generated function of symbols, whatever it needs of them."""
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
def test_second_derivatives_by_automatic_differentiation(name):
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
def test_derivatives_against_differences(name):
    r = robot(name)
    q, _ = far_from_dead_points(name, 60, seed=11)
    qd, qdd = random_rates(name, len(q), 12), random_rates(name, len(q), 13)

    def along(function, *rates):
        """The rate of a function of q (and qd) along the motion."""
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
def test_the_constraints_derivatives(name):
    """At any configuration, closed or not, and with a null space that is the motion."""
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


# --- from the chain back to the actuators ---


@pytest.mark.parametrize("name", NAMES)
def test_actuators_come_back(name):
    r = robot(name)
    q, _ = far_from_dead_points(name, 2000, seed=21)
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
    """Differences of coordinates, angles between -pi and pi."""
    turning = np.array([c.kind == "revolute" for c in model(name).mechanism.coordinates])
    turning &= name != "bricklaying_gantry"
    return np.where(turning, wrapped(difference), difference)


def on_the_branch(name, q, back):
    """Where the actuators of a chain are on the reference's branch and off their dead point."""
    r = robot(name)
    if name not in INVERTIBLE:
        return np.ones(len(q), dtype=bool)
    far = (r.actuator_margin(r.chain(q)) > 1e-3).all(-1)
    if name == "slider_crank":
        # Half of the circle has the slider at the same places.
        far &= np.sin(q[:, 0]) * np.sin(r.reference.q[0]) > 0
    return far


@pytest.mark.parametrize("name", [n for n in NAMES if n != "bricklaying_gantry"])
def test_actuators_against_differences(name):
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
    """The derivative at 0 by differences that are good to the fourth order."""
    near = function(step) - function(-step)
    far = function(2 * step) - function(-2 * step)
    return (8 * near - far) / (12 * step)


# --- one pose, many poses, CasADi ---


def arguments(name, function, n):
    """Inputs of a function at closed configurations of the robot."""
    r, m = robot(name), model(name)
    q, z = far_from_dead_points(name, n, seed=31)
    q, z = q[on_the_branch(name, q, q)], z[on_the_branch(name, q, q)]
    rates, faster = random_rates(name, len(q), 32), random_rates(name, len(q), 33)
    given = {"q": q, "qd": rates, "qdd": faster, "theta": z[:, m.chain], "z": z}
    given["thetad"] = r.chain_rates(q, rates)
    given["thetadd"] = r.chain_accelerations(q, rates, faster)
    given["zd"] = (m.z_D_q(z) @ rates[..., None])[..., 0]
    return [given[argument.name] for argument in function.inputs]


@pytest.mark.parametrize("name", NAMES)
def test_one_pose_a_batch_and_casadi_are_the_same(name):
    r, checked = robot(name), 0
    for key, function in r.functions.items():
        if function.solutions:
            continue
        inputs = arguments(name, function, 150)
        batch = function(*inputs)
        outputs = batch if isinstance(batch, tuple) else (batch,)
        assert len(inputs[0]) > 40
        singles = [function(*row) for row in zip(*inputs, strict=True)]
        singles = [s if isinstance(s, tuple) else (s,) for s in singles]
        for k, output in enumerate(outputs):
            single = np.stack([row[k] for row in singles])
            np.testing.assert_array_equal(np.isnan(single), np.isnan(output), err_msg=key)
            assert relative(np.nan_to_num(single), np.nan_to_num(output)) < DERIVATIVES, key
        kept = kernels(name)[key]
        for j in range(0, len(inputs[0]), 7):
            found = kept.call([x[j] for x in inputs])
            for output, value in zip(outputs, found, strict=True):
                expected = np.array(value).reshape(output[j].shape)
                np.testing.assert_array_equal(np.isnan(output[j]), np.isnan(expected), key)
                there = np.nan_to_num(output[j])[None], np.nan_to_num(expected)[None]
                assert relative(*there) < DERIVATIVES, key
            checked += 1
    assert checked > 6 * len(r.functions)


@pytest.mark.parametrize("name", NAMES)
def test_maps_by_automatic_differentiation(name):
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


# --- out of reach ---


@pytest.mark.parametrize("name", LOOPED)
def test_far_outside_the_limits_no_number_is_wrong(name):
    r, m = robot(name), model(name)
    q = random_q(name, 20_000, seed=41, wider=2.0)
    z, valid, margin = r.configuration(q), r.valid(q), r.margin(q)
    finite = np.isfinite(z).all(-1)
    np.testing.assert_array_equal(finite, valid)
    # A step behind one that does not close has no margin.
    assert (finite == (np.nan_to_num(margin, nan=-1.0) >= 0).all(-1)).all()
    # Grashof's crank turns all round, and so do the slider-crank's and the five-bar's.
    assert (~valid).any() == (name not in ("four_bar", "slider_crank", "five_bar"))
    assert m.gap(z[finite]).max() < 1e-9
    for function in ("fk", "chain", "jacobian_mixed", "chain_D_q"):
        found = getattr(r, function)(q)
        found = found.reshape(len(q), -1)
        assert np.isfinite(found[valid & (margin > 1e-9).all(-1)]).all()
        if function == "chain":
            assert np.isnan(found[~valid]).any(-1).all()


@pytest.mark.parametrize("name", LOOPED)
def test_the_tool_is_where_it_is_or_not_a_number(name):
    r, m = robot(name), model(name)
    q = random_q(name, 20_000, seed=42, wider=2.0)
    T = r.fk(q)
    finite = np.isfinite(T).all((-2, -1))
    closed = r.valid(q)
    np.testing.assert_allclose(T[closed], m.tip(r.configuration(q[closed])), atol=1e-9)
    # What needs no solution of the loops may be known all the same.
    assert not (finite & ~closed).any()


def random_chains(name, n, seed):
    """Joints of the main chain around the reference's, far out of reach too."""
    r = robot(name)
    start = r.chain(r.reference.q)
    turning = np.array([joint.kind == "revolute" for joint in r.chain_joints])
    # A delta's platform keeps its orientation.
    reach = np.where(turning, 0.0 if name == "delta" else 3.0, 1.0)
    return start + np.random.default_rng(seed).uniform(-reach, reach, (n, len(start)))


def reaches(r, theta):
    """Whether actuators can hold the chain at some joints, on whichever branch."""
    margin = r.actuator_margin(theta)
    return (np.isfinite(margin) & (margin >= 0)).all(-1)


@pytest.mark.parametrize("name", INVERTIBLE)
def test_chains_out_of_the_actuators_reach(name):
    r, m = robot(name), model(name)
    theta = random_chains(name, 20_000, 43)
    q, reached, margin = r.actuators(theta), reaches(r, theta), r.actuator_margin(theta)
    np.testing.assert_array_equal(np.isfinite(q).all(-1), reached)
    assert 0.01 < reached.mean() < 0.999
    assert (margin[reached] <= 1 + 1e-12).all()
    # On whichever branch of the chain.
    np.testing.assert_array_equal(r.actuators_valid(theta), reached)
    z = np.zeros((reached.sum(), len(m.names)))
    z[:, m.chain], z[:, m.actuated] = theta[reached], q[reached]
    known = sorted({*m.chain, *m.actuated})
    assert closest(m, z[:200], known).max() < 1e-9


BROKEN = {
    ("well_manipulator", 1, 1.4): "cylinder_1",
    ("well_manipulator", 2, 0.3): "cylinder_2",
    ("well_manipulator", 4, 1.2): "cylinder_3",
    ("well_manipulator", 6, 1.1): "cylinder_4",
    ("board_installer", 1, -0.4): "rod_KH",
    ("board_installer", 4, 0.2): "push_rod",
    ("excavator", 1, 3.5): "boom_cylinder",
    ("excavator", 2, -1.5): "stick_cylinder",
    ("excavator", 3, 2.0): "bucket_cylinder",
    ("delta", 0, -1.5): "rod_1_left and",
}


@pytest.mark.parametrize(("name", "k", "value"), BROKEN)
def test_the_loop_that_does_not_close_is_named(name, k, value):
    r = robot(name)
    q = np.array(r.reference.q)
    r.chain(q)
    q[k] = value
    if name == "delta":
        q[1:] = 2.7, 1.7
    assert np.isnan(r.chain(q[None])).any()
    assert not r.valid(q[None])[0]
    for function in (r.chain, r.configuration, r.chain_D_q):
        with pytest.raises(chasles.OutOfReachError, match=BROKEN[name, k, value]) as caught:
            function(q)
        assert f"{r.coordinates[k].name} = {value:.6g}" in str(caught.value)
        assert "does not close" in str(caught.value)


# --- dead points ---


def crossing(closes, start, goals):
    """Where straight ways from a start leave what closes: neighbours inside and outside."""
    inside, outside = np.zeros(len(goals)), np.ones(len(goals))
    parts = np.linspace(0, 1, 400)
    way = start + parts[:, None, None] * (goals - start)
    open_ = ~closes(way)
    first = np.argmax(open_, axis=0)
    assert (first > 0).all()
    inside, outside = parts[first - 1], parts[first]
    for _ in range(60):
        middle = (inside + outside) / 2
        good = closes(start + middle[:, None] * (goals - start))
        inside, outside = np.where(good, middle, inside), np.where(good, outside, middle)
    return inside, outside


def check_dead_points(start, goals, closes, margin, values, slopes):
    inside, outside = crossing(closes, start, goals)
    at = lambda part: start + part[:, None] * (goals - start)  # noqa: E731
    beyond = margin(at(outside))
    step = np.nanargmin(np.where(beyond < 0, beyond, np.inf), axis=1)
    rows = np.arange(len(goals))
    near = np.array([1e-3, 1e-5, 1e-7])
    margins = np.stack([margin(at(inside - s))[rows, step] for s in near])
    assert (margins > 0).all()
    # Linear in what is left of the way, up to the dead point and through it.
    ratio = margins / near[:, None]
    assert np.abs(ratio[2] / ratio[1] - 1).max() < 0.02
    past = margin(at(outside + 1e-7))[rows, step]
    assert np.abs(past / margins[2] + 1).max() < 0.02
    assert (np.abs(margin(at(inside))[rows, step]) < 1e-9).all()
    # Positions go on to the end, rates grow with the inverse root of the margin.
    assert np.isfinite(values(at(inside - 1e-12))).all()
    rates = [np.abs(slopes(at(inside - s))).reshape(len(goals), -1).max(-1) for s in (1e-8, 1e-10)]
    assert np.abs(rates[1] / rates[0] / 10 - 1).max() < 0.2
    assert np.isnan(values(at(outside + 1e-9))).any(-1).all()
    for point in at(inside):
        # Rounding decides whether the loop just closes there.
        with suppress(chasles.OutOfReachError):
            assert np.abs(slopes(point)).max() > 1e5


@pytest.mark.parametrize("name", ["well_manipulator", "board_installer", "excavator", "delta"])
def test_dead_points_of_the_chain(name):
    r = robot(name)
    goals = random_q(name, 5000, seed=51, wider=2.0)
    goals = goals[~r.valid(goals)][:40]
    assert len(goals) > 10
    start = np.array(r.reference.q)
    check_dead_points(start, goals, r.valid, r.margin, r.chain, r.chain_D_q)


@pytest.mark.parametrize("name", INVERTIBLE)
def test_dead_points_of_the_actuators(name):
    r = robot(name)
    start = r.chain(r.reference.q)
    goals = random_chains(name, 20_000, 52)
    goals = goals[~reaches(r, goals)][:40]
    assert len(goals) > 10
    closes = partial(reaches, r)
    check_dead_points(start, goals, closes, r.actuator_margin, r.actuators, r.actuators_D_chain)
    for theta in goals[:5]:
        with pytest.raises(chasles.OutOfReachError, match=r"does not close at \w+ = "):
            r.actuators(theta)


# --- all branches ---


@pytest.mark.parametrize("name", LOOPED)
def test_every_branch_closes_and_the_reference_s_is_first(name):
    r, m = robot(name), model(name)
    q = random_q(name, 20, seed=61)
    theta, valid, margin = r.chain_branches(q)
    np.testing.assert_allclose(theta[:, 0], r.chain(q), atol=CLOSED)
    assert valid[:, 0].all()
    assert (np.isfinite(theta).all(-1) == valid).all()
    row, slot = np.nonzero(valid)
    z = np.zeros((len(row), len(m.names)))
    z[:, m.chain] = theta[row, slot]
    z[:, m.actuated] = q[row] * m.ratio
    assert closest(m, z, sorted({*m.chain, *m.actuated})).max() < CLOSED
    for branches in theta:
        good = branches[np.isfinite(branches).all(-1)]
        apart = np.abs(wrapped(good[:, None] - good[None])).max(-1) + np.eye(len(good))
        # Branches of passive joints alone have the same chain.
        assert apart.min() > 1e-6 or name in ("excavator", "board_installer")
    assert margin.shape[:2] == valid.shape


def closest(m, z, known):
    """What is left of the loops in the best of many starts for the other joints."""
    if len(known) == len(m.names):
        return m.gap(z)
    free = [k for k in range(len(m.names)) if k not in known]
    generator, best = np.random.default_rng(62), np.full(len(z), np.inf)
    for _ in range(25):
        left = np.flatnonzero(best > CLOSED)
        start = z[left]
        start[:, free] = generator.uniform(-np.pi, np.pi, (len(left), len(free)))
        best[left] = np.minimum(best[left], m.gap(m.newton(start, known)))
    return best


@pytest.mark.parametrize("name", INVERTIBLE)
def test_every_branch_of_the_actuators_closes(name):
    r, m = robot(name), model(name)
    q, z = far_from_dead_points(name, 15, seed=63)
    theta = z[:, m.chain]
    found, valid, _ = r.actuator_branches(theta)
    np.testing.assert_allclose(found[:, 0], r.actuators(theta), atol=CLOSED)
    row, slot = np.nonzero(valid)
    assert len(row) > len(q)
    z = z[row]
    z[:, m.actuated] = found[row, slot]
    assert closest(m, z, sorted({*m.chain, *m.actuated})).max() < CLOSED


def roots(f, points=20_001):
    """Zeros of f over a turn, by sign changes and bisection."""
    x = np.linspace(-np.pi, np.pi, points)
    y = f(x)
    found = []
    for k in np.flatnonzero(np.sign(y[:-1]) != np.sign(y[1:])):
        low, high, sign = x[k], x[k + 1], np.sign(y[k])
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if np.sign(f(middle)[()]) == sign else (low, middle)
        found.append((low + high) / 2)
    return np.array(found)


def left_over(name, known):
    """What is left of a loop as a function of its one unknown, by complex numbers alone."""
    e = lambda angle: np.exp(1j * angle)  # noqa: E731
    return {
        "four_bar": lambda x: abs(0.1 * e(known) + 0.3 * e(known + x) - 0.35) - 0.25,
        "five_bar": lambda x: (
            abs(-0.1 + 0.2 * e(known[0]) + 0.3 * e(known[0] + x) - 0.1 - 0.2 * e(known[1])) - 0.3
        ),
        # The slider is within half a metre, which makes it a sine here.
        "slider_crank": lambda x: abs(0.5 * np.sin(x / 2) - 0.05 * e(known)) - 0.18,
    }[name]


@pytest.mark.parametrize("name", ["four_bar", "five_bar", "slider_crank"])
def test_no_configuration_of_the_chain_is_missed(name):
    r = robot(name)
    q = np.random.default_rng(64).uniform(-np.pi, np.pi, (60, r.n))
    theta, valid, _ = r.chain_branches(q)
    counts = []
    for row, branches, good in zip(q, theta, valid, strict=True):
        scanned = roots(left_over(name, row if name == "five_bar" else row[0]))
        if name == "slider_crank":
            scanned = 0.5 * np.sin(scanned / 2)
        np.testing.assert_allclose(np.sort(branches[good][:, -1]), np.sort(scanned), atol=1e-9)
        counts.append(len(scanned))
    assert set(counts) == {2}


@pytest.mark.parametrize("name", ["five_bar", "slider_crank"])
def test_no_actuators_are_missed(name):
    r = robot(name)
    generator = np.random.default_rng(65)
    if name == "five_bar":
        theta = generator.uniform(-np.pi, np.pi, (60, 2))
    else:
        theta = generator.uniform(-0.3, 0.3, (60, 1))
    q, valid, _ = r.actuator_branches(theta)
    counts = []
    for row, branches, good in zip(theta, q, valid, strict=True):
        if name == "five_bar":
            tip = -0.1 + 0.2 * np.exp(1j * row[0]) + 0.3 * np.exp(1j * row.sum())
            scanned = roots(lambda x, tip=tip: abs(tip - 0.1 - 0.2 * np.exp(1j * x)) - 0.3)
        else:
            scanned = roots(lambda x, row=row: abs(row[0] - 0.05 * np.exp(1j * x)) - 0.18)
        np.testing.assert_allclose(np.sort(branches[good][:, -1]), np.sort(scanned), atol=1e-9)
        counts.append(len(scanned))
    assert set(counts) == {0, 2}
