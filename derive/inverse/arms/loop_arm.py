"""A part of a loop as a serial arm between two known bodies.

The unknown joints of a loop and the loop closure form a serial arm if all other joints of the loop
are known. The last link of this serial arm has a known pose, so the closed-form inverse kinematics
of an arm family can solve the arm. Examples of such arms are the legs of a tripteron, with one
prismatic joint and three parallel axes. Other examples of such arms are the legs of an Exechon or a
3-UPU, and a shaft between universal joints.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import sympy as sp

from ...description.chain_between import inverted
from ...loops.model.body_frames import pose_along, relative_entries
from ...loops.model.planes import Loop
from ...model.mechanism import Closure, Frame, Mechanism
from ...model.placements import inverse
from ...model.robot import Joint, Placement, SerialRobot
from ...terms.terms import Terms
from ..chain_solution import solve_chain
from ..classify import Attempt, classify
from ..families import FAMILIES, LEG_FAMILIES
from ..steps.target import of_pose
from ..steps.work import Work
from ..structure.lines import Lines, home_of
from ..tasks.slots import pose_errors, squares, tool_of, values_of
from ..tool_axis import with_still_axis

Values = Mapping[str, sp.Expr]
FREEDOMS: Mapping[str, tuple[Joint, ...]] = {
    "pin": (Joint("closure", "revolute"),),
    "slider": (Joint("closure", "prismatic"),),
    "weld": (),
}
"""Serial joints that replace the loop-closing joint of a closure, keyed by the closure kind."""


@dataclass(frozen=True)
class LoopArm:
    """The unknown joints of a loop as a serial arm between two known bodies.

    Attributes:
        closure: Name of the loop closure.
        known: The known joints between the first body of the loop and the base of the arm.
        unknown: The moving joints of the arm, without the loop-closing joint.
        back: The known joints from the body where the loop begins to the target body of the arm.
        end: The placement of the target frame on the target body.
        robot: The serial robot that consists of the unknown joints of the loop and the loop-closing
            joint.
        lines: The axes of the arm.
        found: The axis structure that gives the closed-form solution of the arm.
    """

    closure: str
    known: tuple[Joint, ...]
    unknown: tuple[Joint, ...]
    back: tuple[Joint, ...]
    end: Placement
    robot: SerialRobot
    lines: Lines
    found: Attempt

    def wanted(self, mechanism: Mechanism, terms: Terms, values: Values) -> list[sp.Expr]:
        """Return the sixteen entries of the pose that the arm reaches, in the frame of its base.

        Args:
            mechanism: The mechanism to which the joints of the arm belong.
            terms: Names of all terms.
            values: Values of the known joints, keyed by joint name.
        """
        start = pose_along(mechanism, terms, self.known, (), values)
        end = pose_along(mechanism, terms, self.back, self.end, values)
        return relative_entries(terms, start, end)

    def solved(self, work: Work, entries: Sequence[sp.Expr]) -> tuple[dict[str, sp.Expr], sp.Expr]:
        """Return the values of the unknown joints, and the squared pose error (m^2 and rad^2).

        Args:
            work: State of the derivation, to which ``solved`` adds the branch signs and the
                solution steps of the arm.
            entries: The matrix entries of the pose that the arm must reach.
        """
        terms, robot = work.terms, self.robot
        solve_chain(
            work, self.lines, self.found, of_pose(terms, entries, home_of(robot, terms)), {}
        )
        values = values_of(work, robot, {})
        moved, turned = pose_errors(tool_of(terms, robot, values), entries)
        joints = zip(robot.moving, values, strict=True)
        found = {joint.name: joint.direction * value for joint, value in joints}
        names = [joint.name for joint in self.unknown]
        residual = terms.let(squares(terms, moved) + squares(terms, turned) / 2)
        return {name: found[name] for name in names}, residual


def loop_arm(
    mechanism: Mechanism, terms: Terms, loop: Loop, open_: Collection[str]
) -> LoopArm | None:
    """Return the unknown joints of a loop as an arm, or None if no closed form solves this arm.

    Args:
        mechanism: The description.
        terms: Names of all terms.
        loop: The loop.
        open_: Names of the unknown joints.
    """
    closure = loop.loop_joint
    if not isinstance(closure, Closure) or closure.kind not in FREEDOMS:
        return None
    sides = [(*_split(loop.to_a, open_), closure.a), (*_split(loop.to_b, open_), closure.b)]
    if not sides[0][1]:
        sides.reverse()
    (known, near, at), (back, far, end) = sides
    unknown = tuple(joint for joint in (*near, *far) if joint.kind != "fixed")
    if not unknown or any(joint.name not in open_ for joint in unknown):
        return None
    robot, placement = _robot(mechanism, closure, (near, at), (far, end))
    structure = structure_of(robot, terms)
    if structure is None:
        return None
    return LoopArm(closure.name, known, unknown, back, placement, robot, *structure)


def _split(
    path: tuple[Joint, ...], open_: Collection[str]
) -> tuple[tuple[Joint, ...], tuple[Joint, ...]]:
    """Split a path into the joints before its first unknown joint and the remaining joints."""
    first = next((k for k, joint in enumerate(path) if joint.name in open_), len(path))
    return path[:first], path[first:]


def _robot(
    mechanism: Mechanism,
    closure: Closure,
    near: tuple[tuple[Joint, ...], Frame],
    far: tuple[tuple[Joint, ...], Frame],
) -> tuple[SerialRobot, Placement]:
    """Return the arm, and the placement of its target frame on the target body."""
    (joints, at), (others, end) = near, far
    parts, after, freedom = [*joints], at.placement, FREEDOMS[closure.kind]
    if freedom:
        parts.append(replace(freedom[0], before=after))
        after = ()
    placement = end.placement
    if others:
        first, *rest = (inverted(joint) for joint in reversed(others))
        parts += [replace(first, before=(*after, *inverse(placement), *first.before)), *rest]
        after = placement = ()
    chain = tuple(replace(joint, parent="") for joint in parts)
    return SerialRobot(
        mechanism.name, chain, tool=after, parameters=mechanism.parameters
    ), placement


def structure_of(robot: SerialRobot, terms: Terms) -> tuple[Lines, Attempt] | None:
    """Return the axes and the axis structure of an arm, or None if no structure fits the axes."""
    classification = classify(robot, terms, families=LEG_FAMILIES)
    found = classification.found
    if found is None:
        return with_still_axis(robot, classification, FAMILIES)
    fits = classification.method == "exact" and not found.given and not found.family.inputs
    return (classification.lines, found) if fits else None
