"""Loops of space that have a closed form: legs on balls, and platforms that only translate.

A strut on balls keeps two points at a distance. Where both points are known it gives a cylinder's
length; where a single joint moves one of them it gives that joint (a circle or a line meets a
sphere); where three struts hold a platform that keeps its orientation they give its position (three
spheres meet). Pairs of equal, parallel rods hold a platform in that way. A rod on a universal
joint and a ball is such a strut, which gives the joint's angles besides. A closure between bodies
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
from .dead_points import is_clearest
from .guides import Guides
from .sliding_leg import SlidingLeg
from .struts import Known, Legs, LegStep
from .three_spheres import ThreeSpheres
from .turning_leg import TurningLeg
from .universal_leg import UniversalJoint, UniversalLeg

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
        loops: The loops that are not planar; struts on balls, rods on universal joints and bodies
            on guides are solved.
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
    joints = [joint for loop in loops if (joint := UniversalJoint.of(legs, loop)) is not None]
    left = [strut for strut in struts if strut.ends == "ball"] + [joint.rod for joint in joints]
    while left or joints:
        aimed = [joint for joint in joints if UniversalLeg.use(legs, joint)]
        used = [
            strut
            for strut in left
            if (is_clearest(legs, strut, left) and _use(legs, (strut,))) or _is_held(legs, strut)
        ]
        if not aimed and not used:
            if not left or not _use(legs, left):
                return
            used = left
        left = [strut for strut in left if strut not in used]
        joints = [joint for joint in joints if joint not in aimed]


def _use(legs: Legs, struts: Sequence[Strut]) -> bool:
    return any(kind.use(legs, struts) for kind in STEPS)


def _is_held(legs: Legs, strut: Strut) -> bool:
    """Whether both ends of a rod are known: it repeats an equation of other struts."""
    return legs.length(strut) is not None and not legs.moving(strut)
