"""Static loads of mechanisms agree with MuJoCo's inverse dynamics at rest.

Each trial draws random configurations, masses, gravity and a wrench on the tool. Actuator and strut
forces and all joint wrenches must equal MuJoCo's values.
"""

from dataclasses import dataclass

import numpy as np

import chasles
from chasles.study import static_loads
from tests.support.oracles.mujoco_statics import mujoco_loads, random_masses

from .bars import barred
from .campaign import Campaign, Outcome

MECHANISMS = (
    *("board_installer", "bricklaying_gantry", "delta", "excavator", "five_bar", "four_bar"),
    *("planar_3rrr", "slider_crank", "stewart_gough", "well_manipulator"),
)
STATES = 20
BARS = {"actuators": 1e-9, "joints": 1e-9, "struts": 1e-9}


@dataclass(frozen=True)
class Differences:
    """Largest load differences from MuJoCo, relative to the largest load at a configuration."""

    actuators: float
    joints: float
    struts: float


def trial(number: int) -> Outcome:
    robot, rng = chasles.load(MECHANISMS[number % len(MECHANISMS)]), np.random.default_rng(number)
    masses = random_masses(robot, rng)
    gravity, wrench = rng.normal(size=3) * 5, rng.normal(size=(STATES, 6)) * 50
    q = robot.random_q(STATES, rng=number)
    found = static_loads(robot, q, masses, wrench=wrench, gravity=gravity)
    gaps = []
    for k in range(STATES):
        wanted = mujoco_loads(robot, q[k], masses, wrench[k], gravity)
        size = max(np.abs(wanted.joints).max(), np.abs(wanted.struts).max(initial=0.0))
        own = found.actuator_forces[k], found.joint_wrenches[k], found.strut_forces[k]
        gaps.append(
            [np.abs(a - b).max(initial=0.0) / size for a, b in zip(own, wanted, strict=False)]
        )
    return barred(robot.name, Differences(*np.max(gaps, axis=0)), BARS)


CAMPAIGN = Campaign(
    "statics", "Static loads of mechanisms equal MuJoCo's inverse dynamics at rest.", trial
)
