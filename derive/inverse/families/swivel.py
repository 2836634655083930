"""Seven revolute joints: a spherical shoulder, an elbow and a spherical wrist.

The seven-joint arm is redundant, because the elbow can rotate about the line from shoulder to wrist
at a fixed tool pose. The swivel angle specifies the position of the elbow. The swivel angle is
measured about the line from shoulder to wrist, between a reference half plane and the half plane of
the elbow.

Let S be the shoulder, W the wrist center, and E the elbow, which is the point of axis 4 nearest to
axis 3. Let ``w = (W - S) / |W - S|``, let t be the direction opposite to axis 1, and let r be
normal to axis 1.

    The unit vectors ``e_x = direction of ((w - t) x r) x w`` and ``e_y = w x e_x`` give ``swivel =
    atan2(e_y.(E - S), e_x.(E - S))``.

The reference half plane is undefined if the wrist is straight below the shoulder, where a
floor-mounted arm has its base. For a wrist straight below the shoulder, the swivel angle is
measured from an arbitrary direction.

Maximum number of solutions: 8 per swivel angle.

Source: Elias and Wen 2023 (stereographic shoulder-elbow-wrist angle). The pole of the stereographic
angle is below the shoulder.
"""

import sympy as sp

from ...chain.kinematics import arguments_of
from ...model.robot import SerialRobot
from ...model.tolerances import EXACT_STRUCTURE, VECTOR_FLOOR
from ...terms.role import Role
from ...terms.symbolic_function import Argument, Result, SymbolicFunction
from ...terms.terms import Terms
from ...terms.vectors import Vector, added, combination, cross, dot, subtracted
from ..steps.rotations import three_turns, wrist
from ..steps.target import Target
from ..steps.work import Work
from ..structure.lines import Axis, Lines
from ..structure.requirement import Requirement, askew, meeting, revolute
from ..subproblems.sp3 import sp3, squared_across
from ..subproblems.turns import CosSin, any_across, direction, perpendicular, rotated
from ..tasks.task import InputLetter, TaskInput
from .family import Family

_ONE = sp.Integer(1)
_SYMBOL = sp.Symbol("_swivel", real=True)
_INPUT = TaskInput(
    Argument("swivel", (_SYMBOL,), (), "rad", "swivel angle of the elbow"),
    (InputLetter((r"\psi", r"\Psi", r"\zeta")),),
)


def _requires(lines: Lines) -> list[Requirement]:
    return [
        revolute(lines, range(7)),
        meeting(lines, 0, 1, 2),
        meeting(lines, 4, 5, 6),
        # The elbow is the point of axis 4 that is nearest to axis 3.
        askew(lines, 2, 3),
    ]


def _solve(work: Work, lines: Lines, target: Target) -> None:
    terms = work.terms
    swivel = CosSin(*terms.cos_sin(_SYMBOL))
    a1, a2, a3, a4, *_ = lines.axes
    shoulder, center, elbow = lines.meeting(0, 1), lines.meeting(6, 5), _elbow(lines)

    # 1. The shoulder joints do not change the distance between shoulder and wrist center.
    wanted = work.name_vector(("W", "V"), "the wrist center", target.point(terms, center))
    V = subtracted(terms, wanted, shoulder)
    upper, fore = subtracted(terms, elbow, shoulder), subtracted(terms, center, elbow)
    across2 = squared_across(terms, a4.h, V, (upper, fore))
    sign = work.sign()
    q4 = work.step(
        [a4],
        "subproblem 3",
        "the shoulder and wrist joints do not change the distance between their centers",
        sp3(terms, a4.h, upper, fore, across2, sign, dot(terms, V, V)),
    )

    # 2. The swivel angle determines the arm plane.
    arm = added(terms, upper, rotated(terms, a4.h, q4, fore))
    w, n, b = _frame(terms, arm, upper, fore, a4.h)
    sense = terms.let(
        sp.Piecewise((_ONE, dot(terms, upper, b) >= 0), (-_ONE, True), evaluate=False)
    )
    W, e_x, e_y = _reference(terms, a1, V)
    side = combination(
        terms, (terms.let(sense * swivel.c), terms.let(sense * swivel.s)), (e_x, e_y)
    )
    for letters, meaning, vector in (
        (("u", r"\upsilon"), "the direction from shoulder to wrist with joints 1 to 3 at 0", w),
        (("b", r"\beta"), "the perpendicular direction in the arm plane", b),
        (("w", r"\omega"), "the direction from shoulder to wrist", W),
        (("e", r"\epsilon"), "the perpendicular direction at which the swivel angle is 0", e_x),
        (("f", r"\phi"), "the direction perpendicular to both", e_y),
        (
            ("g", r"\gamma"),
            "the target of the perpendicular direction in the arm plane",
            side,
        ),
    ):
        work.name_vector(letters, meaning, vector)
    normal = cross(terms, W, side)

    # 3 to 5. The three shoulder angles follow from the orientation of the upper arm.
    three_turns(
        work,
        (a1, a2, a3),
        lambda v: combination(terms, [dot(terms, v, e) for e in (w, n, b)], (W, normal, side)),
    )

    # 6 to 8. The wrist produces the remaining tool rotation.
    wrist(work, lines, 4, target)


def _functions(robot: SerialRobot, lines: Lines) -> tuple[SymbolicFunction, ...]:
    terms = lines.terms
    q = arguments_of([joint.unit for joint in robot.coordinates])["q"]
    turns = {
        k: CosSin(*terms.cos_sin(joint.direction * symbol))
        for k, (joint, symbol) in enumerate(zip(robot.moving, q.symbols, strict=True))
    }
    swivel = _swivel_of(lines, turns)
    angle = terms.let(sp.atan2(swivel.s, swivel.c, evaluate=False))
    function = SymbolicFunction(
        "swivel",
        "Angle by which the elbow is rotated about the line from shoulder to wrist.",
        "q is among the solutions of ik(fk(q), swivel(q))",
        (q,),
        (Result("swivel", (angle,), (), "rad", "swivel angle of the elbow"),),
        terms,
        role=Role("redundancy", "actuators"),
    )
    return (function,)


def _swivel_of(lines: Lines, turns: dict[int, CosSin]) -> CosSin:
    terms = lines.terms
    a1, a2, a3, a4, *_ = lines.axes
    shoulder, center, elbow = lines.meeting(0, 1), lines.meeting(6, 5), _elbow(lines)

    def carried(v: Vector) -> Vector:
        for axis in (a3, a2, a1):
            v = rotated(terms, axis.h, turns[axis.joint], v)
        return v

    upper, fore = subtracted(terms, elbow, shoulder), subtracted(terms, center, elbow)
    V = carried(added(terms, upper, rotated(terms, a4.h, turns[a4.joint], fore)))
    _, e_x, e_y = _reference(terms, a1, V)
    E = carried(upper)
    return direction(terms, dot(terms, e_x, E), dot(terms, e_y, E))


def _reference(terms: Terms, a1: Axis, V: Vector) -> tuple[Vector, Vector, Vector]:
    w = _unit(terms, V, a1.h)
    r = any_across(terms, a1.h)
    # For a wrist straight below the shoulder, the direction of axis 1 replaces the vector w - t.
    away = combination(terms, (_ONE, VECTOR_FLOOR), (added(terms, w, a1.h), a1.h))
    e_x = _unit(terms, cross(terms, cross(terms, away, r), w), cross(terms, a1.h, r))
    return w, e_x, cross(terms, w, e_x)


def _frame(
    terms: Terms, arm: Vector, upper: Vector, fore: Vector, h: Vector
) -> tuple[Vector, Vector, Vector]:
    """Return three unit vectors of the arm with joints 1 to 3 at zero.

    The three vectors are the direction from shoulder to wrist, the normal of the arm plane and the
    side direction.

    If the upper arm and the forearm move in a plane normal to the elbow axis, the side direction
    lies in this plane. In the plane normal to the elbow axis, the side direction is also defined
    for a stretched arm. If the upper arm or the forearm leaves this plane, the side direction
    points from the shoulder-wrist line to the elbow.
    """
    w = _unit(terms, arm, upper)
    flat = all(
        abs(float(terms.value(dot(terms, h, part)))) <= EXACT_STRUCTURE for part in (upper, fore)
    )
    b = _unit(terms, cross(terms, h, w) if flat else perpendicular(terms, w, upper), upper)
    return w, cross(terms, w, b), b


def _unit(terms: Terms, v: Vector, instead: Vector) -> Vector:
    v = combination(terms, (_ONE, VECTOR_FLOOR), (v, instead))
    inverse = terms.let(1 / terms.let(sp.sqrt(dot(terms, v, v))))
    return combination(terms, (inverse,), (v,))


def _elbow(lines: Lines) -> Vector:
    return lines.meeting(3, 2)


# The swivel angle is measured relative to axis 1, so the axes must be numbered from the base.
SWIVEL = Family(
    "spherical shoulder and spherical wrist",
    (7,),
    _requires,
    _solve,
    readings=("base",),
    inputs=(_INPUT,),
    functions=_functions,
)
