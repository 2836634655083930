"""Placement of labels and dimensions in a drawing without overlaps."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .scene import Dimension, Scene

FloatArray = NDArray[np.float64]
Box = tuple[float, float, float, float]
"""A box: left, bottom, right and top in pixels."""
Places = dict[str, FloatArray | None]

_DIRECTIONS = [(math.cos(a), math.sin(a)) for a in np.linspace(0, 2 * math.pi, 16, endpoint=False)]
_DISTANCES = (1.6, 2.6, 4.0, 6.0, 8.5, 12.0)
"""Candidate distances of a label from its point, in drawing units."""
_LEADER = 5.0
"""Maximum distance of a label without a leader line, in drawing units."""
_ALONG = (0.5, 0.35, 0.65, 0.2, 0.8)
"""Candidate positions of a dimension along its line, as fractions from 0 to 1."""
_COVERED, _CROSSED, _FAR, _OUTSIDE = 1e6, 3.0, 1.5, 1e4
"""Cost weights of a label: overlap, crossed line [1/pixel], distance [1/unit], outside
[1/pixel]."""


@dataclass
class Lettering:
    """The labels of one matplotlib axes object.

    Attributes:
        ax: The axes.
        scene: The scene that is drawn on the axes.
        size: Font size [pt].
        places: Offset of each label from its point [m], or None for an omitted label. A label with
            an offset keeps this offset in all frames of an animation.
        taken: The bounding boxes of all placed labels [pixels].
    """

    ax: Any
    scene: Scene
    size: float
    places: Places
    taken: list[Box] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.to_pixels = self.ax.transData.transform
        self.lines = self._lines()
        low, high = self.ax.transAxes.transform([(0, 0), (1, 1)])
        self.frame = (*low, *high)

    def name_coordinates(self) -> list[Any]:
        """Write q with its index at each actuated joint."""
        return [
            self._place(f"$q_{{{anchor.coordinate + 1}}}$", anchor.point, "#8a5a00")
            for anchor in self.scene.anchors
        ]

    def name_axes(self, colours: tuple[str, ...]) -> list[Any]:
        """Write x, y and z at all frame arrows that are long enough in the view."""
        found: list[Any] = []
        base = self.scene.frames[0].tips
        for number, frame in enumerate(self.scene.frames):
            is_again = frame.tips is not base and np.allclose(frame.tips, base)
            for k, tip in enumerate(frame.tips):
                vector = tip - frame.origin
                length = float(np.linalg.norm(vector))
                if length > 2.6 * self.scene.unit and not is_again:
                    ahead = tip + 1.1 * self.scene.unit * vector / length
                    found += self._near(f"frame {number}", ahead, "xyz"[k], colours[k])
        return found

    def write_lengths(self) -> list[Any]:
        """Write the length of each dimension along the dimension line, if there is space."""
        decimals = _decimals([dimension.length for dimension in self.scene.dimensions])
        return [
            text
            for dimension in self.scene.dimensions
            for text in self._length(dimension, f"{dimension.length:.{decimals}f} m")
        ]

    def add_scale(self) -> Any:
        """Draw a scale bar of a round length below the robot."""
        (left, right), (low, _) = self.ax.get_xlim(), self.ax.get_ylim()
        length = _round_length(0.15 * (right - left))
        text = self._text(f"{length:g} m", "#333333")
        text.set(va="bottom")
        gap = 2 * self.scene.unit
        half = 0.3 * self.scene.unit
        x0, x1 = left + gap + length / 2, right - gap - length / 2
        tried = [
            (float(min(k, 4 - k)), np.array([x, low + gap]), 0.0)
            for k, x in enumerate(np.linspace(x0, x1, 5))
        ]
        bar = self.to_pixels([[-length / 2, -2 * half], [length / 2, 0.0]]) - self.to_pixels((0, 0))
        place = self.places.get("scale")
        if place is None:
            self._best(text, tried, bar)
            self.places["scale"] = np.array(text.get_position())
        else:
            text.set_position(place)
        x, y = text.get_position()
        bar = np.array([[-1, 1], [-1, -1], [-1, 0], [1, 0], [1, 1], [1, -1]])
        bar = bar * [length / 2, half] + [x, y - half]
        self.ax.plot(*bar.T, color="#333333", linewidth=0.7, zorder=1000)
        return text

    def _lines(self) -> tuple[FloatArray, FloatArray]:
        """Return start and end points (m, 2) of all line segments in the drawing [pixels]."""
        rows = []
        for mark in self.scene.marks:
            rows.append(np.concatenate([mark.points, mark.points[: mark.is_area]]))
        rows += [line for ghost in self.scene.ghosts for line in ghost]
        rows += [np.array([f.origin, tip]) for f in self.scene.frames for tip in f.tips]
        begins = np.concatenate([row[:-1] for row in rows])
        ends = np.concatenate([row[1:] for row in rows])
        return self.to_pixels(begins), self.to_pixels(ends)

    def _text(self, letters: str, colour: str) -> Any:
        text = self.ax.text(0, 0, letters, color=colour, fontsize=self.size, zorder=1000)
        text.set(ha="center", va="center", rotation_mode="anchor")
        return text

    def _box(self, text: Any) -> Box:
        extent = text.get_window_extent()
        return extent.x0, extent.y0, extent.x1, extent.y1

    def _place(self, letters: str, point: FloatArray, colour: str) -> Any:
        text = self._text(letters, colour)
        vector = self.places.get(letters)
        if vector is None:
            tried = [
                (distance, point + distance * self.scene.unit * np.array(direction))
                for distance in _DISTANCES
                for direction in _DIRECTIONS
            ]
            self._best(text, [(_FAR * distance, place, 0.0) for distance, place in tried])
            vector = self.places[letters] = np.array(text.get_position()) - point
        text.set_position(point + vector)
        length = float(np.linalg.norm(vector)) / self.scene.unit
        if length > _LEADER:
            ends = np.array(
                [point + 1.2 * vector / length, point + (length - 2.2) / length * vector]
            )
            self.ax.plot(*ends.T, color=colour, linewidth=0.4, zorder=990)
        return text

    def _near(self, frame: str, point: FloatArray, letters: str, colour: str) -> list[Any]:
        """Place a letter at the nearest free position, if there is one."""
        key = f"{frame} {letters}"
        if key in self.places:
            offset = self.places[key]
            if offset is None:
                return []
            text = self._text(letters, colour)
            text.set_position(point + offset)
            return [text]
        text = self._text(letters, colour)
        tried = [(0.0, point, 0.0)]
        for distance in (0.8, 1.4, 2.0, 2.8, 3.6):
            for direction in _DIRECTIONS:
                place = point + distance * self.scene.unit * np.array(direction)
                tried.append((4 * distance, place, 0.0))
        found = self._kept(text, tried)
        self.places[key] = np.array(text.get_position()) - point if found else None
        return found

    def _kept(self, text: Any, tried: list[tuple[float, FloatArray, float]]) -> list[Any]:
        """Return the text at its best position, or an empty list if no position is free."""
        if self._best(text, tried) < _COVERED:
            return [text]
        self.taken.pop()
        text.remove()
        return []

    def _length(self, dimension: Dimension, letters: str) -> list[Any]:
        a, b = dimension.a, dimension.b
        vector = b - a
        pixels = float(np.linalg.norm(np.diff(self.to_pixels(np.array([a, b])), axis=0)))
        text = self._text(letters, "#333333")
        x0, y0, x1, y1 = self._box(text)
        size = np.array([x1 - x0, y1 - y0])
        angle = math.degrees(math.atan2(vector[1], vector[0]))
        angle = (angle + 90) % 180 - 90
        normal = np.array([-vector[1], vector[0]]) / np.linalg.norm(vector)
        tried = [
            (
                10 * abs(part - 0.5) + 2 * step,
                a + part * vector + side * step * self.scene.unit * normal,
            )
            for step in (1.6, 2.4, 3.4)
            for side in (1, -1)
            for part in _ALONG
        ]
        clear = [
            (cost, place, angle)
            for cost, place in tried
            if self._is_nearest(place, dimension) and not self._crosses(place, angle, size)
        ]
        if size[0] <= 1.6 * pixels and clear:
            return self._kept(text, clear)
        text.remove()
        return []

    def _is_nearest(self, place: FloatArray, dimension: Dimension) -> bool:
        others = [own for own in self.scene.dimensions if own is not dimension]
        own = _distance(place, dimension)
        return all(_distance(place, other) > own for other in others)

    def _crosses(self, place: FloatArray, angle: float, size: FloatArray) -> bool:
        """Return whether a line crosses a label with size [pixels] and angle [deg]."""
        c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        turned = [(ends - self.to_pixels(place)) @ [[c, -s], [s, c]] for ends in self.lines]
        return _inside((*(-size / 2), *(size / 2)), *turned) > 0

    def _best(
        self,
        text: Any,
        tried: list[tuple[float, FloatArray, float]],
        corners: FloatArray | None = None,
    ) -> float:
        """Move a text to the position with the smallest cost, and return this cost.

        Args:
            text: The text.
            tried: Cost, position and rotation [deg] of each candidate position.
            corners: Lower and upper corner of a mark that moves with the text [pixels].
        """
        best, least = tried[0], math.inf
        text.set_rotation(tried[0][2])
        text.set_position(tried[0][1])
        x0, y0, x1, y1 = self._box(text)
        at = self.to_pixels(tried[0][1])
        box0 = np.array([x0 - at[0], y0 - at[1], x1 - at[0], y1 - at[1]])
        if corners is not None:
            box0 = np.array([*np.minimum(box0[:2], corners[0]), *np.maximum(box0[2:], corners[1])])
        for cost, place, angle in tried:
            if cost >= least:
                continue  # the remaining terms of the cost are not negative
            x, y = self.to_pixels(place)
            total = cost + self._cost(box0 + np.array([x, y, x, y]))
            if total < least:
                best, least = (cost, place, angle), total
        text.set_position(best[1])
        self.taken.append(self._box(text))
        return least

    def _cost(self, box: Any) -> float:
        left, bottom, right, top = box
        cost = 0.0
        for other in self.taken:
            w = min(right, other[2]) - max(left, other[0])
            h = min(top, other[3]) - max(bottom, other[1])
            cost += _COVERED * (w > -1 and h > -1)
        cost += _CROSSED * _inside(box, *self.lines)
        over = (
            self.frame[0] - left,
            self.frame[1] - bottom,
            right - self.frame[2],
            top - self.frame[3],
        )
        return float(cost + _OUTSIDE * sum(max(part, 0.0) for part in over))


def _decimals(lengths: list[float]) -> int:
    """Return the common number of decimal places of the lengths."""
    if not lengths:
        return 0
    power = math.floor(math.log10(max(lengths)))
    most = max(min(3 - power, max(3, 2 - power)), 0)
    shown = [f"{length:.{most}f}".rstrip("0") for length in lengths]
    return max(len(number.partition(".")[2]) for number in shown)


def _distance(place: FloatArray, dimension: Dimension) -> float:
    """Return the distance [m] from a position to a dimension line."""
    vector = dimension.b - dimension.a
    part = np.clip((place - dimension.a) @ vector / (vector @ vector), 0, 1)
    return float(np.linalg.norm(place - dimension.a - part * vector))


def _round_length(least: float) -> float:
    """Round a length up to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(digit * power for digit in (1, 2, 5, 10) if digit * power >= least)


def _inside(box: Box, a: FloatArray, b: FloatArray) -> float:
    """Return the total length of the parts of line segments that lie inside a box."""
    vector = b - a
    with np.errstate(divide="ignore", invalid="ignore"):
        parts = np.stack([(np.array(box[:2]) - a) / vector, (np.array(box[2:]) - a) / vector])
    # If a line lies along a side of the box, the division 0 / 0 gives NaN.
    is_along = np.isnan(parts).any(axis=(0, 2))
    enter, leave = parts.min(0).max(-1), np.where(is_along, -np.inf, parts.max(0).min(-1))
    inside = np.clip(np.minimum(leave, 1) - np.fmax(enter, 0), 0, None)
    return float((inside * np.linalg.norm(vector, axis=1)).sum())
