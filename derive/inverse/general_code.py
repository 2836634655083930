"""The C of a general arm's inverse: its tables, and the function ``ik`` over them."""

import textwrap

import numpy as np

from ..c_code import notice
from ..robot import Robot
from .general_lines import Array
from .general_tables import tables
from .raghavan_roth import Split, signs

SUPPORT = "chasles_general.h"
SLOTS = 16


def source(robot: Robot, split: Split) -> str:
    """The file ``<robot>_ik.c``: ``void <robot>_ik(T, q, residual, margin)``.

    It stands beside the robot's own file, whose ``ik_matrices`` and ``fk_jacobian_mixed`` it calls.
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
#include "{robot.name}.h"

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
