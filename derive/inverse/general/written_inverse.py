"""The C of a general arm's inverse: its tables, and the function ``ik`` over them."""

import textwrap

import numpy as np

from ...emit.c.scalar import notice
from ...model.robot import Robot
from ...terms.symbolic_function import Result, WrittenFunction
from ..tasks.slots import pose_argument
from .eigenvalue_tables import tables
from .line_quantities import Array
from .raghavan_roth import Split, signs

SUPPORT = "chasles_general.h"
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
    return WrittenFunction(
        "ik",
        f"Every solution of the inverse kinematics, in {SLOTS} slots, solutions first.",
        "fk(q[k]) = T wherever residual[k] is rounding",
        (pose_argument(robot),),
        outputs,
        source(robot, split),
        SUPPORT,
        SLOTS,
        CALLS,
        OPERATIONS,
    )


def source(robot: Robot, split: Split) -> str:
    """The file ``<robot>_ik.h``: ``void <robot>_ik(T, q, residual, margin)`` and its tables.

    It stands behind ``ik_matrices`` and ``fk_jacobian_mixed``, which it calls.
    """
    numbers = tables(robot, split)
    joints = ", ".join(map(str, split.joints))
    senses = ", ".join(f"{sign}.0" for sign in signs(robot, split))
    rows = [
        f"  {robot.name}_ik_matrices,",
        f"  {robot.name}_fk_jacobian_mixed,",
        f"  {{{joints}}},",
        f"  {{{senses}}},",
        f"  {float(numbers.length)!r},",
        _table(numbers.right),
        _table(numbers.own),
        _table(numbers.back),
    ]
    arm = "\n".join(rows)
    return f"""\
{notice(robot)}
#include "{SUPPORT}"

static const chasles_general_arm {robot.name}_arm = {{
{arm}
}};

void {robot.name}_ik(const double T[16], double q[{6 * SLOTS}], double residual[{SLOTS}],
    double margin[{SLOTS}])
{{
  double pose[16];
  memcpy(pose, T, sizeof pose);
  chasles_general_ik(&{robot.name}_arm, pose, q, residual, margin);
}}
"""


def _table(values: Array) -> str:
    text = _braces(values)
    return "\n".join(textwrap.wrap(f"{text},", 100, initial_indent="  ", subsequent_indent="    "))


def _braces(values: Array) -> str:
    rows = (
        _braces(row) if row.ndim else repr(float(row.item()) + 0.0)
        for row in map(np.asarray, values)
    )
    return "{" + ", ".join(rows) + "}"
