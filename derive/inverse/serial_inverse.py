"""Inverse kinematics of a serial robot.

A chain whose axes exactly fit a known family has a closed-form solution. If the axes nearly fit a
family, Newton's method refines the solutions of a nominal arm that fits the family exactly. A
five-joint arm that fits no family is solved as a six-joint arm with an added joint about the tool
axis. The general solver solves any other arm with six free joints.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import chain, islice

from ..chain.kinematics import common_unit
from ..model.robot import SerialRobot
from ..model.tolerances import (
    CONVERGENCE_CLEAR,
    CONVERGENCE_UNLIKELY,
    EXACT_STRUCTURE,
    MIN_CONVERGED,
    MIN_NEARBY,
)
from ..terms.symbolic_function import NativeSolverFunction, SymbolicFunction
from ..terms.terms import Terms
from .chain_solution import pose_task, solve_chain
from .classify import Attempt, Classification, classify, further_families
from .coupled_chain import CoupledChain, coupled_chain
from .coupled_inverse import (
    coordinates_at,
    in_coordinates,
    of_coordinates,
    refined_in_coordinates,
)
from .coupled_wrist import coupled_wrist
from .families import FAMILIES
from .families.family import Family
from .general.general_inverse import (
    GeneralInverse,
    GeneralTables,
    general_inverse,
    general_tables,
)
from .lost_poses import lost_poses
from .nominal import nominal_of
from .nominal_convergence import Sampled, share_near
from .polished_inverse import as_start, polished_inverse
from .steps.target import of_pose
from .steps.work import Work
from .structure.lines import Lines, axes_of, home_of
from .structure.numeric_arm import NumericArm
from .structure.self_motion import joints_of_self_motion, self_motion
from .tasks.slots import (
    POSE_SYMBOLS,
    function_of,
    pose_argument,
    pose_residual,
    tool_of,
    values_of,
    with_rounding,
)
from .tasks.task import Solved, Task
from .tool_axis import by_tool_axis

MAX_FREE = 6
"""Maximum number of joints that a tool pose can determine."""
MAX_TRIED = 5
"""Maximum number of axis structures for which a closed-form solution is derived and tested. The
search for an axis structure ends early if a closed-form solution solves all test poses."""


@dataclass(frozen=True)
class Inverses:
    """All inverse kinematics functions of a robot.

    Attributes:
        classification: The structure of the robot's joint axes, or the reason why no known
            structure fits.
        solved: The closed-form solutions of the inverse kinematics tasks, keyed by function name.
        others: Functions related to the inverse kinematics, such as the swivel angle of a
            configuration.
        general: Inverse kinematics by the general solver, for a robot whose axes fit no closed-form
            family.
        polished: Inverse kinematics function of an arm whose axes nearly fit a closed-form family.
            If the attribute ``polished`` is set, the attribute ``solved`` contains the inverse
            kinematics of the nominal arm.
        polished_tasks: Functions for inverse kinematics tasks other than the full pose. Each of
            these functions refines solutions of the nominal arm.
        composed: Inverse kinematics function of a robot with loops. This function calls the inverse
            kinematics function of the main chain.
        chain: Chain that the inverse kinematics of a robot with coupled joints solves, or None if
            no joints are coupled.
    """

    classification: Classification
    solved: dict[str, Solved]
    others: tuple[SymbolicFunction, ...] = ()
    general: GeneralInverse | None = None
    polished: NativeSolverFunction | None = None
    polished_tasks: tuple[NativeSolverFunction, ...] = ()
    composed: NativeSolverFunction | None = None
    chain: CoupledChain | None = None

    @property
    def written(self) -> tuple[NativeSolverFunction, ...]:
        """Functions in handwritten C that read tables of robot constants."""
        found = self.polished if self.general is None else self.general.function
        composed = () if self.composed is None else (self.composed,)
        return () if found is None else (found, *self.polished_tasks, *composed)

    @property
    def missing(self) -> str:
        """Why the robot has no inverse kinematics function, or an empty text if it has one."""
        return "" if self.solved or self.written else self.classification.missing

    @property
    def self_motion(self) -> str:
        """Describe the joints that can always move without moving the tool.

        The description is empty if no joint can always move without moving the tool. The
        description is also empty if the arm has more joints than a pose determines, or redundant
        joints that loops couple.
        """
        lines = self.classification.lines
        is_whole = self.general is not None or bool(self.given)
        return self_motion(lines) if is_whole and len(lines.axes) <= MAX_FREE else ""

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the fixed joints, whose values are inputs of ``ik``."""
        if self.general is not None:
            return self.general.given
        found = self.classification.found
        axes = self.classification.lines.axes
        return () if found is None else tuple(axes[k].name for k in found.given)

    @property
    def functions(self) -> dict[str, SymbolicFunction]:
        """All derived functions, keyed by name."""
        tasks = {name: solved.function for name, solved in self.solved.items()}
        return tasks | {function.name: function for function in self.others}


def inverses(
    robot: SerialRobot,
    terms: Terms,
    coordinates: int | None = None,
    families: Sequence[Family] = FAMILIES,
    give: tuple[int, ...] = (),
    methods: "Sequence[Method] | None" = None,
) -> Inverses:
    """Derive the inverse kinematics of a serial robot for all tasks.

    Args:
        robot: The description.
        terms: Table of named terms.
        coordinates: Number of coordinates that move the robot, if loops couple joints.
        families: The families of axis structures to try, in order.
        give: Indices of the joints to fix, or () to select suitable joints automatically.
        methods: The solution methods to try, or None for all methods in ``METHODS``.
    """
    classification = classify(robot, terms, coordinates, families, give)
    found = (
        method(robot, classification, families)
        for method in (METHODS if methods is None else methods)
    )
    return next((result for result in found if result), Inverses(classification, {}))


def _by_structure(
    robot: SerialRobot, classification: Classification, families: Sequence[Family]
) -> Inverses | None:
    found, lines = classification.found, classification.lines
    if found is None or classification.method != "exact":
        return None
    if not found.is_whole:
        further = further_families(lines, found, families, classification.give)
        attempt, whole = _losing_least(robot, lines, chain([found], further))
        others = {task.name: task.solved(robot, lines) for task in _tasks(robot, found, lines)}
        solved = {"ik": whole} | others
        return Inverses(replace(classification, found=attempt), solved)
    solved = {"ik": pose_task(robot, lines, found)} if found.family.solves_pose else {}
    tasks = _tasks(robot, found, lines)
    if not solved and not tasks:
        reason = f"{found.title}, but the tool moves in fewer directions than its tasks require"
        return Inverses(replace(classification, found=None, missing=reason), {})
    solved |= {task.name: task.solved(robot, lines) for task in tasks}
    functions = found.family.functions(robot, lines)
    return _searching(robot, Inverses(classification, solved, functions))


def _tasks(robot: SerialRobot, found: Attempt, lines: Lines) -> list[Task]:
    tasks = [] if found.given else found.family.tasks
    usable = [task for task in tasks if found.is_whole or task.reads_base]
    return [task for task in usable if task.applies(robot, lines)]


def _losing_least(
    robot: SerialRobot, lines: Lines, attempts: Iterable[Attempt]
) -> tuple[Attempt, Solved]:
    arm = NumericArm.of(robot, lines)
    best: tuple[int, Attempt, Solved] | None = None
    for attempt in islice(attempts, MAX_TRIED):
        task = pose_task(robot, lines, attempt)
        lost = lost_poses(arm, task.function)
        if best is None or lost < best[0]:
            best = lost, attempt, task
        if not lost:
            break
    assert best is not None
    lost, attempt, task = best
    return attempt, task.with_search() if lost else task


def _searching(robot: SerialRobot, found: Inverses) -> Inverses:
    if found.others:
        return found
    arm = NumericArm.of(robot, found.classification.lines)

    def misses(task: Solved) -> bool:
        return task.is_known and lost_poses(arm, task.function) > 0

    solved = {
        name: task.with_search() if misses(task) else task for name, task in found.solved.items()
    }
    return replace(found, solved=solved)


def _by_nominal(
    robot: SerialRobot, classification: Classification, _: Sequence[Family]
) -> Inverses | None:
    lines = classification.lines
    for found in classification.near:
        nominal = nominal_of(robot, lines, found)
        exact = Lines(lines.terms, axes_of(nominal, lines.terms))
        if found.on(exact).deviation > EXACT_STRUCTURE:
            continue
        near = share_near(robot, lines, nominal, exact, found.given)
        if near < CONVERGENCE_UNLIKELY:
            continue
        solved = pose_task(nominal, exact, found)
        sampled = Sampled.of(robot, lines, solved.function)
        is_clear = near >= CONVERGENCE_CLEAR and sampled.share_nearby >= MIN_NEARBY
        if is_clear or sampled.share_converged >= MIN_CONVERGED:
            fitting = replace(classification, found=found, missing="")
            # The distances between solutions depend on the value of a fixed joint, so they are used
            # only for an arm without fixed joints.
            apart = () if found.given else sampled.separations
            return refined_from(
                fitting, solved, general_tables(robot, found.given, apart), sampled.move
            )
    return None


def refined_from(
    classification: Classification, nominal: Solved, general: GeneralTables, move: float
) -> Inverses:
    """Return the inverse kinematics functions of a calibrated arm."""
    start = as_start(nominal)
    inverse = polished_inverse(classification, nominal.function, general, move)
    return Inverses(classification, {start.function.name: start}, polished=inverse)


def _by_tool_axis(
    robot: SerialRobot, classification: Classification, families: Sequence[Family]
) -> Inverses | None:
    if classification.found is not None:
        return None
    found = by_tool_axis(robot, classification, families)
    return None if found is None else _searching(robot, Inverses(*found))


def _by_couplings(
    robot: SerialRobot, classification: Classification, families: Sequence[Family]
) -> Inverses | None:
    if not robot.couplings:
        return None
    terms, chain = classification.lines.terms, coupled_chain(robot)
    if chain.surplus > 0:
        return None if classification.give else _by_free_followers(robot, chain, terms, families)
    give = tuple(chain.index(robot.moving[k].name) for k in classification.give)
    found = inverses(chain.robot, terms, families=families, give=give)
    if found.general is not None:
        reason = "coupled joints need a closed form; ik_numeric finds one solution by iteration"
        return Inverses(replace(found.classification, found=None, missing=reason), {})
    solved = {
        name: mapped
        for name, task in found.solved.items()
        if (mapped := in_coordinates(robot, chain, terms, task)) is not None
    }
    others = tuple(of_coordinates(robot, chain, terms, function) for function in found.others)
    polished = found.polished and refined_in_coordinates(robot, chain, found.polished, solved)
    return replace(found, solved=solved, others=others, polished=polished, chain=chain)


def _by_self_motion(
    robot: SerialRobot, classification: Classification, families: Sequence[Family]
) -> Inverses | None:
    """Derive the inverse kinematics of an arm with a self-motion in every configuration."""
    lines = classification.lines
    if classification.found is not None or classification.give or len(lines.axes) > MAX_FREE:
        return None
    for joint in reversed(joints_of_self_motion(lines)):
        found = inverses(robot, lines.terms, families=families, give=(joint,))
        if found.solved or found.written:
            return found
    return None


def _by_determinant(
    robot: SerialRobot, classification: Classification, _: Sequence[Family]
) -> Inverses | None:
    if classification.found is not None:
        return None
    general = general_inverse(robot, classification.give)
    return None if general is None else Inverses(classification, {}, general=general)


Method = Callable[[SerialRobot, Classification, Sequence[Family]], Inverses | None]
METHODS: tuple[Method, ...] = (
    _by_couplings,
    _by_structure,
    _by_nominal,
    _by_tool_axis,
    _by_self_motion,
    _by_determinant,
)
"""Methods to derive the inverse kinematics of a robot, in the order in which they are tried."""
WRITTEN: tuple[Method, ...] = (_by_nominal, _by_determinant)
"""Methods whose inverse kinematics functions use handwritten C code.

The inverse kinematics function of a robot with loops can call the handwritten C code for the
robot's main chain.
"""
STRUCTURED = METHODS[: METHODS.index(_by_self_motion)]
"""Methods whose solution steps can be printed."""


def _by_free_followers(
    robot: SerialRobot, chain: CoupledChain, terms: Terms, families: Sequence[Family]
) -> Inverses | None:
    """Derive ``ik`` of a robot with coupled joints, and ``ik_position`` of a palletizer.

    The solution steps ignore the couplings between joints, unless the family of the chain includes
    the couplings. Solutions that violate a coupling are therefore possible, and are invalid.

    Args:
        robot: The description.
        chain: The chain without couplings, which has more joints than the robot has coordinates.
        terms: Table of named terms.
        families: The families of axis structures to try, in order.

    Returns:
        The inverse kinematics functions, or None if the pose does not determine all free joints.
        The returned value is also None if a coupling ratio is a fraction, because full turns of the
        coupled joints are then ambiguous.
    """
    if not chain.keeps_turns:
        return None
    classification = classify(chain.robot, terms, families=families)
    if not _solves_free_chain(classification):
        classification = classify(chain.robot, terms, chain.C.cols, coupled_wrist(chain))
    found = classification.found
    if found is None:
        return None
    work = Work(terms)
    target = of_pose(terms, POSE_SYMBOLS, home_of(chain.robot, terms))
    solve_chain(work, classification.lines, found, target, {})
    q = coordinates_at(chain, terms, values_of(work, chain.robot, {}))
    pose = tool_of(terms, chain.robot, chain.joints_at(q))
    residual = pose_residual(terms, pose, POSE_SYMBOLS)
    lengths = [e for e, c in zip(q, robot.coordinates, strict=True) if c.unit == "m"]
    unit = common_unit([c.unit for c in robot.coordinates])
    identity = "fk(q[k]) = T if residual[k] is a rounding error"
    residual = with_rounding(terms, residual, lengths)
    function = function_of("ik", work, (pose_argument(robot),), q, unit, residual, identity)
    solved = {"ik": Solved(function, work)}
    position = found.family.coupled_position if found.is_whole else None
    level = position and position(chain, classification.lines)
    task = level and in_coordinates(robot, chain, terms, level)
    solved |= {task.function.name: task} if task else {}
    return Inverses(classification, solved, chain=chain)


def _solves_free_chain(classification: Classification) -> bool:
    found = classification.found
    return (
        found is not None
        and not found.given
        and found.family.solves_pose
        and not found.family.inputs
    )
