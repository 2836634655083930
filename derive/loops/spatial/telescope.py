"""Solves for the slide between revolute joints and a ball joint, as in RPS and UPS legs.

The axes of the revolute joints intersect at a fixed point, the foot. The foot of a leg with a
single hinge lies on the fixed axis of this hinge. The travel of the slide determines the distance
between the ball and the foot. The revolute joints then point the slide at the ball.

Source:
    Lee and Shah, Kinematic analysis of a three-degrees-of-freedom in-parallel actuated manipulator,
    1988, for the platform on three RPS legs; Merlet, Parallel Robots, ch. 2.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import sympy as sp

from ...model.mechanism import Closure, Frame
from ...model.robot import Joint
from ...terms.generic_point import vanishes
from ...terms.vectors import ZERO, Vector, dot, subtracted
from ..model.body_frames import pose_along, pose_of
from ..model.planes import Loop
from ..planar.loop_step import (
    SPACE,
    LoopStep,
    RateEquation,
    StepEquations,
    components,
    quantity,
    weighted,
)
from ..planar.pin_pin_slide import TRAVELS, travel_remark
from .ball_ends import BallEnd, ball_ends, fork_of
from .struts import SIGNS, Legs


@dataclass(frozen=True)
class Telescope:
    """A prismatic joint between unknown revolute joints and the ball joint that closes a loop.

    Attributes:
        closure: The loop closure with the ball joint.
        slide: The prismatic joint.
        target: The frame of the ball joint on the other body that the ball joint connects.
        foot: The frame of the foot, at the fixed point or on the fixed axis of the revolute joints.
        is_hinge: Whether a single hinge rotates the slide. The hinge axis is the z axis of the foot
            frame.
        tip: The vector from the foot to the ball at zero travel. For a hinge, the vector `tip` is
            normal to the hinge axis.
        direction: Direction of the slide in the axes of the foot frame.
    """

    closure: Closure
    slide: Joint
    target: Frame
    foot: Frame
    is_hinge: bool
    tip: Vector
    direction: Vector

    rod: ClassVar[None] = None

    @classmethod
    def of(cls, legs: Legs, loop: Loop) -> "Telescope | None":
        """Return the telescope before a ball joint that closes a loop, or None."""
        ends = ball_ends(legs, loop)
        found = (_on_fork(legs, end) or _on_hinge(legs, end) for end in ends)
        return next((telescope for telescope in found if telescope is not None), None)

    def solved(self, legs: Legs) -> bool:
        """Solve for the travel of the slide if the foot and the ball have known positions."""
        return TelescopeTravel.use(legs, self)


def _on_fork(legs: Legs, end: BallEnd) -> Telescope | None:
    """Return the leg whose prismatic joint is mounted on a universal joint, or None."""
    places = end.last("revolute", "revolute", "prismatic")
    fork = fork_of(legs, end.path, *places[:2]) if places else None
    if fork is None:
        return None
    (x, y, z), direction = _at_zero(legs, end, *places[1:])
    tip = (x, y, legs.terms.let(z + fork.height))
    slide = end.path[places[2]]
    return Telescope(end.closure, slide, end.target, fork.center, False, tip, direction)


def _on_hinge(legs: Legs, end: BallEnd) -> Telescope | None:
    """Return the telescope whose slide is perpendicular to a hinge axis, or None."""
    places = end.last("revolute", "prismatic")
    if not places:
        return None
    (x, y, _), direction = _at_zero(legs, end, *places)
    if not vanishes(legs.terms, direction[2]):
        return None
    hinge, slide = (end.path[place] for place in places)
    foot = Frame(hinge.parent, hinge.before)
    flat = (direction[0], direction[1], ZERO)
    return Telescope(end.closure, slide, end.target, foot, True, (x, y, ZERO), flat)


def _at_zero(legs: Legs, end: BallEnd, i: int, k: int) -> tuple[Vector, Vector]:
    """Return the ball position at zero travel and the slide direction, in axes of joint ``i``."""
    values = {**legs.known.values, end.path[k].name: ZERO}
    between, before, after = end.path[i + 1 : k], end.path[k].before, end.path[i].after
    axes, _ = pose_along(legs.mechanism, legs.terms, between, before, values, after)
    path, placement = end.path[i + 1 :], end.frame.placement
    return pose_along(legs.mechanism, legs.terms, path, placement, values, after)[1], axes[2]


@dataclass(frozen=True, kw_only=True)
class TelescopeTravel(LoopStep):
    """Travel of the slide at which the foot and the ball of a telescope have the required distance.

    Attributes:
        ball: The vector from the foot to the ball (meter).
        telescope: The prismatic joint, and the position of the ball at zero travel.
        travel: Travel along the slide (meter).
    """

    ball: Vector
    telescope: Telescope
    travel: sp.Expr

    title: ClassVar[str] = "a displacement from a distance"
    branches: ClassVar[Mapping[int, str]] = TRAVELS
    opening: ClassVar[str] = (
        "Let, with the vector $D$ from the foot to the ball, the same vector $A$ at zero"
        " displacement and the direction $B$ of the prismatic joint, in the axes of the joint"
        " before it,"
    )
    dead_point: ClassVar[str] = (
        "the line from the foot to the ball is perpendicular to the prismatic joint"
    )

    @classmethod
    def use(cls, legs: Legs, telescope: Telescope) -> bool:
        """Solve the slide."""
        if legs.unknown(telescope.target) or legs.unknown(telescope.foot):
            return False
        terms, slide = legs.terms, telescope.slide
        let = terms.let
        axes, foot = pose_of(legs.mechanism, terms, telescope.foot, legs.known.values)
        between = subtracted(terms, legs.point(telescope.target), foot)
        x, y = dot(terms, axes[0], between), dot(terms, axes[1], between)
        ball = (x, y, ZERO if telescope.is_hinge else dot(terms, axes[2], between))
        tip, direction = telescope.tip, telescope.direction
        square, along = dot(terms, ball, ball), dot(terms, tip, direction)
        off = let(dot(terms, tip, tip) - along**2)
        is_straight = vanishes(terms, off)
        inside = square if is_straight else let(square - off)
        root = let(sp.sqrt(inside))
        travels = {sign: let(sign * root - along) for sign in SIGNS}
        sign = legs.sign(_distances(legs, slide, travels), slide.name, is_length=True)
        travel = let(sign * root - along)
        legs.known.values[slide.name] = slide.direction * travel
        legs.known.steps.append(
            cls(
                joints=(slide.name, telescope.closure.name),
                axes=telescope.foot.body,
                margin=None if is_straight else let(inside / square),
                root=root,
                sign=sign,
                ball=ball,
                telescope=telescope,
                travel=travel,
            )
        )
        return True

    def equations(self) -> StepEquations:
        """Return the equation for the travel t of the slide."""
        D, A, B = (components(letter, SPACE) for letter in "DAB")
        t, m = quantity("t"), quantity("m")
        square = sp.Add(*(part**2 for part in D))
        off = sp.Add(*(part**2 for part in A)) - m**2
        inside = square if self.margin is None else square - off
        return StepEquations(
            vectors={"D": self.ball, "A": self.telescope.tip, "B": self.telescope.direction},
            unknowns={t: self.travel},
            results=(
                (m, sp.Add(*(a * b for a, b in zip(A, B, strict=True)))),
                (t, self.sign * sp.sqrt(inside) - m),
            ),
            margin=None if self.margin is None else inside / square,
            rates=(RateEquation(((t, t + m),), weighted(D, D)),),
        )

    @property
    def remark(self) -> str:
        """A sentence that states which solution for the travel is used."""
        return travel_remark(self.sign)


def _distances(legs: Legs, slide: Joint, travels: Mapping[int, sp.Expr]) -> dict[int, float]:
    """Return the error of the slide displacement at the reference for each branch sign.

    The displacement errors are divided by the mechanism size.
    """
    if legs.branch is not None:
        return {}
    hint = legs.reference.hints_of([slide.name]).get(slide.name, 0.0)
    values = {sign: slide.direction * legs.reference.of(t) for sign, t in travels.items()}
    return {sign: abs(value - hint) / legs.reference.size for sign, value in values.items()}
