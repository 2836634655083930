"""exp, log, adjoint and differentials agree with Pinocchio.

Pinocchio's Motion also has the component order (v, omega). Pinocchio's Jexp is the right
differential, `dexp_right`, and Jlog is the inverse of Jexp.
"""

from typing import Any

import numpy as np
import pytest

from . import lie
from .oracles import ANGLES, LAW_TOLERANCE, PRINCIPAL_ANGLES, few_twists, random_twists, wide

pin = pytest.importorskip(
    "pinocchio", reason="Pinocchio, the oracle of this file, is not installed"
)


def numbers(M: lie.Matrix) -> np.ndarray:
    return np.array(wide(M).tolist(), dtype=float)


def motion(x: lie.Matrix) -> Any:
    return pin.Motion(numbers(x).ravel())


def assert_same(ours: lie.Matrix, theirs: np.ndarray, case: object) -> None:
    error = np.abs(numbers(ours) - theirs.reshape(ours.shape)).max()
    assert error <= LAW_TOLERANCE, f"off by {error} at {case}"


CASES = [*few_twists(ANGLES), *random_twists(6, seed=13)]


def test_exp_inverse_and_adjoints_match_pinocchio() -> None:
    checked = 0
    for x in CASES:
        T = lie.exp_se3(x)
        M = pin.exp6(motion(x))
        assert_same(T, M.homogeneous, x)
        assert_same(lie.exp_so3(x[3:, :]), pin.exp3(numbers(x[3:, :]).ravel()), x)
        assert_same(lie.adjoint(T), M.action, x)
        assert_same(lie.inverse_se3(T), M.inverse().homogeneous, x)
        assert_same(lie.ad(x), motion(x).action, x)
        checked += 1
    assert checked == 13 + 6


def test_log_matches_pinocchio_log6() -> None:
    checked = 0
    for x in few_twists(PRINCIPAL_ANGLES):
        T = lie.exp_se3(x)
        assert_same(lie.log_se3(T), pin.log6(numbers(T)).vector, x)
        checked += 1
    assert checked == 12


def test_dexp_right_matches_pinocchio_jexp6() -> None:
    checked = 0
    for x in CASES:
        assert_same(lie.dexp_right_se3(x), pin.Jexp6(motion(x)), x)
        assert_same(lie.dexp_right_so3(x[3:, :]), pin.Jexp3(numbers(x[3:, :]).ravel()), x)
        checked += 1
    assert checked == 13 + 6


def test_dexp_right_inverse_matches_pinocchio_jlog6() -> None:
    checked = 0
    for x in few_twists(PRINCIPAL_ANGLES):
        M = pin.exp6(motion(x))
        assert_same(lie.dexp_right_inverse_se3(x), pin.Jlog6(M), x)
        checked += 1
    assert checked == 12
