"""Inverse kinematics of robots with loops whose main chain is solved by shared C code.

The function ``ik_chain`` solves the main chain as a serial arm. For each solution of the main
chain, the function ``actuators_all`` computes the actuators on every branch of the loops. The
function ``fk`` checks the computed actuated coordinates.
"""

from collections.abc import Sequence
from dataclasses import replace

from ...chain.coordinates import InProportion
from ...chain.groups import groups
from ...chain.kinematics import Kinematics
from ...loops.functions.maps import actuators_all
from ...loops.solve.solved_loops import SolvedLoops, named
from ...terms.role import Role
from ...terms.symbolic_function import NativeSolverFunction, SymbolicFunction
from ..classify import unfit
from ..families.family import Family
from ..serial_inverse import WRITTEN, Inverses, inverses
from .mode_check import FK, IDENTITY, IK, ModeTables

SOLVER = "chain_modes"
CHAIN_IK, CHAIN_POSE, ACTUATORS = "ik_chain", "fk_jacobian_chain", "actuators_all"
MAX_BRANCHES = 16
"""Maximum number of loop branches for each solution of the main chain."""


def chain_inverse(
    hybrid: SolvedLoops, families: Sequence[Family], give: tuple[int, ...]
) -> Inverses | None:
    """Return the inverse kinematics, or None if shared C code cannot solve the main chain.

    ``chain_inverse`` also returns None if the loops couple joints of the main chain or have no
    closed form.

    Args:
        hybrid: The robot.
        families: The families of axis structures to try on the main chain, in order.
        give: Indices of the chain joints to fix, or () to select suitable joints automatically.
    """
    robot, count = hybrid.robot, len(hybrid.robot.moving)
    if not hybrid.has_closed_form or len(hybrid.q) != count or unfit(robot):
        return None
    found = inverses(robot, hybrid.terms, families=families, give=give, methods=WRITTEN)
    if not found.written:
        return None
    (solved,) = found.written
    every = actuators_all(hybrid)
    if every.outputs[0].shape[0] > MAX_BRANCHES:
        return None
    of_chain = replace(
        solved,
        name=CHAIN_IK,
        calls=(*solved.calls[:-1], CHAIN_POSE),
        role=replace(solved.role, name="nominal inverse", labels=()),
    )
    general = found.general and replace(found.general, function=of_chain)
    return replace(
        found,
        others=(chain_pose(hybrid),),
        general=general,
        polished=None if general else of_chain,
        composed=_composed(hybrid, of_chain, every, solved.role.labels),
    )


def chain_pose(hybrid: SolvedLoops) -> SymbolicFunction:
    """Return the tool pose and the mixed Jacobian as functions of the main-chain joints."""
    robot, terms = hybrid.robot, hybrid.terms
    arguments = {f"q{'d' * k}": hybrid.arguments[f"theta{'d' * k}"] for k in range(3)}
    motion = InProportion(robot, terms, hybrid.theta)
    kinematics = Kinematics.of(robot, terms, groups(robot, terms, motion.values), motion, arguments)
    function = kinematics.function("fk_jacobian_mixed")
    return replace(function, name=CHAIN_POSE, role=Role("chain pose"))


def _composed(
    hybrid: SolvedLoops, chain: NativeSolverFunction, every: SymbolicFunction, labels: Sequence[str]
) -> NativeSolverFunction:
    (_, residual, margin), (q, _) = chain.outputs, every.outputs
    branches, n = q.shape
    slots = chain.branches * branches
    sides = every.role.labels if branches > 1 else ("",)
    labels = tuple(", ".join(filter(None, (own, side))) for own in labels for side in sides)
    coordinates = moving_coordinates(hybrid, chain.role.fixed)
    return NativeSolverFunction(
        IK,
        f"All inverse kinematics solutions, in {slots} solution slots.",
        IDENTITY,
        chain.inputs,
        (
            replace(q, entries=(), shape=(slots, n), meaning="coordinates, one solution per row"),
            replace(
                residual,
                shape=(slots,),
                meaning="distance of fk(q[k]) from the target; infinite in another assembly mode",
            ),
            replace(
                margin, shape=(slots,), meaning="smallest margin of the main chain and the loops"
            ),
        ),
        SOLVER,
        ModeTables(hybrid.backward.reference.size),
        (CHAIN_IK, ACTUATORS, FK),
        slots,
        chain.operations,
        role=Role("inverse", "pose", fixed=tuple(coordinates), labels=labels),
    )


def moving_coordinates(hybrid: SolvedLoops, joints: Sequence[int]) -> list[int]:
    """Return the indices of the actuated coordinates that move any of the listed joints."""
    entries = named(hybrid, hybrid.forward, [hybrid.robot.moving[k].name for k in joints])
    rests_on = [*entries, *(hybrid.terms.definitions[s] for s in hybrid.terms.needed(entries))]
    behind = {symbol for e in rests_on for symbol in e.free_symbols}
    return [k for k, symbol in enumerate(hybrid.q) if symbol in behind]
