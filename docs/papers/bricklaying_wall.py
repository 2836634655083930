"""A wall that the bricklaying gantry lays, with bricks and speeds of our choice."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from report import Printed, Row, assumed, lost, not_printed

import chasles
from chasles.study.motion import MotionSequence, Trajectory, limit_violations, line

FloatArray = NDArray[np.float64]

BRICK = np.array([0.08, 0.04, 0.03])
"""Length, width and height of a brick [m], chosen so that a wall fits into the strokes of the
gantry."""
PICK_SPOT = np.array([0.04, 0.05, 0.03])
"""Guide position at which the gripper grips a brick by its upper face [m]."""
ABOVE = 0.03
"""Height above the drop position at which the guide moves horizontally [m]."""
SPEED = {"speed": 0.12, "acceleration": 0.4, "jerk": 4.0}
"""Limits of the guide's speed, acceleration and jerk [m/s, m/s^2, m/s^3]."""
GRIP = 0.4
"""Time to close or open the gripper [s]."""


def chain_of(gantry: Any, xyz: Any) -> FloatArray:
    """Return the prismatic joint values for a guide position [m], in main-chain order."""
    return np.array([xyz["xyz".index(joint.name)] for joint in gantry.chain_joints])


@dataclass(frozen=True)
class Wall:
    """The motion with which the gantry builds a wall.

    Attributes:
        places: (m, 3) planned guide positions at which bricks are released [m].
        released: (m, 3) guide positions at which bricks are released, computed by `fk` from the
            motor angles [m].
        sampled: The planned motion of the motors.
    """

    places: FloatArray
    released: FloatArray
    sampled: Trajectory


def bond() -> FloatArray:
    """Return the guide positions for a wall with rows of 4, 3 and 2 bricks.

    Each brick above the first row rests on two bricks.
    """
    length, _, height = BRICK
    return np.array(
        [
            [0.08 + length * (column + course / 2), 0.4, height * (1 + course)]
            for course in range(3)
            for column in range(4 - course)
        ]
    )


@cache
def wall() -> Wall:
    """Return the motion that lays all bricks: pick, lift, travel, lower, release and return."""
    gantry = chasles.load("bricklaying_gantry")
    laying = MotionSequence(gantry, gantry.actuators(chain_of(gantry, PICK_SPOT)))
    released = []
    for place in bond():
        height = place[2] + ABOVE
        laying = laying.pause(GRIP, "grip")
        laying = over(laying, place, height, "lay")
        released.append(gantry.fk(laying.q_end)[:3, 3])
        laying = over(laying.pause(GRIP, "release"), PICK_SPOT, height, "return")
    return Wall(bond(), np.array(released), laying.sample(frequency=50))


def over(laying: MotionSequence, place: FloatArray, height: float, name: str) -> MotionSequence:
    """Add a motion of the guide along three straight lines: up, horizontally, and down."""
    for stop in ([None, None, height], [place[0], place[1], height], place):
        start = laying.robot.fk(laying.q_end)
        end = start.copy()
        end[:3, 3] = [
            now if then is None else then for then, now in zip(stop, start[:3, 3], strict=True)
        ]
        laying = laying.follow(line(start, end), "s_curve", name=name, **SPEED)
    return laying


def wall_rows(printed: dict[str, Printed]) -> list[Row]:
    """Return table rows for the bricks and speeds that we chose, and for the position errors."""
    built = wall()
    beyond = limit_violations(chasles.load("bricklaying_gantry"), built.sampled)
    if beyond:
        raise ValueError(f"the motion exceeds the strokes: {beyond[0]}")
    missed = np.linalg.norm(built.released - built.places, axis=1).max()
    speeds = (
        "the guide moves with at most 0.12 m/s, 0.4 m/s² and 4 m/s³, and stays within all strokes"
    )
    return [
        assumed(
            printed["brick"], BRICK, "with this size, three courses of bricks fit into the strokes"
        ),
        assumed(
            printed["bricks"],
            len(built.places),
            "the courses have four, three and two bricks; each brick rests on two bricks",
        ),
        lost(
            printed["flow_chart"],
            f"{(built.sampled.stage[-1] + 1) / len(built.places):.0f} stages per brick",
            "the paper lists switching on, feeding design data, defining pick and drop spots, and "
            "going to the next area. Our stages are grip, lift, travel, lower, release and three "
            "returns",
        ),
        not_printed(
            printed["laying"],
            built.sampled.t[-1],
            f"{speeds}. Gripping and releasing take 0.4 s each",
        ),
        not_printed(
            printed["motors"],
            np.abs(built.sampled.qd).max(0),
            "we assume pulleys of 10 mm for x and y, and a sprocket of 15 mm",
        ),
        not_printed(
            printed["placed"],
            missed,
            "the positions follow from forward kinematics of the motor angles",
        ),
    ]
