"""Text that explains the inverse of a robot: the structure of the axes and the solution steps."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from chasles.contract import check_type

from ..loops.checks.closable import doubts_of, limits_of
from ..loops.closing.loop_model import loop_model
from ..loops.closing.mobility import mobility_of
from ..loops.functions.constraint_functions import equations
from ..loops.iterated.closure_equations import loop_closure
from ..loops.solve.solution import Solution
from ..loops.solve.solved_loops import SolvedLoops, solved_loops
from ..model.mechanism import Described, Mechanism
from ..model.plural import counted
from ..model.robot import SerialRobot
from ..model.tolerances import EXACT_STRUCTURE
from ..terms.terms import Terms
from .arms.arm_step import from_chain_with_arms, with_arms
from .chosen_joints import hybrid_inverses_for_fixed, inverses_for_fixed
from .classify import Attempt, Classification
from .coupled_chain import CoupledChain
from .families import FAMILIES
from .families.family import Family
from .general.general_inverse import GeneralInverse
from .mechanisms import backward_inverse, leg_inverse
from .mechanisms.backward_inverse import is_carried, is_carried_arm
from .mechanisms.carried_arm import carried_arm
from .mechanisms.carried_wrist import ROTATIONS
from .mechanisms.leg_chains import leg_chains
from .polished_inverse import FREEDOMS
from .serial_inverse import Inverses
from .steps.work import InverseStep
from .structure.requirement import Requirement
from .structure.words import listed
from .tasks.task import Solved

NEVER = "a small change of the arm does not suffice"
MAX_LISTED = 12
"""Maximum number of axis structures in a table that compares them with the robot's axes."""
_GAP = 3
"""Number of spaces between table columns."""


@dataclass(frozen=True)
class Explanation:
    """An explanation of a robot's inverse kinematics, printed by ``print(explain(robot))``.

    Attributes:
        robot: The robot's title.
        chain: The explained chain of joints, from the base to the tool.
        inverses: The axis structure of the chain and the solved inverse functions, such as ``ik``.
            None for robots with several tool poses per q, such as parallel platforms.
        loops: A sentence about the inverse kinematics of the loops, or "" for a serial robot.
        hybrid: The loops and their solution, or None for a serial robot.
    """

    robot: str
    chain: SerialRobot
    inverses: Inverses | None
    loops: str = ""
    hybrid: SolvedLoops | None = None

    @property
    def max_solutions(self) -> int:
        """Maximum number of solutions per tool pose, or 0 if this number is unknown."""
        if self.inverses is None:
            return 0
        written = {function.name: function for function in self.inverses.written}
        if "ik" in written:
            return written["ik"].branches
        solved = self.inverses.solved.get("ik") or next(iter(self.inverses.solved.values()), None)
        return solved.function.branches if solved else 0

    @property
    def line(self) -> str:
        """Explanation in one line: the kind of IK function and the maximum solution count."""
        if self.inverses is None:
            return self.loops
        classification, general = self.inverses.classification, self.inverses.general
        found = classification.found
        if general is not None:
            given = f", with {listed(general.given)} fixed" if general.given else ""
            most = counted(self.max_solutions, "solution")
            return f"inverse: {general.title}{given}, at most {most}{self._singular('; ')}"
        if found is None:
            return f"no closed-form inverse: {classification.missing}"
        if not self.max_solutions:
            return f"no closed-form inverse: {self.loops[:1].lower()}{self.loops[1:]}".rstrip(".")
        of_chain = " of the main chain" if self.loops else ""
        title = found.title + _with_added(classification) + _with_fixed(found, classification)
        if classification.method == "snapped":
            title = f"nearly {title}, refined from a nominal arm"
        most = counted(self.max_solutions, "solution")
        return f"inverse{of_chain}: {title}, at most {most}{self._singular('; ')}"

    def _singular(self, before: str) -> str:
        if self.inverses is None or not self.inverses.self_motion:
            return ""
        return before + singular(self.inverses)

    def __str__(self) -> str:
        title = f"{self.robot}\n{'=' * len(self.robot)}"
        if self.hybrid is not None:
            title = f"{title}\n\n{mechanism_in_words(self.hybrid)}"
        if self.inverses is None:
            return f"{title}\n\n{self.loops}"
        classification = self.inverses.classification
        parts = [title, _structure(classification, is_general=self.inverses.general is not None)]
        if self.inverses.self_motion:
            parts.append(f"{self._singular('The arm is ')}.")
        if classification.found is not None and self.inverses.chain is not None:
            parts.append(_couplings(classification.found.family, self.inverses.chain))
        if classification.found is not None:
            parts += [_task(name, solved) for name, solved in self.inverses.solved.items()]
        if self.inverses.general is not None:
            parts.append(_general(self.inverses.general))
        if classification.found is None and classification.attempts:
            parts.append(_nearest(classification))
        return "\n\n".join([*parts, *([self.loops] if self.loops else [])])


def _couplings(family: Family, chain: CoupledChain) -> str:
    sentences = [
        f"{listed(names)} act as one joint, {joint.name}."
        for joint, names in zip(chain.robot.moving, chain.members, strict=True)
        if len(names) > 1
    ]
    if family.has_couplings:
        sentences.append("The steps include the couplings.")
    elif chain.surplus > 0:
        sentences.append("All joints are free in these steps; the residual includes the couplings.")
    sentences.append("The coordinates follow linearly from the joints.")
    return " ".join(sentences)


def explain(
    description: Described,
    *,
    fixed: str | Sequence[str] = (),
    families: Sequence[Family] = FAMILIES,
) -> Explanation:
    """Explain the inverse kinematics of a robot, or why there is no closed form.

    Args:
        description: A serial robot or a mechanism, from ``read`` or built in Python.
        fixed: Names of fixed joints, whose values are inputs of ``ik``. By default, joints are
            fixed only if the robot is redundant.
        families: The axis structures with a closed-form inverse kinematics function, in the order
            in which to try them.

    Returns:
        The explanation. Its text lists the structure of the axes, the solution steps and the
        maximum number of solutions. If no structure with a closed form fits, the text compares the
        axes with each known structure. For a mechanism, the text starts with the degrees of freedom
        and the loops.

    Raises:
        InputValueError: A joint in ``fixed`` is unknown, or the other joints have no closed-form
            inverse kinematics function.
    """
    check_type("explain: description", description, SerialRobot, Mechanism)
    if not isinstance(description, Mechanism):
        terms = Terms({parameter.symbol: parameter.value for parameter in description.parameters})
        return explanation(
            description, inverses_for_fixed(description, terms, families, fixed), None
        )
    hybrid = with_arms(solved_loops(loop_model(description)))
    found = None
    if hybrid.may_have_inverse:
        iterated = (
            loop_closure(hybrid) if hybrid.forward.open and not hybrid.chain_is_known else None
        )
        found = hybrid_inverses_for_fixed(hybrid, families, fixed, iterated)
    return explanation(description, found, hybrid)


def explanation(
    robot: Described, inverses: Inverses | None, hybrid: SolvedLoops | None
) -> Explanation:
    """Return the explanation of the inverse kinematics that chasles derived for a robot.

    Args:
        robot: The robot.
        inverses: The derived inverse kinematics function, or None for a robot whose loops allow
            several tool poses per actuator configuration.
        hybrid: The loops, or None for a serial robot.
    """
    chain = robot.main_chain if isinstance(robot, Mechanism) else robot
    loops = _of_loops(hybrid) if hybrid is not None else ""
    return Explanation(robot.title or robot.name, chain, inverses, loops, hybrid)


def _structure(classification: Classification, is_general: bool) -> str:
    found = classification.found
    if found is None and is_general:
        missing = classification.missing
        return (
            "No known structure fits the axes, so the general method below solves the arm. "
            f"{missing[0].upper()}{missing[1:]}."
        )
    if found is None:
        return f"No closed-form inverse: {classification.missing}."
    nearly = "" if classification.method == "exact" else "nearly "
    added = _with_added(classification)
    lines = [f"Structure: {nearly}{found.title}{added}{_with_fixed(found, classification)}."]
    lines += [f"  {_condition(r, classification)}" for r in found.requirements]
    if classification.method == "exact":
        lines.append("Tier: exact; the axes have this structure exactly.")
    else:
        lines.append(
            "Tier: snapped; ik_nominal is the closed form of a nominal robot, whose axes have the "
            "structure exactly. Newton's method refines its solutions until they "
            "solve the true robot, and ik searches for further solutions near singularities."
        )
    return "\n".join(lines)


def missed_by(classification: Classification) -> str:
    """List the conditions of an axis structure that the axes satisfy only approximately."""
    found = classification.found
    missed = [r for r in found.requirements if r.deviation > EXACT_STRUCTURE] if found else []
    return "; ".join(f"{r.text}: off by {_distance(r, classification)}" for r in missed)


def singular(inverses: Inverses) -> str:
    """Describe an arm that can move in every configuration without moving its tool."""
    rest = "ik returns some of infinitely many solutions"
    if inverses.given:
        rest = f"the value of {listed(inverses.given)} is an input of ik"
    return f"singular in every configuration: {inverses.self_motion}; {rest}"


def notes(inverses: Inverses) -> tuple[str, ...]:
    """Return remarks if an arm is always singular or has only a refined IK function."""
    classification = inverses.classification
    if inverses.self_motion:
        return (f"the arm is {singular(inverses)}",)
    if classification.found is None or classification.method == "exact":
        return ()
    near = (
        f"the structure of the axes ({classification.found.title}) is only approximate: "
        f"{missed_by(classification)}; ik refines the solutions of a nominal arm"
    )
    if len(classification.lines.axes) >= FREEDOMS:
        return (near,)
    return (
        near,
        "only inverses of a full pose are refined, so ik_position and other inverses of a part of "
        "a pose are missing",
    )


def _with_added(classification: Classification) -> str:
    names = [axis.name for axis in classification.lines.added]
    return f", with {listed(names)} at 0 in addition to the arm's joints" if names else ""


def _with_fixed(attempt: Attempt, classification: Classification) -> str:
    names = [classification.lines.axes[k].name for k in attempt.given]
    return f", with {listed(names)} fixed" if names else ""


def _condition(requirement: Requirement, classification: Classification) -> str:
    if requirement.deviation <= EXACT_STRUCTURE:
        return f"{requirement.text}: holds"
    return f"{requirement.text}: off by {_distance(requirement, classification)}"


def _distance(requirement: Requirement, classification: Classification) -> str:
    if not np.isfinite(requirement.deviation):
        return NEVER
    return requirement.in_units(classification.lines.length)


def nearest(classification: Classification) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return the tested axis structures with their violated conditions, best fit first."""
    best: dict[str, Attempt] = {}
    for attempt in sorted(classification.attempts, key=lambda attempt: attempt.deviation):
        best.setdefault(attempt.title, attempt)
    return [
        (
            attempt.title + _with_fixed(attempt, classification),
            [
                (requirement.text, _distance(requirement, classification))
                for requirement in attempt.requirements
                if requirement.deviation > EXACT_STRUCTURE
            ],
        )
        for attempt in best.values()
    ]


def _nearest(classification: Classification) -> str:
    rows = [("structure, and the conditions that do not hold", "off by")]
    for title, missed in nearest(classification)[:MAX_LISTED]:
        rows += [(title, ""), *((f"  {text}", off) for text, off in missed)]
    return "\n".join(_table(rows))


def _table(rows: Sequence[tuple[str, str]]) -> list[str]:
    wide = max(len(left) for left, right in rows if right) + _GAP
    head, *body = (f"{left.ljust(wide)}{right}".rstrip() for left, right in rows)
    return [head, "-" * len(head), *body]


def _task(name: str, solved: Solved) -> str:
    function = solved.function
    arguments = ", ".join(argument.name for argument in function.inputs)
    several = f"{function.branches} slots" if function.branches > 1 else "one slot"
    solutions = f"at most {counted(function.branches, 'solution')} in {several}"
    lines = [f"{name}({arguments}): {solutions}, residual and margin of each."]
    for number, step in enumerate(solved.work.steps, 1):
        lines += _step(number, step, solved)
    lines += [f"    {rest}" for rest in _remaining(solved)]
    return "\n".join(lines)


def _step(number: int, step: InverseStep, solved: Solved) -> Iterable[str]:
    yield f"{number:2}. {' + '.join(step.joints)}, by {step.method}: {step.reason}."
    if step.found.sign is not None:
        number_of_sign = solved.work.signs.index(step.found.sign) + 1
        boundary = (
            "" if step.found.margin is None else "; they coincide at the boundary of the workspace"
        )
        yield f"    Two solutions, sign {number_of_sign} of {len(solved.work.signs)}{boundary}."
    if step.degenerate:
        yield f"    Degenerate: {step.degenerate}."


def _remaining(solved: Solved) -> Iterable[str]:
    for remainder in solved.work.remainders:
        others = [name for name in remainder.joints if name != remainder.last]
        total = " + ".join(remainder.joints)
        yield f"{remainder.last} follows from {total}, with {listed(others)} known."


def _general(general: GeneralInverse) -> str:
    most = general.function.branches
    arguments = ", ".join(argument.name for argument in general.function.inputs)
    head = f"ik({arguments}): at most {most} solutions in {most} slots, {general.method}."
    return "\n".join([head, *(f"{k:2}. {step}" for k, step in enumerate(general.steps, 1))])


def _of_loops(hybrid: SolvedLoops) -> str:
    mechanism = hybrid.mechanism
    if not mechanism.is_constrained:
        return "The actuators follow from the main chain by constant ratios."
    solution = hybrid.backward
    actuated = {c.moves for c in mechanism.coordinates}
    if aside := _aside(hybrid):
        return f"The tool on {mechanism.tool_body} does not depend on {listed(aside)}."
    if solution.open and hybrid.forward.open and backward_inverse.makers(hybrid):
        legs = listed([leg.closure for leg in leg_chains(hybrid) or ()])
        return (
            f"The main chain determines the legs that end at {legs} in closed form, each as a "
            "serial arm. ik solves a pose in this way."
        )
    if solution.open and actuated & set(solution.open):
        missing = listed(sorted(actuated & set(solution.open)))
        return f"There is no closed form for {missing} from the main chain."
    steps = counted(len(solution.steps), "step")
    message = (
        f"The actuators follow from the main chain in closed form, through the loops in {steps}."
    )
    is_solved = hybrid.forward.open and (
        leg_inverse.makers(hybrid) or backward_inverse.makers(hybrid)
    )
    if is_solved and is_carried(hybrid):
        return (
            f"{message} The pose of the tool determines the wrist center. Each leg keeps a ball "
            f"joint in a plane, so that up to {ROTATIONS} rotations of the platform are roots of a "
            "polynomial. ik solves the legs and the wrist for each rotation."
        )
    arm = carried_arm(hybrid) if is_solved else None
    if arm is not None and is_carried_arm(hybrid):
        names = [arm.carried.others[k].name for k in sorted(arm.unknown)]
        given = [hybrid.robot.moving[k].name for k in arm.given]
        fixed = f" with {listed(given)} fixed" if given else ""
        found = f"determine {listed(names)}{fixed}" if names else f"hold{fixed}"
        return (
            f"{message} Each leg keeps a ball joint in a plane. For a pose of the tool, the three "
            f"equations of the planes {found}, in up to {arm.solutions} ways. ik solves the legs "
            "for each of them."
        )
    if is_solved:
        return f"{message} ik solves a pose in this way."
    reason = backward_inverse.missing(hybrid)
    return f"{message} There is no ik; {reason}." if reason else message


def _aside(hybrid: SolvedLoops) -> list[str]:
    moving = {joint.name for joint in hybrid.robot.moving}
    moving |= {name for loop in equations(hybrid) for name in loop.joints}
    return [c.name for c in hybrid.mechanism.coordinates if c.moves not in moving]


def mechanism_in_words(h: SolvedLoops) -> str:
    """Describe the degrees of freedom, the loops and the solution of each loop."""
    paragraphs = [_freedoms(h)]
    if h.mechanism.is_constrained:
        paragraphs += [_loops(h), _ways(h)]
    paragraphs += [[f"{line[0].upper()}{line[1:]}." for line in (*limits_of(h), *doubts_of(h))]]
    return "\n\n".join("\n".join(lines) for lines in paragraphs if lines)


def _freedoms(h: SolvedLoops) -> list[str]:
    found = mobility_of(h.numbers, equations(h))
    actuated = ", ".join(h.mechanism.actuated)
    return [
        f"Degrees of freedom: {found.true}, actuated by {actuated}. "
        f"n = {found.bodies} bodies, j = {found.joints} joints, sum f = {found.freedoms}, "
        f"lambda = {found.order}.",
        *(f"  {line}" for line in found.report),
    ]


def _loops(h: SolvedLoops) -> list[str]:
    lines = [
        "Loops and couplings, each with its joints:"
        if h.mechanism.couplings
        else "Loops, each with the joints around it:"
    ]
    for loop in equations(h):
        around, count = ", ".join(loop.joints), counted(len(loop.residual), "equation")
        lines.append(f"  {loop.name} ({loop.kind}, {count}): {around}")
    return lines


def _ways(h: SolvedLoops) -> list[str]:
    lines = ["Joints from the actuators:", *_steps(h, h.forward)]
    if h.is_overdetermined:
        lines.append(f"  no joint: {len(h.q)} actuators for {h.freedoms} degrees of freedom")
    elif h.forward.open:
        lines.append(f"  {', '.join(h.forward.open)}: by Newton's iteration at run time")
    backward = (from_chain_with_arms(h) or h).backward
    lines += ["Joints from the main chain:", *_steps(h, backward)]
    if backward.open:
        lines.append(f"  {', '.join(backward.open)}: no closed form")
    return lines


def _steps(h: SolvedLoops, solution: Solution) -> Iterator[str]:
    for number, step in enumerate(solution.steps, 1):
        side = f"; branch: {step.branch}" if step.branch else ""
        loop = step.name(h.mechanism)
        of_loop = f"{loop}: " if loop else ""
        yield f"  {number}. {of_loop}{step.title}, for {', '.join(step.joints)}{side}"
