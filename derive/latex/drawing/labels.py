"""Places the labels of a drawing in free space around the labelled points."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TypeVar

from .paper import HEIGHT, WIDTH, Point, at, between, is_inside, rounded

LINE, LETTER = 28, 15.5
"""Height of a label and mean width of a letter (0.1 mm), at LaTeX's footnote size."""
_DIRECTIONS = [
    (rounded(1000 * math.cos(k * math.pi / 12)), rounded(1000 * math.sin(k * math.pi / 12)))
    for k in range(24)
]
"""Candidate directions from a point to its label, as vectors of length 1000."""
_NEAR, _STEPS = 8, (0, 8, 18, 30, 44, 60, 80, 100)
"""Minimum distance of a label from its point, and the additional distances that are tried."""
_AFAR = 40
"""If the additional distance of a label reaches this value, a leader line connects the label to its
point."""
_AWAY = 1.2
"""Cost per unit of distance between a label and its point."""
_GAP = 6
"""Distance between the end of a leader line and the label."""
_CROSSED = 3
"""Cost of a label per unit of drawn line length that it covers."""
_LEVEL, _STEEP = 380, 380
"""The direction from a point to its label determines the anchor of the label. If the magnitude of
the horizontal component exceeds `_LEVEL` (per mille), the label is anchored at its left or right
side. If the magnitude of the vertical component exceeds `_STEEP` (per mille), the label is anchored
at its top or bottom."""

Line = tuple[Point, Point, int]
P = TypeVar("P")


@dataclass(frozen=True)
class Box:
    """The bounding rectangle of a label on the page."""

    left: int
    bottom: int
    right: int
    top: int

    def shared(self, other: "Box") -> int:
        """Return the overlap area of two boxes."""
        w = min(self.right, other.right) - max(self.left, other.left)
        h = min(self.top, other.top) - max(self.bottom, other.bottom)
        return max(w, 0) * max(h, 0)

    def grown(self, by: int) -> "Box":
        """Return a box with a margin added on each side."""
        return Box(self.left - by, self.bottom - by, self.right + by, self.top + by)

    def length_inside(self, a: Point, b: Point) -> float:
        """Return the length of the part of a line segment that is inside the box."""
        first, last = 0.0, 1.0
        for start, end, low, high in (
            (a[0], b[0], self.left, self.right),
            (a[1], b[1], self.bottom, self.top),
        ):
            if start == end:
                if not low <= start <= high:
                    return 0.0
                continue
            enter, leave = sorted(((low - start) / (end - start), (high - start) / (end - start)))
            first, last = max(first, enter), min(last, leave)
        length = math.sqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2)
        return max(last - first, 0.0) * max(length, 1.0)


@dataclass(frozen=True)
class Label:
    """A text label for a point of a drawing.

    Attributes:
        text: The text of the label in LaTeX.
        letters: Approximate width of the text, in letter widths.
        point: The labelled point.
        radius: Radius of the drawn symbol at the point.
        style: The TikZ style of the label's node.
    """

    text: str
    letters: float
    point: Point
    radius: int
    style: str


@dataclass
class Obstacles:
    """Drawn objects that labels should not cover.

    Attributes:
        lines: Start, end and half width of each line that no label should cross.
        outlines: Start, end and half width of each body outline. A label that crosses a body
            outline costs less if it is a loop number.
        boxes: Areas of labels and symbols that no other label should cover.
        plates: Filled polygons. A label covers a filled polygon only if no other position is free.
    """

    lines: list[Line] = field(default_factory=list)
    outlines: list[Line] = field(default_factory=list)
    boxes: list[Box] = field(default_factory=list)
    plates: list[Sequence[Point]] = field(default_factory=list)

    def disc(self, point: Point, radius: int) -> None:
        """Add the area of a symbol to the areas that no label should cover."""
        x, y = point
        self.boxes.append(Box(x - radius, y - radius, x + radius, y + radius))

    def path(self, corners: Sequence[Point], half: int) -> None:
        """Add a polyline to the lines that no label should cross."""
        self.lines.extend((a, b, half) for a, b in pairwise(corners))

    def body(self, corners: Sequence[Point], half: int) -> None:
        """Add the outline of a body to the obstacles for labels."""
        self.outlines.extend((a, b, half) for a, b in pairwise(corners))

    def cost(self, box: Box, on_plate: float, on_outline: float) -> float:
        """Return the cost of a label that covers the given box."""
        covered = sum(min(box.grown(6).shared(other), 4000) / 4 for other in self.boxes)
        crossed = _CROSSED * _length(box, self.lines) + on_outline * _length(box, self.outlines)
        middle = ((box.left + box.right) // 2, (box.bottom + box.top) // 2)
        laid = sum(on_plate for plate in self.plates if is_inside(middle, plate))
        return covered + crossed + laid + self._outside(box)

    @staticmethod
    def _outside(box: Box) -> float:
        over = (-box.left, -box.bottom, box.right - WIDTH, box.top - HEIGHT)
        return 1000.0 * sum(max(part, 0) for part in over)


def _length(box: Box, lines: Sequence[Line]) -> float:
    return sum(box.grown(half + 4).length_inside(a, b) for a, b, half in lines)


def placed(label: Label, obstacles: Obstacles) -> list[str]:
    """Place a label at the position with the lowest cost, and return the label's TikZ code."""
    positions = [(step, direction) for step in _STEPS for direction in range(len(_DIRECTIONS))]
    best = _least(positions, lambda p: _AWAY * p[0], lambda p: _cost(label, obstacles, *p))
    near, box, anchor = _place(label, *best)
    obstacles.boxes.append(box)
    lines = [f"\\node[{label.style},anchor={anchor}] at {at(near)} {{{label.text}}};"]
    if best[0] >= _AFAR:
        begin, end = (_place(label, step, best[1])[0] for step in (best[0] - _GAP, -_NEAR))
        lines.insert(0, f"\\draw[leader] {at(begin)} -- {at(end)};")
        obstacles.path([near, label.point], 1)
    return lines


def _least(positions: Sequence[P], bound: Callable[[P], float], cost: Callable[[P], float]) -> P:
    best, least = positions[0], math.inf
    for position in positions:
        if bound(position) >= least:
            break
        found = cost(position)
        if found < least:
            best, least = position, found
    return best


def _cost(label: Label, obstacles: Obstacles, step: int, direction: int) -> float:
    near, box, _ = _place(label, step, direction)
    leader = _leader_cost(near, label.point, obstacles) if step >= _AFAR else 0.0
    # Labels are easiest to read beside, above or below their points.
    oblique = 3 if direction % 6 else 0
    return obstacles.cost(box, 40, _CROSSED) + _AWAY * step + oblique + leader


def _leader_cost(near: Point, to: Point, obstacles: Obstacles) -> float:
    cost = 0.0
    for share in (0.2, 0.4, 0.6):
        x, y = between(near, to, share)
        cost += obstacles.cost(Box(x - 3, y - 3, x + 3, y + 3), 0, 1) / 2
    return cost


def _place(label: Label, step: int, direction: int) -> tuple[Point, Box, str]:
    dx, dy = _DIRECTIONS[direction]
    reach = label.radius + _NEAR + step
    x = label.point[0] + rounded(reach * dx / 1000)
    y = label.point[1] + rounded(reach * dy / 1000)
    w, h = rounded(LETTER * label.letters), LINE
    side = "west" if dx > _LEVEL else "east" if dx < -_LEVEL else ""
    end = "south" if dy > _STEEP else "north" if dy < -_STEEP else ""
    left = {"west": x, "east": x - w, "": x - w // 2}[side]
    bottom = {"south": y, "north": y - h, "": y - h // 2}[end]
    anchor = f"{end} {side}".strip()
    return (x, y), Box(left, bottom, left + w, bottom + h), anchor


LOOP = 20
"""Radius of the circle around a loop number."""
_GRID = 15
_OUTSIDE = 150
"""Cost of placing a loop number outside its loop."""


def loop_number(corners: Sequence[Point], obstacles: Obstacles) -> Point:
    """Return a free position for the number of a loop, near the middle of the loop."""
    middle = (
        sum(x for x, _ in corners) // len(corners),
        sum(y for _, y in corners) // len(corners),
    )
    reach = 20
    tried = [
        (middle[0] + _GRID * i, middle[1] + _GRID * j)
        for i in range(-reach, reach + 1)
        for j in range(-reach, reach + 1)
    ]
    inside = {point for point in tried if is_inside(point, corners)}

    def least(point: Point) -> float:
        away = math.sqrt((point[0] - middle[0]) ** 2 + (point[1] - middle[1]) ** 2)
        return away + (0 if not inside or point in inside else _OUTSIDE)

    def cost(point: Point) -> float:
        x, y = point
        return least(point) + obstacles.cost(Box(x - LOOP, y - LOOP, x + LOOP, y + LOOP), 8, 1)

    best = _least(sorted(tried, key=least), least, cost)
    obstacles.disc(best, LOOP)
    return best
