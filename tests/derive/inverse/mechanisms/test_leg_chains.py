"""Inverse of platforms with serial legs, compared with NumPy and a formula."""

from functools import cache, partial

import numpy as np
import pytest

from chasles.derive import derive, explain
from chasles.derive.terms.branches import patterns
from chasles.derive.terms.casadi_graph import lower
from tests.support.compiling import compiled
from tests.support.generators.guided_platforms import X, Y, guided
from tests.support.generators.leg_platforms import drawn_as, drawn_legs
from tests.support.loops.closures import Model

POSES, CLOSED, SAME = 20, 1e-12, 1e-9
REACH = {"revolute": 0.2, "prismatic": 0.05}
"""Maximum distance of a coordinate from the reference (radian or meter)."""
FOLDED = {"3-RUU": 1, "3-RUU with offsets": 2}
"""Number of folded configurations of a rod; the formula gives only one of these configurations."""
SLOTS = {
    "tripteron": 1,
    "exechon": 8,
    "3-UPU": 8,
    "3-URU": 8,
    "3-PUU": 8,
    "3-RUU": 8,
    "3-RUU with offsets": 64,
}
"""Number of solution slots: one for a decoupled robot, otherwise two per leg, or four with a folded
rod. 3-PUU with offsets differs from 3-RUU with offsets only in the driven joint."""


@cache
def legs_of(kind):
    mechanism = drawn_legs(kind, 1)
    return mechanism, derive(mechanism, functions=["ik_legs"]).function("ik_legs")


def configurations(mechanism):
    model, rng = Model(mechanism), np.random.default_rng(0)
    at = dict(mechanism.reference)
    z = np.repeat([[float(at.get(name, 0)) for name in model.names]], POSES, 0)
    reach = [REACH[c.kind] for c in mechanism.coordinates]
    z = model.newton(z, [])
    z[:, model.actuated] += rng.uniform(-1, 1, (POSES, len(reach))) * reach
    z = model.newton(z, model.actuated)
    return model, z[model.gap(z) < CLOSED]


def slots_at(ik, T):
    """Returns coordinates (k, N, n) and residuals (k, N) of all solution slots."""
    (kernel,) = lower([ik], "legs")
    q, residual = [], []
    for signs in patterns(ik):
        choice = [np.repeat(np.array(signs)[:, None], len(T), 1)] if signs else []
        found = kernel(T.reshape(-1, 16).T, *choice)
        q.append(np.array(found[0]).T)
        residual.append(np.array(found[1])[0])
    return np.array(q), np.array(residual)


@pytest.mark.parametrize("kind", SLOTS)
def test_slots_contain_the_generating_coordinates(kind):
    mechanism, ik = legs_of(kind)
    assert ik.branches == SLOTS[kind]
    model, z = configurations(mechanism)
    assert len(z) > POSES / 2
    q, residual = slots_at(ik, model.tip(z))
    own = np.abs(q - z[:, model.actuated]).max(-1) < SAME
    assert (own & (residual < SAME)).any(0).all()


@pytest.mark.parametrize("kind", SLOTS)
def test_unreachable_pose_has_a_residual(kind):
    """The platforms have three degrees of freedom, so a screw motion leaves their workspace."""
    mechanism, ik = legs_of(kind)
    model, z = configurations(mechanism)
    T = model.tip(z)
    c, s = np.cos(0.02), np.sin(0.02)
    screw = np.array([[c, -s, 0, 0.003], [s, c, 0, 0.002], [0, 0, 1, 0.001], [0, 0, 0, 1]])
    _, residual = slots_at(ik, T @ screw)
    assert (residual > 1e-4).all()


@pytest.mark.parametrize("kind", ["3-RUU", "3-RUU with offsets"])
def test_rotary_delta_agrees_with_the_formula_of_its_arms(kind):
    """Projected onto the arm's plane, each arm and its rod form a triangle."""
    mechanism, ik = legs_of(kind)
    model, z = configurations(mechanism)
    q, residual = slots_at(ik, model.tip(z))
    assert (residual < SAME).all()
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
            assert np.abs(q[:, :, k] - wanted).min(0).max() < SAME
        assert (np.abs(q[:, :, k, None] - both.T).min(-1) < SAME).sum(0).min() == len(q) / FOLDED[
            kind
        ]


def test_missing_inverse_of_guided_platform_has_reason(tmp_path):
    """No structure fits the passive chain PRPU of the 5-UPS/PRPU platform."""
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
