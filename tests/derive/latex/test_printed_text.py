"""Formulas parsed from the LaTeX text of an inverse agree with the generated IK function."""

import numpy as np
import pytest

from chasles.derive import derive
from chasles.derive.latex import fragments
from tests.support.derivations import committed, derivation
from tests.support.generators.synthetic import robot_of
from tests.support.printed_latex import Formula, PrintedInverse
from tests.support.printed_robots import FUNCTIONS
from tests.support.read_back import POSES, read_back, without_formula

SHIPPED = ("ur5e", "iiwa14")
"""Names of two arms with different structures and a closed-form inverse kinematics function.
``python tests/derive/latex/read_all.py`` tests all arms."""
CHAIN = "R/RLP/RxrxR"


def count_read_back(found, texts):
    """Count the solutions of the printed formulas that agree with the derived IK function."""
    assert not without_formula(found, texts)
    return read_back(found, texts=texts)


@pytest.mark.parametrize("name", SHIPPED)
def test_printed_text_of_shipped_arms_evaluates_to_their_inverse(name):
    assert count_read_back(derivation(name), committed(name)) >= POSES


def test_printed_text_of_a_random_arm_evaluates_to_its_inverse():
    found = derive(robot_of(CHAIN, right=True), functions=(*FUNCTIONS, "ik"))
    assert count_read_back(found, fragments(found)) >= POSES


def test_reader_of_printed_inverse_detects_a_wrong_sign():
    assert Formula(r"a_{2} c_{1} - 2 (b + 1)^{2}", {"a_{2}": 3, "c_{1}": 2, "b": 1}).value() == -2
    found = committed("puma560")
    text = found["inverse.tex"]
    wrong = text.replace(r"t_{18} t_{20} - t_{17}", r"t_{18} t_{20} + t_{17}")
    assert wrong != text
    T = np.eye(4)
    T[:3, 3] = 0.4, 0.3, 0.5
    one, other = (
        PrintedInverse(found | {"inverse.tex": shown}).solve(T, {}, (1, 1, 1))
        for shown in (text, wrong)
    )
    assert abs(one["q_{2}"] - other["q_{2}"]) > 0.1
