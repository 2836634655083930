"""Random chains agree with Pinocchio: poses, Jacobians and their time derivatives."""

import random

import numpy as np
import pinocchio as pin

from chasles.derive import derive
from chasles.derive.terms.casadi_graph import lower
from tests.support.chains import random_chain
from tests.support.tolerances import ORACLE, ORACLE_RATES

from .campaign import Campaign, Outcome

FRAMES = {
    "space": pin.ReferenceFrame.WORLD,
    "body": pin.ReferenceFrame.LOCAL,
    "mixed": pin.ReferenceFrame.LOCAL_WORLD_ALIGNED,
}
POSES = 3
CHAINS = 20
"""Number of random chains per trial."""


def trial(number: int) -> Outcome:
    """Check many chains."""
    generator = random.Random(number)
    for _ in range(CHAINS):
        check_jacobians(generator.randrange(2**32))
    check_motions(generator.randrange(2**32))
    return Outcome({"chains": CHAINS + 1, "configurations": CHAINS * POSES + 1})


def check_jacobians(seed: int) -> None:
    """Compare poses and Jacobians of a random chain with Pinocchio."""
    generator = random.Random(seed)
    chain = random_chain(generator, generator.randint(1, 12))
    robot = chain.robot()
    # To save time, each chain is tested with only one of the three Jacobian frames.
    name = tuple(FRAMES)[seed % len(FRAMES)]
    wanted = ("fk", "link_poses", f"jacobian_{name}", f"jacobian_{name}_dot")
    functions = dict(
        zip(wanted, lower(derive(robot, functions=wanted).functions, "c"), strict=True)
    )
    model, frames = chain.pinocchio()
    data = model.createData()
    D_q = np.array(robot.joint_values_D_q(), float)
    offset = np.array(robot.joint_values([0] * D_q.shape[1]), float)
    numbers = np.random.default_rng(seed)
    for _ in range(POSES):
        q, qd = numbers.uniform(-np.pi, np.pi, (2, D_q.shape[1]))
        pin.computeJointJacobiansTimeVariation(model, data, D_q @ q + offset, D_q @ qd)
        pin.updateFramePlacements(model, data)
        links = _shaped(functions["link_poses"](q), (-1, 4, 4))
        for T_0_link, frame in zip(links, frames[:-1], strict=True):
            _close(T_0_link, data.oMf[frame].homogeneous, ORACLE, seed)
        tool = data.oMf[frames[-1]].homogeneous
        _close(_shaped(functions["fk"](q), (4, 4)), tool, ORACLE, seed)
        J, J_dot = _jacobian_and_rate(model, data, frames[-1], FRAMES[name], D_q)
        _close(_shaped(functions[f"jacobian_{name}"](q), J.shape), J, ORACLE, seed)
        found = _shaped(functions[f"jacobian_{name}_dot"](q, qd), J.shape)
        _close(found, J_dot, ORACLE_RATES, seed)


def _jacobian_and_rate(model, data, tool, reference, D_q):
    """Return Pinocchio's tool Jacobian and its time derivative."""
    J = pin.getFrameJacobian(model, data, tool, reference)
    J_dot = pin.getFrameJacobianTimeVariation(model, data, tool, reference)
    return J.reshape(6, -1) @ D_q, J_dot.reshape(6, -1) @ D_q


MOTIONS = (
    "hessian_mixed",
    *(f"twist_{name}" for name in FRAMES),
    *(f"acceleration_{name}" for name in FRAMES),
)


def check_motions(seed: int) -> bool:
    """Compare Hessians, twists and accelerations of a chain with Pinocchio.

    Returns True if the random chain has a coupled joint.
    """
    generator = random.Random(seed)
    chain = random_chain(generator, generator.randint(2, 9))
    robot = chain.robot()
    functions = dict(
        zip(MOTIONS, lower(derive(robot, functions=MOTIONS).functions, "c"), strict=True)
    )
    model, frames = chain.pinocchio()
    data = model.createData()
    D_q = np.array(robot.joint_values_D_q(), float)
    n = D_q.shape[1]
    offset = np.array(robot.joint_values([0] * n), float)
    q, qd, qdd = np.random.default_rng(seed).uniform(-1, 1, (3, n))
    pin.computeJointJacobiansTimeVariation(model, data, D_q @ q + offset, D_q @ qd)
    pin.updateFramePlacements(model, data)
    for name, reference in FRAMES.items():
        J, J_dot = _jacobian_and_rate(model, data, frames[-1], reference, D_q)
        twist = _shaped(functions[f"twist_{name}"](q, qd), (6,))
        _close(twist, J @ qd, ORACLE, seed)
        acceleration = _shaped(functions[f"acceleration_{name}"](q, qd, qdd), (6,))
        _close(acceleration, J @ qdd + J_dot @ qd, ORACLE_RATES, seed)
        if name == "mixed":
            H = _shaped(functions["hessian_mixed"](q), (6, n, n))
            _close(H @ qd, J_dot, ORACLE_RATES, seed)
    return bool(robot.couplings)


def _shaped(value, shape):
    return np.array(value).reshape(shape)


def _close(found, expected, tolerance, seed):
    assert np.abs(found - expected).max() <= tolerance, f"chain of seed {seed}"


CAMPAIGN = Campaign(
    "chains",
    "Poses, Jacobians, Hessians, twists and accelerations of random chains agree with Pinocchio.",
    trial,
)
