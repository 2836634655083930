"""Inverse kinematics of robots with joints that the caller fixes."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations

from ..loops.iterated.closure_equations import LoopClosure
from ..loops.solve.solved_loops import SolvedLoops
from ..model.errors import InputValueError
from ..model.robot import SerialRobot
from ..terms.terms import Terms
from .classify import classify, unfit
from .families.family import Family
from .general.general_inverse import general_tables
from .mechanisms.hybrid_inverse import hybrid_inverses
from .serial_inverse import MAX_FREE, Inverses, inverses
from .structure import rank
from .structure.lines import Lines, axes_of
from .tasks.orientation import NAME, orientation_task, orients

MAX_TRIED = 60
"""Maximum number of joint sets that are tested to suggest fixable joints in an error message.
Testing this many sets takes 1 to 2 seconds."""
MAX_NAMED = 12
"""Maximum number of joint sets listed in an error message."""


def inverses_for_fixed(
    robot: SerialRobot, terms: Terms, families: Sequence[Family], fixed: str | Sequence[str]
) -> Inverses:
    """Derive the inverse kinematics of a serial robot for fixed joints chosen by the caller.

    Args:
        robot: The description.
        terms: Table of named terms.
        families: The families of axis structures to try, in order.
        fixed: Names of the fixed joints, or () to let chasles select suitable joints if the robot
            is redundant.

    Raises:
        InputValueError: A name in ``fixed`` is unknown, or the joints that are not fixed have no
            closed-form inverse kinematics function.
    """
    chosen = _indices(robot, fixed)
    found = inverses(robot, terms, families=families, give=chosen)
    lines = Lines(terms, axes_of(robot, terms))
    if not unfit(robot) and orients(lines, chosen):
        task = orientation_task(robot, lines, chosen)
        found = replace(found, solved=found.solved | {NAME: task})
    if chosen and not (found.solved or found.written):
        raise _nothing_left(robot, families, chosen, found)
    return found


def hybrid_inverses_for_fixed(
    hybrid: SolvedLoops,
    families: Sequence[Family],
    fixed: str | Sequence[str],
    closure: LoopClosure | None = None,
) -> Inverses:
    """Derive the inverse kinematics of a robot with loops for fixed main-chain joints.

    Args:
        hybrid: The robot.
        families: The families of axis structures to try, in order.
        fixed: Names of the fixed joints, or an empty tuple to let chasles select suitable joints of
            the main chain.
        closure: Closure equations of loops without a closed form, or None if all loops have a
            closed form.

    Raises:
        InputValueError: A name in ``fixed`` is no main-chain joint, or the joints that are not
            fixed have no closed-form inverse kinematics function.
    """
    chosen = _indices(hybrid.robot, fixed)
    if chosen and len(hybrid.q) != len(hybrid.robot.moving):
        raise InputValueError(
            f"{hybrid.robot.name}: no joint can be fixed, because loops couple the joints of its "
            "main chain; ik_numeric with fixed= finds one solution by iteration"
        )
    found = hybrid_inverses(hybrid, families, chosen, closure)
    if chosen and not (found.solved or found.written):
        raise _nothing_left(hybrid.robot, families, chosen, found)
    return found


def _indices(robot: SerialRobot, fixed: str | Sequence[str]) -> tuple[int, ...]:
    names = [joint.name for joint in robot.moving]
    fixed = (fixed,) if isinstance(fixed, str) else fixed
    unknown = [name for name in fixed if name not in names]
    if unknown:
        raise InputValueError(
            f"{robot.name}: cannot fix unknown joint {', '.join(unknown)}; expected one of "
            f"{', '.join(names)}"
        )
    if len({*fixed}) >= len(names):
        raise InputValueError(f"{robot.name}: all joints are fixed; at least one must be free")
    return tuple(sorted({names.index(name) for name in fixed}))


def _nothing_left(
    robot: SerialRobot, families: Sequence[Family], chosen: tuple[int, ...], found: Inverses
) -> InputValueError:
    """Return the error if no closed-form IK function exists for the chosen fixed joints."""
    names = [joint.name for joint in robot.moving]
    surplus = len(names) - rank.of_chain(found.classification.lines)
    others = list(_offered(robot, families, chosen, max(len(chosen), surplus)))[:MAX_NAMED]
    offered = "; ".join(", ".join(names[k] for k in g) for g in others) or "none as many"
    rest = len(names) - len(chosen)
    numeric = "; ik_numeric with fixed= finds one solution by iteration" if rest <= MAX_FREE else ""
    return InputValueError(
        f"{robot.name}: no closed form is left if {', '.join(names[k] for k in chosen)} "
        f"{'is' if len(chosen) == 1 else 'are'} fixed: {found.missing}; joints that can be fixed: "
        f"{offered}{numeric}"
    )


def _offered(
    robot: SerialRobot, families: Sequence[Family], chosen: tuple[int, ...], count: int
) -> Iterator[tuple[int, ...]]:
    """Yield sets of ``count`` joints that can be fixed so that the chain keeps a closed form."""
    sets = list(combinations(range(len(robot.moving)), count))
    sets.sort(key=lambda given: -len({*given} & {*chosen}))
    for given in sets[:MAX_TRIED]:
        terms = Terms({p.symbol: p.value for p in robot.parameters})
        found = classify(robot, terms, None, families, given)
        if found.method == "exact" or found.near or general_tables(robot, given).arm:
            yield given
