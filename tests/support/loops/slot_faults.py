"""Checks inverse kinematics solutions of robots with loops by forward kinematics."""

from collections import Counter

import numpy as np

import chasles
from chasles.derive.model.mechanism import Mechanism

FAULTS = ("another pose", "lost", "negative length", "valid in another mode")
SAME_POSE, SAME = 1e-7, 1e-6
"""Tolerances of equal poses (SAME_POSE) and equal coordinates (SAME), in radian or relative to the
robot size."""
CLEAR = 1e-3
"""Minimum margin of a configuration that ``ik`` must recover.

A configuration with a smaller margin is too close to a dead point for an accurate comparison.
"""


def slot_faults(robot: chasles.Robot, mechanism: Mechanism, q: np.ndarray) -> Counter[str]:
    """Count the wrong solutions of ``ik(fk(q))``, and the configurations q that ``ik`` misses.

    Args:
        robot: The robot, whose redundant joints are fixed at their values in each configuration.
        mechanism: The description of the robot.
        q: (N, n) coordinates of the tested configurations.
    """
    T = robot.fk(q)
    closed = np.isfinite(T).all((1, 2))
    q, T = q[closed], T[closed]
    given = {parameter.name: q[:, parameter.index] for parameter in robot.redundancy}
    slots = robot.ik(T, fixed=given) if given else robot.ik(T)
    valid, size = slots.valid, robot.unit_length
    back = robot.fk(slots.q.reshape(-1, robot.n)).reshape(*valid.shape, 4, 4)
    missed = np.abs(back - T[:, None])
    missed[..., :3, 3] /= size
    is_pose = missed.max((-2, -1)) < SAME_POSE
    turns = np.array([c.unit == "rad" for c in robot.coordinates])
    apart = slots.q - q[:, None]
    apart = np.where(turns, np.remainder(apart + np.pi, 2 * np.pi) - np.pi, apart / size)
    own = (np.abs(apart) < SAME).all(-1)
    return Counter(
        {
            "another pose": int((valid & ~is_pose).sum()),
            "lost": int((~(own & valid).any(-1) & _clear(robot, q)).sum()),
            "negative length": int((valid & (_lengths(mechanism, slots.q) <= 0).any(-1)).sum()),
            "valid in another mode": int((valid & slots.other_mode).sum()),
        }
    )


def _clear(robot: chasles.Robot, q: np.ndarray) -> np.ndarray:
    """Test whether configurations (N, n) are far from dead points of `chain` and `actuators`."""
    clear = np.ones(len(q), dtype=bool)
    for name, values in (("margin", q), ("actuator_margin", robot.chain(q))):
        if name in robot.functions:
            margin = robot.functions[name](values)
            clear &= (margin > CLEAR).reshape(len(q), margin.size // max(len(q), 1)).all(-1)
    return clear


def _lengths(mechanism: Mechanism, q: np.ndarray) -> np.ndarray:
    """Return the lengths (..., m) of the actuated cylinders at coordinates (..., n)."""
    values = {p.symbol: p.value for p in mechanism.parameters}
    struts = {strut.name: strut for strut in mechanism.struts}
    found = [
        float(struts[c.moves].length.xreplace(values)) + float(c.ratio.xreplace(values)) * q[..., k]
        for k, c in enumerate(mechanism.coordinates)
        if c.moves in struts
    ]
    return np.stack(found, -1) if found else np.ones((*q.shape[:-1], 1))
