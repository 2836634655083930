"""Platforms on legs: assembly modes, kinematics, velocities and singularities."""

from functools import cache
from itertools import product

import numpy as np
import pytest

import chasles
from tests.support.handwritten import planar
from tests.support.loops.closures import TINY, model, wrapped
from tests.support.loops.planar_scan import errors, random_q, scan
from tests.support.rate_inputs import sampling_limits

PLANAR = {"planar_3rrr": 0.13}
ITERATED = [*PLANAR, "stewart_gough"]
CLOSED = 1e-12
SAME = 1e-11
STEP = 2e-6
PIN = planar.PLATFORM * planar.DIRECTIONS[0]


@cache
def robot(name):
    return chasles.load(name)


def within(name, n, seed):
    r = robot(name)
    return np.random.default_rng(seed).uniform(*sampling_limits(r), (n, r.n))


def twists(m, z, rates):
    """Compute tool twists (N, 6) in base axes by a complex step."""
    T = m.tip(z + TINY * 1j * rates)
    Td = T.imag / TINY
    W = Td[:, :3, :3] @ np.swapaxes(T.real[:, :3, :3], -1, -2)
    return np.concatenate([Td[:, :3, 3], np.stack([W[:, 2, 1], W[:, 0, 2], W[:, 1, 0]], -1)], -1)


# --- three planar legs: all modes, forward and inverse kinematics ---


@pytest.mark.parametrize("name", PLANAR)
def test_planar_assembly_modes_close_and_come_in_pairs(name, capsys):
    r, rod = robot(name), PLANAR[name]
    generator = np.random.default_rng(0)
    poses = generator.uniform([-0.2, -0.2, -np.pi], [0.2, 0.2, np.pi], (240_000, 3))
    closed = planar.cranks(poses, rod, generator.choice([-1.0, 1.0], poses.shape))
    closed = closed[np.isfinite(closed).all(-1)][:10_000]
    q = np.concatenate([closed, generator.uniform(-np.pi, np.pi, (20_000 - len(closed), 3))])
    modes = r.fk_planar_all(q)
    worst = np.abs(errors(q, modes, rod)).max()
    counts = np.bincount(modes.valid.sum(-1), minlength=7)
    with capsys.disabled():
        print(f"\n{name}, 20000 inputs by number of modes 0 to 6:", *counts, f"; {worst:.1e} m")
    assert worst < CLOSED
    assert counts[1::2].sum() == 0
    assert (counts[[2, 4, 6]] > 100).all()
    assert np.isnan(modes.x[~modes.valid]).all()


@pytest.mark.parametrize("name", PLANAR)
def test_planar_mode_count_matches_exhaustive_scan(name, capsys):
    r, rod = robot(name), PLANAR[name]
    q = random_q(np.random.default_rng(7), 600, rod)
    found = r.fk_planar_all(q).valid.sum(-1)
    whole = np.full(50, np.pi)
    parts = [scan(part, -whole, whole, rod, [1025, 33, 65]) for part in np.split(q, 12)]
    scanned = np.concatenate(parts)
    with capsys.disabled():
        print(f"\n{name}, 600 inputs by number of modes 0 to 6:")
        print("  found   ", *np.bincount(found, minlength=7))
        print("  scanned ", *np.bincount(scanned, minlength=7))
    np.testing.assert_array_equal(found, scanned)


@pytest.mark.parametrize("name", PLANAR)
def test_ik_planar_returns_two_branches_per_leg(name):
    r, rod = robot(name), PLANAR[name]
    generator = np.random.default_rng(1)
    pose = generator.uniform([-0.2, -0.2, -np.pi], [0.2, 0.2, np.pi], (5000, 3))
    found = r.ik_planar(pose)
    q, valid = found.q, found.valid | found.other_mode
    assert q.shape == (5000, 8, 3)
    expected = np.stack(
        [planar.cranks(pose, rod, np.array(sides)) for sides in product((1.0, -1.0), repeat=3)], 1
    )
    closed = np.isfinite(expected).all((-2, -1))
    np.testing.assert_array_equal(valid.all(-1), closed)
    np.testing.assert_array_equal(valid.any(-1), closed)
    assert 200 < closed.sum() < 4800
    apart = np.abs(wrapped(q[closed][:, :, None] - expected[closed][:, None])).max(-1)
    # Two branches merge near stretched legs, where angles are less accurate.
    margin = r.actuator_margin(pose[closed]).min(-1)
    assert (apart.min(-1).max(-1) * np.sqrt(margin)).max() < SAME
    assert (apart.min(-2).max(-1) * np.sqrt(margin)).max() < SAME
    np.testing.assert_array_equal(r.actuators(pose[closed]), q[closed][:, 0])
    np.testing.assert_array_equal(r.chain_closes(pose), closed)
    assert np.isnan(r.actuators(pose[~closed])).any(-1).all()


@pytest.mark.parametrize("name", PLANAR)
def test_unreachable_pose_error_names_leg(name):
    with pytest.raises(
        chasles.OutOfReachError, match=r"actuators: coupler_1: the loop does not close"
    ):
        robot(name).actuators([0.2, 0.1, 0.0])
    with pytest.raises(
        chasles.OutOfReachError, match=r"actuators: coupler_3: the loop does not close"
    ):
        robot(name).actuators([0.0, -0.25, 0.0])


@pytest.mark.parametrize("name", PLANAR)
def test_assembly_modes_contain_reference_mode(name):
    r = robot(name)
    q = within(name, 2000, 2)
    modes = r.fk_planar_all(q).x
    assert np.nanmin(np.abs(modes - r.chain(q)[:, None]).max(-1), axis=-1).max() < 1e-9


@pytest.mark.parametrize("name", ITERATED)
def test_loops_close_everywhere_within_limits(name):
    r, m = robot(name), model(name)
    q = within(name, 10_000, 3)
    z = r.configuration(q)
    assert np.isfinite(z).all()
    assert m.gap(z).max() < CLOSED
    assert np.abs(r.constraint(z)).max() < CLOSED
    assert r.loops_close(q).all()
    np.testing.assert_allclose(z[:, m.actuated], q, atol=1e-15)
    np.testing.assert_array_equal(r.chain(q), z[:, m.chain])
    np.testing.assert_allclose(r.fk(q[:500]), m.tip(z[:500]), atol=CLOSED)


POSES = {
    "planar_3rrr": ([-0.04, -0.04, -0.4], [0.04, 0.04, 0.4]),
    "stewart_gough": (
        [-0.05, -0.05, 0.56, -0.25, -0.15, -0.15],
        [0.05, 0.05, 0.63, 0.25, 0.15, 0.15],
    ),
}


@pytest.mark.parametrize("name", ITERATED)
def test_chain_inverts_actuators(name):
    r, m = robot(name), model(name)
    theta = np.random.default_rng(4).uniform(*POSES[name], (1000, len(POSES[name][0])))
    q = r.actuators(theta)
    assert np.isfinite(q).all()
    assert np.abs(wrapped(r.chain(q) - theta)).max() < SAME
    z = np.zeros((1000, len(m.names)))
    z[:, m.chain], z[:, m.actuated] = theta, q
    if m.passive:
        z[:, m.passive] = r.passive(q)
    assert m.gap(z).max() < CLOSED
    assert np.abs(r.actuators(r.chain(q)) - q).max() < CLOSED


@pytest.mark.parametrize("name", ITERATED)
def test_derivatives_match_implicit_function_theorem(name):
    r, m = robot(name), model(name)
    q = within(name, 200, 5)
    z, qd = r.configuration(q), np.random.default_rng(6).uniform(-1, 1, q.shape)
    z_D_q = m.z_D_q(z)
    size = np.abs(z_D_q).max()
    assert np.abs(r.configuration_D_q(q) - z_D_q).max() < SAME * size
    assert np.abs(r.chain_D_q(q) - z_D_q[:, m.chain]).max() < SAME * size
    V = twists(m, z, (z_D_q @ qd[..., None])[..., 0])
    assert np.abs(r.jacobian_mixed(q) @ qd[..., None] - V[..., None]).max() < SAME * size
    T = r.fk(q)
    R, p = T[:, :3, :3], T[:, :3, 3]
    space, body = (r.jacobian_space(q) @ qd[..., None])[..., 0], r.jacobian_body(q) @ qd[..., None]
    at_origin = V[:, :3] + np.cross(p, V[:, 3:])
    np.testing.assert_allclose(space, np.concatenate([at_origin, V[:, 3:]], -1), atol=1e-9)
    turned = np.concatenate(
        [np.swapaxes(R, 1, 2) @ part[..., None] for part in (V[:, :3], V[:, 3:])], 1
    )
    np.testing.assert_allclose(body, turned, atol=1e-9)
    if m.passive:
        assert np.abs(r.passive_D_q(q) - z_D_q[:, m.passive]).max() < SAME * size


@pytest.mark.parametrize("name", ITERATED)
def test_results_far_outside_limits_are_closed_or_nan(name):
    r, m = robot(name), model(name)
    lower, upper = sampling_limits(r)
    span = 2 * (upper - lower)
    q = np.random.default_rng(8).uniform(lower - span, upper + span, (2000, r.n))
    z = r.configuration(q)
    finite = np.isfinite(z).all(-1)
    assert 0.05 < finite.mean() < 0.98
    assert m.gap(z[finite]).max() < 1e-9
    np.testing.assert_array_equal(finite, r.loops_close(q))
    np.testing.assert_array_equal(finite, np.isfinite(r.fk(q)).all((-2, -1)))
    alone = q[~finite][0]
    for function in (r.fk, r.chain):
        with pytest.raises(chasles.OutOfReachError, match=rf"{r.coordinates[0].name} = "):
            function(alone)


@pytest.mark.parametrize("name", ITERATED)
def test_actuator_derivatives_match_finite_differences(name):
    r = robot(name)
    q = within(name, 100, 9)
    theta = r.chain(q)
    generator = np.random.default_rng(10)
    thetad, thetadd = generator.uniform(-1, 1, (2, *theta.shape))

    def along(function, *rates):
        there = [theta + STEP * thetad + STEP**2 / 2 * thetadd, thetad + STEP * thetadd]
        back = [theta - STEP * thetad + STEP**2 / 2 * thetadd, thetad - STEP * thetadd]
        n = 1 + len(rates)
        return (function(*there[:n]) - function(*back[:n])) / (2 * STEP)

    rates = r.actuator_rates(theta, thetad)
    expected = (r.actuators_D_chain(theta) @ thetad[..., None])[..., 0]
    np.testing.assert_allclose(rates, expected, rtol=1e-11, atol=1e-12)
    scale = np.maximum(np.abs(rates).max(-1, keepdims=True), 1) ** 3
    assert (np.abs(rates - along(r.actuators)) / scale).max() < 1e-7
    found = r.actuator_accelerations(theta, thetad, thetadd)
    scale = np.maximum(np.abs(found).max(-1, keepdims=True), 1) ** 3
    assert (np.abs(found - along(r.actuator_rates, thetad)) / scale).max() < 1e-7


@pytest.mark.parametrize("name", ITERATED)
def test_single_pose_and_batch_results_agree(name):
    r = robot(name)
    q = within(name, 60, 11)
    given = {"q": q, "theta": r.chain(q), "z": r.configuration(q)}
    given["seed"] = given["z"]
    # The last entries of a configuration z are the swing angles of struts.
    given["w"] = given["z"][:, : r.functions["closure"].inputs[0].shape[0]]
    generator = np.random.default_rng(12)
    for key in ("q", "theta", "z", "w"):
        given |= {f"{key}{d}": generator.uniform(-1, 1, given[key].shape) for d in ("d", "dd")}
    given |= {"phi": generator.uniform(-3, 3, 60), "T": r.chain_fk(given["theta"])}
    for key, function in r.functions.items():
        inputs = [given[argument.name] for argument in function.inputs]
        batch = function(*inputs)
        outputs = batch if isinstance(batch, tuple) else (batch,)
        singles = [function(*row) for row in zip(*inputs, strict=True)]
        singles = [s if isinstance(s, tuple) else (s,) for s in singles]
        for k, output in enumerate(outputs):
            single = np.stack([row[k] for row in singles])
            size = np.maximum(1.0, np.nanmax(np.abs(output)))
            np.testing.assert_allclose(single, output, atol=SAME * size, rtol=0, err_msg=key)


# --- velocities and singular poses of platforms ---

FREE = {"planar_3rrr": [0, 1, 5], "slider_crank": [0]}
FREE |= {"stewart_gough": list(range(6)), "delta": [0, 1, 2, 3, 4, 5]}


@pytest.mark.parametrize("name", FREE)
def test_velocity_relation_holds_for_true_rates(name):
    r, m = robot(name), model(name)
    q = np.linspace(-3, 3, 100)[:, None] if name == "slider_crank" else within(name, 100, 13)
    z = r.configuration(q)
    J_x, J_q = r.functions["velocity_relation"](z[:, m.chain], q)
    qd = np.random.default_rng(14).uniform(-1, 1, q.shape)
    V = twists(m, z, (m.z_D_q(z) @ qd[..., None])[..., 0])
    assert J_x.shape[-1] == len(FREE[name])
    left, right = (J_x @ V[:, FREE[name], None])[..., 0], (J_q @ qd[..., None])[..., 0]
    assert np.abs(right).max() > 0.01
    assert np.abs(left - right).max() < SAME


@pytest.mark.parametrize("name", PLANAR)
def test_stretched_leg_is_type_1_singularity(name):
    r, rod = robot(name), PLANAR[name]
    regular = r.singularity(r.chain(r.reference.q), r.reference.q)
    assert min(regular) > 0.02
    along = np.array([0.1, 0.05]) - planar.DIRECTIONS[0]
    along = along / np.linalg.norm(along)
    sizes = []
    for short in (1e-5, 1e-7):
        pin = planar.BASE * planar.DIRECTIONS[0] + (planar.CRANK + rod - short) * along
        turns = np.linspace(-np.pi, np.pi, 73)
        poses = np.array([[*(pin - turned(PIN, turn)), turn] for turn in turns])
        poses = poses[np.isfinite(planar.cranks(poses, rod, 1.0)).all(-1)]
        found = r.singularity(poses, r.actuators(poses))
        sizes.append(found.type_1)
        assert found.type_2.max() > 0.02
    assert len(sizes[0]) > 3
    assert sizes[0].max() < 0.1
    # The smallest singular value is proportional to the square root of `short`, the distance of the
    # leg from full extension.
    np.testing.assert_allclose(sizes[0], 10 * sizes[1], rtol=0.02)


def turned(vector, angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])


@pytest.mark.parametrize("name", PLANAR)
def test_concurrent_rods_are_type_2_singularity(name):
    """The platform is at the center, where all rods intersect or nearly intersect."""
    r, rod = robot(name), PLANAR[name]
    # The rods lie on lines through the center, so the crank ends have the distance `reach` from the
    # center.
    reach = planar.PLATFORM + rod
    # Each crank end lies on two circles: the circle of its crank, and the circle of radius `reach`
    # about the center.
    cosine = (reach**2 + planar.BASE**2 - planar.CRANK**2) / (2 * reach * planar.BASE)
    phi = np.arccos(cosine)
    ends = reach * np.stack([np.cos(planar.ANGLES + phi), np.sin(planar.ANGLES + phi)], -1)
    arms = ends - planar.BASE * planar.DIRECTIONS
    q = np.arctan2(arms[:, 1], arms[:, 0])
    pose = np.array([0.0, 0.0, phi])
    found = r.singularity(pose, q)
    assert np.abs(r.functions["rods"](pose, q)).max() < CLOSED
    assert found.type_2 < 1e-12
    assert found.type_1 > 0.05
    assert found.type_3 == found.type_1
    sizes = []
    for away in (1e-3, 1e-4):
        moved = np.array([0.0, 0.0, phi + away])
        branches = r.ik_planar(moved).q
        nearest = branches[np.abs(wrapped(branches - q)).max(-1).argmin()]
        sizes.append(r.singularity(moved, nearest).type_2)
    assert sizes[0] / sizes[1] == pytest.approx(10, rel=0.05)


def test_stewart_quarter_turn_is_type_2_singularity():
    """Fichter's singularity: platform and base are similar, and the yaw is 90 degrees."""
    r = robot("stewart_gough")
    regular = r.singularity(r.chain(r.reference.q), r.reference.q)
    assert regular.type_2 > 0.05
    for turn in (np.pi / 2, -np.pi / 2):
        theta = np.array([0.0, 0.0, 0.5, turn, 0.0, 0.0])
        found = r.singularity(theta, r.actuators(theta))
        assert found.type_2 < 1e-12
        assert found.type_1 == pytest.approx(1.0)


# --- delta ---

R_B, ARM, ROD, R_P = 0.2, 0.26, 0.8, 0.05
AROUND = np.radians([0, 120, 240])


def elbows(q):
    out, down = R_B + ARM * np.cos(q), -ARM * np.sin(q)
    return np.stack([out * np.cos(AROUND), out * np.sin(AROUND), down], -1)


def spheres(q):
    """Return both points (N, 2, 3) whose distance from three shifted elbows is the rod length.

    The elbows are shifted inward by the platform radius.
    """
    inwards = np.stack([np.cos(AROUND), np.sin(AROUND), 0 * AROUND], -1)
    center = elbows(q) - R_P * inwards
    n = center[:, 1:] - center[:, :1]
    middle = (center[:, 1:] + center[:, :1]) / 2
    right = (n * middle).sum(-1)
    point = (np.linalg.pinv(n) @ right[..., None])[..., 0]
    along = np.cross(n[:, 0], n[:, 1])
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    to = point - center[:, 0]
    b = (to * along).sum(-1)
    with np.errstate(invalid="ignore"):
        root = np.sqrt(b**2 - (to**2).sum(-1) + ROD**2)
    return np.stack([point + (-b + side * root)[:, None] * along for side in (1, -1)], 1)


def test_delta_fk_matches_intersection_of_three_spheres():
    r = robot("delta")
    q = within("delta", 2000, 15)
    both = spheres(q)
    lower = np.take_along_axis(both, both[..., 2].argmin(-1)[:, None, None], 1)[:, 0]
    np.testing.assert_allclose(r.fk(q)[:, :3, 3], lower, atol=CLOSED)
    np.testing.assert_array_equal(r.fk(q)[:, :3, :3], np.tile(np.eye(3), (2000, 1, 1)))
    theta, valid, _ = r.chain_branches(q)
    assert valid.all()
    order = theta[..., 2].argsort(-1)[..., None]
    found = np.take_along_axis(theta[..., :3], order, 1)
    expected = np.take_along_axis(both, both[..., 2].argsort(-1)[..., None], 1)
    np.testing.assert_allclose(found, expected, atol=1e-11)
    assert (theta[..., 3:] == 0).all()


def test_delta_is_invalid_if_spheres_do_not_intersect():
    r = robot("delta")
    q = np.random.default_rng(16).uniform(-np.pi, np.pi, (5000, 3))
    there = np.isfinite(spheres(q)).all((-2, -1))
    assert 100 < (~there).sum() < 4900
    np.testing.assert_array_equal(r.loops_close(q), there)
    np.testing.assert_array_equal(np.isfinite(r.fk(q)).all((-2, -1)), there)


def test_delta_actuators_match_half_angle_solution():
    """The half-angle substitution solves E cos q + F sin q + G = 0 for the crank angle q."""
    r = robot("delta")
    q = within("delta", 2000, 17)
    p = r.fk(q)[:, :3, 3]
    x = p[:, :1] * np.cos(AROUND) + p[:, 1:2] * np.sin(AROUND) + R_P - R_B
    y = -p[:, :1] * np.sin(AROUND) + p[:, 1:2] * np.cos(AROUND)
    z = p[:, 2:]
    E, F = -2 * ARM * x, 2 * ARM * z
    G = x**2 + y**2 + z**2 + ARM**2 - ROD**2
    root = np.sqrt(E**2 + F**2 - G**2)
    branches = np.stack([2 * np.arctan2(-F + side * root, G - E) for side in (1, -1)], -1)
    found = r.actuators(r.chain(q))
    # The half-angle formulas lose digits near merging branches.
    assert np.abs(wrapped(branches - found[..., None])).min(-1).max() < 1e-9
    np.testing.assert_allclose(found, q, atol=CLOSED)
    every, valid, _ = r.actuator_branches(r.chain(q[:200]))
    assert every.shape == (200, 8, 3)
    assert valid.all()
    apart = np.abs(wrapped(every[..., None] - branches[:200, None])).min(-1)
    assert apart.max() < 1e-9
    sides = np.abs(wrapped(every[..., None] - branches[:200, None])).argmin(-1)
    assert all(len({tuple(row) for row in rows}) == 8 for rows in sides)
