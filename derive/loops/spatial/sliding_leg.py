"""Solves for the prismatic joint of a ball-ended leg by intersecting a line with a sphere."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import sympy as sp

from ...model.mechanism import Strut
from ...terms.vectors import Vector, subtracted
from ..planar.loop_step import (
    HALF,
    SPACE,
    RateEquation,
    StepEquations,
    components,
    quantity,
    weighted,
)
from ..planar.pin_pin_slide import TRAVELS, travel_remark
from .struts import Legs, LegStep
from .turning_leg import OPENING


@dataclass(frozen=True, kw_only=True)
class SlidingLeg(LegStep):
    """Solves for the travel of a slider at which a leg has its given length.

    Attributes:
        offset: The vector from the leg end on the slider to the other leg end at zero travel, in
            the axes of the prismatic joint.
        travel: Travel along the z axis of the prismatic joint (meter).
        square: The square of the leg length.
    """

    offset: Vector
    travel: sp.Expr
    square: sp.Expr

    title: ClassVar[str] = "intersection of a line and a sphere"
    branches: ClassVar[Mapping[int, str]] = TRAVELS
    opening: ClassVar[str] = OPENING
    dead_point: ClassVar[str] = "the rod is perpendicular to the prismatic joint"

    @classmethod
    def use(cls, legs: Legs, struts: Sequence[Strut]) -> bool:
        """Solve for a prismatic joint if a single strut determines its displacement."""
        reach = legs.reach(struts, sliding=True)
        if reach is None:
            return False
        let, joint = legs.terms.let, reach.joint
        x, y, z = subtracted(legs.terms, reach.target, reach.tip)
        inside = legs.while_long(let(reach.square - let(x**2 + y**2)), reach.strut)
        along = let(sp.sqrt(inside))
        sign = legs.chosen(reach, lambda s: legs.reference.of(joint.direction * (z + s * along)))
        value = let(z + sign * along)
        legs.known.values[joint.name] = joint.direction * value
        legs.known.steps.append(
            cls(
                joints=(joint.name, reach.strut.name),
                axes=joint.parent,
                margin=let(inside / reach.square),
                root=along,
                sign=sign,
                offset=(x, y, z),
                travel=value,
                square=reach.square,
            )
        )
        return True

    def equations(self) -> StepEquations:
        """Return the equation for the travel t along the z axis of the prismatic joint."""
        D = components("D", SPACE)
        t, square = quantity("t"), quantity("l^2")
        inside = square - D[0] ** 2 - D[1] ** 2
        right = (*weighted(D, (-D[0], -D[1], t - D[2])), (square, HALF))
        return StepEquations(
            vectors={"D": self.offset},
            scalars={square: self.square},
            unknowns={t: self.travel},
            results=((t, D[2] + self.sign * sp.sqrt(inside)),),
            margin=inside / square,
            rates=(RateEquation(((t, t - D[2]),), right),),
        )

    @property
    def remark(self) -> str:
        """Return a sentence that states which of two prismatic joint values is used."""
        return travel_remark(self.sign)
