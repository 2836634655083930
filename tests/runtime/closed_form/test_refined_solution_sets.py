"""A refined inverse kinematics function returns every regular solution exactly once."""

import numpy as np

from chasles.derive import read, read_text
from tests.support.compiling import compiled
from tests.support.derivations import description
from tests.support.fixed import fixed_at
from tests.support.oracles.newton_solutions import regular_solutions

FUNCTIONS = ("fk", "fk_jacobian_mixed", "ik")
SAME = 1e-5
"""Maximum angle (radian) between two configurations that count as equal."""
OFFSET_WRIST = """
name = "offset_wrist"
convention = "dh"
units = { length = "mm", angle = "deg" }
joints = [
  { name = "j1", d = 352, a = 70, alpha = -90 },
  { name = "j2", d = 0, a = 360, alpha = 0 },
  { name = "j3", d = 0, a = 0, alpha = 90 },
  { name = "j4", d = 380, a = 13.3, alpha = -90 },
  { name = "j5", d = 0, a = 0, alpha = 90 },
  { name = "j6", d = 65, a = 0, alpha = 0 },
]
"""
"""Robot file of an IRB 140 whose axis 5 misses axis 4 by 13.3 mm."""
NEAR_WRIST = (
    np.pi * np.array([0, 1, 1, 0.5, 1, 0]),
    np.pi * np.array([1.5, 0, 1, 0.5, 1, 0]),
    np.pi * np.array([-0.5, 0.5, 1, -0.5, 1, 0]),
    np.array([-2.49425114, 0.00785660, 2.98636075, 1.45100495, 0.00447197, -2.49826848]),
)
"""Configurations of the offset-wrist arm near its wrist singularity, where the smallest singular
value of the Jacobian is 0.007 to 0.009."""


def wrapped(angles):
    return (angles + np.pi) % (2 * np.pi) - np.pi


def is_found(arm, solutions, q):
    apart = np.abs(wrapped(solutions.q - q[..., None, :])).max(-1)
    return (solutions.valid & (apart < SAME)).any(-1)


def test_copies_of_nearly_singular_solutions_leave_their_slots(displaced_arm):
    """At pose 21, two refined solutions may differ by only 7e-8 rad, with a residual of 2e-10."""
    arm, q = displaced_arm, np.random.default_rng(1).uniform(-np.pi, np.pi, (600, 6))
    solutions = arm.ik(arm.fk(q))
    np.testing.assert_array_equal(solutions.count, solutions.distinct().count)
    assert len(regular_solutions(arm, arm.fk(q[21]))) == solutions.count[21]


def test_exact_pose_with_few_digits_is_solved_exactly(tmp_path):
    """The tested pose is exact although its entries have few digits."""
    arm = compiled(read(description("gen3")), tmp_path / "gen3", FUNCTIONS, ["c"])
    q = np.array([1, 1, 0, 0, 1, -1, 1]) * (np.pi / 2)
    T = arm.fk(q)
    solutions = arm.ik(T, fixed=fixed_at(arm, q))
    assert solutions.count >= 1
    assert solutions.residual[solutions.valid].max() < 1e-9
    assert np.abs(arm.fk(solutions.valid_q()) - T).max() < 2e-9


def test_offset_wrist_finds_solutions_that_no_nominal_branch_shows(tmp_path):
    robot = read_text(OFFSET_WRIST, file="offset_wrist.toml")
    arm = compiled(robot, tmp_path / "offset_wrist", FUNCTIONS, ["c"])
    rng = np.random.default_rng(2)
    right = rng.integers(0, 4, (300, 6)) * np.pi / 2
    near = np.repeat(NEAR_WRIST, 20, 0) + rng.normal(scale=1e-4, size=(80, 6))
    q = np.concatenate([NEAR_WRIST, near, right])
    T, J = arm.fk_jacobian_mixed(q)
    regular = np.linalg.svd(J, compute_uv=False)[:, -1] > 1e-3
    assert regular.sum() > 200
    solutions = arm.ik(T)
    assert is_found(arm, solutions, q)[regular].all()
    np.testing.assert_array_equal(solutions.count, solutions.distinct().count)
    for k in range(2):
        for other in regular_solutions(arm, T[k]):
            assert is_found(arm, solutions.at(k), other)
