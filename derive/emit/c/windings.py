"""Generates the C tables for the search over full turns of coupled joints.

If joints are coupled, a full turn of one joint may move several motors by fractions of a turn. For
example, a full turn of one joint may move both motors of a differential by half a turn each. The
limits of a robot with coupled joints form a polytope. Generated code needs no coupling tables if
coupled joints have no limits and full turns of a joint change the coordinates only by full turns.
"""

import textwrap
from collections.abc import Sequence

import sympy as sp

from ...derivation import Derivation
from ...inverse.coupled_chain import CoupledChain
from ...model.coupling import Limits, LinearMap
from ...model.robot import SerialRobot
from .expressions import WIDTH, number

COUPLINGS = "chasles_couplings.h"


def shares_limits(derivation: Derivation, wraps: Sequence[bool]) -> bool:
    """Return whether the search over full turns needs the coupling tables of the robot.

    Args:
        derivation: The derivation of the robot.
        wraps: Whether each coordinate can make a full turn without a change of the pose.
    """
    robot = derivation.robot
    chain = None if derivation.inverse is None else derivation.inverse.chain
    if not isinstance(robot, SerialRobot) or chain is None:
        return False
    return _turns_share(chain, wraps) or joint_limits(robot) != ((None, None),) * len(robot.moving)


def joint_limits(robot: SerialRobot) -> tuple[Limits, ...]:
    """Return the limits of each joint, or (None, None) for a joint whose value is a coordinate.

    If the value of a joint is a coordinate, the limits of the coordinate also apply to the joint.
    """
    own = robot.linear_map
    named = [
        own.coordinates.index(j.name) if j.name in own.coordinates else -1 for j in robot.moving
    ]
    return tuple(
        (None, None) if _is_own(own, k, at) else joint.limits
        for k, (joint, at) in enumerate(zip(robot.moving, named, strict=True))
    )


def windings(derivation: Derivation) -> list[str]:
    """Return the C lines of the coupling tables of a robot with coupled coordinates."""
    robot = derivation.robot
    assert isinstance(robot, SerialRobot)
    assert derivation.inverse is not None
    chain = derivation.inverse.chain
    assert chain is not None
    L, independent = chain.inverse()
    own, moving = robot.linear_map, chain.robot.moving
    n, m = chain.C.cols, len(robot.moving)
    turns = [2 * sp.pi if moving[j].kind == "revolute" else 0 for j in independent]
    only = [_only(row) for row in (own.C * L).tolist()]
    tables = [
        ("double", "measure", [x for j in independent for x in chain.C.row(j)]),
        ("double", "step", [x * turn for k, turn in enumerate(turns) for x in L.col(k)]),
        ("double", "joint", list(own.C)),
        ("double", "offset", list(own.c)),
        ("int", "only", [k for k, _ in only]),
        ("double", "ratio", [ratio for _, ratio in only]),
        ("int", "alone", [_alone(k, L, own.C) for k in range(n)]),
    ]
    name = robot.name
    pointers = ", ".join(f"{name}_{table}" for _, table, _ in tables)
    couplings = f"static const chasles_couplings {name}_couplings = {{{n}, {m}, {pointers}}};"
    return [
        *(line for kind, table, row in tables for line in _table(kind, f"{name}_{table}", row)),
        *textwrap.wrap(couplings, WIDTH, subsequent_indent="    "),
        "",
        *nearest_slots(name, "coupled", "couplings"),
    ]


def nearest_slots(name: str, kind: str, table: str) -> list[str]:
    """Return the C lines of the function chasles_nearest_slots for a robot with joint limits.

    Args:
        name: Name of the robot.
        kind: Suffix in the name of the support function ``chasles_nearest_<suffix>``, which selects
            a solution.
        table: Suffix in the name of the C table that the support function reads.
    """
    return [
        "/* chasles_nearest_slots for limits of coordinates and joints. */",
        f"static inline void {name}_nearest_slots(size_t rows, int n, int k,",
        "    const double *const *slots, double tolerance, const double *const *moves,",
        "    const double *q_seed, ptrdiff_t seed_step, double *const *outputs, signed char *slot)",
        "{",
        "  const chasles_moves by = {moves[0], moves[1], moves[2], moves[3]};",
        "  for (size_t row = 0; row < rows; row++, q_seed += seed_step) {",
        "    const size_t from = row * (size_t)k;",
        "    const chasles_slots of = {n, k, slots[0] + from * (size_t)n, slots[1] + from,",
        "        slots[2] + from, tolerance};",
        f"    slot[row] = (signed char)chasles_nearest_{kind}(&{name}_{table}, &of, &by,",
        "        q_seed, outputs[0] + row * (size_t)n, outputs[1] + row, outputs[2] + row);",
        "  }",
        "}",
        f"#define chasles_nearest_slots {name}_nearest_slots\n",
    ]


def _turns_share(chain: CoupledChain, wraps: Sequence[bool]) -> bool:
    L, independent = chain.inverse()
    return any(
        chain.robot.moving[j].kind == "revolute"
        and any(x != 0 and not (x.is_Integer and wraps[i]) for i, x in enumerate(L.col(k)))
        for k, j in enumerate(independent)
    )


def _is_own(own: LinearMap, joint: int, coordinate: int) -> bool:
    row = [sp.Integer(k == coordinate) for k in range(own.C.cols)]
    return coordinate >= 0 and list(own.C.row(joint)) == row and own.c[joint] == 0


def _only(row: Sequence[sp.Expr]) -> tuple[int, sp.Expr]:
    """Return the index and value of the only nonzero entry of a row.

    If the row has no nonzero entry or several nonzero entries, return (-1, 1).
    """
    entries = [(k, ratio) for k, ratio in enumerate(row) if ratio != 0]
    return entries[0] if len(entries) == 1 else (-1, sp.S.One)


def _alone(k: int, L: sp.Matrix, C: sp.Matrix) -> int:
    """Return the index of the only coordinate that a full turn of joint k changes, or -1.

    The result is -1 if joint k changes several coordinates, or if an independent joint other than
    joint k also changes the coordinate.
    """
    moved = [i for i in range(L.rows) if L[i, k] != 0]
    if len(moved) > 1 or any(L[moved[0], j] != 0 for j in range(L.cols) if j != k):
        return -1
    rows = (list(row) for row in (C * L).tolist() if row[k] != 0)
    return moved[0] if all(_only(row)[0] == k for row in rows) else -1


def _table(kind: str, name: str, entries: Sequence[sp.Expr | int]) -> list[str]:
    values = [str(x) if kind == "int" else number(float(x)) for x in entries]
    line = f"static const {kind} {name}[{len(values)}] = {{{', '.join(values)}}};"
    return textwrap.wrap(line, WIDTH, subsequent_indent="    ")
