r"""Prints the inverse kinematics of a robot with loops."""

from dataclasses import replace

from ...inverse.mechanisms.backward_inverse import moving_inverses
from ...inverse.mechanisms.leg_chains import leg_chains
from ...inverse.mechanisms.mode_check import LEGS, carried_chain
from ...inverse.serial_inverse import Inverses
from ...inverse.structure.words import listed as in_words
from ...model.plural import counted
from ...terms.symbolic_function import NativeSolverFunction, SymbolicFunction
from ..loops.loop_page import LoopPage
from ..setting.names import escape
from ..setting.page import Page, text
from .carried_fragment import carried
from .inverse_fragment import written


def inverse_of_loops(page: LoopPage) -> str:
    """Print the inverse kinematics of the main chain."""
    chain = page.chain
    # For a robot with loops, only the inverse kinematics of the main chain for a complete tool pose
    # is printed, not the additional tasks.
    tasks = {name: solved for name, solved in chain.inverse.solved.items() if name == "ik"}
    of_chain = replace(chain.inverse, solved=tasks)
    found = page.inverse
    back = next((f for f in page.functions if f.name in ("ik", LEGS)), None)
    chain_of_legs = None if back is None else carried_chain(page.hybrid, back)
    if back is not None and chain_of_legs is not None:
        return text(*carried(page, chain_of_legs), _through_the_chain(page, back))
    moving = moving_inverses(page.hybrid) if found is None and back is not None else None
    if moving is not None and back is not None:
        return text(written(chain, moving, {}).rstrip(), _through_the_chain(page, back))
    if tasks and found is None and back is not None:
        return text(written(chain, of_chain, {}).rstrip(), _through_the_chain(page, back))
    if tasks:
        return text(written(chain, of_chain, {}).rstrip(), _sides_of_loops(found))
    if found is not None and found.composed is not None:
        return text(written(chain, found, {}).rstrip(), _on_every_branch(found.composed))
    if found is None or not found.solved:
        return written(chain, of_chain, {})
    if not _has_slides(chain, found):
        # If the arm itself has no closed form, the solution steps of the nominal arm are printed.
        return text(
            written(chain, found, {}).rstrip(), _sides_of_loops(found), _position_task(found)
        )
    actuators = {q.name: shown for q, shown in zip(page.hybrid.q, page.q, strict=True)}
    return text(
        "Loops prevent part of the main chain from rotating, so that this part acts like"
        " prismatic joints; their displacements are found first.",
        written(chain, found, actuators).rstrip(),
        "The actuators follow from these joints as in the solution of the loops.",
        _position_task(found),
    )


def _through_the_chain(page: LoopPage, function: SymbolicFunction) -> str:
    freedoms = page.hybrid.freedoms
    reached = (
        f" The tool has {counted(freedoms, 'degree')} of freedom: the residual of an unreachable"
        " pose is not zero."
        if freedoms < len(page.hybrid.theta)
        else ""
    )
    legs = [escape(leg.closure) for leg in leg_chains(page.hybrid) or ()]
    by_legs = (
        f" The legs that end at {in_words(legs)} are solved as serial arms whose last link has the"
        " pose of the closure's other frame, by the steps in the solution of the loops."
        if legs
        else ""
    )
    carried_joints = carried_chain(page.hybrid, function)
    count = function.branches * (1 if carried_joints is None else carried_joints.solutions)
    slots = f"{count} slots" if count > 1 else "one slot"
    return (
        "The actuators follow from these joints as in the solution of the loops from the main"
        f" chain.{by_legs} Equivalent choices share a slot, so \\texttt{{ik}} has"
        f" {slots}; in each slot the loops close at the pose.{reached} A slot"
        " is a solution if \\texttt{fk} returns to the pose; its residual is infinite if the loops"
        " close there in another assembly mode."
    )


def _position_task(found: Inverses) -> str:
    if not found.polished_tasks:
        return ""
    names = in_words([rf"\texttt{{{escape(task.name)}}}" for task in found.polished_tasks])
    return (
        f"The nominal robot does not rotate its tool, and the true robot rotates it only slightly."
        f" {names} solves for the position only, from the same start configurations."
    )


def _has_slides(chain: Page, found: Inverses) -> bool:
    count = len(chain.robot.moving)
    return any(axis.joint >= count for axis in found.classification.lines.axes)


def _sides_of_loops(found: Inverses | None) -> str:
    solved = None if found is None else next(iter(found.solved.values()), None)
    if solved is None or not (solved.work.sides or solved.work.settled):
        return ""
    names = [name for name, _ in solved.work.sides.values()]
    sides = f" on both branches of {in_words([escape(name) for name in names])}" if names else ""
    return (
        f"The actuators follow from the joints as in the solution of the loops{sides}."
        " Equivalent choices share a slot, so the inverse of"
        f" the robot has {counted(solved.function.branches, 'slot')}."
    )


def _on_every_branch(function: NativeSolverFunction) -> str:
    chain, every, fk = (rf"\texttt{{{escape(name)}}}" for name in function.calls)
    return (
        f"The function {chain} solves the main chain. From each of its solutions, {every} computes"
        f" the actuators on every branch of the loops, and {fk} checks them: \\texttt{{ik}} has"
        f" {counted(function.branches, 'slot')}. The residual is infinite if the loops close at"
        " the pose in another assembly mode."
    )
