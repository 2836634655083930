"""Spatial loops with a closed form: ball-ended legs and purely translating platforms.

A strut on balls keeps two points at a distance. If both points are known, the distance is a
cylinder's length. If a single joint moves one of the points, the strut determines that joint (a
circle or a line intersects a sphere). Three struts determine the position of a platform with
constant orientation (three spheres intersect); pairs of equal, parallel rods keep the orientation
constant. A rod between a ball and a hinge or universal joint acts like a ball-ended strut, and also
determines the joint's angles. A closure between guided bodies determines the slide travels of these
bodies.

Source:
    Merlet, Parallel Robots, ch. 2 and 4; Clavel 1988 for ball-jointed parallelograms.
"""

from collections.abc import Sequence

from ...model.mechanism import Mechanism, Strut
from ...terms.terms import Terms
from ..planar.planes import Loop
from ..planar.reference import AtReference, Branch
from .cylinder_length import CylinderLength
from .dead_points import is_clearest
from .guides import Guides
from .hinged_rod import HingedRod
from .sliding_leg import SlidingLeg
from .struts import Known, Legs, LegStep
from .telescope import Telescope
from .three_spheres import ThreeSpheres
from .turning_leg import TurningLeg
from .universal_leg import UniversalJoint

STEPS: tuple[type[LegStep], ...] = (CylinderLength, SlidingLeg, TurningLeg, ThreeSpheres)
"""The kinds of solution steps, in the order in which they are tried."""
BeforeBall = UniversalJoint | HingedRod | Telescope
BEFORE_BALL: tuple[type[BeforeBall], ...] = (UniversalJoint, HingedRod, Telescope)
"""Kinds of joints before a closure's ball that have steps of their own, in the order of trial."""


def assemble_in_space(
    terms: Terms,
    mechanism: Mechanism,
    loops: Sequence[Loop],
    known: Known,
    reference: AtReference,
    branch: Branch | None = None,
) -> None:
    """Adds to the known values those joint values that the spatial loops determine.

    Args:
        terms: Names of all terms.
        mechanism: The description.
        loops: The spatial loops. Solved kinds are struts on balls, rods on universal joints and
            bodies on guides.
        known: Receives values, rates and steps.
        reference: The configuration that selects the branch.
        branch: The requested branch; None for the branch of the reference.

    Raises:
        DescriptionError: A loop does not close at the reference.
    """
    legs = Legs(terms, mechanism, known, reference, branch)
    while any(Guides.use(legs, loop) for loop in loops):
        pass
    struts = [loop.closer for loop in loops if isinstance(loop.closer, Strut)]
    balls = [strut for strut in struts if strut.ends == "ball"]
    while True:
        solved = len(known.values)
        found = [joints for loop in loops if (joints := _before_ball(legs, loop)) is not None]
        rods = [joints.rod for joints in found if joints.rod is not None]
        left = [strut for strut in (*balls, *rods) if not _is_held(legs, strut)]
        for joints in found:
            joints.solved(legs)
        for strut in left:
            if is_clearest(legs, strut, left):
                _use(legs, (strut,))
        if len(known.values) == solved and not (left and _use(legs, left)):
            return


def _before_ball(legs: Legs, loop: Loop) -> BeforeBall | None:
    """Returns the joints before the ball that closes a loop; None if no step applies."""
    found = (kind.of(legs, loop) for kind in BEFORE_BALL)
    return next((joints for joints in found if joints is not None), None)


def _use(legs: Legs, struts: Sequence[Strut]) -> bool:
    return any(kind.use(legs, struts) for kind in STEPS)


def _is_held(legs: Legs, strut: Strut) -> bool:
    """Whether both ends of a rod are known, so that the rod's equation is redundant."""
    return legs.length(strut) is not None and not legs.moving(strut)
