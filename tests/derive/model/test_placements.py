"""Tests the placement of a joint: the rotation that moves z onto a joint axis, and the inverse
placement."""

import math

import numpy as np
import pytest
import sympy as sp

from chasles.derive.model.placements import align_z, inverse, rotation, translation
from tests.campaigns.mutants import matrix

AXES = [(0, 0, 2), (0, 0, "1/2"), (0, 0, "-1/2"), (0, "-1/3", 0), (1, -2, 2), ("0.31", 0, "-1.7")]


@pytest.mark.parametrize("axis", AXES, ids=str)
def test_z_is_rotated_to_an_axis_of_any_length(axis):
    values = [float(sp.Rational(x)) for x in axis]
    unit = np.array(values) / math.hypot(*values)
    np.testing.assert_allclose(matrix(align_z(axis))[:3, 2], unit, atol=1e-15)


def test_inverse_cancels_every_motion():
    placement = translation(1, "-2", "1/3") + rotation("y", "pi/5") + translation("0.7", 3, -1)
    product = matrix(placement + rotation("z", 2)) @ matrix(inverse(placement + rotation("z", 2)))
    np.testing.assert_allclose(product, np.eye(4), atol=1e-15)
