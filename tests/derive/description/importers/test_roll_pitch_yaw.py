"""Roll, pitch and yaw agree with products of rotations.

Roll, pitch and yaw that are multiples of 90 degrees are exact.
"""

import itertools
import random

import mpmath as mp
import numpy as np
import pytest
import sympy as sp

from chasles.derive.description.importers.mjcf.mjcf_model import roll_pitch_yaw
from chasles.derive.description.importers.roll_pitch_yaw import of_matrix, of_quaternion
from chasles.derive.model.tolerances import GIMBAL_LOCK

CASES = 300


def turn(axis, angle):
    found = mp.eye(3)
    j, k = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    found[j, j] = found[k, k] = mp.cos(angle)
    found[k, j], found[j, k] = mp.sin(angle), -mp.sin(angle)
    return found


def rotation(roll, pitch, yaw):
    return turn("z", yaw) * turn("y", pitch) * turn("x", roll)


def quaternion(roll, pitch, yaw):
    product = np.array([1.0, 0, 0, 0])
    for k, angle in ((3, yaw), (2, pitch), (1, roll)):
        w, x, y, z = product
        by = np.zeros(4)
        by[0], by[k] = np.cos(angle / 2), np.sin(angle / 2)
        a, b, c, d = by
        product = np.array(
            [
                w * a - x * b - y * c - z * d,
                w * b + x * a + y * d - z * c,
                w * c - x * d + y * a + z * b,
                w * d + x * c - y * b + z * a,
            ]
        )
    return product


def random_angles(dice):
    near = mp.mpf(10) ** -dice.randint(3, 18)
    choices = (0, mp.pi / 2, -mp.pi / 2, mp.pi, mp.pi / 2 - near, near - mp.pi / 2)
    return [
        dice.choice(choices) if dice.random() < 0.5 else mp.mpf(dice.uniform(-3.1, 3.1))
        for _ in range(3)
    ]


def test_rpy_reproduces_rotation_matrices_and_quaternions():
    dice = random.Random(5)
    with mp.workdps(40):
        for _ in range(CASES):
            angles = random_angles(dice)
            wanted = rotation(*angles)
            found = of_matrix(wanted)
            assert mp.mnorm(rotation(*found) - wanted) < 5 * GIMBAL_LOCK
            scale = dice.uniform(0.1, 3)
            found = of_quaternion(*(scale * quaternion(*map(float, angles))))
            assert mp.mnorm(rotation(*found) - rotation(*map(float, angles))) < 5 * GIMBAL_LOCK
            assert all(-mp.pi <= angle <= mp.pi for angle in found)


@pytest.mark.parametrize("step", [1, 6])
def test_rpy_is_exact_at_multiples_of_fifteen_degrees(step):
    """The test computes the input quaternions in double precision.

    At gimbal lock, yaw is 0.
    """
    turns = range(-12, 13, step) if step > 1 else random.Random(1).choices(range(-12, 13), k=6)
    for angles in itertools.product(turns, repeat=3):
        found = roll_pitch_yaw(quaternion(*(k * np.pi / 12 for k in angles)))
        twelfths = [12 * angle / sp.pi for angle in found]
        assert all(value.is_Integer for value in twelfths), angles
        if abs(found[1]) == sp.pi / 2:
            assert found[2] == 0
