"""Identification Jacobians agree with Pinocchio's kinematic regressors.

The Pinocchio model has numerical placements, a joint for each coordinate-dependent motion, and one
more joint at the tool. Each column of the regressor is the tool twist caused by a unit displacement
of one placement. A complex-step derivative, exact up to rounding errors, gives the displacement of
each placement per unit of a parameter.
"""

import numpy as np
import pytest
import sympy as sp

from chasles.derive import derive, read
from chasles.derive.model.geometry import Geometry
from chasles.derive.model.placements import Rotation
from chasles.derive.terms.casadi_graph import lower
from tests.support.derivations import ROBOTS

pin = pytest.importorskip(
    "pinocchio", reason="Pinocchio, the oracle of this file, is not installed"
)

STEP = 1e-30
FRAMES = {
    "identification_jacobian": "LOCAL_WORLD_ALIGNED",
    "identification_jacobian_space": "WORLD",
    "identification_jacobian_body": "LOCAL",
}


def largest_difference(path, random, names=("identification_jacobian",)):
    robot = read(path)
    derived = derive(robot, functions=names)
    functions = lower(derived.functions, robot.name)
    p = np.array([float(derived.terms.value(g.value)) for g in derived.geometry.parameters])
    p += random.normal(size=len(p)) * 0.05
    q = random.uniform(-2, 2, len(robot.coordinates))
    worst = 0.0
    for name, found in zip(names, functions, strict=True):
        ours = np.array(found(q, p)).reshape(6, -1)
        theirs = regressor_jacobian(derived.geometry, q, p, FRAMES[name])
        assert ours.shape == theirs.shape
        worst = max(worst, np.abs(ours - theirs).max())
    return worst


def test_identification_jacobian_matches_pinocchio():
    """The robot lynxmotion is described in Craig's convention."""
    assert largest_difference(ROBOTS / "lynxmotion.toml", np.random.default_rng(7)) <= 1e-10


def test_identification_jacobian_matches_pinocchio_in_every_frame():
    """The robot scara has a prismatic joint, and is described in Denavit-Hartenberg convention."""
    path = ROBOTS / "scara.toml"
    assert largest_difference(path, np.random.default_rng(8), FRAMES) <= 1e-10


def regressor_jacobian(found: Geometry, q, p, frame: str) -> np.ndarray:
    """Return the tool twist (6, k) per unit of each parameter."""
    symbols = [*found.q, *(parameter.symbol for parameter in found.parameters)]
    values = np.array([*q, *p], dtype=float)
    placements, joints = _segments(found)
    at = [_placement(part, symbols) for part in placements]
    model = pin.Model()
    parent = 0
    for k, placement in enumerate(at):
        M = pin.SE3(placement(values).real)
        parent = model.addJoint(parent, _joint(joints[k] if k < len(joints) else None), M, f"{k}")
    moved = [sp.lambdify([symbols], value) for _, _, value in joints]
    configuration = np.array([*(value(values) for value in moved), 0.0])
    data = model.createData()
    pin.computeJointJacobians(model, data, configuration)
    reference = getattr(pin.ReferenceFrame, frame)
    by_placement = pin.computeJointKinematicRegressor(model, data, parent, reference)
    by_motion = pin.getJointJacobian(model, data, parent, reference)
    columns = []
    for k in range(len(found.q), len(symbols)):
        shifted = values.astype(complex)
        shifted[k] += 1j * STEP
        column = np.zeros(6)
        for i, placement in enumerate(at):
            M = placement(shifted)
            twist = np.linalg.inv(M.real) @ (M.imag / STEP)
            xi = [*twist[:3, 3], twist[2, 1], twist[0, 2], twist[1, 0]]
            column += by_placement[:, 6 * i : 6 * i + 6] @ xi
        for i, value in enumerate(moved):
            column += by_motion[:, i] * np.imag(value(shifted)) / STEP
        columns.append(column)
    return np.array(columns).T


def _segments(found: Geometry):
    """Return the constant placements, and the joints as tuples (is revolute, axis, value)."""
    placements, joints, waiting = [], [], []
    for motion in found.motions:
        arguments = [motion.angle] if isinstance(motion, Rotation) else list(motion.vector)
        moves = [any(symbol in a.free_symbols for symbol in found.q) for a in arguments]
        if any(moves):
            placements.append(tuple(waiting))
            waiting = []
            axis = motion.axis if isinstance(motion, Rotation) else "xyz"[moves.index(True)]
            joints.append((isinstance(motion, Rotation), axis, arguments[moves.index(True)]))
        else:
            waiting.append(motion)
    return [*placements, tuple(waiting)], joints


def _joint(described):
    if described is None:
        return pin.JointModelRZ()
    turns, axis, _ = described
    return getattr(pin, f"JointModel{'R' if turns else 'P'}{axis.upper()}")()


def _placement(motions, symbols):
    """Return a placement (4, 4) as a function of real or complex numbers."""
    arguments = [m.angle if isinstance(m, Rotation) else list(m.vector) for m in motions]
    evaluated = sp.lambdify([symbols], arguments)

    def at(values):
        T = np.eye(4, dtype=complex)
        for motion, argument in zip(motions, evaluated(values), strict=True):
            step = np.eye(4, dtype=complex)
            if isinstance(motion, Rotation):
                i = "xyz".index(motion.axis)
                j, k = (i + 1) % 3, (i + 2) % 3
                step[j, j] = step[k, k] = np.cos(argument)
                step[k, j] = np.sin(argument)
                step[j, k] = -step[k, j]
            else:
                step[:3, 3] = argument
            T = T @ step
        return T

    return at
