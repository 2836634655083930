"""Calibration from scalar measurements. Central differences check all derivatives."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chasles import se3, so3
from chasles.calibration import (
    Distances,
    PlaneContacts,
    Poses,
    Positions,
    SphereContacts,
    identify,
)

NOISE = 2e-5
RANDOM = np.random.default_rng(7)
POSES = se3.exp(RANDOM.normal(size=(5, 6)))
OBSERVATIONS = {
    "positions": (Positions(RANDOM.normal(size=(5, 2, 3)), 0.1), RANDOM.normal(size=6)),
    "distances": (Distances(RANDOM.uniform(1, 2, 5), 0.1), RANDOM.normal(size=6)),
    "sphere": (SphereContacts(RANDOM.normal(size=5), 0.1), RANDOM.normal(size=7)),
    "plane": (PlaneContacts(RANDOM.normal(size=5), 0.1, (0.6, 0.0, 0.8)), RANDOM.normal(size=6)),
    "poses": (
        Poses(POSES @ np.linalg.inv(se3.exp([0.1, 0.2, 0.3, 1, 0, 0.5])), (0.1, 0.2)),
        np.zeros(0),
    ),
}


@pytest.mark.parametrize("name", OBSERVATIONS)
def test_observation_derivatives_match_central_differences(name):
    measurements, x = OBSERVATIONS[name]
    T, h = POSES, 1e-6
    if name == "poses":
        probe = se3.exp([0.2, -0.1, 0.3, 0.4, 0.2, 0.1])
        measurements = Poses(T @ probe, (0.1, 0.2), probe)
    twists = np.broadcast_to(np.eye(6), (len(T), 6, 6))
    by_p, by_x = measurements._derivatives(T, twists, x)

    def moved(k, step):
        turned = so3.exp(step * np.eye(6)[k, 3:]) @ T[:, :3, :3]
        found = T.copy()
        found[:, :3, :3], found[:, :3, 3] = turned, T[:, :3, 3] + step * np.eye(6)[k, :3]
        return measurements._errors(found, x)

    differences = [(moved(k, h) - moved(k, -h)) / (2 * h) for k in range(6)]
    assert_allclose(by_p, np.array(differences).T, atol=1e-7)
    unit = np.eye(len(x)) * h
    differences = [
        (measurements._errors(T, x + e) - measurements._errors(T, x - e)) / (2 * h) for e in unit
    ]
    assert_allclose(by_x, np.array(differences).reshape(len(x), len(by_x)).T, atol=1e-7)


def test_identify_explains_ball_bar_distances_to_noise(arm, truth):
    random = np.random.default_rng(0)
    target, center = np.array([0.05, 0.02, 0.1, 1]), np.array([0.5, 0.2, 0.1])

    def measured(q):
        return np.linalg.norm((arm.fk_p(q, truth.p) @ target)[:, :3] - center, axis=-1)

    q = random.uniform(-2.5, 2.5, (200, 6))
    found = identify(arm, q, Distances(measured(q) + NOISE * random.normal(size=200), NOISE))
    assert found.rms_before > 20
    assert 0.8 < found.noise < 1.2
    assert found.unidentifiable
    validation = random.uniform(-2.5, 2.5, (500, 6))
    assert (
        np.sqrt(
            np.mean(
                found.validation_errors(validation, Distances(measured(validation), NOISE)) ** 2
            )
        )
        < 1
    )


def test_identify_explains_contacts_with_sphere_of_unknown_radius(arm, truth):
    random = np.random.default_rng(2)
    target, center, radius = np.array([0.05, 0.02, 0.1, 1]), np.array([0.4, 0.2, 0.1]), 0.3

    def apart(q):
        return (arm.fk_p(q, truth.p) @ target)[:, :3] - center

    q = random.uniform(-2.5, 2.5, (600, 6))
    for _ in range(30):
        line = apart(q)
        distance = np.linalg.norm(line, axis=-1)
        twist = arm.jacobian_p(q, truth.p)
        lever = line + center - arm.fk_p(q, truth.p)[:, :3, 3]
        v = twist[:, :3] + np.cross(twist[:, 3:], lever[:, :, None], axis=1)
        slope = np.einsum("ni,nij->nj", line / distance[:, None], v)
        step = slope * ((distance - radius) / (slope**2).sum(-1))[:, None]
        q -= np.clip(step, -0.3, 0.3)
    q = q[np.abs(np.linalg.norm(apart(q), axis=-1) - radius) < 1e-9][:300]
    assert len(q) == 300
    measured = SphereContacts(NOISE * random.normal(size=len(q)), NOISE)
    found = identify(arm, q, measured)
    assert found.rms_before > 5
    assert 0.8 < found.noise < 1.2
    assert any("radius" in dict(item.combination) for item in found.unidentifiable)


def test_identify_explains_contacts_with_plane_to_noise(arm, truth):
    random = np.random.default_rng(1)
    normal, target = np.array([0.1, 0.2, 1.0]) / np.sqrt(1.05), np.array([0.05, 0.02, 0.1, 1])
    q = random.uniform(-2, 2, (400, 6))
    for _ in range(30):
        point = (arm.fk_p(q, truth.p) @ target)[:, :3]
        twist = arm.jacobian_p(q, truth.p)[:, :, 1]
        lever = point - arm.fk_p(q, truth.p)[:, :3, 3]
        slope = (twist[:, :3] + np.cross(twist[:, 3:], lever)) @ normal
        q[:, 1] -= np.clip((point @ normal - 0.3) / slope, -0.3, 0.3)
    q = q[(np.abs((arm.fk_p(q, truth.p) @ target)[:, :3] @ normal - 0.3) < 1e-9)][:150]
    found = identify(arm, q, PlaneContacts(NOISE * random.normal(size=len(q)), NOISE))
    assert len(q) == 150
    assert found.rms_before > 20
    assert 0.7 < found.noise < 1.3
