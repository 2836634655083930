"""EAIK (Ostermeier and others): closed-form inverse kinematics in C++, called through pybind11."""

import numpy as np
from eaik.IK_HP import HPRobot

from tests.support.oracles.screws import Screws
from tests.support.peers.interface import Inverse, aligned, offsets

ONE_THREAD = 1


def inverse(chain: Screws) -> Inverse | None:
    if len(chain.axes) != 6 or not chain.revolute.all():
        return None
    robot = HPRobot(chain.axes, offsets(chain))
    if not robot.hasKnownDecomposition():
        return None
    batch = lambda T: robot.IK_batched(T, ONE_THREAD)  # noqa: E731
    return Inverse("EAIK", robot.IK, _read, aligned(chain), batch)


def _read(found):
    return found.Q, ~np.asarray(found.is_LS, bool)
