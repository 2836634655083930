"""The iterative solver in C refuses functions and arrays that do not match each other."""

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


@pytest.mark.parametrize(
    ("kind", "names", "message"),
    [
        ("tool", ["fk_jacobian_mixed"], "kernels: expected more than 1 for a tool"),
        ("tool", ["fk", "hessian_mixed"], "fk: its sizes do not match the other functions"),
        ("tool", ["fk"] * 3, "kernels: expected fewer than 3 for a tool"),
        ("link", [], "kernels: expected more than 0 for a link"),
        ("link", ["link_poses"], "screws: expected for a link"),
        ("platform", ["fk"], "kernels: expected more than 1 for a platform"),
        ("arm", ["fk"], "kind: expected tool, link or platform, got arm"),
    ],
    ids=[
        "tool without hessian",
        "wrong size",
        "too many kernels",
        "link without kernel",
        "link without screws",
        "platform without jacobian",
        "unknown kind",
    ],
)
def test_functions_must_suit_the_kind_of_tip(arm, kind, names, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        Solver(kind, kernels(arm, *names), arm.lower, arm.upper, *NONE)


@pytest.mark.parametrize(
    "screw",
    [[-2, 0], [99, 0], [0, -1], [0, 6]],
    ids=["negative frame", "frame too large", "negative joint", "joint too large"],
)
def test_screws_must_refer_to_frames_and_joints(arm, screw):
    screws = np.array([[*screw, 0, 0, 0, 0, 0, 1.0]])
    with pytest.raises(ValueError, match=r"^link or screws: an index is out of range$"):
        Solver("link", kernels(arm, "link_poses"), arm.lower, arm.upper, *NONE, 1, screws)


def test_arrays_must_have_the_size_of_the_robot(arm):
    functions = kernels(arm, "fk_jacobian_mixed", "hessian_mixed")
    with pytest.raises(ValueError, match=r"^lower: wrong shape$"):
        Solver("tool", functions, arm.lower[:5], arm.upper, *NONE)
    solver = Solver("tool", functions, arm.lower, arm.upper, *NONE)
    with pytest.raises(ValueError, match=r"^T: expected shape \(..., 4, 4\)$"):
        solver.solve(np.eye(3), None, np.ones(6), False, 1e-9, 1.0, 100, 1, np.zeros(6, bool))
