"""Converts an IK function from joint values of a chain to coordinates of a coupled robot."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import sympy as sp

from ..chain.kinematics import arguments_of, common_unit
from ..model.robot import SerialRobot
from ..terms.symbolic_function import Argument, NativeSolverFunction, SymbolicFunction
from ..terms.terms import Terms
from .coupled_chain import CoupledChain
from .mechanisms.substitution import substituted
from .polished_inverse import NOMINAL, TURN, RefinedTables
from .tasks.task import Solved


def in_coordinates(
    robot: SerialRobot, chain: CoupledChain, terms: Terms, solved: Solved
) -> Solved | None:
    """Convert an IK task from joint values of a chain to coordinates of the coupled robot.

    Args:
        robot: The coupled robot.
        chain: The chain of the coupled robot.
        terms: Table of named terms.
        solved: The inverse kinematics task, which solves for joint values of the chain that the
            couplings allow.

    Returns:
        The converted task.
    """
    function = solved.function
    free = _coordinates_of(chain, function.role.free)
    if free is None:
        return None
    inputs, given = list(function.inputs), _coordinates_of(chain, function.role.fixed)
    for k, joint in enumerate(function.role.fixed, 1):
        inputs[k] = _joint_argument(chain, joint, inputs[k])
    q, *others = function.outputs
    unit = common_unit([c.unit for c in robot.coordinates])
    entries = coordinates_at(chain, terms, q.entries)
    made = replace(
        function,
        inputs=tuple(inputs),
        outputs=(
            replace(q, entries=entries, shape=(q.shape[0], len(entries)), unit=unit),
            *others,
        ),
        role=replace(function.role, fixed=given or (), free=free),
    )
    return replace(solved, function=made)


def coordinates_at(
    chain: CoupledChain, terms: Terms, theta: Sequence[sp.Expr]
) -> tuple[sp.Expr, ...]:
    """Return the robot coordinates q = L (theta - c) for the joint values theta, as named terms."""
    L, joints = chain.inverse()
    moved = [theta[j] - chain.c[j] for j in joints]
    return tuple(
        terms.let(sp.Add(*(r * x for r, x in zip(L.row(k), moved, strict=True) if r != 0)))
        for k in range(L.rows)
    )


def of_coordinates(
    robot: SerialRobot, chain: CoupledChain, terms: Terms, function: SymbolicFunction
) -> SymbolicFunction:
    """Rewrite a function of the chain's joint values as a function of the robot's coordinates."""
    q = arguments_of([c.unit for c in robot.coordinates])["q"]
    theta = dict(zip(function.inputs[0].symbols, chain.joints_at(q.symbols), strict=True))
    outputs = tuple(
        replace(result, entries=substituted(terms, result.entries, theta))
        for result in function.outputs
    )
    return replace(function, inputs=(q, *function.inputs[1:]), outputs=outputs)


def refined_in_coordinates(
    robot: SerialRobot,
    chain: CoupledChain,
    refined: NativeSolverFunction,
    solved: Mapping[str, Solved],
) -> NativeSolverFunction:
    """Return the inverse kinematics function of a calibrated chain in the robot's coordinates.

    The general solver is not used, because it returns joint values of the chain instead of motor
    coordinates.

    Args:
        robot: The coupled robot.
        chain: The chain.
        refined: The refined inverse kinematics function of the chain, which returns joint values.
        solved: The inverse functions of the nominal arm, whose results (robot coordinates) are the
            start of the refinement.
    """
    assert isinstance(refined.tables, RefinedTables)
    start = solved[NOMINAL].function
    joints = chain.robot.moving
    turns = tuple(
        1 / TURN
        if coordinate.unit == "rad"
        and all(
            x == 0 if joint.unit == "m" else x.is_Integer
            for x, joint in zip(chain.C.col(k), joints, strict=True)
        )
        else 0.0
        for k, coordinate in enumerate(robot.coordinates)
    )
    tables = replace(refined.tables, turns=turns, general=None, is_asked=False)
    q, *others = refined.outputs
    unit = common_unit([c.unit for c in robot.coordinates])
    return replace(
        refined,
        inputs=start.inputs,
        outputs=(replace(q, unit=unit), *others),
        tables=tables,
        role=replace(refined.role, fixed=start.role.fixed),
    )


def _joint_argument(chain: CoupledChain, joint: int, argument: Argument) -> Argument:
    return replace(argument, name=chain.robot.moving[joint].name)


def _coordinates_of(chain: CoupledChain, joints: Sequence[int]) -> tuple[int, ...] | None:
    """Return the indices of the coordinates that move only the listed joints.

    Return None if a coordinate moves both a listed joint and another joint.
    """
    rows = range(chain.C.rows)
    found = [
        k
        for k in range(chain.C.cols)
        if all(chain.C[j, k] == 0 for j in rows if j not in joints)
        and any(chain.C[j, k] for j in rows)
    ]
    moved = all(chain.C[j, k] == 0 for j in joints for k in range(chain.C.cols) if k not in found)
    return tuple(found) if moved else None
