"""Solves spatial loops in closed form: ball-ended legs and translating platforms.

The length of a strut with ball ends is the distance between its end points. If both end points of a
cylinder are known, their distance gives the cylinder length. If a single unknown joint moves one
end of a strut, the strut determines this joint. The joint value follows from the intersection of a
circle or a line with a sphere. For a platform with constant orientation, three struts determine the
position as the intersection of three spheres. Pairs of equal, parallel rods keep the orientation of
a platform constant. A rod between a ball and a hinge or universal joint acts like a ball-ended
strut. Such a rod also determines the angles of its hinge or universal joint. If the joint that
closes a loop connects bodies on prismatic joints, the loop determines the displacements of these
prismatic joints.

Source:
    Merlet, Parallel Robots, ch. 2 and 4; Clavel 1988 for ball-jointed parallelograms.
"""

import math
from collections.abc import Callable, Sequence

from ...model.mechanism import Mechanism, Strut
from ...model.tolerances import CLEAR_LEG, NEARLY_DEAD
from ...terms.terms import Terms
from ..model.planes import Loop
from ..planar.reference import AtReference, Branch
from .cylinder_length import CylinderLength
from .guides import Guides
from .hinged_rod import HingedRod
from .sliding_leg import SlidingLeg
from .struts import Known, Legs, LegStep
from .telescope import Telescope
from .three_spheres import ThreeSpheres
from .turning_leg import TurningLeg
from .universal_leg import UniversalJoint

STEPS: tuple[type[LegStep], ...] = (CylinderLength, SlidingLeg, TurningLeg, ThreeSpheres)
"""The solution steps for ball-ended struts, in the order in which the steps are tried."""
LastStep = Callable[[Legs, Loop], bool]
"""Function that solves for the unknown joints of a loop, or returns False if its solution method
does not apply to the loop."""
BeforeBall = UniversalJoint | HingedRod | Telescope
BEFORE_BALL: tuple[type[BeforeBall], ...] = (UniversalJoint, HingedRod, Telescope)
"""Kinds of joints before a ball joint that closes a loop, in the order in which they are tried.
Each kind of joint has its own solution step."""


def assemble_in_space(
    terms: Terms,
    mechanism: Mechanism,
    loops: Sequence[Loop],
    known: Known,
    reference: AtReference,
    branch: Branch | None = None,
    last_step: LastStep | None = None,
) -> None:
    """Add the joint values that the spatial loops determine.

    Args:
        terms: Names of all terms.
        mechanism: The description.
        loops: The spatial loops. Struts with ball ends, rods with universal joints, and bodies on
            prismatic joints can be solved.
        known: Record of the known joint values. The function adds the solved joint values, their
            rates, and the solution steps to this record.
        reference: The configuration that selects the branch.
        branch: The branch to solve, or None for the branch of the reference.
        last_step: The solution step to try on each loop if no other solution step applies.

    Raises:
        DescriptionError: A loop does not close at the reference configuration.
    """
    legs = Legs(terms, mechanism, known, reference, branch)
    while any(Guides.use(legs, loop) for loop in loops):
        pass
    struts = [loop.loop_joint for loop in loops if isinstance(loop.loop_joint, Strut)]
    balls = [strut for strut in struts if strut.ends == "ball"]
    while True:
        solved = len(known.values)
        found = [joints for loop in loops if (joints := _before_ball(legs, loop)) is not None]
        rods = [joints.rod for joints in found if joints.rod is not None]
        left = [strut for strut in (*balls, *rods) if not _is_attached(legs, strut)]
        for joints in found:
            joints.solved(legs)
        for strut in left:
            if is_clearest(legs, strut, left):
                _use(legs, (strut,))
        if len(known.values) > solved or (left and _use(legs, left)):
            continue
        if last_step is None or not any(last_step(legs, loop) for loop in loops):
            return


def _before_ball(legs: Legs, loop: Loop) -> BeforeBall | None:
    """Return the joints before the ball joint of a loop, or None if no solution step applies."""
    found = (kind.of(legs, loop) for kind in BEFORE_BALL)
    return next((joints for joints in found if joints is not None), None)


def _use(legs: Legs, struts: Sequence[Strut]) -> bool:
    return any(kind.use(legs, struts) for kind in STEPS)


def _is_attached(legs: Legs, strut: Strut) -> bool:
    """Whether both ends of a rod are known, so that the rod equation is redundant."""
    return legs.length(strut) is not None and not legs.moving(strut)


def is_clearest(legs: Legs, strut: Strut, struts: Sequence[Strut]) -> bool:
    """Whether the length equation of a leg should determine the unknown joint of the leg.

    In a chain with more joints than degrees of freedom, several rods may determine the same joint.
    A rod that is perpendicular to its crank at the reference is far from its dead point.

    Args:
        legs: The partially solved mechanism.
        strut: The leg.
        struts: All unsolved legs.

    Returns:
        True if the leg is far from its dead point, or if no other leg for the same joint is clearly
        farther from its dead point.
    """
    moving = legs.moving(strut)
    rivals = [
        other
        for other in struts
        if other is not strut
        and len(moving) == 1
        and legs.moving(other) == moving
        and legs.length(other) is not None
    ]
    if not rivals:
        return True
    own = _margin(legs, strut)
    return own >= CLEAR_LEG or not any(_margin(legs, rival) > own + NEARLY_DEAD for rival in rivals)


def _margin(legs: Legs, strut: Strut) -> float:
    """Return the dead-point margin of a leg at the reference, or -1 if the leg does not close."""
    turning = legs.reach((strut,), sliding=False)
    reach = turning or legs.reach((strut,), sliding=True)
    if reach is None:
        return -1.0
    of = legs.reference.of
    (x, y, z), (X, Y, Z) = (tuple(map(of, point)) for point in (reach.tip, reach.target))
    square = of(reach.square)
    if turning is None:
        margin = 1 - ((X - x) ** 2 + (Y - y) ** 2) / square
    else:
        v, d, flat = math.hypot(x, y), math.hypot(X, Y), square - (Z - z) ** 2
        across = 4 * v**2 * flat - (v**2 + flat - d**2) ** 2
        margin = across / (4 * v**2 * square) if v > 0 else -1.0
    return -1.0 if math.isnan(margin) else margin
