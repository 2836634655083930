"""Evaluates printed statements about joint axes, such as "axes 1 and 3 coincide", numerically.

The joint axes come from the screws of the robot description, and no code of the singularity
analysis is used.
"""

import re
from collections.abc import Callable

import numpy as np

from tests.support.oracles.screws import Screws, inverted, meeting

ENDING = "; the arm is stretched or folded"


class Arm:
    """The joint axes of a chain at one configuration.

    Axis numbers start at 1, as in the printed statements.
    """

    def __init__(self, chain: Screws, q: np.ndarray) -> None:
        self.directions, self.points, self.turns = [], [], chain.revolute
        for k in range(len(q)):
            before = np.where(np.arange(len(q)) < k, q, 0.0)
            T = chain.fk(before) @ inverted(chain.home)
            self.directions.append(T[:3, :3] @ (chain.axes[k] + chain.slides[k]))
            self.points.append(T[:3, :3] @ chain.points[k] + T[:3, 3])
        found = np.array([p for p, turns in zip(self.points, self.turns, strict=True) if turns])
        extent = np.ptp(found, axis=0) if len(found) else np.zeros(3)
        self.size = float(np.linalg.norm(extent)) or 1.0

    def direction(self, axis: int) -> np.ndarray:
        return self.directions[axis - 1]

    def line(self, axis: int) -> tuple[np.ndarray, np.ndarray]:
        assert self.turns[axis - 1], f"axis {axis} is prismatic and has no position"
        return self.points[axis - 1], self.directions[axis - 1]

    def parallel(self, i: int, j: int) -> float:
        """Return the sine of the angle between two axes."""
        return float(np.linalg.norm(np.cross(self.direction(i), self.direction(j))))

    def right_angles(self, i: int, j: int) -> float:
        """Return the absolute cosine of the angle between two axes."""
        return abs(float(self.direction(i) @ self.direction(j)))

    def off_line(self, point: np.ndarray, axis: int) -> float:
        """Return the distance of a point from a revolute axis, relative to the arm size."""
        p, h = self.line(axis)
        return float(np.linalg.norm(np.cross(point - p, h))) / self.size

    def coincide(self, i: int, j: int) -> float:
        """Return the deviation of two axes from one common line."""
        return max(self.parallel(i, j), self.off_line(self.line(j)[0], i))

    def in_plane(self, *axes: int) -> float:
        """Return the deviation of parallel axes from one common plane."""
        first, h = self.line(axes[0])
        along = max(self.parallel(axes[0], k) for k in axes[1:])
        across = [np.cross(self.line(k)[0] - first, h) / self.size for k in axes[1:]]
        return max(along, float(np.linalg.norm(np.cross(across[0], across[-1]))))

    def center(self, *axes: int) -> np.ndarray:
        """Return the common intersection point of several axes."""
        points, directions = zip(*(self.line(k) for k in axes), strict=True)
        point, away = meeting(np.array(directions), np.array(points))
        assert away <= 1e-9 * self.size, f"axes {axes} do not intersect"
        return point

    def off_plane(self, point: np.ndarray, axis: int, along: np.ndarray) -> float:
        """Return the distance of a point from a plane, relative to the arm size.

        The plane contains a joint axis and is parallel to a direction.
        """
        p, h = self.line(axis)
        normal = np.cross(h, along)
        return abs(float((point - p) @ normal)) / self.size / float(np.linalg.norm(normal))


def deviation(text: str, arm: Arm) -> float:
    """Return the largest deviation of an arm's joint axes from the relations stated in a text.

    Raises:
        AssertionError: A statement has an unknown form, or is about the position of a prismatic
            axis.
    """
    statements = text.removesuffix(ENDING).replace(" and axes ", "\naxes ").splitlines()
    return max(_one(statement, arm) for statement in statements)


def _one(statement: str, arm: Arm) -> float:
    count = len(arm.directions)
    wrist = r"(?:the wrist center|the intersection of axes (\d+) and (\d+))"
    forms: list[tuple[str, Callable[..., float]]] = [
        (r"axes (\d+) and (\d+) coincide", arm.coincide),
        (r"axes (\d+) and (\d+) are parallel", arm.parallel),
        (r"axes (\d+) and (\d+) are perpendicular", arm.right_angles),
        (r"axes (\d+), (\d+) and (\d+) lie in a plane", arm.in_plane),
    ]
    for form, evaluated in forms:
        if found := re.fullmatch(form, statement):
            return evaluated(*map(int, found.groups()))
    found = re.match(wrist, statement)
    assert found, f"unknown statement: {statement}"
    axes = tuple(map(int, filter(None, found.groups()))) or (count - 2, count - 1, count)
    center, rest = arm.center(*axes), statement[found.end() :]
    if on := re.fullmatch(r" is on axis (\d+)", rest):
        return arm.off_line(center, int(on[1]))
    if plane := re.fullmatch(r" is in the plane of axes (\d+) and (\d+)", rest):
        i, j = int(plane[1]), int(plane[2])
        assert arm.parallel(i, j) <= 1e-9
        return arm.off_plane(center, i, arm.line(j)[0] - arm.line(i)[0])
    plane = re.fullmatch(r" is in the plane of axis (\d+) and the direction of axis (\d+)", rest)
    assert plane, f"unknown statement: {statement}"
    return arm.off_plane(center, int(plane[1]), arm.direction(int(plane[2])))
