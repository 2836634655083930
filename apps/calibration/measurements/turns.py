"""Angles of a table: their unit, and orientations by quaternions, vectors, turns and matrices."""

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
"""Largest angle [rad] of joints that turn once either way; larger numbers are degrees."""
_MOVED = 0.1
"""Least span [rad] of the joint that moves most; as many degrees would calibrate no robot."""
_ROUNDED = 0.02
"""Difference of a quaternion's length, in parts of it, and of a rotation's columns from right
angles, that two decimals leave."""


class WrongRow(ValueError):
    """A row that is no orientation.

    Attributes:
        row: Its index.
    """

    def __init__(self, row: int, words: str) -> None:
        """Takes the row's index and what is wrong, as a sentence without the row."""
        super().__init__(words)
        self.row = row


class Form(NamedTuple):
    """A form of orientations: its columns, the kind of their unit, and how it is read."""

    names: tuple[str, ...]
    kind: str
    said: str
    read: Callable[[FloatArray], FloatArray]


def unit_by_size(values: FloatArray) -> str:
    """The unit of angles without one, "deg" or "rad"; "" where their size leaves it open.

    Args:
        values: (N, k) angles in one unit.
    """
    if np.abs(values).max(initial=0.0) > _TURN:
        return "deg"
    span = float(np.ptp(values, axis=0).max(initial=0.0)) if len(values) else 0.0
    return "rad" if span > _MOVED else ""


def form_of(names: Collection[str]) -> Form | None:
    """The form of the orientations whose columns are there; None where there are none."""
    return next((form for form in FORMS if set(form.names) <= set(names)), None)


def about_axes(turns: FloatArray) -> FloatArray:
    """(N, 3, 3) turns about the fixed x, y and z in this order, (N, 3) [rad]."""
    x, y, z = (so3.exp(turns[:, [k]] * np.eye(3)[k]) for k in range(3))
    return np.asarray(z @ y @ x)


def of_quaternions(found: FloatArray) -> FloatArray:
    """(N, 3, 3) of quaternions (N, 4) w, x, y, z, all of one length.

    Raises:
        WrongRow: One is longer or shorter than the others.
    """
    size = np.linalg.norm(found, axis=-1)
    usual = float(np.median(size))
    k = int(np.argmax(np.abs(size - usual)))
    if not abs(size[k] - usual) < _ROUNDED * usual:
        raise WrongRow(
            k,
            f"the quaternion has the length {size[k]:.3g}, and others have {usual:.3g}; are other "
            "columns called qw, qx, qy and qz?",
        )
    return rotations(found)


def of_matrices(found: FloatArray) -> FloatArray:
    """(N, 3, 3) the rotations nearest to matrices (N, 9), row by row.

    Raises:
        WrongRow: A matrix is no rotation.
    """
    R = found.reshape(-1, 3, 3)
    off = np.abs(R.swapaxes(1, 2) @ R - np.eye(3)).max((1, 2))
    off = np.where(np.linalg.det(R) > 0, off, np.inf)
    k = int(np.argmax(off))
    if not off[k] < _ROUNDED:
        raise WrongRow(k, "the matrix is no rotation: its columns are no right-handed unit frame")
    u, _, vt = np.linalg.svd(R)
    return np.asarray(u @ vt)


FORMS = (
    Form(QUATERNION, "1", "quaternions w, x, y, z", of_quaternions),
    Form(ROTATION_VECTOR, "rad", "rotation vectors", so3.exp),
    Form(ANGLES, "rad", "turns about the fixed axes x, y and z in this order", about_axes),
    Form(MATRIX, "1", "rotation matrices", of_matrices),
)


def described(form: Form, headings: Mapping[str, str]) -> str:
    """A sentence on how orientations are read.

    Args:
        form: Their form.
        headings: The headings of its columns, by name.
    """
    first, last = headings[form.names[0]], headings[form.names[-1]]
    return f"columns {first} to {last} are read as {form.said}"
