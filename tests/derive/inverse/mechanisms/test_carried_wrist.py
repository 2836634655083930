"""Wrist on a platform whose three legs each keep a ball joint in a plane, such as a 3-RPS.

The tests recover coordinates that come from a NumPy model. The number of possible platform
rotations is found by Newton's method from many start rotations.
"""

from functools import cache, partial

import numpy as np
import pytest

from chasles.derive import derive, explain
from chasles.derive.latex import files
from chasles.derive.program.programs import NO_PROGRAMS
from tests.support.compiling import compiled
from tests.support.generators.carried_planes import carrying
from tests.support.loops.closures import Model
from tests.support.loops.legs_of_joints import drawn, driven_by_a_leg

POSES, STARTS, STEPS = 12, 400, 60
CLOSED, SAME, APART = 1e-12, 1e-9, 1e-4
CENTER = np.array([0.1, 0.05, 0.1])
WRIST = [((0, 0, 1), ("0.1", "0.05", "0.1")), ((0, 1, 0), (0, 0, 0)), ((0, 0, 1), (0, 0, 0))]
"""Axis direction and origin (meter) of each wrist joint, along the platform axes. The wrist axes
meet in CENTER."""
ROBOTS = {
    "one axis": (partial(drawn, 0, ("RPS", "RPS", "RPS")), 1),
    "two axes": (partial(drawn, 1, ("RPS", "PRS", "RRS")), 2),
    "three axes": (partial(drawn, 2, ("RPS", "RPS", "RPS")), 3),
    "three axes on a leg": (driven_by_a_leg, 3),
}
COMPILED = ("one axis", "two axes", "three axes on a leg")


@cache
def carried(name):
    make, count = ROBOTS[name]
    return carrying(make(), WRIST[:count])


@pytest.fixture(scope="module", params=COMPILED)
def loaded(request, tmp_path_factory):
    """Return a robot, its NumPy model, and closed configurations (N, n_z)."""
    mechanism, rng = carried(request.param), np.random.default_rng(3)
    folder = tmp_path_factory.mktemp("carried")
    robot = compiled(mechanism, folder, ["ik", "fk", "configuration"], ["c"])
    model, at = Model(mechanism), dict(mechanism.reference)
    z = np.repeat([[float(at.get(name, 0)) for name in model.names]], POSES, 0)
    legs, wrist = model.actuated[:3], model.actuated[3:]
    z[:, legs] += rng.uniform(-0.08, 0.08, (POSES, 3))
    z[:, wrist] += rng.uniform(-2, 2, (POSES, len(wrist)))
    z = model.newton(z, model.actuated)
    z = z[model.gap(z) < CLOSED]
    assert len(z) > POSES / 2
    return robot, model, z


def test_solutions_contain_the_generating_coordinates_and_reach_the_pose(loaded):
    robot, model, z = loaded
    for T, q in zip(model.tip(z), z[:, model.actuated], strict=True):
        found = robot.ik(T)
        apart = found.q[found.valid] - q
        apart[:, 3:] = np.remainder(apart[:, 3:] + np.pi, 2 * np.pi) - np.pi
        assert np.abs(apart).max(-1).min() < SAME
        own = np.array([robot.configuration(other) for other in found.q[found.valid]])
        assert model.gap(own).max() < SAME
        assert np.abs(model.tip(own) - T).max() < SAME


def rotations(model, z, start):
    """Count the platform rotations about the wrist center that keep every ball in its plane.

    All rotations keep the wrist center at its position in the first configuration, z[0].

    The plane of each ball is fitted to the positions of the ball in the configurations z.

    Args:
        model: The NumPy model.
        z: Closed configurations (N, n_z).
        start: Random rotations (k, 3, 3) at which Newton's method starts.
    """
    platform = model.poses(z)["platform"]
    levers, sides, normals = [], [], []
    balls = [np.zeros(3), *(closure.b.placement[0].vector for closure in model.mechanism.closures)]
    for ball in np.array(balls, dtype=float):
        moved = platform[:, :3, :3] @ ball + platform[:, :3, 3]
        normals.append(np.linalg.svd(moved - moved.mean(0))[2][-1])
        levers.append(ball - CENTER)
        center = platform[0, :3, :3] @ CENTER + platform[0, :3, 3]
        sides.append(normals[-1] @ (moved.mean(0) - center))
    n, m, R = np.array(normals), np.array(levers), start
    for _ in range(STEPS):
        turned = np.einsum("kij,lj->kli", R, m)
        errors = np.einsum("li,kli->kl", n, turned) - sides
        step = -np.linalg.solve(np.cross(turned, n) + 1e-14 * np.eye(3), errors[..., None])[..., 0]
        size = np.linalg.norm(step, axis=-1)
        step *= (np.minimum(1.0, 0.5 / np.maximum(size, 1e-300)))[:, None]
        R = turns(step) @ R
    R = R[np.abs(errors).max(-1) < CLOSED]
    found = []
    for one in R:
        if all(np.abs(one - other).max() > APART for other in found):
            found.append(one)
    return len(found)


def turns(vectors):
    """Return the rotations (k, 3, 3) of rotation vectors (k, 3) by Rodrigues' formula."""
    angle = np.linalg.norm(vectors, axis=-1)[:, None, None]
    axes = vectors / np.maximum(angle[:, 0], 1e-300)
    K = np.cross(axes[:, None], -np.eye(3))
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


@pytest.mark.parametrize("loaded", ["three axes on a leg"], indirect=True)
def test_all_platform_rotations_are_found(loaded):
    robot, model, z = loaded
    rng = np.random.default_rng(5)
    start = turns(rng.uniform(-np.pi, np.pi, (STARTS, 3)))
    counts = []
    for k in range(len(z)):
        q = robot.ik(model.tip(z[[k]])[0]).q.reshape(8, -1)
        counts.append(rotations(model, np.roll(z, -k, axis=0), start))
        assert np.isfinite(q).any(-1).sum() == counts[-1]
    assert max(counts) > 4


def test_explanation_and_article_name_the_rotations_of_the_platform():
    assert "up to 8 rotations of the platform" in str(explain(carried("three axes")))
    printed = files(derive(carried("three axes"), functions=["ik"]), NO_PROGRAMS)
    text = " ".join(printed["latex/inverse.tex"].split())
    assert "axis_0, axis_1 and axis_2 meet in the wrist center" in text.replace("\\_", "_")
    assert "16 slots" in text
