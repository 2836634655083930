r"""Prints the LaTeX fragments of a serial robot with coupled joints."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import cycle

import numpy as np
import sympy as sp

from ...derivation import Derivation, derive
from ...inverse.coupled_chain import CoupledChain, coupled_chain
from ...inverse.structure.words import listed
from ...inverse.tasks.partial_poses import POSITION_TASK
from ...model.coupling import Motor
from ...model.geometry import Geometry
from ...model.robot import SerialRobot
from ..inverse.inverse_fragment import inverse
from ..inverse.structure_fragment import missing_structure, structure
from ..setting.layout import aligned
from ..setting.names import escape
from ..setting.notation import LENGTH
from ..setting.page import Page, sentence, text
from ..setting.sharing import PRINTED
from . import tables
from .example_fragment import ANGLES, example, value_at, within
from .given_fragment import parameters, symbols
from .singularity_fragment import singularities

JOINT, INDEPENDENT = r"\theta", r"\varphi"
"""LaTeX letters of joint values. The letter ``JOINT`` denotes all joints, and the letter
``INDEPENDENT`` denotes the independent joints."""


@dataclass(frozen=True)
class CoupledPage:
    """A serial robot with coupled joints, and the data that its LaTeX article prints.

    Attributes:
        robot: The robot description.
        derivation: The derived functions of the robot, in terms of its coordinates q.
        chain: The LaTeX article data of the robot without couplings, whose coordinates are the
            joint values theta.
    """

    robot: SerialRobot
    derivation: Derivation
    chain: Page

    @classmethod
    def of(cls, derivation: Derivation) -> "CoupledPage":
        """Derive the robot without couplings, and return the data of the LaTeX article."""
        robot = derivation.robot
        assert isinstance(robot, SerialRobot)
        plain = derive(robot.uncoupled, functions=PRINTED, families=derivation.families)
        called = [rf"{JOINT}_{{{k}}}" for k, _ in enumerate(robot.moving, 1)]
        chain = Page.of(plain, called)
        geometry = derivation.geometry if isinstance(derivation.geometry, Geometry) else None
        return cls(robot, derivation, replace(chain, geometry=geometry))

    @cached_property
    def free(self) -> CoupledChain:
        """The chain of the independent joints."""
        return coupled_chain(self.robot)

    @cached_property
    def merged(self) -> Page | None:
        """Article data for the chain of independent joints, or None if all joints are independent.

        The symbols of the chain of independent joints differ from the symbols of the whole chain.
        """
        shorter, letters = self.free.robot, self.chain.equations.notation.letters
        if len(shorter.moving) == len(self.robot.moving):
            return None
        called = [rf"{INDEPENDENT}_{{{k}}}" for k, _ in enumerate(shorter.moving, 1)]
        reserved = [letters[kind] for kind in ("cos", "sin", "term", "constant", "geometry")]
        plain = derive(shorter, functions=PRINTED, families=self.derivation.families)
        return Page.of(plain, called, reserved=reserved)

    @property
    def q(self) -> tuple[sp.Symbol, ...]:
        """The printed symbols of the robot's coordinates."""
        notation = self.chain.equations.notation
        count = len(self.robot.coordinates)
        return tuple(notation.symbol(f"q_{{{k}}}", (LENGTH, (80, k))) for k in range(1, count + 1))


def description(page: CoupledPage) -> str:
    """Print the limits of the joints and the motors."""
    motors = [c for c in page.robot.coordinates if isinstance(c, Motor)]
    if not motors:
        return parameters(page.chain, JOINT)
    numbers = {c.name: k for k, c in enumerate(page.robot.coordinates, 1)}
    table = tables.tabular(
        [
            ("$q$", [f"$q_{{{numbers[motor.name]}}}$" for motor in motors]),
            ("motor", [escape(motor.name) for motor in motors]),
            ("limits", [tables.limits(motor.limits) for motor in motors]),
        ],
        repeated=1,
    )
    return text(parameters(page.chain, JOINT).rstrip(), sentence("Motors move the joints:", table))


def couplings(page: CoupledPage) -> str:
    """Print the joint positions as functions of the coordinates, and vice versa."""
    own, printer = page.robot.linear_map, page.chain.equations.printer
    theta = page.chain.equations.notation.q
    forward = zip(theta, own.at(page.q), strict=True)
    L, joints = own.inverse()
    moved = sp.Matrix([theta[j] - own.c[j] for j in joints])
    backward = zip(page.q, (sp.expand(value) for value in L * moved), strict=True)
    shown, shown_back = (
        aligned([(page.chain.tex(name), printer.terms(value)) for name, value in pairs])
        for pairs in (forward, backward)
    )
    names = listed([escape(c.name) for c in page.robot.coordinates])
    return text(
        sentence(f"The coordinates $q$ ({names}) determine the joint positions:", shown),
        sentence("Inversely, the joint positions determine the coordinates:", shown_back),
        r"With $\theta = C q + c$, the Jacobians with respect to $q$ are $J C$, with the Jacobians"
        r" $J$ with respect to $\theta$ below.",
    )


def inverse_of_coupled(page: CoupledPage) -> str:
    """Print the inverse kinematics of a coupled robot, and the coordinates of each solution."""
    found = page.derivation.inverse or page.chain.inverse
    if found.classification.found is None or not found.solved:
        return text(missing_structure(found.classification))
    arm, opening = page.chain, ""
    if page.merged is not None:
        arm = page.merged
        opening = text(_merged_joints(page, arm), symbols(arm)).rstrip()
    attempt = found.classification.found
    if attempt.family.has_couplings:
        shown = text(structure(arm, found.classification, attempt), _COUPLED)
    else:
        tasks = {name: task for name, task in arm.inverse.solved.items() if name in found.solved}
        if page.free.surplus > 0 and POSITION_TASK.name in tasks:
            position = attempt.family.coupled_position
            level = position and position(page.free, arm.inverse.classification.lines)
            tasks |= {POSITION_TASK.name: level} if level else {}
        shown = inverse(replace(arm, inverse=replace(arm.inverse, solved=tasks)))
    surplus = _SURPLUS if page.free.surplus > 0 and not attempt.family.has_couplings else ""
    return text(opening, shown.rstrip(), surplus, _motor_angles(page, arm))


def _merged_joints(page: CoupledPage, arm: Page) -> str:
    values = page.free.joints_at(page.q)
    shown = [
        (arm.tex(name), page.chain.equations.printer.terms(value))
        for name, value in zip(arm.equations.notation.q, values, strict=True)
    ]
    return sentence(_MERGED, aligned(shown))


def _motor_angles(page: CoupledPage, arm: Page) -> str:
    notation, printer = arm.equations.notation, arm.equations.printer
    for symbol in page.q:
        notation.symbol(symbol.name, page.chain.equations.notation.order[symbol])
    L, joints = page.free.inverse()
    shown = [
        (arm.tex(name), printer.terms(value))
        for name, value in zip(page.q, L * _motions(page, arm, joints), strict=True)
    ]
    return sentence("The coordinates of each solution are", aligned(shown))


def _motions(page: CoupledPage, arm: Page, joints: Sequence[int]) -> sp.Matrix:
    chain, moving = page.free, arm.robot.moving
    theta = arm.equations.notation.q
    return sp.Matrix([moving[j].direction * theta[j] - chain.c[j] for j in joints])


def singularities_of_coupled(page: CoupledPage) -> str:
    """Print the singular configurations of a robot with coupled joints."""
    arm = page.merged or page.chain
    return singularities(arm) if page.free.surplus == 0 else ""


def example_of_coupled(page: CoupledPage) -> str:
    """Print a configuration of a coupled robot, its tool pose and all solutions for this pose."""
    coordinates, derivation = page.robot.coordinates, page.derivation
    angles = cycle(ANGLES)
    q = np.array([within(c, math.radians(next(angles))) for c in coordinates])
    functions = derivation.inverse.functions if derivation.inverse else {}
    fk = derivation.function("fk")
    known = dict(zip((joint.name for joint in page.robot.moving), _theta(page, q), strict=True))
    for name, function in functions.items():
        if function.role.name == "redundancy":
            known[name] = float(value_at(function, q).item())
    symbols = [f"q_{{{k}}}" for k, _ in enumerate(coordinates, 1)]
    pose = page.chain.pose
    return example(fk, functions.values(), coordinates, symbols, q, known, {}, pose)


def _theta(page: CoupledPage, q: np.ndarray) -> list[float]:
    own = page.robot.linear_map
    C, c = (np.array(M.tolist(), dtype=float) for M in (own.C, own.c))
    return [float(value) for value in C @ q + c[:, 0]]


_MERGED = (
    "A coupled joint is merged into a joint with the same or a parallel axis. The tool pose equals"
    " the tool pose of a chain without the coupled joint. The joint positions of this chain are"
)
_COUPLED = (
    "The steps of this structure include the joint couplings. The command"
    r" \texttt{chasles explain} prints the steps."
)
_SURPLUS = (
    "These are the solutions of the chain without the couplings. A solution of the robot"
    " also satisfies the couplings: its residual is evaluated at the coordinates."
)
