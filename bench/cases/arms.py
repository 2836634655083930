"""The arms of all benchmarks, as products of elementary motions."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Motion:
    """A rotation about an axis, or a translation along an axis.

    Attributes:
        kind: "turn" (rotation) or "shift" (translation).
        axis: 0, 1 or 2 for the axis x, y or z.
        value: Angle [deg] or length [m] of a fixed motion, or None for a joint.
    """

    kind: str
    axis: int
    value: float | None

    def cos_sin(self) -> tuple[float, float]:
        """Return the cosine and sine of a fixed rotation, exact for right angles."""
        assert self.value is not None
        quarters, rest = divmod(self.value, 90)
        if rest == 0:
            return ((1, 0), (0, 1), (-1, 0), (0, -1))[int(quarters) % 4]
        return math.cos(math.radians(self.value)), math.sin(math.radians(self.value))


@dataclass(frozen=True)
class Arm:
    """A chain of revolute joints from the base frame to the tool."""

    name: str
    motions: tuple[Motion, ...]

    @property
    def joints(self) -> int:
        """Number of joints."""
        return sum(motion.value is None for motion in self.motions)


def _motions(rows: tuple[tuple[tuple[str, float | None], ...], ...]) -> tuple[Motion, ...]:
    found = []
    for name, value in (item for row in rows for item in row):
        if value != 0:
            kind = "turn" if name[0] == "R" else "shift"
            found.append(Motion(kind, "xyz".index(name[1]), value))
    return tuple(found)


def _distal(d: float, a: float, alpha: float):
    return ("Rz", None), ("tz", d), ("tx", a), ("Rx", alpha)


def _proximal(alpha: float, a: float, d: float):
    return ("Rx", alpha), ("tx", a), ("Rz", None), ("tz", d)


UR5E = Arm(
    "ur5e",
    _motions(
        (
            _distal(0.1625, 0, 90),
            _distal(0, -0.425, 0),
            _distal(0, -0.3922, 0),
            _distal(0.1333, 0, 90),
            _distal(0.0997, 0, -90),
            _distal(0.0996, 0, 0),
        )
    ),
)
PANDA = Arm(
    "panda",
    _motions(
        (
            _proximal(0, 0, 0.333),
            _proximal(-90, 0, 0),
            _proximal(90, 0, 0.316),
            _proximal(90, 0.0825, 0),
            _proximal(-90, -0.0825, 0.384),
            _proximal(90, 0, 0),
            _proximal(90, 0.088, 0),
            (("tz", 0.107), ("Rz", -45)),
        )
    ),
)
ARMS = (UR5E, PANDA)
