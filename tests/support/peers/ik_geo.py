"""ik-geo: Elias and Wen's inverse kinematics algorithms in Rust, called through PyO3."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from ik_geo import Robot

from tests.support.oracles.screws import Screws, inverted, reverse
from tests.support.peers.interface import Inverse, aligned, meet, offsets, parallel

WRIST, BASE = (3, 4, 5), (0, 1, 2)


def inverse(chain: Screws) -> Inverse | None:
    if len(chain.axes) != 6 or not chain.revolute.all():
        return None
    if meet(chain, WRIST):
        return _spherical(chain)
    if parallel(chain, (1, 2, 3)) and meet(chain, (4, 5)):
        return _set_up(chain, Robot.three_parallel_two_intersecting, (4, 5))
    if meet(chain, BASE):
        return _reversed(chain)
    return None


def _spherical(chain: Screws) -> Inverse:
    if parallel(chain, (1, 2)):
        return _set_up(chain, Robot.spherical_two_parallel, WRIST)
    if meet(chain, (0, 1)):
        return _set_up(chain, Robot.spherical_two_intersecting, (0, 1), WRIST)
    return _set_up(chain, Robot.spherical, WRIST)


def _set_up(chain: Screws, family: Callable, *groups: tuple[int, ...]) -> Inverse:
    robot = family(chain.axes, offsets(chain, *groups))

    def call(T: np.ndarray):
        return robot.get_ik(T[:3, :3].T, T[:3, 3])

    def batch(T: np.ndarray):
        return [call(pose) for pose in T]

    return Inverse("ik-geo", call, _read, aligned(chain), batch)


def _reversed(chain: Screws) -> Inverse | None:
    """Return the IK function of an arm whose first three axes intersect, by reversing the arm."""
    other = inverse(reverse(chain))
    if other is None:
        return None

    def read(found):
        q, claimed = other.read(found)
        return [row[::-1] for row in q], claimed

    return replace(other, read=read, prepare=lambda T: other.prepare(inverted(T)))


def _read(found):
    return [q for q, _ in found], [not least_squares for _, least_squares in found]
