"""The part of a main chain that moves while the loops lock the other joints.

The rods of a delta robot keep its platform parallel to the base, so the three rotations of the
platform are locked. The moving part of a delta robot contains the three translations and, if
present, the joint on the platform. If the robot has more actuators than the tool has degrees of
freedom, the caller chooses the values of some actuated joints. Examples of joints whose values the
caller may choose are a rail below a hexapod and a joint on the hexapod platform.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import sympy as sp

from ...loops.solve.solved_loops import SolvedLoops
from ...model.robot import Joint, SerialRobot
from ...model.tolerances import STILL_JOINT
from ...terms.symbolic_function import Argument
from ..chain_solution import solve_chain
from ..classify import Attempt, Classification, of_lines, unfit
from ..families.family import Family
from ..steps.target import of_pose
from ..steps.work import Work
from ..structure import rank
from ..structure.lines import Lines, axes_of, home_of
from ..tasks.slots import POSE_SYMBOLS, given_argument, values_of


@dataclass(frozen=True)
class MovingChain:
    """A main chain whose moving joints have a known structure of axes.

    Attributes:
        whole: The main chain.
        robot: The main chain, with fixed joints in place of the joints that the loops lock.
        lines: Axes of the moving joints, numbered by their indices in the whole chain.
        found: The structure of axes that matches the axes of the moving joints.
        locked: The value of each locked joint, keyed by its number in the whole chain.
    """

    whole: SerialRobot
    robot: SerialRobot
    lines: Lines
    found: Attempt
    locked: Mapping[int, sp.Expr]

    @classmethod
    def of(cls, whole: SerialRobot, lines: Lines, found: Attempt) -> "MovingChain":
        """Return a main chain whose joints all move."""
        return cls(whole, whole, lines, found, {})

    @property
    def given(self) -> tuple[int, ...]:
        """Indices, in the whole chain, of the joints whose values the caller chooses."""
        return tuple(self.lines.axes[place].joint for place in self.found.given)

    def coordinates(self, work: Work) -> tuple[tuple[Argument, ...], list[sp.Expr]]:
        """Return (arguments of ``ik`` after the pose, coordinates of all main-chain joints).

        Args:
            work: Record of the solution, to which the function adds joint values and solution
                steps.
        """
        terms, moving, work.locked = work.terms, self.whole.moving, frozenset(self.locked)
        symbols = {k: sp.Symbol(f"_{moving[k].name}", real=True) for k in self.given}
        arguments = tuple(given_argument(self.whole, k, symbol) for k, symbol in symbols.items())
        given = {k: moving[k].direction * symbol for k, symbol in symbols.items()}
        places = {place: given[self.lines.axes[place].joint] for place in self.found.given}
        target = of_pose(terms, POSE_SYMBOLS, home_of(self.robot, terms))
        solve_chain(work, self.lines, self.found, target, places)
        values = values_of(work, self.whole, given | dict(self.locked))
        return arguments, [
            joint.direction * value for joint, value in zip(moving, values, strict=True)
        ]


def moving_chain(
    h: SolvedLoops, families: Sequence[Family]
) -> tuple[MovingChain, Classification] | None:
    """Return the moving part of a main chain, or None if the part fits no inverse family exactly.

    The function also returns None if the loops lock no joint and no actuated joint is redundant.

    Args:
        h: The robot.
        families: The families of axis structures to try, in order.
    """
    locked = locked_joints(h)
    robot = _with_locked_joints(h.robot, locked)
    numbers = [k for k in range(len(h.robot.moving)) if k not in locked]
    axes = axes_of(robot, h.terms)
    lines = Lines(
        h.terms, tuple(replace(axis, joint=k) for axis, k in zip(axes, numbers, strict=True))
    )
    surplus = len(lines.axes) - rank.of_chain(lines)
    # If loops couple moving joints, the chain has fewer redundant joints than the number of moving
    # joints suggests.
    are_coupled = len(numbers) > len(h.q)
    if unfit(robot) or not (locked or surplus) or (surplus and are_coupled):
        return None
    for give in _choices(h, numbers, surplus):
        classification = of_lines(lines, families=families, give=give)
        found = classification.found
        if found is not None and found.given == give and not found.family.inputs:
            return MovingChain(h.robot, robot, lines, found, locked), classification
    return None


def _choices(h: SolvedLoops, numbers: Sequence[int], surplus: int) -> Iterator[tuple[int, ...]]:
    actuated = {c.moves for c in h.mechanism.coordinates}
    places = [place for place, k in enumerate(numbers) if h.robot.moving[k].name in actuated]
    yield from (give[::-1] for give in combinations(places[::-1], surplus))


def locked_joints(h: SolvedLoops) -> dict[int, sp.Expr]:
    """Return the constant values of the locked joints (radian or meter), keyed by joint number."""
    found = {}
    for k, joint in enumerate(h.robot.moving):
        if joint.kind in ("revolute", "prismatic") and _is_still(h, joint):
            found[k] = joint.direction * h.mechanism.reference_of(joint.name)
    return found


def _is_still(h: SolvedLoops, joint: Joint) -> bool:
    reference = float(h.mechanism.reference_of(joint.name))
    if not h.forward.open:
        value = h.forward.values[joint.name]
        return h.terms.is_constant(value) and float(h.terms.value(value)) == reference
    place = h.numbers.names.index(joint.name)
    values = np.array([w[place] for w in h.numbers.generic])
    size = h.numbers.size if joint.kind == "prismatic" else 1.0
    return len(values) > 1 and bool(np.all(np.abs(values - reference) <= STILL_JOINT * size))


def _with_locked_joints(robot: SerialRobot, locked: Mapping[int, sp.Expr]) -> SerialRobot:
    names = {robot.moving[k].name: value for k, value in locked.items()}
    return replace(
        robot,
        joints=tuple(
            joint.fixed_at(names[joint.name]) if joint.name in names else joint
            for joint in robot.joints
        ),
    )
