"""Solves for the joints before or on a parallel platform, such as the rail of a 3-RPS platform.

Each leg of the platform keeps a ball joint in a plane.

The row r_i (unit normal, negative offset) describes the plane of leg i relative to the body at
which the legs start. The vector b_i is the position of the ball joint of leg i in the platform
frame. Let B be the pose, in the base frame, of the body at which the legs start. Let W be the tool
pose in the platform frame. For a tool pose T, the condition that each ball joint lies in its plane
is the equation

    r_i . B^-1 T W^-1 b_i = 0,   i = 1, 2, 3.

Each plane equation is linear in the cosine and sine of each revolute joint before or on the
platform. Each plane equation is also linear in the displacement of each prismatic joint. Up to
three joints before or on the platform are unknown. The values of the remaining joints before or on
the platform are inputs. Handwritten C code eliminates one unknown joint after another and finds the
roots of the remaining trigonometric polynomial. Finally, the function ``ik_legs`` solves for the
joints of the platform and the legs.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import sympy as sp

from ...chain.forward import Pose
from ...loops.model.body_frames import pose_along, relative_entries
from ...loops.solve.solved_loops import SolvedLoops
from ...terms.symbolic_function import Argument, Tables
from ...terms.terms import Terms
from ...terms.vectors import Vector, dot, subtracted
from ..steps.work import Work
from ..structure.words import listed
from ..tasks.slots import given_argument
from .carried_platform import TOOL, CarriedPlatform, carried_platform
from .differences import FloatArray
from .plane_equations import PlaneEquations

SOLVER = "carried_arm"
ARM = "v"
"""Name of the argument of ``ik_legs`` that contains the values of the joints before the platform
and on the platform."""
MAX_UNKNOWN = 3
"""Maximum number of unknown joints before the platform and on the platform."""
LINEAR = 2
"""Minimum number of unknown prismatic joints for which a small determinant replaces Dixon's
resultant."""
MAX_JOINTS = 6
"""Maximum total number of joints before the platform and on the platform."""
SOLUTIONS = {
    (0, 1): 4,
    (0, 2): 8,
    (0, 3): 32,
    (1, 1): 4,
    (1, 2): 24,
    (2, 1): 6,
}
"""Maximum number of solutions, keyed by the number of unknown prismatic joints and the number of
unknown angles. If two angles are unknown, each value of the second angle gives up to two values of
the first angle."""
ON_BOTH_SIDES = 48
"""Maximum number of solutions for three unknown angles, some before and some on the platform."""


@dataclass(frozen=True)
class CarriedArmTables(Tables):
    """The data fields of the C struct ``chasles_carried_arm_arm``.

    Attributes:
        slots: Number of solution slots of ``ik_legs``.
        coordinates: Number of actuated coordinates.
        joints: Total number of joints before the platform and on the platform.
        before: Number of joints before the platform.
        unknown: Number of unknown joints.
        slides: Number of unknown prismatic joints. These joints come first in the list of unknown
            joints.
        dixon: Whether the last unknown joint follows from Dixon's resultant.
        solutions: Maximum number of solutions for the unknown joints.
        places: For each entry of `maps`, the number of its joint, counted from the base.
        ranks: For each entry of `maps`, the index of its joint in the list of unknown joints. For a
            fixed joint with index k in the list of fixed joints, the entry is -1 - k.
        kinds: For each entry of `maps`, whether its joint is prismatic.
        size: Length of the mechanism (meter).
        maps: Three matrix terms of the inverse pose of each joint. For a revolute joint, the three
            matrix terms are the factors of 1, cosine and sine of the joint angle. For a prismatic
            joint, the three matrix terms are the constant, the factor of the displacement, and 0.
        planes: Unit normal and negative offset (meter) of the plane of each leg, in the frame where
            the legs start.
        points: Positions of the ball joints in the platform frame (meter).
    """

    slots: int
    coordinates: int
    joints: int
    before: int
    unknown: int
    slides: int
    dixon: int
    solutions: int
    places: tuple[int, ...]
    ranks: tuple[int, ...]
    kinds: tuple[int, ...]
    size: float
    maps: tuple[tuple[tuple[float, ...], ...], ...]
    planes: tuple[tuple[float, ...], ...]
    points: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class CarriedArm:
    """A main chain with a platform and further joints between base and tool.

    Attributes:
        h: The robot.
        carried: The platform.
        equations: Equations that keep the ball joint of each leg in the plane of the leg.
        unknown: Indices of the joints whose values the C solver finds, in the order of elimination.
    """

    h: SolvedLoops
    carried: CarriedPlatform
    equations: PlaneEquations
    unknown: tuple[int, ...]

    solver, label = SOLVER, "arm solution"
    """Name of the C solver, and label of its solutions."""

    @property
    def solutions(self) -> int:
        """Maximum number of solutions for the unknown joints."""
        angles = len(self.unknown) - self.slides
        before = [k < self.equations.before for k in self.unknown]
        if angles == MAX_UNKNOWN and any(before) and not all(before):
            return ON_BOTH_SIDES
        return SOLUTIONS.get((self.slides, angles), 1)

    @property
    def slides(self) -> int:
        """Number of prismatic joints among the unknown joints."""
        return sum(map(self.equations.is_slide, self.unknown))

    @property
    def has_dixon_resultant(self) -> bool:
        """Whether the last unknown joint follows from Dixon's resultant."""
        if len(self.unknown) < MAX_UNKNOWN or self.slides >= LINEAR:
            return False
        return not (
            self.slides and self.equations.has_constant_factor(self.unknown[0], self.unknown)
        )

    @property
    def given(self) -> tuple[int, ...]:
        """Indices of the main-chain joints whose values are inputs of the inverse kinematics."""
        names = [joint.name for joint in self.h.robot.moving]
        others = self.carried.others
        return tuple(
            names.index(joint.name) for k, joint in enumerate(others) if k not in self.unknown
        )

    @property
    def places(self) -> list[int]:
        """Indices, in the main chain, of the joints before and on the platform."""
        names = [joint.name for joint in self.h.robot.moving]
        return [names.index(joint.name) for joint in self.carried.others]

    @property
    def argument(self) -> Argument:
        """Argument of ``ik_legs`` with the coordinates of all joints before and on the platform."""
        symbols = tuple(sp.Symbol(f"_{joint.name}", real=True) for joint in self.carried.others)
        return Argument(ARM, symbols, (len(symbols),), "", "joints before and on the platform")

    def arguments(self) -> tuple[Argument, ...]:
        """Return one argument of ``ik`` for each main-chain joint whose value is an input."""
        moving = self.h.robot.moving
        return tuple(
            given_argument(self.h.robot, k, sp.Symbol(f"_{moving[k].name}", real=True))
            for k in self.given
        )

    def coordinates(self, work: Work) -> tuple[tuple[Argument, ...], list[sp.Expr]]:
        """Return (extra arguments of ``ik_legs``, coordinates of the main chain).

        The only extra argument of ``ik_legs`` contains the values of the joints before and on the
        platform.
        """
        carried, own = self.carried, self.argument
        values = {
            joint.name: symbol for joint, symbol in zip(carried.others, own.symbols, strict=True)
        }
        found = carried.place(work, self._platform(values))
        moving = zip(carried.platform.moving, found, strict=True)
        values |= {joint.name: joint.direction * x for joint, x in moving}
        return (own,), [values[joint.name] for joint in self.h.robot.moving]

    def tables(self, slots: int, coordinates: int, size: float) -> CarriedArmTables:
        """Return the tables of the C solver.

        Args:
            slots: Number of solution slots of ``ik_legs``.
            coordinates: Number of actuated coordinates.
            size: Length of the mechanism (meter).
        """
        count = len(self.equations.maps)
        fixed = [k for k in range(count) if k not in self.unknown]
        ranks = [
            self.unknown.index(m.joint) if m.joint in self.unknown else -1 - fixed.index(m.joint)
            for m in self.equations.maps
        ]
        empty = [0] * (MAX_JOINTS - count)
        maps = [[_floats(part) for part in m.parts] for m in self.equations.maps]
        maps += [[(0.0,) * 16] * 3 for _ in empty]
        return CarriedArmTables(
            slots,
            coordinates,
            count,
            self.equations.before,
            len(self.unknown),
            self.slides,
            int(self.has_dixon_resultant),
            self.solutions,
            (*(m.joint for m in self.equations.maps), *empty),
            (*ranks, *empty),
            (*(int(m.is_slide) for m in self.equations.maps), *empty),
            size,
            tuple(map(tuple, maps)),
            tuple(map(_floats, self.equations.rows)),
            tuple(map(_floats, self.equations.points)),
        )

    def _platform(self, values: dict[str, sp.Expr]) -> list[sp.Expr]:
        """Return the entries of the platform pose relative to the body at which the legs start."""
        m, terms, carried = self.h.mechanism, self.h.terms, self.carried
        base = self.h.robot.base if carried.before else ()
        B = pose_along(m, terms, carried.before, (), values, base)
        W = pose_along(m, terms, carried.behind, self.h.robot.tool, values)
        return relative_entries(terms, B, _before(terms, TOOL, W))


def carried_arm(h: SolvedLoops) -> CarriedArm | None:
    """Return the main chain with its platform, or None if the plane equations are not solvable."""
    found = _found(h)
    return found if isinstance(found, CarriedArm) else None


def missing(h: SolvedLoops) -> str:
    """Return why a main chain that contains joints coupled by loops has no ``ik``.

    The returned text is empty if the main chain is a platform with legs and further joints.
    """
    found = _found(h)
    if isinstance(found, CarriedArm):
        return ""
    actuated = {c.moves for c in h.mechanism.coordinates}
    coupled = [joint.name for joint in h.robot.moving if joint.name not in actuated]
    couple = f"the loops couple {listed(coupled)}, so that " if coupled else ""
    return f"{couple}a pose of the tool does not determine the platform in closed form: {found}"


def _found(h: SolvedLoops) -> CarriedArm | str:
    carried = carried_platform(h)
    if isinstance(carried, str):
        return carried
    names = [joint.name for joint in carried.others]
    unlike = [j.name for j in carried.others if j.kind not in ("revolute", "prismatic")]
    if len(names) > MAX_JOINTS:
        return (
            f"at most {MAX_JOINTS} joints may be before and on the platform; found {listed(names)}"
        )
    if unlike:
        kinds = "the joints before and on the platform must be revolute or prismatic"
        return f"{kinds}, unlike {listed(unlike)}"
    equations = PlaneEquations(h, carried)
    count = equations.rank()
    obstacles = []
    # The search for unknown joints starts near the tool. Rails and turntables near the base are
    # therefore more likely to become fixed joints.
    for unknown in combinations(range(len(names))[::-1], count):
        if equations.rank(unknown) == count:
            order = _order(equations, unknown)
            if not isinstance(order, str):
                return CarriedArm(h, carried, equations, order)
            obstacles.append(order)
    return f"the planes of the legs determine {count} of {listed(names)}, but {obstacles[0]}"


def _order(equations: PlaneEquations, unknown: Sequence[int]) -> tuple[int, ...] | str:
    """Return the joints in the order of elimination, or the reason why no order works.

    Prismatic joints are eliminated first. If the plane equations for an angle are always linearly
    dependent, this angle is eliminated last. For example, if the three planes of a symmetric
    platform intersect in the axis of a turntable, only two plane equations for the turntable angle
    are independent.
    """
    slides = [k for k in unknown if equations.is_slide(k)]
    angles = sorted(k for k in unknown if k not in slides)
    angles = sorted(angles, key=lambda k: equations.is_dependent(k, angles))
    is_linear = len(slides) == 1 and equations.has_constant_factor(slides[0], unknown)
    if len(unknown) < MAX_UNKNOWN or len(slides) >= LINEAR or is_linear:
        return (*slides, *angles)
    orders = ((*slides, *(k for k in angles if k != last), last) for last in angles[::-1])
    found = (order for order in orders if not equations.meet_at_infinity(*order[:2]))
    names = [joint.name for joint in equations.carried.others]
    own = listed([names[k] for k in sorted(unknown)])
    failed = (
        f"any two of {own} have a resultant of zero, for example because their axes are parallel"
    )
    return next(found, failed)


def _before(terms: Terms, T: Pose, W: Pose) -> Pose:
    """Return T W^-1."""
    axes, origin = W
    rows = [_triple([T[0][j][i] for j in range(3)]) for i in range(3)]
    # Entry (i, k) of the rotation of T W^-1 is row i of the rotation of T times row k of the
    # rotation of W.
    others = [_triple([axes[j][k] for j in range(3)]) for k in range(3)]
    R = [_triple([dot(terms, row, other) for other in others]) for row in rows]
    moved = _triple([dot(terms, row, origin) for row in R])
    x, y, z = (_triple([R[i][k] for i in range(3)]) for k in range(3))
    return (x, y, z), subtracted(terms, T[1], moved)


def _triple(values: Sequence[sp.Expr]) -> Vector:
    x, y, z = values
    return x, y, z


def _floats(values: FloatArray) -> tuple[float, ...]:
    return tuple(map(float, np.ravel(values)))
