"""DH robots agree with the Robotics Toolbox: poses, Jacobians and Hessians."""

import numpy as np
import pytest

import chasles
from tests.support.optional import OptionalPackage
from tests.support.tolerances import ORACLE

rtb = OptionalPackage("roboticstoolbox")

POSES = 50


def puma560():
    return rtb.models.DH.Puma560()


def stanford():
    inch, right = 0.0254, np.pi / 2
    return rtb.DHRobot(
        [
            rtb.RevoluteDH(d=16.22 * inch, alpha=-right),
            rtb.RevoluteDH(d=6.05 * inch, alpha=right),
            rtb.PrismaticDH(theta=-right),
            rtb.RevoluteDH(alpha=-right),
            rtb.RevoluteDH(alpha=right),
            rtb.RevoluteDH(d=10.35 * inch),
        ]
    )


def panda():
    robot = rtb.models.DH.Panda()
    robot.tool = np.eye(4)
    return robot


@pytest.mark.parametrize("model", [puma560, stanford])
def test_dh_robots_match_robotics_toolbox(model):
    oracle, robot = model(), chasles.load(model.__name__)
    checked = 0
    for q in np.random.default_rng(2).uniform(-np.pi, np.pi, (POSES, robot.n)):
        close(robot.fk(q), oracle.fkine(q).A)
        close(robot.jacobian_mixed(q), oracle.jacob0(q))
        close(robot.jacobian_body(q), oracle.jacobe(q))
        close(robot.hessian_mixed(q), oracle.hessian0(q).transpose(1, 2, 0))
        for link, expected in zip(robot.link_poses(q), oracle.fkine_all(q)[1:], strict=True):
            close(link, expected.A)
        checked += 1
    assert checked == POSES


def test_modified_dh_poses_match_robotics_toolbox():
    oracle, robot = panda(), chasles.load("panda")
    flange_to_hand = np.linalg.inv(oracle.fkine(np.zeros(7)).A) @ robot.fk(np.zeros(7))
    turn = np.eye(4)
    turn[:2, :2] = np.array([[1, 1], [-1, 1]]) / np.sqrt(2)
    close(flange_to_hand, turn)
    for q in np.random.default_rng(4).uniform(-np.pi, np.pi, (POSES, 7)):
        close(robot.fk(q), oracle.fkine(q).A @ turn)


def close(found, expected):
    assert np.abs(found - expected).max() <= ORACLE
