"""The inverse of a general arm: the function ``ik``, solved by eigenvalues over its tables."""

import numpy as np

from ...model.robot import Robot
from ...terms.role import Role
from ...terms.symbolic_function import Result, Table, WrittenFunction
from ..tasks.slots import pose_argument
from .eigenvalue_tables import tables
from .line_quantities import Array
from .raghavan_roth import Split, signs

SOLVER = "general"
SLOTS = 16
OPERATIONS = 100_000
"""Approximate count: 13,000 for the reflections of the equations, 17,000 for the matrix, 55,000 for
its sixteen eigenvalues, 16,000 for the other joints and 6,000 for Newton's steps."""
CALLS = ("ik_matrices", "fk_jacobian_mixed")


def inverse(robot: Robot, split: Split) -> WrittenFunction:
    """The function ``ik``: every solution of a pose, in sixteen slots.

    Solutions come first, in the order of the suppressed joint; the other slots hold nearest
    answers, from the real parts of complex roots. The margin of a solution is |det J| over the
    product of the lengths of J's columns, with metres in parts of the arm's length: 0 where J is
    singular and two solutions meet, at most 1. The margin of another slot is its negative residual.
    """
    n = len(robot.coordinates)
    outputs = (
        Result("q", (), (SLOTS, n), "rad", "joint coordinates, one solution a row"),
        Result("residual", (), (SLOTS,), "m or rad", "distance of fk(q[k]) from the target"),
        Result(
            "margin",
            (),
            (SLOTS,),
            "1",
            "distance from a singularity; in a slot without a solution the negative residual",
        ),
    )
    numbers = tables(robot, split)
    suppressed = robot.coordinates[split.joints[2]].name
    labels = tuple(f"number {k + 1} in the order of {suppressed}" for k in range(SLOTS))
    return WrittenFunction(
        "ik",
        f"Every solution of the inverse kinematics, in {SLOTS} slots, solutions first.",
        "fk(q[k]) = T wherever residual[k] is rounding",
        (pose_argument(robot),),
        outputs,
        SOLVER,
        (
            split.joints,
            tuple(map(float, signs(robot, split))),
            float(numbers.length),
            *(_table(values) for values in (numbers.right, numbers.own, numbers.back)),
        ),
        CALLS,
        SLOTS,
        OPERATIONS,
        role=Role("inverse", "pose", labels=labels),
    )


def _table(values: Array) -> Table:
    """Nested rows of doubles."""
    return tuple(_table(row) if row.ndim else float(row.item()) for row in map(np.asarray, values))
