"""The iterative solver in C rejects functions and arrays of inconsistent sizes."""

import numpy as np
import pytest

import chasles
from chasles.iterative._numeric import Solver

NONE = (np.empty((0, 6)), np.empty((12, 0)))


@pytest.fixture(scope="module")
def arm():
    return chasles.load("ur5e")


def kernels(arm, *names):
    return tuple(arm.functions[name].kernel for name in names)


NUMBER = "expected two for the tool, one or two for a link"


@pytest.mark.parametrize(
    ("names", "more", "message"),
    [
        (["fk_jacobian_mixed"], (), f"kernels: got 1, {NUMBER}"),
        (["fk", "hessian_mixed"], (), "fk: its sizes do not match the other functions"),
        (["fk"] * 3, (), f"kernels: got 3, {NUMBER}"),
        ([], (1, np.empty((0, 8))), f"kernels: got 0, {NUMBER}"),
        (["link_poses"], (1,), "screws: expected for a link"),
    ],
    ids=[
        "tool without hessian",
        "wrong size",
        "too many kernels",
        "link without kernel",
        "link without screws",
    ],
)
def test_functions_must_suit_the_tip(arm, names, more, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        Solver(kernels(arm, *names), arm.lower, arm.upper, *NONE, *more)


@pytest.mark.parametrize(
    "screw",
    [[-1, 0], [99, 0], [0, -1], [0, 6]],
    ids=["negative link", "link too large", "negative joint", "joint too large"],
)
def test_screws_must_refer_to_frames_and_joints(arm, screw):
    screws = np.array([[*screw, 0, 0, 0, 0, 0, 1.0]])
    with pytest.raises(ValueError, match=r"^link or screws: an index is out of range$"):
        Solver(kernels(arm, "link_poses"), arm.lower, arm.upper, *NONE, 1, screws)


def test_arrays_must_have_the_size_of_the_robot(arm):
    functions = kernels(arm, "fk_jacobian_mixed", "hessian_mixed")
    with pytest.raises(ValueError, match=r"^lower: wrong shape$"):
        Solver(functions, arm.lower[:5], arm.upper, *NONE)
    solver = Solver(functions, arm.lower, arm.upper, *NONE)
    with pytest.raises(ValueError, match=r"^T: expected shape \(..., 4, 4\)$"):
        solver.solve(np.eye(3), None, np.ones(6), False, 1e-9, 1.0, 100, 1, np.zeros(6, bool))
