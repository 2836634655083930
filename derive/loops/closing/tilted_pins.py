"""Models rods and cylinders with slightly tilted pins, which occur on real robots.

The two pins at the ends of a rod keep the rod in a plane. If an axis of the loop is not exactly
normal to the plane of the rod, no configuration satisfies all constraints. The constraint along the
pin axes is redundant, because a planar loop closes without this constraint. In a least-squares
solution, the pins tilt, and the rod lengths do not change to first order.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...model.errors import DescriptionError
from ...model.mechanism import Closure, Mechanism, Strut
from ...model.tolerances import MEASURED_STRUCTURE, NUMERICALLY_CLOSED
from ...terms.terms import Terms
from ..model.planes import Loop, axes_in_numbers, linkages
from .least_squares_closure import least_squares_closure

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Tilt:
    """Deviation of a loop with a pin-ended rod from a planar loop.

    Attributes:
        loop_joint: Name of the rod, cylinder or closure that closes the loop.
        joint: The joint whose axis is least parallel to the other axes of the loop.
        angle: Angle (radian) between the axis of ``joint`` and the mean direction of the other
            axes, or 0 for a loop with one axis.
        offset: Distance (meter) between the rod ends along the mean direction of the joint axes, at
            zero joint values.
        span: Distance (meter) between the ends of the rod at zero joint values.
        axes: Number of joint axes of the loop. If the loop has only two axes, either axis may be
            the tilted axis.
    """

    loop_joint: str
    joint: str
    angle: float
    offset: float
    span: float
    axes: int

    @property
    def is_small(self) -> bool:
        """Whether the deviation from a planar loop is at most a typical manufacturing error."""
        return max(self.angle * self.span, self.offset) <= MEASURED_STRUCTURE * self.span

    @property
    def is_rounding(self) -> bool:
        """Whether the loop is planar up to rounding errors."""
        return max(self.angle * self.span, self.offset) <= NUMERICALLY_CLOSED * self.span

    def __str__(self) -> str:
        """Describe the deviation from a planar loop, without parts within rounding errors."""
        parts = []
        if self.angle > NUMERICALLY_CLOSED:
            parts.append(
                f"the axis of {self.joint!r} is {1e3 * self.angle:.3g} mrad out of parallel with"
                " the others"
            )
        if self.offset > NUMERICALLY_CLOSED * self.span or not parts:
            parts.append(
                f"the ends of {self.loop_joint!r} are {1e3 * self.offset:.3g} mm apart along the"
                " axes"
            )
        return ", and ".join(parts)


def tilts(mechanism: Mechanism, terms: Terms) -> list[Tilt]:
    """Return the deviation from a planar loop for each pin-ended strut of a spatial loop."""
    _, spatial = linkages(mechanism)
    return [
        tilt_of(mechanism, terms, loop)
        for loop in spatial
        if isinstance(loop.loop_joint, Strut) and loop.loop_joint.ends == "pin"
    ]


def explain_open_loop(mechanism: Mechanism) -> str:
    """Explain why no length closes the loops, or return "" if no explanation is found.

    The explanation names the joint with the tilted axis, the redundant constraints, and the closure
    errors.
    """
    terms = Terms({p.symbol: p.value for p in mechanism.parameters})
    _, spatial = linkages(mechanism)
    found = ""
    for loop in spatial:
        turning = [joint for joint in loop.joints if joint.kind == "revolute"]
        if (
            isinstance(loop.loop_joint, Closure)
            and loop.loop_joint.kind in ("pin", "ball")
            and turning
        ):
            tilt = tilt_of(mechanism, terms, loop)
            if tilt.is_small and not tilt.is_rounding:
                found += f"\n    Its loop is nearly planar: {tilt}."
    redundant = least_squares_closure(mechanism)
    if redundant is not None:
        return (
            f'{found}\n    {redundant}.\n    closure = "least squares" at the top of the file '
            "selects the configuration nearest to closure"
        )
    if mechanism.closure == "least squares":
        found += (
            '\n    closure = "least squares" applies to redundant constraints with closure errors '
            "within as-built errors"
        )
    return found


def closable(mechanism: Mechanism, terms: Terms) -> Mechanism:
    """Return a mechanism whose loops can close.

    If the robot file allows least-squares closure, a rod with tilted pins constrains only the
    distance between its ends.

    Raises:
        DescriptionError: A pin-ended rod is in a spatial loop, and either the robot file does not
            allow least-squares closure or the loop is far from planar.
    """
    found = tilts(mechanism, terms)
    if not found:
        return mechanism
    far = [tilt for tilt in found if not tilt.is_small]
    if far or mechanism.closure != "least squares":
        tilt = max(far or found, key=lambda tilt: tilt.axes)
        remedy = (
            'expected parallel axes, or ends = "ball"'
            if far
            else 'expected parallel axes, ends = "ball", or closure = "least squares" at the top of'
            " the file if the play of the pins absorbs the tilt"
        )
        raise DescriptionError(
            f"robot {mechanism.name!r}: {tilt.loop_joint!r}: the pins allow only planar motion of"
            f" the rod, but its loop cannot close: {tilt}. The constraint along the axes"
            f" is redundant; {remedy}"
        )
    names = {tilt.loop_joint for tilt in found}
    swings = {strut.swing_name for strut in mechanism.struts if strut.name in names}
    return replace(
        mechanism,
        struts=tuple(
            replace(strut, ends="ball") if strut.name in names else strut
            for strut in mechanism.struts
        ),
        reference=tuple((name, v) for name, v in mechanism.reference if name not in swings),
        notes=(*mechanism.notes, *(f"closed in least squares: {tilt}" for tilt in found)),
    )


def tilt_of(mechanism: Mechanism, terms: Terms, loop: Loop) -> Tilt:
    """Measure how far a loop with revolute joints deviates from a planar loop."""
    names, axes, (a, b) = axes_in_numbers(mechanism, terms, loop)
    others = [[*axes[:k], *axes[k + 1 :]] or [axis] for k, axis in enumerate(axes)]
    angles = [_angle(axis, _mean(rest)) for axis, rest in zip(axes, others, strict=True)]
    worst = int(np.argmax(angles))
    offset = abs(float(_mean(others[worst]) @ (b - a)))
    span = float(np.linalg.norm(b - a))
    return Tilt(loop.loop_joint.name, names[worst], angles[worst], offset, span, len(axes))


def _mean(axes: Sequence[Vector]) -> Vector:
    """Return the mean direction of axes, with axes flipped that oppose the first axis."""
    total = sum((axis * (1.0 if axis @ axes[0] >= 0 else -1.0) for axis in axes), np.zeros(3))
    return np.asarray(total / np.linalg.norm(total))


def _angle(a: Vector, b: Vector) -> float:
    """Return the angle between two lines (radian)."""
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), abs(a @ b)))
