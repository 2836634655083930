"""Simulated measurements of random robots by several devices.

The seed determines the robot errors, the device, the number of configurations, the noise and the
identified parameters.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from chasles import se3, so3
from chasles.calibration import (
    Distances,
    Measurements,
    PlaneContacts,
    Poses,
    Positions,
    SphereContacts,
)

SIGMA = 2e-5, 5e-5
"""Measurement noise [m, rad]."""
ERROR = 5e-4
"""Maximum error of a parameter [m, rad]."""
ANOTHER = 0.02
"""Link length error [m] that simulates a measurement of a different robot."""
TOLERANCES = {"offset": 1e-3, "axis": 5e-4, "loop": 5e-4}
DEVICES = ("poses", "one target", "three targets", "ball bar", "sphere", "plane")
MANY = {"poses": 40, "one target": 80, "three targets": 40}
"""Number of configurations for devices that measure several values per configuration. For other
devices, the number is `MAX`."""
MAX = 150
FEW = 6, 25
"""Minimum and maximum number of configurations in a set of few measurements."""
REACH = 2.0
"""Maximum absolute value of a coordinate [rad or m], also for robots without limits or with wider
limits."""
TOUCHING = 1e-10
"""Maximum distance of a contact from its surface [m]."""


@dataclass(frozen=True)
class Simulated:
    """Simulated measurements for one seed.

    Attributes:
        device: The device.
        q: (N, n) reported coordinates.
        measurements: The measurements.
        vary: Identified parameters.
        parameter_std: Standard deviations of the parameters, or None if they are unknown.
        noise: Factor (0 or 1) that scales the noise of the device.
        p: The true geometry.
    """

    device: str
    q: np.ndarray
    measurements: Measurements
    vary: tuple[str, ...]
    parameter_std: Mapping[str, float] | None
    noise: float
    p: np.ndarray

    def __str__(self) -> str:
        how = "exact" if self.noise == 0 else "noisy"
        known = " with tolerances" if self.parameter_std else ""
        return f"{len(self.q)} {how} rows, {self.device}, vary {'+'.join(self.vary)}{known}"


def simulated(robot, seed: int, *, device: str = "", another: bool = False) -> Simulated:
    """Return the simulated measurements for a seed.

    Args:
        robot: A robot with parametric functions.
        seed: The seed.
        device: Measuring device from `DEVICES`, or an empty string for a random device.
        another: Whether to lengthen one link of the measured robot by `ANOTHER`.
    """
    rng = np.random.default_rng(seed)
    device = device or str(rng.choice(DEVICES if robot.n > 2 else DEVICES[:4]))
    many, noise = rng.random() < 0.5, float(rng.random() < 0.7)
    vary, parameter_std = _model(robot, rng)
    count = MANY.get(device, MAX) if many else int(rng.integers(*FEW))
    p = _geometry(robot, vary, rng)
    if another:
        p[_link(robot, rng)] += ANOTHER
    q = _measurable(robot, p, rng, count if device in DEVICES[:4] else 12 * count)
    measurements, q = _observed(robot, device, p, q, noise, rng)
    q, measurements = q[:count], measurements.at(np.arange(min(count, len(q))))
    return Simulated(device, q, measurements, vary, parameter_std, noise, p)


def with_exchanged_columns(draw: Simulated, seed: int) -> Simulated:
    """Return a copy of the measurements with two random columns of q exchanged."""
    i, j = np.random.default_rng(seed).choice(draw.q.shape[1], 2, replace=False)
    q = draw.q.copy()
    q[:, [i, j]] = draw.q[:, [j, i]]
    return replace(draw, q=q)


def in_degrees(robot, draw: Simulated) -> Simulated:
    """Return the measurements with the joint angles q in degrees."""
    turning = np.array([c.unit == "rad" for c in robot.coordinates])
    return replace(draw, q=np.where(turning, np.degrees(draw.q), draw.q))


def _model(robot, rng: np.random.Generator) -> tuple[tuple[str, ...], Mapping[str, float] | None]:
    has_offsets = any(item.part == "offset" for item in robot.geometry)
    models = [(("geometry",), None), (("offset", "geometry"), TOLERANCES)]
    if has_offsets:
        models += [(("offset",), None), (("offset",), TOLERANCES)]
    vary, parameter_std = models[rng.integers(len(models))]
    known = {item.part for item in robot.geometry}
    chosen = {part: size for part, size in TOLERANCES.items() if part in known}
    vary = tuple(word for word in vary if word == "geometry" or word in known)
    return vary, chosen if parameter_std else None


def _geometry(robot, vary: tuple[str, ...], rng: np.random.Generator) -> np.ndarray:
    parts = {"axis", "loop"} if "geometry" in vary else {"offset"}
    p = np.array([item.value for item in robot.geometry])
    off = np.array([item.part in parts for item in robot.geometry])
    p[off] += rng.uniform(-ERROR, ERROR, off.sum())
    return p


def _link(robot, rng: np.random.Generator) -> int:
    """Return the index of a random length parameter.

    Base, tool and offset corrections cannot compensate an error of this length parameter.
    """
    low, high = _span(robot)
    q = rng.uniform(low, high, (200, robot.n))
    nominal = np.array([item.value for item in robot.geometry])
    q = q[np.isfinite(robot.fk_p(q, nominal)).all((-1, -2))]
    J = robot.identification_jacobian(q, nominal)[:, :3]
    own = np.array([item.part in ("base", "tool", "offset") for item in robot.geometry])
    taken = np.linalg.qr(J[..., own].reshape(-1, own.sum()))[0]
    left = J.reshape(-1, J.shape[-1])
    left = left - taken @ (taken.T @ left)
    size = np.linalg.norm(left, axis=0) / np.sqrt(len(q))
    lengths = [
        k
        for k, item in enumerate(robot.geometry)
        if item.unit == "m" and item.part in ("axis", "loop") and size[k] > 0.2
    ]
    return int(rng.choice(lengths))


def _span(robot) -> tuple[np.ndarray, np.ndarray]:
    low, high = np.maximum(robot.lower, -REACH), np.minimum(robot.upper, REACH)
    if robot.kind == "serial":
        return low, high
    step = np.array([0.1 if c.unit == "m" else 0.6 for c in robot.coordinates])
    at = np.array(robot.reference.q)
    return np.maximum(robot.lower, at - step), np.minimum(robot.upper, at + step)


def _measurable(robot, p: np.ndarray, rng: np.random.Generator, count: int) -> np.ndarray:
    """Return random coordinates at which the loops of the true and of the nominal robot close."""
    low, high = _span(robot)
    q = rng.uniform(low, high, (4 * count, robot.n))
    closed = np.isfinite(robot.fk_p(q, p) + robot.fk(q)).all((-1, -2))
    return q[closed][:count]


def _observed(
    robot, device: str, p: np.ndarray, q: np.ndarray, noise: float, rng: np.random.Generator
) -> tuple[Measurements, np.ndarray]:
    """Return the measurements of a device, and the coordinates of the measured configurations."""
    targets = rng.uniform(-0.1, 0.1, (3, 3))
    sigma = SIGMA[0]
    if device in ("sphere", "plane"):
        return _contacts(robot, device, p, q, targets[0], noise, rng)
    T = se3.exp(rng.normal(size=6)) @ robot.fk_p(q, p)
    if device == "poses":
        T = T @ se3.exp(rng.normal(size=6) * [0.1, 0.1, 0.1, 1, 1, 1])
        T[:, :3, 3] += noise * sigma * rng.normal(size=(len(q), 3))
        turned = so3.exp(noise * SIGMA[1] * rng.normal(size=(len(q), 3)))
        T[:, :3, :3] = turned @ T[:, :3, :3]
        return Poses(T, SIGMA), q
    points = T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], targets)
    if device == "ball bar":
        center = points[:, 0].mean(0) + rng.normal(size=3) * points[:, 0].std(0)
        values = np.linalg.norm(points[:, 0] - center, axis=-1)
        return Distances(values + noise * sigma * rng.normal(size=len(q)), sigma), q
    points = points[:, : 1 if device == "one target" else 3]
    return Positions(points + noise * sigma * rng.normal(size=points.shape), sigma), q


def _contacts(
    robot,
    device: str,
    p: np.ndarray,
    q: np.ndarray,
    target: np.ndarray,
    noise: float,
    rng: np.random.Generator,
) -> tuple[Measurements, np.ndarray]:
    """Return simulated contacts of a target with a surface, and the robot configurations."""

    def placed(q):
        T = robot.fk_p(q, p)
        return T, T[:, :3, 3] + T[:, :3, :3] @ target

    reached = placed(q)[1]
    middle, size = reached.mean(0), np.linalg.norm(reached.std(0))
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)

    def distance(points):
        if device == "plane":
            return (points - middle) @ normal, np.broadcast_to(normal, points.shape)
        apart = points - middle
        length = np.linalg.norm(apart, axis=-1)
        return length - size / 2, apart / length[:, None]

    low, high = _span(robot)
    for _ in range(30):
        T, points = placed(q)
        J, (gap, along) = robot.jacobian_p(q, p), distance(points)
        levers = T[:, :3, :3] @ target
        v = J[:, :3] + np.cross(J[:, 3:], levers[:, :, None], axis=1)
        slope = np.einsum("ni,nij->nj", along, v)
        step = slope * (gap / np.maximum((slope**2).sum(-1), 1e-12))[:, None]
        q = np.nan_to_num(q - np.clip(step, -0.2, 0.2))
    gap = distance(placed(q)[1])[0]
    touching = (np.abs(gap) < TOUCHING) & (q >= low).all(-1) & (q <= high).all(-1)
    q = q[touching & np.isfinite(robot.fk(q)).all((-1, -2))]
    values = noise * SIGMA[0] * rng.normal(size=len(q))
    surface = PlaneContacts if device == "plane" else SphereContacts
    return surface(values, SIGMA[0]), q
