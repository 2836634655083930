"""Measures how a joint axis moves if the parameters of its convention change.

The axis of a revolute joint is a line with four degrees of freedom. Shifts along the line and
rotations about the line have no effect. For a prismatic joint, only the direction of the axis
matters. The direction has two degrees of freedom.

Source:
    K. Schroeer, S. Albright, M. Grethlein, Complete, minimal and model-continuous kinematic models
    for robot calibration, Robotics and Computer-Integrated Manufacturing 13 (1997).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ...model.convention import Convention, Fitted
from ...model.kinds import JointKind
from ...model.placements import Placement, Rotation, Translation, rotation, translation

FREE = {"prismatic": (3, 4)}
"""For each joint type: indices of the twist components (v, omega) that change the joint axis."""
OF_A_LINE = (0, 1, 3, 4)
"""Indices of the twist components that change a z axis: vx, vy, wx and wy."""
POSE = 6
"""Number of parameters of a full pose."""
_BEFORE = sp.symbols("theta_before d_before", real=True)
_AFTER = sp.symbols("theta_after d_after", real=True)


@dataclass(frozen=True)
class AxisMap:
    """The transform between two axes, as a product of motions with six parameters.

    Attributes:
        product: Pose of the joint frame relative to the preceding axis, as elementary motions.
        own: Symbols of the convention parameters.
        added: Symbols of the rotations and shifts that are added to the convention parameters. The
            added motions are about or along the joint axis or the preceding axis.
        columns: Twists (v; omega) of the joint frame per unit change of each parameter, shape (6,
            number of parameters), in the joint frame.
        free: Indices of the twist components that move the joint axis.
    """

    product: Placement
    own: tuple[sp.Symbol, ...]
    added: tuple[sp.Symbol, ...]
    columns: sp.ImmutableMatrix
    free: tuple[int, ...]

    @property
    def symbols(self) -> tuple[sp.Symbol, ...]:
        """The symbols of all parameters, in the order of the columns."""
        return (*self.own, *self.added)


def free_of(kind: JointKind) -> tuple[int, ...]:
    """Return the indices of the twist components (v, omega) that move the axis of a joint."""
    return FREE.get(kind, OF_A_LINE)


@cache
def axis_map(convention: Convention, kind: JointKind) -> AxisMap:
    """Return the transform from one joint axis to the next, in the parameters of a convention.

    If a transform ends with a rotation about the joint axis, a rotation and a shift along the
    preceding axis are added.

    If a transform starts with a rotation about the preceding axis, a rotation and a shift along the
    joint axis are added.
    """
    product = numbers_of(convention, kind)
    own = symbols_in(product)
    first = product[0]
    ends_with_turn = not _turns_about_z(first) and _ends_with_turn(product)
    missing = POSE - len(own)
    turn, shift = _BEFORE if ends_with_turn else _AFTER
    completion = rotation("z", turn) if missing > 0 else ()
    completion += translation(sp.S.Zero, sp.S.Zero, shift) if missing > 1 else ()
    added = (turn, shift)[: max(missing, 0)]
    product = completion + product if ends_with_turn else product + completion
    columns = twists(product, (*own, *added))
    return AxisMap(product, own, added, columns, free_of(kind))


def numbers_of(convention: Convention, kind: JointKind) -> Placement:
    """Return the elementary transforms of a convention as functions of its parameters."""
    return convention.numbers(kind) if convention.numbers else convention.transform


def symbols_in(product: Placement) -> tuple[sp.Symbol, ...]:
    """Return the symbols of a sequence of motions, in the order of their first use."""
    arguments = (argument for motion in product for _, _, argument in _steps(motion))
    found = (symbol for a in arguments for symbol in sorted(a.free_symbols, key=str))
    return tuple(dict.fromkeys(found))


def twists(product: Placement, symbols: Sequence[sp.Symbol]) -> sp.ImmutableMatrix:
    """Return twists (6, k) of the last frame, in this frame, per unit change of each symbol."""
    found = {symbol: sp.zeros(6, 1) for symbol in symbols}
    R, p = sp.eye(3), sp.zeros(3, 1)
    for motion in reversed(product):
        for symbol, twist in _coordinates(motion):
            v, omega = twist[:3, 0], twist[3:, 0]
            found[symbol] += sp.Matrix.vstack(R.T * (v + omega.cross(p)), R.T * omega)
        if isinstance(motion, Rotation):
            turn = _turned(motion)
            R, p = turn * R, turn * p
        else:
            p = sp.Matrix(motion.vector) + p
    return sp.ImmutableMatrix.hstack(*(found[symbol] for symbol in symbols))


class Motions:
    """Numeric functions for the orientation and the twists of a product of motions.

    Args:
        product: A product of motions that depend on the symbols.
        symbols: The symbols.
    """

    def __init__(self, product: Placement, symbols: Sequence[sp.Symbol]) -> None:
        """Compile the functions."""
        steps = [step for motion in product for step in _steps(motion)]
        self._axes = [(turns, axis) for turns, axis, _ in steps]
        arguments = [argument for _, _, argument in steps]
        places = {symbol: i for i, symbol in enumerate(symbols)}
        rates = [
            (k, places[symbol], argument.diff(symbol))
            for k, argument in enumerate(arguments)
            for symbol in argument.free_symbols & places.keys()
        ]
        self._places = [(k, i) for k, i, _ in rates]
        # Without ``docstring_limit``, SymPy would print all expressions into the docstring.
        results = [arguments, [rate for _, _, rate in rates]]
        self._evaluated = sp.lambdify([symbols], results, docstring_limit=0)
        self._count = len(symbols)

    def __call__(self, values: Sequence[float]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the twists (6, k) and the orientation (3, 3) of the last frame.

        The twists are expressed in the axes of the last frame.

        Args:
            values: One value for each symbol, in the order of the symbols.
        """
        arguments, rates = self._evaluated(values)
        of_motions = np.zeros((6, len(arguments)))
        R, p = np.eye(3), np.zeros(3)
        for k in reversed(range(len(arguments))):
            turns, axis = self._axes[k]
            # R[axis] is the direction of the elementary motion, expressed in the last frame.
            if turns:
                i, j = (axis + 1) % 3, (axis + 2) % 3
                of_motions[:3, k] = p[i] * R[j] - p[j] * R[i]
                of_motions[3:, k] = R[axis]
                turn = _turn(axis, arguments[k])
                R, p = turn @ R, turn @ p
            else:
                of_motions[:3, k] = R[axis]
                p[axis] += arguments[k]
        columns = np.zeros((6, self._count))
        for (k, i), rate in zip(self._places, rates, strict=True):
            columns[:, i] += of_motions[:, k] * rate
        return columns, R


def _steps(motion: Rotation | Translation) -> list[tuple[bool, int, sp.Expr]]:
    """Split a motion into steps about or along one axis: (is rotation, axis index, amount)."""
    if isinstance(motion, Rotation):
        return [(True, "xyz".index(motion.axis), motion.angle)]
    return [(False, k, part) for k, part in enumerate(motion.vector) if part != 0]


def _turn(axis: int, angle: float) -> NDArray[np.float64]:
    j, k = (axis + 1) % 3, (axis + 2) % 3
    R = np.eye(3)
    R[j, j] = R[k, k] = np.cos(angle)
    R[k, j] = np.sin(angle)
    R[j, k] = -R[k, j]
    return R


def field_values(found: Fitted) -> dict[str, sp.Expr]:
    """Return the field values by symbol name. A vector has one value per component."""
    values: dict[str, sp.Expr] = {}
    for name, value in found.values.items():
        if isinstance(value, tuple):
            values |= {f"{name}_{axis}": part for axis, part in zip("xyz", value, strict=True)}
        else:
            values[name] = value
    return values


def _coordinates(motion: Rotation | Translation) -> list[tuple[sp.Symbol, sp.Matrix]]:
    """Return pairs (symbol, twist), one for each symbol of a motion.

    The twist is the velocity for a unit rate of the symbol.
    """
    if isinstance(motion, Rotation):
        arguments = [(motion.angle, 3 + "xyz".index(motion.axis))]
    else:
        arguments = [(component, k) for k, component in enumerate(motion.vector)]
    return [(a, sp.eye(6)[:, k]) for a, k in arguments if isinstance(a, sp.Symbol)]


def _turned(motion: Rotation) -> sp.Matrix:
    c, s = sp.cos(motion.angle), sp.sin(motion.angle)
    j, k = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[motion.axis]
    R = sp.eye(3)
    R[j, j], R[j, k], R[k, j], R[k, k] = c, -s, s, c
    return R


def _turns_about_z(motion: Rotation | Translation) -> bool:
    return isinstance(motion, Rotation) and motion.axis == "z"


def _ends_with_turn(product: Placement) -> bool:
    """Whether the last rotation of the product is about z, followed only by shifts along z."""
    for motion in reversed(product):
        if isinstance(motion, Rotation):
            return motion.axis == "z"
        if motion.vector[0] != 0 or motion.vector[1] != 0:
            return False
    return False
