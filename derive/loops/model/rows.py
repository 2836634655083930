"""The table of closure equations for every kind of closure.

An equation compares frames a and b of a closure. Position errors are in meters. Direction errors
are cosines of angles that are 90 degrees if the loop is closed.
"""

from collections.abc import Mapping
from typing import Literal, NamedTuple


class Along(NamedTuple):
    """The vector from origin a to origin b, projected on an axis of frame a."""

    axis: int


class Turn(NamedTuple):
    """The cosine between an axis of frame a and an axis of frame b."""

    a: int
    b: int


Row = Along | Turn
Kind = tuple[str, Literal["plane", "space"]]
_MET = (Along(0), Along(1), Along(2))
_HELD = (Turn(1, 2), Turn(2, 0), Turn(0, 1))
ROWS: Mapping[Kind, tuple[Row, ...]] = {
    ("ball", "plane"): _MET[:2],
    ("pin", "plane"): _MET[:2],
    ("slider", "plane"): (Along(1), Turn(1, 0)),
    ("weld", "plane"): (*_MET[:2], Turn(0, 1)),
    ("ball", "space"): _MET,
    ("pin", "space"): (*_MET, Turn(0, 2), Turn(1, 2)),
    ("slider", "space"): (*_MET[:2], *_HELD),
    ("weld", "space"): (*_MET, *_HELD),
}
"""The equations of each kind of closure, in the plane and in space."""
FACING: Mapping[Kind, tuple[int, ...]] = {
    ("ball", "plane"): (),
    ("pin", "plane"): (),
    ("slider", "plane"): (0,),
    ("weld", "plane"): (0,),
    ("ball", "space"): (),
    ("pin", "space"): (2,),
    ("slider", "space"): (0, 1),
    ("weld", "space"): (0, 1),
}
"""Indices of the axes that must have the same direction in both frames of a closure. The closure
equations also hold if the axes have opposite directions. A separate test therefore compares the
axis directions of the two frames."""
