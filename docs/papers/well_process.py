"""The 49 s working process of the well manipulator, and three assumptions for its last stage."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

import chasles
from chasles.study.motion import MotionSequence, Trajectory, line

FloatArray = NDArray[np.float64]

TURNING = [0, 1, 2, 4, 6]
"""Indices of theta1, theta2, theta3, theta5 and theta7 among the joints of the main chain."""
ARMS = TURNING[1:]
CYLINDERS = [1, 2, 4, 6]
"""Indices of the four cylinders among the coordinates of the well manipulator."""
TELESCOPES = ["l_HI", "l_MN"]
OVER_THE_WELL = np.array([[0, 1, 0, 1.237], [0, 0, -1, 0], [-1, 0, 0, 1.02], [0, 0, 0, 1]])
"""Pose of the tool point R after 25 s [m], from step (4) of section 5."""
DESCENT = 2.166
"""Distance by which the tool moves down in each of the last two motions [m], in 10 s at 216.6 mm/s.
"""
RATE = 50.0
"""Samples per second."""
IN_PLANE = [0, 2, 4]
"""Indices of x, z and pitch in the six tool coordinates."""


@cache
def robot() -> Any:
    """Load the manipulator."""
    return chasles.load("well_manipulator")


@dataclass(frozen=True)
class Process:
    """The sampled working process of section 5 of the paper, which takes 49 s.

    Attributes:
        sampled: The motion of the coordinates and of the tool point R.
        theta: (m, 7) joint values of the main chain [rad or m].
        rates: (m, 7) joint rates of the main chain [rad/s or m/s].
        swings: (m, 4) angles theta8 to theta11 of the cylinders [rad].
    """

    sampled: Trajectory
    theta: FloatArray
    rates: FloatArray
    swings: FloatArray

    def at(self, time: float) -> int:
        """Return the sample index at a time [s].

        If two stages meet at this time, the sample belongs to the later stage.
        """
        return int(np.searchsorted(self.sampled.t, time - 0.5 / RATE))


def initial() -> FloatArray:
    """Return the main-chain joint values (7,) at the start of the motion [rad or m]."""
    theta = np.zeros(7)
    theta[TURNING] = np.radians([0, 88.79, -49.2, -86.76, -40.62])
    return theta


def over_the_well(down: float) -> FloatArray:
    """Return a pose of point R on its vertical line, a distance [m] below its pose after 25 s."""
    pose = OVER_THE_WELL.copy()
    pose[2, 3] -= down
    return pose


@cache
def process() -> Process:
    """Return the working process of the manipulator with all its eight stages.

    In the last stage, four joints satisfy three conditions. The four joints move by minimum-norm
    steps from the configuration at 37 s.
    """
    well, start = robot(), initial()
    q_start = well.actuators(start)
    q_object = q_start.copy()
    q_object[0] = np.radians(30)
    retracted = dict.fromkeys(TELESCOPES, 0.0)
    prepared = well.ik(OVER_THE_WELL, fixed={"theta2": start[1], **retracted})
    q_prepared = prepared.within_limits().nearest(q_start)
    narrow = line(over_the_well(0), over_the_well(DESCENT))
    moves = (
        MotionSequence(well, q_start)
        .move(q_object, "constant", duration=5, name="to the object")
        .pause(5, "grab")
        .move(q_start, "constant", duration=5, name="back")
        .move(well.chain(q_prepared), "constant", space="chain", duration=10, name="over the well")
        .pause(2, "adjust")
        .follow(narrow, "constant", fixed=["theta2", *TELESCOPES], duration=10, name="in")
        .pause(2, "adjust")
    )
    moves = moves.follow(
        line(over_the_well(DESCENT), over_the_well(2 * DESCENT)),
        "constant",
        fixed=TELESCOPES,
        redundancy="minimum_norm",
        duration=10,
        name="down",
    )
    sampled = moves.sample(RATE)
    theta, rates = well.chain(sampled.q), well.chain_rates(sampled.q, sampled.qd)
    return Process(sampled, theta, rates, well.passive(sampled.q))


def joint_norm(_: FloatArray) -> FloatArray:
    """Return the weight matrix (4, 4) of the norm of the joint rates."""
    return np.eye(len(ARMS))


def cylinder_norm(by_chain: FloatArray) -> FloatArray:
    """Return the weight matrix (4, 4) of the norm of the cylinder speeds."""
    return by_chain[np.ix_(CYLINDERS, ARMS)]


@cache
def integrated(norm: Callable[[FloatArray], FloatArray]) -> Process:
    """Return the process with joint rates of minimum norm in its last stage.

    Args:
        norm: Function that computes the (4, 4) weight matrix of the arm rates. Its argument
            contains the (7, 7) derivatives of the coordinates with respect to the main-chain
            joints.
    """
    found = process()
    first = found.at(39)
    theta, step = found.theta.copy(), 1 / RATE
    for k in range(first, len(theta) - 1):
        theta[k + 1] = theta[k] + runge_kutta(theta[k], step, norm)
    rates = found.rates.copy()
    rates[first:] = [least_rates(own, norm) for own in theta[first:]]
    q, qd = robot().actuators(theta), found.sampled.qd.copy()
    by_chain = robot().actuators_D_chain(theta[first:])
    qd[first:] = np.einsum("mij,mj->mi", by_chain, rates[first:])
    sampled = replace(found.sampled, q=q, qd=qd, T=robot().fk(q))
    return Process(sampled, theta, rates, robot().passive(q))


def runge_kutta(
    theta: FloatArray, step: float, norm: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """Return the joint change over a time step [s], by a fourth-order Runge-Kutta method."""
    a = least_rates(theta, norm)
    b = least_rates(theta + step / 2 * a, norm)
    c = least_rates(theta + step / 2 * b, norm)
    d = least_rates(theta + step * c, norm)
    return step / 6 * (a + 2 * b + 2 * c + d)


def least_rates(theta: FloatArray, norm: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Return the minimum-norm joint rates (7,) with which point R moves down [rad/s]."""
    by_chain = robot().actuators_D_chain(theta)
    J = (robot().jacobian_mixed(robot().actuators(theta)) @ by_chain)[np.ix_(IN_PLANE, ARMS)]
    inverse = np.linalg.inv(norm(by_chain))
    rates = np.zeros(len(theta))
    rates[ARMS] = inverse @ np.linalg.pinv(J @ inverse) @ [0, -DESCENT / 10, 0]
    return rates
