"""The displacement of a joint's axis by the numbers of a convention.

A turning joint's axis is a line: a shift along it and a turn about it displace nothing, four
directions are left. The axis of a sliding joint is a direction, of which two tilts are left. The
numbers of a convention place the axis anywhere near where they span these directions.

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
"""Components of (v, omega) that displace the axis of a joint of a kind."""
OF_A_LINE = (0, 1, 3, 4)
"""Those of all other kinds: shifts along x and y, turns about x and y of the joint's frame."""
POSE = 6
"""Numbers of a pose."""
_BEFORE = sp.symbols("theta_before d_before", real=True)
_AFTER = sp.symbols("theta_after d_after", real=True)


@dataclass(frozen=True)
class AxisMap:
    """The link between two axes in a convention, completed to all numbers of a pose.

    Attributes:
        product: The pose of the joint's frame as the axis before sees it, elementary motions.
        own: Symbols of the convention's numbers.
        added: Symbols of the turns about and shifts along both axes that complete them.
        columns: (6, own and added) twists (v; omega) of the joint's frame in its own axes, by the
            rate of each number.
        free: Components of these twists that displace the axis.
    """

    product: Placement
    own: tuple[sp.Symbol, ...]
    added: tuple[sp.Symbol, ...]
    columns: sp.ImmutableMatrix
    free: tuple[int, ...]

    @property
    def symbols(self) -> tuple[sp.Symbol, ...]:
        """All numbers, in the order of the columns."""
        return (*self.own, *self.added)


def free_of(kind: JointKind) -> tuple[int, ...]:
    """Components (v, omega) of the displacement of a joint's frame that displace its axis."""
    return FREE.get(kind, OF_A_LINE)


@cache
def axis_map(convention: Convention, kind: JointKind) -> AxisMap:
    """The link between two axes in a convention.

    A link that begins with a turn about the axis before is completed after the joint's axis, by a
    turn about it and a shift along it; one that ends so, before, by the offset of the axis before.
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
    """The product of elementary motions in the numbers of a convention."""
    return convention.numbers(kind) if convention.numbers else convention.transform


def symbols_in(product: Placement) -> tuple[sp.Symbol, ...]:
    """The symbols of a product of elementary motions, in order."""
    arguments = (argument for motion in product for _, _, argument in _steps(motion))
    found = (symbol for a in arguments for symbol in sorted(a.free_symbols, key=str))
    return tuple(dict.fromkeys(found))


def twists(product: Placement, symbols: Sequence[sp.Symbol]) -> sp.ImmutableMatrix:
    """(6, k) twists (v; omega) of the last frame in its own axes by the rate of each symbol."""
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
    """A product of elementary motions in numbers: its orientation, and its twists.

    Args:
        product: The product, its arguments any expressions of some symbols.
        symbols: These symbols.
    """

    def __init__(self, product: Placement, symbols: Sequence[sp.Symbol]) -> None:
        """Prepares the arguments and their derivatives."""
        steps = [step for motion in product for step in _steps(motion)]
        self._axes = [(turns, axis) for turns, axis, _ in steps]
        arguments = [argument for _, _, argument in steps]
        rates = [
            (k, i, argument.diff(symbol))
            for k, argument in enumerate(arguments)
            for i, symbol in enumerate(symbols)
            if argument.has(symbol)
        ]
        self._places = [(k, i) for k, i, _ in rates]
        self._evaluated = sp.lambdify([symbols], [arguments, [rate for _, _, rate in rates]])
        self._count = len(symbols)

    def __call__(self, values: Sequence[float]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(6, k) twists (v; omega) of the last frame in its own axes, and its orientation (3, 3).

        Args:
            values: A value for each symbol.
        """
        arguments, rates = self._evaluated(values)
        of_motions = np.zeros((6, len(arguments)))
        R, p = np.eye(3), np.zeros(3)
        for k in reversed(range(len(arguments))):
            turns, axis = self._axes[k]
            e = np.eye(3)[axis]
            if turns:
                of_motions[:, k] = *(R.T @ np.cross(e, p)), *(R.T @ e)
                turn = _turn(axis, arguments[k])
                R, p = turn @ R, turn @ p
            else:
                of_motions[:3, k] = R.T @ e
                p = p + arguments[k] * e
        columns = np.zeros((6, self._count))
        for (k, i), rate in zip(self._places, rates, strict=True):
            columns[:, i] += of_motions[:, k] * rate
        return columns, R


def _steps(motion: Rotation | Translation) -> list[tuple[bool, int, sp.Expr]]:
    """Whether a motion turns, about or along which axis, and how far; without steps of zero."""
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
    """Values of fields, vectors by component, by the names of their symbols."""
    values: dict[str, sp.Expr] = {}
    for name, value in found.values.items():
        if isinstance(value, tuple):
            values |= {f"{name}_{axis}": part for axis, part in zip("xyz", value, strict=True)}
        else:
            values[name] = value
    return values


def _coordinates(motion: Rotation | Translation) -> list[tuple[sp.Symbol, sp.Matrix]]:
    """The symbols of an elementary motion with the twist that each gives."""
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
    """Whether a turn about z is last, but for shifts along z."""
    for motion in reversed(product):
        if isinstance(motion, Rotation):
            return motion.axis == "z"
        if motion.vector[0] != 0 or motion.vector[1] != 0:
            return False
    return False
