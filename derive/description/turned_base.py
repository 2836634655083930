"""Restores the exact angles of a robot whose base is rotated.

If the whole robot is rotated in its file, the angles of parallel and perpendicular axes become
arbitrary rounded numbers. Therefore, the base frames are expressed relative to one of the base
frames. Relative angles near multiples of 15 degrees become exact. If any other length or angle
equals a value of another body up to rounding errors, it is set to that value. Otherwise, the length
or angle becomes the shortest decimal within its rounding error. The rotation of the whole base does
not change.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import mpmath
import sympy as sp

from ..model.cleaning import decimal_places
from ..model.mechanism import Closure, Frame, Mechanism, Strut
from ..model.placements import Placement, Rotation, Translation, from_xyz_rpy
from ..model.robot import Joint
from ..model.tolerances import CHANCE, EVALUATION_DIGITS
from .exact_numbers import ExactNumbers
from .noise import exact_angle
from .pose_error import pose_in_digits

_STEP = math.pi / 12
_ROUNDED_ANGLES = 3
"""Rounding error of a relative rotation in units of the last place. A relative rotation follows
from two orientations, which have three rounded angles each. Each angle has an error of half a unit
in the last place."""
_FINE = 10**20
_UPRIGHT = 1e-3
"""Minimum cosine of the pitch for which roll and yaw count as rotations about two axes."""
_GUARD = 2
"""Number of decimal places that the list of changes shows beyond the rounding error of a
coordinate."""


@dataclass(frozen=True)
class TurnedBase:
    """A rotated frame.

    Relative to this frame, the frames on the base have exact angles.

    Attributes:
        owner: The joint or closure whose frame defines the rotated axes.
        turn: The orientation of the rotated axes.
        matrix: The orientation of the rotated axes as a matrix (4, 4).
        angle: Rounding error of frame angles in the rotated axes (radian).
        length: Rounding error of coordinates in the rotated axes (meter).
        lengths: Lengths of rods and of bodies other than the base. A length from ``lengths`` may
            replace a rounded coordinate of a base frame.
        angles: Angles of bodies other than the base. An angle from ``angles`` may replace a rounded
            angle of a base frame.
    """

    owner: str
    turn: Placement
    matrix: mpmath.matrix
    angle: float
    length: float
    lengths: Sequence[Fraction]
    angles: Sequence[Fraction]


def turned_base(mechanism: Mechanism, noise: float) -> TurnedBase | None:
    """Return the rotated base axes for which the most frame angles are multiples of 15 degrees.

    Args:
        mechanism: The robot with the numbers as written in its file.
        noise: Lower bound of the rounding errors of lengths and angles (meter or radian).

    Returns:
        The rotated axes. The result is None if no rotation of the base axes gives more exact
        angles.
    """
    oriented = dict(_oriented(mechanism))
    placements = [place for body, place in mechanism.placed if body == mechanism.base_frame]
    numbers = [number for placement in placements for number in _numbers(placement)]
    turns = [m for p in oriented.values() for m in p if isinstance(m, Rotation)]
    if any(number.free_symbols for number in numbers) or all(map(_is_exact, turns)):
        return None
    places = max(decimal_places(motion.angle) or 0 for motion in turns)
    angle = max(_ROUNDED_ANGLES / 10**places, noise)
    if angle > CHANCE * _STEP:
        return None
    size = max(_shift(placement) for placement in placements)
    length = max(1 / 10 ** _places(placements) + angle / 2 * size, noise)
    own = TurnedBase("", (), mpmath.eye(4), angle, length, *_others(mechanism))
    choices = [own, *(_turned_with(own, name, p) for name, p in oriented.items())]
    best = min(choices, key=lambda base: sum(_rough(base, p) for p in oriented.values()))
    return best if best.turn else None


def _turned_with(own: TurnedBase, owner: str, placement: Placement) -> TurnedBase:
    turn = tuple(motion for motion in placement if isinstance(motion, Rotation))
    with mpmath.workdps(EVALUATION_DIGITS):
        return replace(own, owner=owner, turn=turn, matrix=pose_in_digits(turn, {}))


def _rough(base: TurnedBase, placement: Placement) -> int:
    """Count the angles that are not multiples of 15 degrees.

    The placement is first expressed in the rotated axes.
    """
    with mpmath.workdps(EVALUATION_DIGITS):
        T = _turned_back(base, placement)
        return sum(not (angle * 12 / sp.pi).is_Integer for angle in _angles(T, base))


def on_turned_base(mechanism: Mechanism, base: TurnedBase, work: ExactNumbers) -> Mechanism:
    """Return the robot with the frames on its base expressed in the rotated axes.

    Args:
        mechanism: The robot with the numbers as written in its file.
        base: The axes.
        work: Receives the changes.
    """

    def placed(at: str, placement: Placement) -> Placement:
        with mpmath.workdps(EVALUATION_DIGITS):
            T = _turned_back(base, placement)
            roll, pitch, yaw = _angles(T, base)
            x, y, z = (_listed(work, at, n, T[i, 3], base) for i, n in enumerate("xyz"))
        return from_xyz_rpy((x, y, z), (roll, pitch, yaw))

    def frame(loop_joint: Closure | Strut, end: str, of: Frame) -> Frame:
        if of.body != mechanism.base_frame:
            return of
        return replace(of, placement=placed(f"{loop_joint.name}.{end}", of.placement))

    def joint(of: Joint) -> Joint:
        if of.parent != mechanism.base_frame:
            return of
        return replace(of, before=placed(of.name, of.before), convention=None, given=())

    message = f"frames on the base are expressed in axes with the orientation of {base.owner}"
    return replace(
        mechanism,
        base=(*mechanism.base, *base.turn),
        joints=tuple(map(joint, mechanism.joints)),
        closures=tuple(
            replace(c, a=frame(c, "a", c.a), b=frame(c, "b", c.b)) for c in mechanism.closures
        ),
        struts=tuple(
            replace(s, a=frame(s, "a", s.a), b=frame(s, "b", s.b)) for s in mechanism.struts
        ),
        notes=(*mechanism.notes, message),
    )


def _listed(
    work: ExactNumbers, at: str, name: str, coordinate: mpmath.mpf, base: TurnedBase
) -> sp.Expr:
    """Return the exact coordinate and list the change."""
    places = _GUARD - round(float(mpmath.log10(base.length)))
    found = Fraction(int(mpmath.nint(coordinate * 10**places)), 10**places)
    taken = _meant(found, base.lengths, base.length)
    return work.noted(at, name, "length", sp.Rational(found), sp.Rational(taken))


def _meant(number: Fraction, others: Sequence[Fraction], rounding: float) -> Fraction:
    """Return the exact number that a rounded number stands for.

    The candidates for the exact number are 0, the numbers in ``others`` and their negatives. The
    function returns the first candidate within ``rounding`` of the given number. If no candidate is
    that close, the function returns the shortest decimal within ``rounding`` of the given number.
    """
    for other in (Fraction(0), *others):
        if abs(abs(number) - other) <= rounding:
            return other if number > 0 else -other
    places = 0
    while abs(Fraction(round(number * 10**places), 10**places) - number) > rounding:
        places += 1
    return Fraction(round(number * 10**places), 10**places)


def _oriented(mechanism: Mechanism) -> Iterator[tuple[str, Placement]]:
    """Yield the name and placement of each frame on the base, except frames of ball joints."""
    for joint in mechanism.joints:
        if joint.parent == mechanism.base_frame:
            yield joint.name, joint.before
    for closure in mechanism.closures:
        for frame in (closure.a, closure.b):
            if frame.body == mechanism.base_frame and closure.kind != "ball":
                yield closure.name, frame.placement


def _others(mechanism: Mechanism) -> tuple[list[Fraction], list[Fraction]]:
    """Return the absolute values of lengths and angles of all bodies except the base."""
    placements = [place for body, place in mechanism.placed if body != mechanism.base_frame]
    lengths = [strut.length for strut in mechanism.struts]
    lengths += [x for placement in placements for x in _lengths(placement)]
    turns = [m.angle for p in placements for m in p if isinstance(m, Rotation)]
    return _magnitudes(lengths), _magnitudes(turns)


def _magnitudes(numbers: Iterable[sp.Expr]) -> list[Fraction]:
    decimals = {abs(number) for number in numbers if decimal_places(number) and number}
    return sorted((Fraction(x.p, x.q) for x in decimals), key=lambda x: (x.denominator, x))


def _lengths(placement: Placement) -> list[sp.Expr]:
    return [x for m in placement if isinstance(m, Translation) for x in m.vector]


def _numbers(placement: Placement) -> Iterator[sp.Expr]:
    for motion in placement:
        yield from (motion.angle,) if isinstance(motion, Rotation) else motion.vector


def _places(placements: Iterable[Placement]) -> int:
    """Return the largest number of decimal places among the coordinates."""
    return max(
        (decimal_places(x) or 0 for placement in placements for x in _lengths(placement)),
        default=0,
    )


def _is_exact(motion: Rotation) -> bool:
    return bool((exact_angle(motion.angle) * 12 / sp.pi).is_Integer)


def _shift(placement: Placement) -> float:
    return float(mpmath.norm(pose_in_digits(placement, {})[:3, 3]))


def _turned_back(base: TurnedBase, placement: Placement) -> mpmath.matrix:
    """Return the pose (4, 4) of a base frame in the rotated axes."""
    return base.matrix.T * pose_in_digits(placement, {})


def _angles(T: mpmath.matrix, base: TurnedBase) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """Return roll, pitch and yaw of a pose.

    Angles close to a multiple of 15 degrees are rounded to this multiple.
    """
    level = mpmath.hypot(T[0, 0], T[1, 0])
    pitch = mpmath.atan2(-T[2, 0], level)
    roll, yaw = mpmath.atan2(T[2, 1], T[2, 2]), mpmath.atan2(T[1, 0], T[0, 0])
    if level < _UPRIGHT:
        roll, yaw = mpmath.mpf(0), mpmath.atan2(-T[0, 1], T[1, 1])
    x, y, z = (_angle_meant(angle, base) for angle in (roll, pitch, yaw))
    return x, y, z


def _angle_meant(angle: mpmath.mpf, base: TurnedBase) -> sp.Expr:
    steps = int(mpmath.nint(angle / _STEP))
    if abs(angle - steps * mpmath.pi / 12) <= base.angle:
        return steps * sp.pi / 12
    number = Fraction(int(mpmath.nint(angle * _FINE)), _FINE)
    meant = _meant(number, base.angles, base.angle)
    return sp.Rational(meant.numerator, meant.denominator)
