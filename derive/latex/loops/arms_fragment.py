r"""Prints parts of loops that are solved as serial arms between known bodies."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import sympy as sp

from ...inverse.arms.arm_step import WHOLE, ArmStep, from_chain_with_arms
from ...inverse.arms.loop_arm import LoopArm, structure_of
from ...inverse.classify import Attempt, Classification
from ...inverse.mechanisms.leg_chains import leg_chains
from ...inverse.serial_inverse import Inverses
from ...inverse.steps.work import Work
from ...inverse.structure.lines import Lines
from ...inverse.structure.words import listed as in_words
from ...inverse.tasks.slots import POSE_SYMBOLS, branches, pose_argument
from ...loops.planar.reference import AtReference, wrapped
from ...loops.solve.solution import Solution
from ...loops.solve.solved_loops import SolvedLoops
from ...loops.spatial.struts import SIGNS
from ...model.placements import Placement, inverse
from ...model.robot import Joint, SerialRobot
from ...model.tolerances import RECOVERED
from ..inverse.inverse_fragment import arm_steps, method, step_numbers
from ..inverse.printed_task import PrintedTask
from ..setting import transforms
from ..setting.arm_notation import ArmNotation
from ..setting.layout import flowed
from ..setting.names import frame
from ..setting.page import Page, sentence, text
from .loop_page import LoopPage
from .printed_steps import after

IDENTITY = "T is the pose that the arm reaches"


@dataclass(frozen=True)
class _ArmPage(Page):
    """The LaTeX article data of a serial arm inside a loop.

    The LaTeX symbol T denotes the pose of the arm's end relative to the frame of the arm's first
    joint.
    """

    @property
    def pose(self) -> str:
        """Return the symbol of the pose that the arm reaches."""
        return "T"


@dataclass(frozen=True)
class OwnArm:
    """A serial arm inside a loop, from its first joint frame to its last joint frame.

    Attributes:
        arm: The arm without the constant transforms at its base and tool.
        begin: Pose of the first joint frame in the frame of the body ``base``.
        base: The known body before the first joint.
        body: The known body after the last joint.
    """

    arm: LoopArm
    begin: Placement
    base: str
    body: str

    @classmethod
    def of(cls, page: LoopPage, arm: LoopArm) -> "OwnArm":
        """Return the arm without constant transforms at its ends.

        The poses of the arm's end frames relative to the adjacent bodies include the removed
        transforms.
        """
        first, *rest = arm.robot.joints
        *inner, last = replace(first, before=()), *rest
        robot = replace(arm.robot, joints=(*inner, replace(last, after=())), tool=())
        end = (*arm.end, *inverse((*last.after, *arm.robot.tool)))
        base = arm.unknown[0].parent
        common = arm.known[0].parent if arm.known else base
        body = arm.back[-1].link if arm.back else common
        structure = structure_of(robot, page.terms)
        if structure is None:
            return cls(arm, (), base, body)
        lines, found = structure
        begin = Joint("begin", "fixed", first.before)
        own = replace(
            arm, known=(*arm.known, begin), robot=robot, end=end, lines=lines, found=found
        )
        return cls(own, first.before, base, body)

    @property
    def shape(self) -> tuple[object, ...]:
        """A key that is equal for arms with equal joint geometry and thus equal solution steps."""
        return tuple(
            (joint.kind, joint.before, joint.after, joint.pitch, joint.direction)
            for joint in self.arm.robot.joints
        )


@dataclass(frozen=True)
class PrintedArm:
    """A serial arm inside a loop, with its printed solution steps.

    Attributes:
        own: The arm.
        symbols: The symbols of the arm.
        steps: The text of the solution steps.
        task: The steps.
        like: An arm with the same solution steps that is printed earlier, or None if no earlier arm
            has them.
    """

    own: OwnArm
    symbols: Page
    steps: str
    task: PrintedTask
    like: "PrintedArm | None" = None


def arms(page: LoopPage) -> list[str]:
    """Return an opening paragraph, and one paragraph for each serial arm that solves a loop.

    The list is empty if no arm solves a loop.
    """
    printed = printed_arms(page)
    paragraphs = [_paragraph(page, arm) for arm in printed]
    tasks = [arm.task for arm in printed if arm.like is None]
    return [_opening(page, tasks), *paragraphs] if paragraphs else []


def printed_arms(page: LoopPage) -> list[PrintedArm]:
    """Return the serial arms that solve loops, with their printed solution steps."""
    first = after(page.backward_steps, after(page.forward_steps))
    printed: list[PrintedArm] = []
    for arm in _arms(page.hybrid):
        own = OwnArm.of(page, arm)
        symbols = arm_page(page, own.arm.robot)
        like = next((other for other in printed if other.own.shape == own.shape), None)
        if like is not None:
            printed.append(replace(like, own=own, symbols=symbols, like=like))
            continue
        steps, task = arm_steps(symbols, _inverses(page, own.arm), first)
        first += len(task.steps)
        printed.append(PrintedArm(own, symbols, steps, task))
    return printed


def _arms(h: SolvedLoops) -> Iterable[LoopArm]:
    through = from_chain_with_arms(h)
    yield from _of_steps(h.forward)
    yield from _of_steps(h.backward if through is None else through.backward)
    if through is None and h.forward.open:
        yield from (leg.arm for leg in leg_chains(h) or ())


def _of_steps(solution: Solution) -> Iterable[LoopArm]:
    for step in solution.steps:
        if isinstance(step, ArmStep) and step.arm is not None:
            yield step.arm


def _opening(page: LoopPage, tasks: Sequence[PrintedTask]) -> str:
    origin = frame(page.mechanism.base_frame)
    return sentence(
        r"\paragraph{Serial arms between known bodies.} The pose $T$ of an arm's end, relative to"
        r" the frame of its first joint, follows from the known joints. The joints of the arm"
        r" follow from this pose as in the inverse kinematics of a serial arm. The pose of body $b$"
        f" in the base frame is ${transforms.transform(origin, 'b')}$.",
        method(tasks),
    )


def _paragraph(page: LoopPage, arm: PrintedArm) -> str:
    steps = arm.steps if arm.like is None else _as_in(arm, arm.like)
    closing = sentence(_signs(page, arm), _condition(arm.own.arm))
    return text(_beginning(page, arm.own, arm.symbols), steps, closing).rstrip()


def _as_in(arm: PrintedArm, other: PrintedArm) -> str:
    """Return a sentence that refers to the solution steps of a geometrically equal arm."""
    pairs = zip(_joints(arm.symbols), _joints(other.symbols), strict=True)
    changes = in_words([f"${tex}$ in place of ${first}$" for tex, first in pairs])
    numbers = step_numbers(other.task.steps[0].number, len(other.task.steps))
    return f"The joints follow as in {numbers.lower()}, with {changes}."


def _beginning(page: LoopPage, own: OwnArm, symbols: Page) -> str:
    base, body = _body(page, own.base), _body(page, own.body)
    named = zip(own.arm.robot.moving, _joints(symbols), strict=True)
    names = in_words([_joint(page, joint.name, tex) for joint, tex in named])
    return sentence(
        rf"\paragraph{{Arm from {base} to {body} through {page.members.called(own.arm.closure)}.}}"
        f" The joints are {names}.",
        _target(page, own, symbols),
    )


def _joints(symbols: Page) -> tuple[str, ...]:
    notation = symbols.equations.notation
    return tuple(notation.tex[q] for q in notation.q)


def arm_page(page: LoopPage, robot: SerialRobot) -> Page:
    """Return the symbols of a serial arm in a robot with loops.

    Each moving joint of the arm is a joint of the robot or a joint that closes a loop.
    """
    q = [page.joints.get(joint.name) or page.letters.next("angle") for joint in robot.moving]
    chain, whole = page.chain, page.chain.equations.notation
    called = [*(whole.tex[symbol] for symbol in q), *page.members.of.values()]
    equations = replace(chain.equations, notation=ArmNotation(whole, q, called))
    return _ArmPage(robot, equations, chain.links, chain.screws, chain.inverse, chain.singular)


def arm_inverses(
    lines: Lines, found: Attempt | None, robot: SerialRobot, work: Work, values: Sequence[sp.Expr]
) -> Inverses:
    """Return the inverse kinematics of an arm in a loop, in the form used for serial robots.

    Args:
        lines: The axes of the arm.
        found: The structure of the axes, or None if the solution steps need no structure.
        robot: The arm.
        work: The solution steps.
        values: The values of the moving joints of the arm.
    """
    pose = (pose_argument(robot),)
    solved = branches("ik", robot, work, pose, values, sp.S.Zero, IDENTITY)
    return Inverses(Classification(lines, found, () if found is None else (found,)), {"ik": solved})


def _solved(page: LoopPage, arm: LoopArm) -> tuple[Work, dict[str, sp.Expr], sp.Expr]:
    work = Work(page.terms)
    return work, *arm.solved(work, POSE_SYMBOLS)


def _inverses(page: LoopPage, arm: LoopArm) -> Inverses:
    work, values, _ = _solved(page, arm)
    entries = [values.get(joint.name, sp.S.Zero) for joint in arm.robot.moving]
    return arm_inverses(arm.lines, arm.found, arm.robot, work, entries)


def _joint(page: LoopPage, name: str, tex: str) -> str:
    if name in page.joints:
        return page.members.with_symbol(name)
    return f"the coordinate ${tex}$ of the closure"


def _body(page: LoopPage, name: str) -> str:
    return "the base" if name == page.mechanism.base_frame else page.members.called(name)


def _target(page: LoopPage, own: OwnArm, symbols: Page) -> str:
    """Print the pose that a serial arm inside a loop reaches."""
    origin, ends = page.mechanism.base_frame, {"B": own.begin, "E": own.arm.end}
    begin, end = (page.letters.letters[letter] for letter in ends)
    poses = [transforms.transform(*map(frame, (origin, body))) for body in (own.base, own.body)]
    factors = [
        f"{begin}^{{-1}}" if own.begin else "",
        rf"\bigl({poses[0]}\bigr)^{{-1}}" if own.base not in (origin, own.body) else "",
        poses[1] if own.body not in (origin, own.base) else "",
        end if own.arm.end else "",
    ]
    product = r"\,".join(filter(None, factors)) or "I"
    notation = symbols.equations.notation
    placements = {begin: own.begin, end: own.arm.end}
    displays = [
        symbols.matrix(name, transforms.matrix(placement, notation))
        for name, placement in placements.items()
        if placement
    ]
    return sentence(
        f"The arm reaches the pose $T = {product}${' with' if displays else '.'}",
        flowed(displays) if displays else "",
    )


def _signs(page: LoopPage, arm: PrintedArm) -> str:
    """State the branch signs of the reference configuration."""
    signs = zip(arm.task.signs, _at_reference(page, arm.own.arm), strict=False)
    shown = [f"${arm.symbols.tex(symbol)} = {sign}$" for symbol, sign in signs]
    return f"The branch of the reference configuration has {in_words(shown)}." if shown else ""


def _at_reference(page: LoopPage, arm: LoopArm) -> tuple[int, ...]:
    """Return the branch signs of an arm in the reference configuration, or () if not unique."""
    terms, near = page.terms, page.hybrid.at_reference
    work, values, _ = _solved(page, arm)
    if not work.signs:
        return ()
    numbers = {name: sp.Float(value) for name, value in near.items()}
    pose = arm.wanted(page.hybrid.mechanism, terms, numbers)
    entries = [float(terms.value(entry)) for entry in pose]
    known = dict(zip(POSE_SYMBOLS, entries, strict=True))
    fits = []
    for signs in product(SIGNS, repeat=len(work.signs)):
        at = AtReference(terms, known | dict(zip(work.signs, map(float, signs), strict=True)), {})
        apart = [wrapped(at.of(value) - near[name]) for name, value in values.items()]
        fits += [signs] if math.hypot(*apart) < RECOVERED else []
    return fits[0] if len(fits) == 1 else ()


def _condition(arm: LoopArm) -> str:
    """State that an arm with fewer than six joints reaches only some poses."""
    if len(arm.robot.moving) >= WHOLE:
        return ""
    return "The loop closes only if the arm reaches the orientation and the position of the pose."
