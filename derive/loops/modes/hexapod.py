"""The function ``modes`` for all assembly modes of a platform on six rods."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import sympy as sp

from ...model.tolerances import NO_FRAME
from ...terms.casadi_graph import lower
from ...terms.role import Role
from ...terms.symbolic_function import NativeSolverFunction, Result, SymbolicFunction, Tables
from ...terms.vectors import ORIGIN, Vector, subtracted
from ..solve.solved_loops import SolvedLoops
from .hexapod_starts import MAX_POSES, RodFamily, starts
from .rods import free_platform, is_right_handed, rods_of
from .soma import RODS, SOMA, Array, SixRods

PAIR = 2
FREE = ["prismatic"] * 3 + ["revolute"] * 3
SAMPLES = 60
"""Number of sample configurations from which the affine space of all rods is computed. This affine
space has at most 24 dimensions."""
OPERATIONS = 2_000_000
"""Approximate number of operations for tracking forty paths with thirty steps each."""
CALLED = "rod_ends"


@dataclass(frozen=True)
class Hexapod:
    """Six rods that connect actuated points to a platform.

    Points are expressed in the axes of the first three joints of the main chain. The coordinate
    origin is the intersection point of the last three main-chain axes at zero coordinates.

    Attributes:
        a: The endpoints of the rods on the actuated bodies.
        b: The endpoints of the rods on the platform, at zero coordinates.
        lengths: Rod lengths.
        axes: For each of the last three main-chain joints, the index (0 to 2) of the parallel joint
            among the first three joints.
    """

    a: tuple[Vector, ...]
    b: tuple[Vector, ...]
    lengths: tuple[sp.Expr, ...]
    axes: tuple[int, ...]


class DoubleJoints(NamedTuple):
    """Six rods in three pairs. The rods of a pair may share an end.

    Attributes:
        side: 1 if the rods of each pair share an end on the platform, 2 if they share an end on the
            actuated side, 0 if no rods share an end.
        rods: Rod indices, ordered in pairs of rods that share an end, or zeros if ``side`` is 0.
    """

    side: int
    rods: tuple[int, ...]


NO_JOINTS = DoubleJoints(0, (0,) * RODS)


def double_joints(a: Sequence[Sequence[object]], b: Sequence[Sequence[object]]) -> DoubleJoints:
    """Return the pairs of rods that share an end point.

    If both platform and base have shared rod ends, the result contains the pairs on the platform.
    """
    sides = ((side, _paired(ends)) for side, ends in ((1, b), (2, a)))
    return next((DoubleJoints(side, rods) for side, rods in sides if rods), NO_JOINTS)


def _paired(ends: Sequence[Sequence[object]]) -> tuple[int, ...]:
    """Return the rod indices in pairs with a shared end, or () unless all rods form such pairs."""
    joints: dict[tuple[object, ...], list[int]] = {}
    for rod, end in enumerate(ends):
        joints.setdefault(tuple(end), []).append(rod)
    pairs = tuple(rod for rods in joints.values() for rod in rods)
    return pairs if all(len(rods) == PAIR for rods in joints.values()) else ()


def hexapod_of(h: SolvedLoops) -> Hexapod | None:
    """Return the six rods of a spatial platform, or None for other robots."""
    platform = free_platform(h, FREE)
    if platform is None:
        return None
    along, about = platform.directions[:3], platform.directions[3:]
    *others, origin = platform.points[3:]
    meet = all(subtracted(h.terms, point, origin) == ORIGIN for point in others)
    axes = [k for turned in about for k in range(3) if turned == along[k]]
    is_permutation = len(axes) == len(set(axes)) == len(about)
    if not (meet and is_permutation and is_right_handed(h.terms, along)):
        return None
    a, b = (tuple(end[k] for end in platform.ends) for k in (0, 1))
    return Hexapod(a, b, tuple(rod.length for rod in rods_of(h)), tuple(axes))


def rod_ends(h: SolvedLoops) -> SymbolicFunction:
    """Build the function for the rod lengths and the rod ends on the actuated side."""
    found = hexapod_of(h)
    assert found is not None
    a = tuple(h.terms.let(entry) for point in found.a for entry in point)
    lengths = tuple(map(h.terms.let, found.lengths))
    return h.function(
        CALLED,
        "Rod ends on the actuated side, in the axes of the first three main-chain joints, and rod "
        "lengths.",
        "|b_i(theta) - a_i(q)| = l_i",
        ("q",),
        Result("a", a, (RODS, 3), "m", "rod ends on the actuated side"),
        Result("l", lengths, (RODS,), "m", "lengths"),
        role=Role("rod ends"),
    )


def modes(h: SolvedLoops) -> NativeSolverFunction | None:
    """Return the function ``modes``, or None if the rod lengths do not determine the pose."""
    found = hexapod_of(h)
    assert found is not None
    rods = _rods(h, found)
    own, poses = starts(rods.family)
    n = len(poses)
    if n == 0:
        return None
    return NativeSolverFunction(
        "modes",
        f"Every assembly mode of the platform, up to {n}, from the highest to the lowest.",
        "|b_i(theta[k]) - a_i(q)| = l_i if theta[k] is finite",
        (h.arguments["q"],),
        (
            Result("theta", (), (n, len(FREE)), "m, rad", "main-chain joints, one mode per row"),
            Result(
                "margin",
                (),
                (n,),
                "1",
                "|det J_x| over the product of its row norms: 0 if the "
                "platform is singular and two modes coincide",
            ),
            Result(
                "unsure",
                (),
                (1,),
                "1",
                "number of complex solutions that were not found for "
                "certain; 0 if no mode is missing",
            ),
        ),
        "hexapod",
        HexapodTables.of(rods, found.axes, double_joints(found.a, found.b), own, poses),
        (CALLED,),
        n,
        OPERATIONS,
        role=Role("modes", "actuators", "chain"),
    )


class RodNumbers:
    """Numerical model of a platform on six rods at sample configurations, scaled to size 1.

    Attributes:
        size: The size of the platform (meter).
        origin: The centroid of the rod ends on the actuated side, divided by `size`.
        middle: The centroid of the rod ends on the platform, divided by `size`.
        family: The affine space that the rods span in all configurations. In `family`, rod ends on
            the actuated side are relative to `origin`, and rod ends on the platform are relative to
            `middle`.
    """

    def __init__(self, a: Array, b: Array, lengths: Array) -> None:
        """Scale the rods.

        Args:
            a: (n, 6, 3) rod ends on the actuated side at n configurations, meter.
            b: (6, 3) rod ends on the platform, in platform axes.
            lengths: (n, 6) rod lengths at n configurations, meter.
        """
        middle, origin = b.mean(0), a.mean((0, 1))
        spread = ((a - origin) ** 2).sum(-1).mean() + ((b - middle) ** 2).sum(-1).mean()
        # Rounding makes the size and the centroids independent of the order of summation.
        self.size = _short(np.sqrt(spread))
        middle, origin = (np.array([_short(x) for x in point]) for point in (middle, origin))
        self.origin, self.middle = origin / self.size, middle / self.size
        self.family = RodFamily(
            (a - origin) / self.size, (b - middle) / self.size, lengths / self.size
        )


@dataclass(frozen=True)
class HexapodTables(Tables):
    """Fields of the C struct ``chasles_hexapod_platform``.

    Lengths are divided by the platform size. Each complex number is stored as a pair: its real and
    imaginary parts.

    Attributes:
        size: The platform size (meter).
        origin: The centroid of the rod ends on the actuated side.
        middle: The centroid of the rod ends on the platform.
        axis: For each angle of the platform, the index (0 to 2) of its rotation axis.
        moves: Whether the actuators move the rod ends on the actuated side, instead of only
            changing the rod lengths.
        paths: Number of complex poses, which is also the number of solutions in the results.
        joined: The side on which pairs of rods share ends, coded as in ``DoubleJoints.side``.
        pairs: Indices of the rods (0 to 5), ordered in pairs of rods that share an end.
        b: The rod ends on the platform.
        a: The ends of the generic rods on the actuated side.
        c: The constants |a|^2 + |b|^2 - l^2 of the generic rods, where l is the rod length.
        starts: All complex poses that satisfy the equations of the generic rods, with zeros in
            unused rows.
    """

    size: float
    origin: Any
    middle: Any
    axis: tuple[int, ...]
    moves: bool
    paths: int
    joined: int
    pairs: tuple[int, ...]
    b: Any
    a: Any
    c: Any
    starts: Any

    @classmethod
    def of(
        cls,
        rods: RodNumbers,
        axes: tuple[int, ...],
        joints: DoubleJoints,
        own: SixRods,
        poses: Array,
    ) -> "HexapodTables":
        """Return the numerical data of a platform.

        Args:
            rods: The rods.
            axes: For each angle of the platform, the index (0 to 2) of its rotation axis.
            joints: The double joints.
            own: Six rods with generic dimensions for the platform.
            poses: All n complex platform poses at which each rod in ``own`` has its given length,
                as an array (n, 8).
        """
        slots = np.zeros((MAX_POSES, SOMA), np.complex128)
        slots[: len(poses)] = poses
        return cls(
            rods.size,
            _nested(rods.origin),
            _nested(rods.middle),
            axes,
            rods.family.moves,
            len(poses),
            joints.side,
            joints.rods,
            _nested(rods.family.b),
            _nested(own.a),
            _nested(own.c),
            _nested(slots),
        )


def _rods(h: SolvedLoops, found: Hexapod) -> RodNumbers:
    kernel = lower([rod_ends(h)], h.mechanism.name)[0]
    outputs = [kernel(q) for q in _samples(h)]
    a = np.array([np.array(out[0]).reshape(RODS, 3) for out in outputs])
    lengths = np.array([np.array(out[1]).ravel() for out in outputs])
    b = np.array([[float(h.terms.value(entry)) for entry in point] for point in found.b])
    return RodNumbers(a, b, lengths)


def _short(x: float) -> float:
    """Round a number to three significant digits, or to 0 if it is a rounding error."""
    return float(f"{x:.3g}") if abs(x) > NO_FRAME else 0.0


def _samples(h: SolvedLoops) -> Array:
    """Return deterministic sample values of the actuated coordinates within their limits."""
    coordinates = h.mechanism.coordinates
    parts = np.sqrt(np.arange(2, SAMPLES * len(coordinates) + 2) * 3) % 1
    rows = parts.reshape(SAMPLES, len(coordinates))
    bounds = []
    for c, at in zip(coordinates, h.q_at_reference, strict=True):
        low, high = c.limits
        bounds.append(
            (at - 1, at + 1) if low is None or high is None else (float(low), float(high))
        )
    lower_, upper = np.array(bounds).T
    return np.asarray(lower_ + rows * (upper - lower_))


def _nested(values: Array) -> tuple[Any, ...]:
    if np.iscomplexobj(values):
        values = np.stack([values.real, values.imag], -1)
    return tuple(map(_nested, values)) if values.ndim > 1 else tuple(values.tolist())
