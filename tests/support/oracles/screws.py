"""Screws of a robot's main chain, and poses by the product of exponentials.

The poses come only from the robot description, so they verify generated code independently.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import sympy as sp

import chasles.derive
from chasles.derive import SerialRobot, read
from chasles.derive.chain.poe import placement_matrix
from chasles.derive.model.robot import Placement

ROBOTS = Path(chasles.derive.__file__).parent / "robots"


@dataclass(frozen=True)
class Screws:
    """The joint axes of a chain with all joint values 0, in the base frame [m].

    Attributes:
        axes: (n, 3) unit vectors along revolute axes, or zero vectors for prismatic joints.
        points: (n, 3) the point of each revolute axis that is closest to the origin of the base
            frame.
        slides: (n, 3) unit vectors along prismatic axes, or zero vectors for revolute joints.
        home: (4, 4) pose of the tip with all joint values 0.
    """

    axes: np.ndarray
    points: np.ndarray
    slides: np.ndarray
    home: np.ndarray

    @property
    def revolute(self) -> np.ndarray:
        """Whether each joint is revolute (n,)."""
        return self.axes.any(axis=1)

    def fk(self, theta: np.ndarray) -> np.ndarray:
        """Return the tip poses (..., 4, 4) at joint values t (..., n).

        Each pose is exp(S1 t1) ... exp(Sn tn) M, with screws S and home pose M.

        Source: Brockett, Robotic manipulators and the product of exponentials formula, 1983.
        """
        T = np.broadcast_to(self.home, (*theta.shape[:-1], 4, 4)).copy()
        revolute = self.revolute
        for k in reversed(range(len(self.axes))):
            angle = theta[..., k, None, None]
            if revolute[k]:
                T[..., :3, 3] -= self.points[k]
                T[..., :3, :] = turned(T[..., :3, :], self.axes[k], angle)
                T[..., :3, 3] += self.points[k]
            else:
                T[..., :3, 3] += angle[..., 0] * self.slides[k]
        return T


def turned(columns: np.ndarray, axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Rotate columns (..., 3, m) about an axis through the origin (Rodrigues)."""
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    once = cross @ columns
    return columns + np.sin(angle) * once + 2 * np.sin(angle / 2) ** 2 * (cross @ once)


def screws(name: str) -> Screws:
    """Return the screws of a shipped robot's main chain from its description."""
    described = read(ROBOTS / f"{name}.toml")
    return screws_of(described if isinstance(described, SerialRobot) else described.main_chain)


def screws_of(chain: SerialRobot) -> Screws:
    values = {parameter.symbol: parameter.value for parameter in chain.parameters}
    frame, frames, moving = _placed(chain.base, values), [], []
    assert not chain.couplings
    for joint in chain.joints:
        frame = frame @ _placed(joint.before, values)
        if joint.kind != "fixed":
            frames.append(frame)
            moving.append(joint)
        frame = frame @ _placed(joint.after, values)
    turns = np.array([[joint.kind == "revolute"] for joint in moving])
    along = np.array([joint.direction * T[:3, 2] for joint, T in zip(moving, frames, strict=True)])
    axes = np.where(turns, along, 0.0)
    origins = np.array([T[:3, 3] for T in frames])
    points = origins - np.sum(origins * axes, axis=1, keepdims=True) * axes
    return Screws(axes, points, np.where(turns, 0.0, along), frame @ _placed(chain.tool, values))


def _placed(placement: Placement, values: dict[sp.Symbol, sp.Expr]) -> np.ndarray:
    return np.array(placement_matrix(placement).subs(values).evalf(20), dtype=float)


def meeting(axes: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the point closest to several lines, and its distance [m] from the farthest line."""
    normals = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    sums = normals.sum(axis=0), np.einsum("kij,kj->i", normals, points)
    point = np.linalg.lstsq(*sums, rcond=None)[0]
    away = np.einsum("kij,kj->ki", normals, point - points)
    return point, float(np.linalg.norm(away, axis=1).max())


def locked(chain: Screws, joint: int, value: float) -> Screws:
    """Return the chain that remains if one joint is fixed at a value."""
    moved = np.zeros(len(chain.axes))
    moved[joint] = value
    frame = chain.fk(moved) @ inverted(chain.home)
    R, p = frame[:3, :3], frame[:3, 3]
    after = np.arange(len(chain.axes)) > joint
    keep = np.arange(len(chain.axes)) != joint

    def displaced(vectors: np.ndarray, shift: np.ndarray) -> np.ndarray:
        return np.where(after[:, None], vectors @ R.T + shift, vectors)[keep]

    none = np.zeros(3)
    axes, slides = displaced(chain.axes, none), displaced(chain.slides, none)
    return Screws(axes, displaced(chain.points, p), slides, frame @ chain.home)


def reverse(chain: Screws) -> Screws:
    """Return the chain from tip to base, with inverse poses and reversed joint order."""
    home = inverted(chain.home)
    R, p = home[:3, :3], home[:3, 3]
    axes, slides = (-(vectors @ R.T)[::-1] for vectors in (chain.axes, chain.slides))
    return Screws(axes, (chain.points @ R.T + p)[::-1], slides, home)


def inverted(T: np.ndarray) -> np.ndarray:
    """Return the inverses of poses (..., 4, 4)."""
    inverse = np.zeros_like(T)
    R = np.swapaxes(T[..., :3, :3], -1, -2)
    inverse[..., :3, :3], inverse[..., 3, 3] = R, 1
    inverse[..., :3, 3] = -np.einsum("...ij,...j->...i", R, T[..., :3, 3])
    return inverse
