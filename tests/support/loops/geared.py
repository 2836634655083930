"""Compares the functions of a geared linkage with loops closed by Newton's method."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import chasles
from tests.support.generators.geared_linkages import GearedLinkage
from tests.support.loops.closed_in_numbers import HELD, Model

STEP = 1e-5
REACH = 0.12
"""Largest change of an actuated coordinate from its reference value (in radian or decimeter)."""


@dataclass
class Errors:
    """Largest errors of the functions of one linkage (radian, or meter).

    Attributes:
        pose: Difference between ``fk`` and the tip pose after Newton's method closes the loops.
        joints: Difference between ``configuration`` and the joint values of Newton's method.
        jacobian: Difference between ``jacobian_mixed`` and finite differences of poses.
        acceleration: Difference between ``acceleration_mixed`` and finite differences of Jacobians.
        closure: Residual of ``constraint`` at the full configuration.
        rates: Product of ``constraint_D_z`` and the rates of the full configuration, which is 0
            without errors.
        back: Difference between coordinates q and the nearest result of
            ``actuator_branches(chain(q))``.
        inverse: Pose error of the valid solutions of ``ik``, or 1 if no solution equals the tested
            coordinates.
        configurations: Number of compared configurations.
    """

    pose: float = 0.0
    joints: float = 0.0
    jacobian: float = 0.0
    acceleration: float = 0.0
    closure: float = 0.0
    rates: float = 0.0
    back: float = 0.0
    inverse: float = 0.0
    configurations: int = 0


def errors_of(
    robot: chasles.Robot, linkage: GearedLinkage, rng: np.random.Generator, count: int
) -> Errors:
    """Compare a robot's functions with Newton's method at random coordinates near the reference."""
    found, model = Errors(), Model(linkage.mechanism)
    for _ in range(count):
        scale = [0.1 if c.unit == "m" else 1.0 for c in linkage.mechanism.coordinates]
        q = model.q + REACH * rng.uniform(-1, 1, len(model.q)) * scale
        try:
            u, held = model.followed(q, steps=6)
        except AssertionError:
            continue
        if held > HELD:
            _compare(found, robot, model, q, u, rng)
    return found


def _compare(
    found: Errors, robot: chasles.Robot, model: Model, q: np.ndarray, u: np.ndarray, rng
) -> None:
    found.configurations += 1
    T = model.tip(q, u)
    _note(found, "pose", robot.fk(q) - T)
    z = robot.configuration(q)
    names = [variable.name for variable in robot.configuration_variables]
    values = model.values(q, u)
    at = dict(zip(names, z, strict=True))
    coupled = model.mechanism.coupled
    off = np.array([at[name] - values[name] for name in values])
    whole = [name not in coupled for name in values]
    off[whole] = np.remainder(off[whole] + np.pi, 2 * np.pi) - np.pi
    _note(found, "joints", off)
    J = _differences(model, q, u)
    _note(found, "jacobian", robot.jacobian_mixed(q) - J)
    qd, qdd = rng.uniform(-1, 1, (2, len(q)))
    Jd = _slope(robot.jacobian_mixed, q, qd)
    _note(found, "acceleration", robot.acceleration_mixed(q, qd, qdd) - J @ qdd - Jd @ qd)
    _note(found, "closure", robot.constraint(z))
    _note(found, "rates", robot.constraint_D_z(z) @ _slope(robot.configuration, q, qd))
    if hasattr(robot, "actuator_branches"):
        branches = robot.actuator_branches(robot.chain(q))
        apart = np.remainder(branches.q[branches.valid] - q + np.pi, 2 * np.pi) - np.pi
        _note(found, "back", np.abs(apart).max(-1, initial=0.0).min(initial=np.inf))
    elif hasattr(robot, "actuators"):
        apart = robot.actuators(robot.chain(q)) - q
        _note(found, "back", np.remainder(apart + np.pi, 2 * np.pi) - np.pi)
    if hasattr(robot, "ik"):
        _compare_inverse(found, robot, q, T)


def _compare_inverse(found: Errors, robot: chasles.Robot, q: np.ndarray, T: np.ndarray) -> None:
    if robot.redundancy:
        return
    valid = robot.ik(T).valid_q()
    for other in valid:
        _note(found, "inverse", robot.fk(other) - T)
    apart = np.remainder(valid - q + np.pi, 2 * np.pi) - np.pi
    is_there = len(valid) and np.abs(apart).max(-1).min() < 1e-6
    _note(found, "inverse", np.array([0.0 if is_there else 1.0]))


def _differences(model: Model, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return the mixed Jacobian (6, n) from finite differences of tip poses."""
    columns = []
    for e in np.eye(len(q)):
        D = _slope(lambda at: _tip(model, at, u), q, e)
        W = D[:3, :3] @ _tip(model, q, u)[:3, :3].T
        columns.append([*D[:3, 3], W[2, 1], W[0, 2], W[1, 0]])
    return np.array(columns).T


def _slope(function: Callable[[np.ndarray], np.ndarray], q: np.ndarray, qd: np.ndarray):
    """Differentiate a function of q along the rates qd, by central differences of fourth order."""
    at = {k: function(q + k * STEP * qd) for k in (-2, -1, 1, 2)}
    return (8 * (at[1] - at[-1]) - (at[2] - at[-2])) / (12 * STEP)


def _tip(model: Model, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    return model.tip(q, model.closed(q, u))


def _note(found: Errors, name: str, error: np.ndarray) -> None:
    largest = float(np.max(np.abs(error), initial=0.0))
    previous = getattr(found, name)
    setattr(found, name, largest if np.isnan(largest) else max(previous, largest))
