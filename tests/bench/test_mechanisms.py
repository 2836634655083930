"""Both sides of the benchmarks of robots with loops compute the same kinematics."""

import numpy as np
import pytest

import chasles
from bench.measures import mechanisms
from bench.native.kernel import kernel
from bench.peers.forward import absent
from tests.support.tolerances import AGREEMENT

POSES = 20


def close(found, wanted):
    assert np.shape(found) == np.shape(wanted)
    assert np.abs(np.asarray(found) - wanted).max() <= AGREEMENT


def results(loop, q):
    T, J = np.zeros((len(q), 4, 4)), np.zeros((len(q), 6, loop.joints))
    loop.fk_jacobian(q, T, J)
    return T, J


@pytest.mark.parametrize("name", mechanisms.CHAINS)
def test_main_chain_is_the_same_robot_without_loops(name):
    robot = chasles.load(name)
    own, chain = mechanisms.chain_loops(robot)
    q = mechanisms.closed(robot, POSES)
    assert len(q) == POSES
    T, J = robot.fk_jacobian_mixed(q)
    in_q, in_theta = results(own, q), results(chain, robot.chain(q))
    close(in_q[0], T)
    close(in_q[1], J)
    close(in_theta[0], T)
    close(in_theta[1] @ robot.chain_D_q(q), J)


@pytest.mark.skipif("pinocchio" in absent(), reason="pinocchio is not installed")
def test_five_bar_of_pinocchio_agrees():
    robot = chasles.load("five_bar")
    peer = mechanisms.five_bar_peer(robot)
    path = mechanisms.five_bar_path(robot)
    assert robot.valid(path).all()
    q = path[:POSES]
    for k, (T, J) in enumerate(zip(*robot.fk_jacobian_mixed(q), strict=True)):
        pose, jacobian = peer.fk_jacobian(q[k])
        close(pose.homogeneous, T)
        close(jacobian, J)
        z = robot.configuration(q[k])
        close(peer.z, z)
        close(peer.velocity_map(z)[:2], robot.chain_D_q(q[k]))
    assert peer.corrections == 2 * (POSES - 1)


@pytest.mark.parametrize(("name", "function"), mechanisms.TIMED)
def test_kernel_computes_what_the_robot_does(name, function):
    robot = chasles.load(name)
    q = mechanisms.closed(robot, POSES)
    info = robot.functions[function]
    rows = q if info.inputs[0].name == "q" else robot.chain(q)
    wanted = getattr(robot, function)(rows[-1])
    in_C = kernel(robot, function)
    in_C.run(np.ascontiguousarray(rows))
    several = wanted if isinstance(wanted, tuple) else (wanted,)
    assert len(several) == len(in_C.results)
    for found, result in zip(in_C.results, several, strict=True):
        finite = np.nan_to_num(np.ravel(result))
        close(np.nan_to_num(found[: finite.size]), finite)
