"""Loops of space that have a closed form: legs on balls, and platforms that only translate.

A strut on balls keeps two points at a distance. Where both points are known it gives a cylinder's
length; where a single joint moves one of them it gives that joint (a circle or a line meets a
sphere); where three struts hold a platform that keeps its orientation they give its position (three
spheres meet). Pairs of equal, parallel rods hold a platform in that way. A closure between bodies
on guides gives the travels of their slides.

Source:
    Merlet, Parallel Robots, ch. 2 and 4; Clavel 1988 for the parallelograms of balls.
"""

from collections.abc import Sequence

from ...model.mechanism import Mechanism, Strut
from ...terms.terms import Terms
from ..planar.planes import Loop
from ..planar.reference import AtReference, Branch
from .cylinder_length import CylinderLength
from .guides import Guides
from .sliding_leg import SlidingLeg
from .struts import Known, Legs, LegStep
from .three_spheres import ThreeSpheres
from .turning_leg import TurningLeg

STEPS: tuple[type[LegStep], ...] = (CylinderLength, SlidingLeg, TurningLeg, ThreeSpheres)
"""The kinds of steps, in the order in which they are tried."""


def assemble_in_space(
    terms: Terms,
    mechanism: Mechanism,
    loops: Sequence[Loop],
    known: Known,
    reference: AtReference,
    branch: Branch | None = None,
) -> None:
    """Adds the values that the spatial loops determine to the known values.

    Args:
        terms: Names of all terms.
        mechanism: The description.
        loops: The loops that are not planar; struts on balls and bodies on guides are solved.
        known: Receives values, rates and steps.
        reference: The configuration that selects the branch.
        branch: The branch that is asked for, instead of that at the reference.

    Raises:
        RobotError: A loop does not close at the reference.
    """
    legs = Legs(terms, mechanism, known, reference, branch)
    while any(Guides.use(legs, loop) for loop in loops):
        pass
    struts = [loop.closer for loop in loops if isinstance(loop.closer, Strut)]
    left = [strut for strut in struts if strut.ends == "ball"]
    while left:
        used = [strut for strut in left if _use(legs, (strut,)) or _is_held(legs, strut)]
        if not used and not _use(legs, left):
            return
        left = [strut for strut in left if strut not in used] if used else []


def _use(legs: Legs, struts: Sequence[Strut]) -> bool:
    return any(kind.use(legs, struts) for kind in STEPS)


def _is_held(legs: Legs, strut: Strut) -> bool:
    """Whether both ends of a rod are known: it repeats an equation of other struts."""
    return legs.length(strut) is not None and not legs.moving(strut)
