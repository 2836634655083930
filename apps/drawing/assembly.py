"""Assembly modes of a platform: all configurations for the same actuated coordinates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chasles import Robot
from chasles.sampling import low_discrepancy
from chasles.tolerances import SAME_SOLUTION, SOLVED

from .skeleton import Skeleton

FloatArray = NDArray[np.float64]
_STARTS = 24
"""Number of start configurations of the passive leg joints. Legs with two links need only two start
configurations."""
_STEPS = 20
"""Maximum number of Newton steps from each start configuration."""


class AssemblyModes(NamedTuple):
    """The assembly modes at specified actuated coordinates.

    Attributes:
        z: (k, n_z) configurations. The rotation of a rod about its own axis is not changed, because
            no other body depends on this rotation.
        margin: (k,) singularity margin of each assembly mode. The margin is 0 at a singularity.
    """

    z: FloatArray
    margin: FloatArray


def has_modes(robot: Robot) -> bool:
    """Return whether the robot has a function that returns all assembly modes."""
    return "modes" in robot.functions


def assembly_modes(bodies: Skeleton, q: FloatArray, near: FloatArray) -> AssemblyModes:
    """Return all assembly modes of a platform.

    Args:
        bodies: The bodies of a robot that has the function `modes`.
        q: (n,) actuated coordinates [rad or m].
        near: (n_z,) configuration from which the passive leg joints start.

    Returns:
        The modes for which Newton's method closes the loops.
    """
    robot = bodies.robot
    theta, margin, _ = robot.functions["modes"](q)
    found = np.isfinite(margin)
    names = [variable.name for variable in robot.configuration_variables]
    chain = [names.index(joint.name) for joint in robot.chain_joints]
    z = np.tile(near, (int(found.sum()), 1))
    for item, value in zip(robot.manifest.loops.actuated_in_z, q, strict=True):
        z[:, item.index] = item.ratio * value
    z[:, chain] = theta[found]
    known = {*chain, *(item.index for item in robot.manifest.loops.actuated_in_z)}
    moving = {body.joint.coordinate for body in bodies.bodies if body.joint}
    if moving - known <= {-1}:
        return AssemblyModes(z, margin[found])
    legs = [k for k in range(len(names)) if k not in known]
    closed = [_closed(robot, row, legs) for row in z]
    kept = np.array([row is not None for row in closed], dtype=np.bool_)
    rows = [row for row in closed if row is not None]
    return AssemblyModes(np.reshape(rows, (-1, len(names))), margin[found][kept])


def _closed(robot: Robot, z: FloatArray, legs: list[int]) -> FloatArray | None:
    """Return the configuration that closes the loops, or None without convergence."""
    turns = np.array([robot.configuration_variables[k].unit == "rad" for k in legs])
    reach = np.where(turns, 2 * np.pi, robot.unit_length)
    for part in low_discrepancy(0, _STARTS, len(legs), np.zeros(len(legs))):
        start = z.copy()
        start[legs] += reach * (part - np.round(part))
        for _ in range(_STEPS):
            residual = robot.constraint(start)
            if np.abs(residual).max() < SOLVED * robot.unit_length:
                return start
            J = robot.constraint_D_z(start)[:, legs]
            start[legs] -= np.linalg.lstsq(J, residual, rcond=None)[0]
    return None


def others(modes: AssemblyModes, z: FloatArray, bodies: Skeleton) -> AssemblyModes:
    """Return all modes except the current mode."""
    tips = bodies.tip_poses(bodies.poses_from_configuration(modes.z))
    tip = bodies.tip_poses(bodies.poses_from_configuration(z))
    size = np.where(np.arange(4) == 3, bodies.size, 1.0)  # noqa: PLR2004 - lengths
    is_other = np.abs((tips - tip) / size).max((-1, -2)) > SAME_SOLUTION
    return AssemblyModes(modes.z[is_other], modes.margin[is_other])
