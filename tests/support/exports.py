"""Inputs of exported functions, and the expected results from the compiled C code."""

import numpy as np

from tests.support.derivations import robot_of


def inputs_of(robot, info, q):
    """Return the input arrays of a function for given configurations."""
    rng = np.random.default_rng(3)
    if info.role.is_inverse:
        return [robot.fk(q), *(q[:, [k]] for k in info.role.fixed)]
    of_joints = {"theta": "chain", "z": "configuration"}.get(info.inputs[0].name)
    first = getattr(robot, of_joints)(q) if of_joints else q
    return [first, *(rng.uniform(-1, 1, (len(q), *item.shape)) for item in info.inputs[1:])]


def expected(robot, info, inputs):
    """Return the results of a function in double precision."""
    if not info.role.is_inverse:
        results = getattr(robot, info.name)(*inputs)
        return results if isinstance(results, tuple) else (results,)
    fixed = [robot_of(robot.name).coordinates[k].name for k in info.role.fixed]
    values = dict(zip(fixed, (x[:, 0] for x in inputs[1:]), strict=True))
    found = robot.ik(inputs[0], fixed=values) if fixed else robot.ik(inputs[0])
    return found.q, found.residual, found.margin


def inverse_of(robot):
    (info,) = (info for info in robot.manifest.functions if info.name == "ik")
    return info


def configurations(robot, count):
    """Return random configurations.

    If the robot has loops, the configurations are near its reference configuration.
    """
    rng = np.random.default_rng(7)
    if robot.reference:
        return np.array(robot.reference.q) + rng.uniform(-0.05, 0.05, (count, robot.n))
    return rng.uniform(-3, 3, (count, robot.n))


def right_angles(robot, count):
    """Return random configurations whose joint values are multiples of a right angle."""
    return np.random.default_rng(0).integers(-2, 3, (count, robot.n)) * (np.pi / 2)


def apart(x, y):
    """Return the absolute differences of angles modulo whole turns."""
    difference = x - y
    return np.abs(difference - 2 * np.pi * np.round(difference / (2 * np.pi)))


def regular_slots(robot, info, q, residual, regular=1e-3):
    """Return a Boolean mask of the valid inverse kinematics solutions away from singularities."""
    valid = residual <= 1e-9
    kept = [k for k in range(robot.n) if k not in info.role.fixed]
    J = robot.jacobian_mixed(q[valid])[..., kept]
    valid[valid] = np.linalg.svd(J, compute_uv=False)[:, -1] > regular
    return valid
