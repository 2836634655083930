"""Actuator values and inverse kinematics of platforms with serial legs.

The tests compare results with Newton's method on a NumPy model, and with a formula for the arm
angles of a rotary delta.
"""

from functools import partial

import numpy as np
import pytest

from chasles.derive import derive, explain
from chasles.derive.terms.branches import patterns
from chasles.derive.terms.casadi_graph import lower
from tests.support.compiling import compiled
from tests.support.generators.guided_platforms import X, Y, guided
from tests.support.generators.leg_platforms import LEG_KINDS, drawn_as, drawn_legs
from tests.support.generators.machine_platforms import MACHINE_KINDS
from tests.support.loops.closures import Model, wrapped

POSES, CLOSED, SAME, NEAR = 20, 1e-12, 1e-12, 1e-9
REACH = {"revolute": 0.2, "prismatic": 0.05}
"""Maximum deviation of an actuated coordinate from its reference value (radian or meter)."""
STEP, CURVED = 1e-5, 1e-3
"""Time step (s) of a second difference of configurations, and error tolerance relative to the
largest acceleration."""
SLOTS = {"tripteron": 1, "exechon": 8, "3-UPU": 8, "3-URU": 8, "3-PUU": 8, "3-RUU with offsets": 64}
"""Number of solution slots of each platform's inverse kinematics function. A decoupled platform has
one solution slot. On other platforms, each leg doubles the number of solution slots, or quadruples
it if the leg has a folded rod. The platforms 3-PUU with offsets and 3-RUU without offsets are not
listed, because their solution steps are those of listed platforms."""
WITHOUT_SLOTS = ("Exechon with a head", "pentapod")
KINDS = {kind: (LEG_KINDS | MACHINE_KINDS)[kind] for kind in (*SLOTS, *WITHOUT_SLOTS)}
SHORT = {"pentapod": 0.1}
"""For each nearly singular platform, the fraction of `REACH` in which coordinates are sampled, so
that Newton's method converges."""
MAPS = ("actuators", "actuators_D_chain", "actuator_rates", "actuator_accelerations")


@pytest.fixture(scope="module", params=KINDS)
def platform(request):
    """Return the kernels, the NumPy model and closed configurations (N, n_z) of a platform."""
    mechanism = drawn_as(KINDS[request.param], 0)
    inverse = ("ik_legs",) if request.param in SLOTS else ()
    functions = kernels(mechanism, (*MAPS, "actuator_margin", *inverse))
    return functions, *configurations(mechanism, SHORT.get(request.param, 1.0))


def configurations(mechanism, part=1.0):
    """Return a model and closed configurations (N, n_z) near the reference of a mechanism."""
    model, rng = Model(mechanism), np.random.default_rng(0)
    at = dict(mechanism.reference)
    z = np.repeat([[float(at.get(name, 0)) for name in model.names]], POSES, 0)
    z = model.newton(z, model.actuated)
    reach = [part * REACH[c.kind] for c in mechanism.coordinates]
    step = rng.uniform(-1, 1, (POSES, len(reach))) * reach
    known = z[:, model.actuated] + step
    z += (model.tangent(z, model.actuated) @ step[..., None])[..., 0]
    z[:, model.actuated] = known
    z = model.newton(z, model.actuated)
    z = z[model.gap(z) < CLOSED]
    assert len(z) > POSES / 2
    return model, z


def kernels(mechanism, names):
    """Return the named functions, which must have closed forms, with their CasADi kernels."""
    found = derive(mechanism, functions=names)
    functions = [found.function(name) for name in names]
    assert not any(function.calls for function in functions)
    return dict(zip(names, zip(functions, lower(functions, "arms"), strict=True), strict=True))


def evaluated(kernels, names, *inputs):
    """Return the first result (N, ...) of each named function."""
    results = []
    for function, kernel in (kernels[name] for name in names):
        values = kernel(*(x.T for x in inputs[: len(function.inputs)]))
        first = values[0] if isinstance(values, list | tuple) else values
        results.append(np.array(first).T.reshape(-1, *function.outputs[0].shape))
    return results


def slots_at(ik, T):
    """Return coordinates (k, N, n) and residuals (k, N) of all k solution slots at N poses."""
    (kernel,) = lower([ik], "legs")
    q, residual = [], []
    for signs in patterns(ik):
        choice = [np.repeat(np.array(signs)[:, None], len(T), 1)] if signs else []
        found = kernel(T.reshape(-1, 16).T, *choice)
        q.append(np.array(found[0]).T)
        residual.append(np.array(found[1])[0])
    return np.array(q), np.array(residual)


def test_actuators_of_iterated_platforms_have_a_closed_form(platform):
    functions, model, z = platform
    rates = np.random.default_rng(1).normal(size=(len(z), len(model.actuated)))
    slope = model.z_D_q(z)
    zd = np.einsum("nij,nj->ni", slope, rates)
    moved = [model.newton(z + side * STEP * zd, model.actuated) for side in (1, -1)]
    zdd = (moved[0] + moved[1] - 2 * z) / STEP**2
    theta, thetad, thetadd = (values[:, model.chain] for values in (z, zd, zdd))
    q, slopes, qd, qdd = evaluated(functions, MAPS, theta, thetad, thetadd)
    assert np.abs(wrapped(q - z[:, model.actuated])).max() < SAME
    products = slopes @ slope[:, model.chain]
    assert np.abs(products - np.eye(len(model.actuated))).max() < 100 * SAME
    assert np.abs(qd - rates).max() < 100 * SAME
    assert np.abs(qdd).max() < CURVED * max(1.0, np.abs(thetadd).max())


def test_joints_that_loops_exclude_have_no_actuators(platform):
    functions, model, z = platform
    theta = z[:, model.chain] + 1e-3 * np.arange(1, len(model.chain) + 1)
    q, margin = evaluated(functions, ("actuators", "actuator_margin"), theta)
    assert np.isnan(q).any(-1).all()
    assert (margin.min(-1) < 0).all()


@pytest.mark.parametrize("platform", SLOTS, indirect=True)
def test_slots_contain_the_generating_coordinates(platform, request):
    functions, model, z = platform
    ik = functions["ik_legs"][0]
    assert ik.branches == SLOTS[request.node.callspec.params["platform"]]
    q, residual = slots_at(ik, model.tip(z))
    own = np.abs(wrapped(q - z[:, model.actuated])).max(-1) < NEAR
    assert (own & (residual < NEAR)).any(0).all()


@pytest.mark.parametrize("platform", SLOTS, indirect=True)
def test_unreachable_pose_has_a_residual(platform):
    """The platforms have three degrees of freedom, so a screw motion leaves their workspace."""
    functions, model, z = platform
    c, s = np.cos(0.02), np.sin(0.02)
    screw = np.array([[c, -s, 0, 0.003], [s, c, 0, 0.002], [0, 0, 1, 0.001], [0, 0, 0, 1]])
    _, residual = slots_at(functions["ik_legs"][0], model.tip(z) @ screw)
    assert (residual > 1e-4).all()


@pytest.mark.parametrize("platform", ["3-RUU with offsets"], indirect=True)
def test_rotary_delta_agrees_with_the_formula_of_its_arms(platform):
    """In projection onto the plane of an arm, the arm and its rod are two sides of a triangle."""
    functions, model, z = platform
    q, residual = slots_at(functions["ik_legs"][0], model.tip(z))
    assert (residual < NEAR).all()
    poses = {body: T[:, :3, 3] for body, T in model.poses(z).items()}
    for k in range(3):
        c, s = np.cos(2 * np.pi * k / 3), np.sin(2 * np.pi * k / 3)
        end = poses[f"v{k}"] - poses[f"arm{k}"]
        X, Y, Z = c * end[:, 0] + s * end[:, 1], c * end[:, 1] - s * end[:, 0], end[:, 2]
        length = np.linalg.norm(poses[f"p{k}"] - poses[f"arm{k}"], axis=1)
        rod = np.linalg.norm(poses[f"t{k}"] - poses[f"s{k}"], axis=1)
        offset = np.linalg.norm(poses[f"s{k}"] - poses[f"p{k}"], axis=1)
        D, r = np.hypot(X, Z), 2 * offset + np.sqrt(rod**2 - Y**2)
        opening = np.arccos((D**2 + length**2 - r**2) / (2 * length * D))
        both = np.arctan2(-Z, X) + np.array([[-1], [1]]) * opening
        both = np.sort(np.remainder(both + np.pi, 2 * np.pi) - np.pi, axis=0)
        for wanted in both:
            assert np.abs(q[:, :, k] - wanted).min(0).max() < NEAR
        assert (np.abs(q[:, :, k, None] - both.T).min(-1) < NEAR).sum(0).min() == len(q) / 2


def test_missing_inverse_of_guided_platform_has_reason(tmp_path):
    mechanism = drawn_as(partial(guided, ("ahead", Y, "up", X, Y)), 3)
    reason = "for the main chain, the nearest structure is"
    assert f"There is no ik; {reason}" in str(explain(mechanism))
    robot = compiled(mechanism, tmp_path, ("fk", "actuators"), ["c"])
    assert robot.manifest.inverse.missing.startswith(reason)
    with pytest.raises(AttributeError, match=reason):
        _ = robot.ik


def test_explanation_names_the_legs():
    message = str(explain(drawn_legs("tripteron", 0)))
    assert "ik solves a pose" in message
