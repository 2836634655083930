"""Infer angle units, and read orientations as quaternions, rotation vectors, angles or matrices."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chasles import so3

from .headings import ANGLES, MATRIX, QUATERNION, ROTATION_VECTOR
from .quaternions import rotations

FloatArray = NDArray[np.float64]

_TURN = 2 * math.pi + 0.01
"""Maximum angle [rad] in a table whose angles are in radians. If an angle in a table without units
exceeds this maximum, the angles are in degrees."""
_MOVED = 0.1
"""Small angles without a unit count as radians only if the values of one column span more than this
range [rad]."""
_ROUNDED = 0.02
"""Tolerance for the relative length error of quaternions, and for the deviation of rotation
matrices from orthogonality. This tolerance admits tables whose values have only two decimal places.
"""


class WrongRow(ValueError):
    """Exception: a table row has no valid orientation.

    Attributes:
        row: Index of the table row without a valid orientation.
    """

    def __init__(self, row: int, words: str) -> None:
        super().__init__(words)
        self.row = row


class Form(NamedTuple):
    """A format of orientations in a table."""

    names: tuple[str, ...]
    kind: str
    said: str
    read: Callable[[FloatArray], FloatArray]


def unit_by_size(values: FloatArray) -> str:
    """Infer the unit of angles (N, k).

    Return "deg", "rad", or "" if the unit is ambiguous.
    """
    if np.abs(values).max(initial=0.0) > _TURN:
        return "deg"
    span = float(np.ptp(values, axis=0).max(initial=0.0)) if len(values) else 0.0
    return "rad" if span > _MOVED else ""


def form_of(names: Collection[str]) -> Form | None:
    """Return the format of the orientation columns, or None if a table has no such columns."""
    return next((form for form in FORMS if set(form.names) <= set(names)), None)


def about_axes(turns: FloatArray) -> FloatArray:
    """Return rotations (N, 3, 3) by angles (N, 3) [rad] about the fixed axes x, then y, then z."""
    x, y, z = (so3.exp(turns[:, [k]] * np.eye(3)[k]) for k in range(3))
    return np.asarray(z @ y @ x)


def of_quaternions(found: FloatArray) -> FloatArray:
    """Return rotations (N, 3, 3) from quaternions (N, 4) w, x, y, z of equal length.

    Raises:
        WrongRow: A quaternion is longer or shorter than the other quaternions of the table.
    """
    size = np.linalg.norm(found, axis=-1)
    usual = float(np.median(size))
    k = int(np.argmax(np.abs(size - usual)))
    if not abs(size[k] - usual) < _ROUNDED * usual:
        raise WrongRow(
            k,
            "the quaternion has another length than the quaternions in other rows: "
            f"{size[k]:.3g} instead of {usual:.3g}; "
            "check that the columns qw, qx, qy and qz are a quaternion",
        )
    return rotations(found)


def of_matrices(found: FloatArray) -> FloatArray:
    """Return the rotations (N, 3, 3) nearest to matrices (N, 9), stored row by row.

    Raises:
        WrongRow: A matrix is not a rotation.
    """
    R = found.reshape(-1, 3, 3)
    off = np.abs(R.swapaxes(1, 2) @ R - np.eye(3)).max((1, 2))
    off = np.where(np.linalg.det(R) > 0, off, np.inf)
    k = int(np.argmax(off))
    if not off[k] < _ROUNDED:
        raise WrongRow(k, "the matrix is not a rotation: its columns are not right-handed axes")
    u, _, vt = np.linalg.svd(R)
    return np.asarray(u @ vt)


FORMS = (
    Form(QUATERNION, "1", "quaternions w, x, y, z", of_quaternions),
    Form(ROTATION_VECTOR, "rad", "rotation vectors", so3.exp),
    Form(ANGLES, "rad", "rotations about the fixed axes x, y and z in this order", about_axes),
    Form(MATRIX, "1", "rotation matrices", of_matrices),
)


def described(form: Form, headings: Mapping[str, str]) -> str:
    """Return a sentence that states how orientations are interpreted.

    Args:
        form: The format of the orientations.
        headings: The column headings, keyed by column name.
    """
    first, last = headings[form.names[0]], headings[form.names[-1]]
    return f"columns {first} to {last} are interpreted as {form.said}"
