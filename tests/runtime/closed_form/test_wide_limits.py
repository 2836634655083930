"""Limits that span many turns raise an error, which suggests that the unit is degrees."""

import numpy as np
import pytest

import chasles
from chasles.errors import InputValueError


def test_limits_in_degrees_raise_error_about_windings():
    found, limits = chasles.load("ur5e").ik(np.eye(4)), np.full(6, 180.0)
    with pytest.raises(
        InputValueError,
        match=r"windings of each solution are within the limits .*; limits must be in radians, "
        "not degrees",
    ):
        found.within_limits(np.stack([-limits, limits], -1))
    assert found.within_limits(np.stack([-limits, limits], -1), windings=False).q.shape == (8, 6)
