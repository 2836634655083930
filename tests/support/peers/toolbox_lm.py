"""The Robotics Toolbox: Levenberg-Marquardt with random restarts, in C++, called from Python.

The robot in the toolbox has as few elements as possible: a constant transform and a motion for each
joint, and a constant transform for the tool.
"""

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import roboticstoolbox as rtb

from tests.support.oracles.screws import Screws, inverted

NAME = "Robotics Toolbox ik_LM"
TOLERANCE = 1e-13
"""Limit of half the squared pose error, so the pose error is at most 4.5e-7 (meter or radian)."""


def inverse(chain: Screws, lower: np.ndarray, upper: np.ndarray) -> Callable:
    """Return a function from a pose (4, 4) to a solution with `q` and `valid`."""
    elements = sequence(chain, lower, upper)

    def call(T: np.ndarray):
        found = elements.ik_LM(T, tol=TOLERANCE)
        return SimpleNamespace(q=found.q, valid=found.success)

    return call


def sequence(chain: Screws, lower: np.ndarray, upper: np.ndarray) -> rtb.ETS:
    """Return the elementary transforms of an arm with its joint limits."""
    elements, before = [], np.eye(4)
    for k, turns in enumerate(chain.revolute):
        frame = _along(chain.axes[k] if turns else chain.slides[k], chain.points[k])
        joint = rtb.ET.Rz if turns else rtb.ET.tz
        limits = [lower[k], upper[k]]
        elements += [rtb.ET.SE3(inverted(before) @ frame), joint(qlim=limits)]
        before = frame
    return rtb.ETS([*elements, rtb.ET.SE3(inverted(before) @ chain.home)])


def _along(axis: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Return a frame at a point.

    The z axis of the frame has the direction ``axis``.
    """
    across = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    x = across / np.linalg.norm(across)
    frame = np.eye(4)
    frame[:3] = np.column_stack([x, np.cross(axis, x), axis, point])
    return frame
