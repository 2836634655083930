"""Inverse kinematics solutions of chasles and of other libraries, for tests."""

import numpy as np

from tests.support.fixed import fixed_values
from tests.support.generators.poses import Case
from tests.support.peers.interface import Answers, answers

FIXED_JOINTS = {"iiwa14": 2, "panda": 6}
"""Index of the joint that is fixed if a library can solve only six joints."""
MAX_JOINTS = 6
"""Maximum number of joints at which a pose has finitely many solutions."""


def own_answers(case: Case, q: np.ndarray) -> Answers:
    """Return the solutions of chasles for the targets at q (m, n)."""
    fixed = fixed_values(case.robot, case.others(q)) if case.given else {}
    solve = getattr(case.robot, case.function)
    found = solve(case.targets(q), **({"fixed": fixed} if fixed else {}))
    return Answers(found.q, found.valid)


def peer_answers(name: str, case: Case, q: np.ndarray) -> Answers:
    """Return the solutions of another library for the targets at q (m, n)."""
    fixed = FIXED_JOINTS.get(case.name, -1)
    return answers(name, case.screws, case.targets(q), fixed, q[:, fixed])


def chooses_branches(name: str, case: Case) -> bool:
    """Test whether the library selects some of infinitely many solutions of a redundant robot."""
    return name == "ssik" and case.robot.n > MAX_JOINTS
