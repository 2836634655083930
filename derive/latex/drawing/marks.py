"""Draws the symbols of joints and bodies."""

from collections.abc import Sequence

import numpy as np

from ...chain.rigid_bodies import Array
from .labels import Obstacles
from .paper import Paper, Point, angle, area, at, between, distance, hull, number, rounded, turn
from .parts import Bar, DrawnSlide, Hinge, Scene, Solid

TINTS = 6
"""Number of fill colors (tints) for bodies. If a robot has more bodies than colors, the colors
repeat."""
THIN, THICK, RIM = 14, 22, 4
"""Line widths of a body, of a main-chain body, and of an outline."""
PIN, MAIN_PIN = 10, 12
SHAFT = 22
"""Half length of a hinge with its axis in the picture plane."""
MOTOR = 28
"""Radius of the rotation arrow around a motor."""
STROKE = 70
"""Half of the maximum length of an arrow beside a cylinder."""
COLLAR = 36
"""Distance between a hinge and the arrow around its shaft."""
BARREL = 0.55
"""Barrel length of a cylinder, relative to the whole cylinder."""
FORESHORTENED = 0.35
"""Projected length of a unit vector below which the vector counts as parallel to the viewing
direction."""
GUIDE, RAIL = 45, 110
"""Length of a guide beyond its slider, and length of a ground guide for a slider without limits."""
HATCH = 11
"""Distance between the strokes that mark the ground."""
FOOT, FOOTING = 34, 32
"""Height of the triangle under a fixed pin, and half width of the ground below it."""
AXIS = 80
"""Length of the tool frame's arrows."""


class Marks:
    """The TikZ symbols of one drawing.

    Attributes:
        behind: TikZ code of the ground and the base.
        bodies: TikZ code of the bodies, rods and cylinders.
        joints: TikZ code of the hinges and sliders.
        arrows: TikZ code of the motor arrows and of the base and tool frames.
        obstacles: The areas that the symbols of the drawing cover.
        anchors: Label point and symbol radius of each joint, rod, cylinder or frame, keyed by name.
    """

    def __init__(self, scene: Scene, paper: Paper, *, is_planar: bool) -> None:
        self.scene, self.paper, self.is_planar = scene, paper, is_planar
        self.behind: list[str] = []
        self.bodies: list[str] = []
        self.joints: list[str] = []
        self.arrows: list[str] = []
        self.obstacles = Obstacles()
        self.anchors: dict[str, tuple[Point, int]] = {}
        self.corners = [self._outline(solid) for solid in scene.solids]
        self.has_plate = not is_planar and len(self.corners[0]) > 2  # noqa: PLR2004
        self._base()
        self._bodies()
        for slide in scene.slides:
            self._slide(slide)
        self._hinges()
        self._frame_of(scene.tool, "tool")
        if scene.base is not None:
            self._frame_of(scene.base, "base")

    def _outline(self, solid: Solid) -> list[Point]:
        points = [self.paper.at(p) for p in solid.points]
        if not solid.is_line:
            return hull(points)
        return [p for p, before in zip(points, [None, *points], strict=False) if p != before]

    # --- ground ---

    def ground_at(self, point: Point, other: Point) -> None:
        """Draw the ground at a point, perpendicular to the direction toward another point."""
        length = max(distance(point, other), 1)
        x, y = (other[0] - point[0]) / length, (other[1] - point[1]) / length
        side = rounded(FOOTING * y), rounded(FOOTING * x)
        self._ground(
            (point[0] - side[0], point[1] + side[1]), (point[0] + side[0], point[1] - side[1])
        )

    def _base(self) -> None:
        if self.has_plate:
            corners = self.corners[0]
            self.behind.append(f"\\filldraw[base] {_closed(corners)};")
            self.obstacles.plates.append(corners)
            side = -1 if self._hangs() else 1
            for a, b in zip(corners, [*corners[1:], *corners[:1]], strict=True):
                self.obstacles.path([a, b], 2)
                if side * (b[0] - a[0]) > 0:
                    self._ground(a, b)
            return
        feet: list[Point] = []
        for hinge in self.scene.hinges:
            if 0 in (hinge.a, hinge.b):
                self._foot(hinge, feet)

    def _hangs(self) -> bool:
        """Whether the robot hangs below its base."""
        moving = [self._height(corners) for corners in self.corners[1:] if corners]
        return bool(moving) and sum(moving) < len(moving) * self._height(self.corners[0])

    @staticmethod
    def _height(corners: Sequence[Point]) -> float:
        return sum(y for _, y in corners) / len(corners)

    def _ground(self, a: Point, b: Point) -> None:
        length = distance(a, b)
        strokes = f"foreach \\k in {{1,...,{max(length // HATCH, 1)}}}"
        stroke = f"({number(HATCH)}*\\k,0) -- ++(-1.3,-1.3)"
        self.behind.append(
            f"\\draw[ground] {_frame(a, b)} (0,0) -- ({number(length)},0) {strokes} {{ {stroke} }};"
        )
        self.obstacles.path(_shifted(a, b, -7), 8)

    def _foot(self, hinge: Hinge, feet: list[Point]) -> None:
        point = self.paper.at(hinge.at)
        if point in feet:
            return
        feet.append(point)
        shaft = self._shaft(hinge)
        if shaft is not None:
            away = self._away(hinge, shaft)
            x, y = point[0] - rounded(away[0] * SHAFT), point[1] - rounded(away[1] * SHAFT)
            side = rounded(away[1] * FOOTING), rounded(away[0] * FOOTING)
            self._ground((x - side[0], y + side[1]), (x + side[0], y - side[1]))
            return
        up = self._up(hinge, point)
        a = (point[0] - up * FOOTING, point[1] - up * FOOT)
        b = (point[0] + up * FOOTING, point[1] - up * FOOT)
        legs = f"{at(between(a, b, 0.2))} -- {at(point)} -- {at(between(a, b, 0.8))}"
        self.behind.append(f"\\filldraw[stand] {legs} -- cycle;")
        self._ground(a, b)
        self.obstacles.path([point, between(a, b, 0.5)], 20)

    def _up(self, hinge: Hinge, point: Point) -> int:
        other = self._carried(hinge)
        x, y = other[0] - point[0], other[1] - point[1]
        return -1 if -y > 2 * abs(x) else 1

    def _away(self, hinge: Hinge, shaft: tuple[float, float]) -> tuple[float, float]:
        point, other = self.paper.at(hinge.at), self._carried(hinge)
        along = rounded(shaft[0] * (other[0] - point[0]) + shaft[1] * (other[1] - point[1]))
        leads = along > 0 if 2 * abs(along) > distance(point, other) else shaft[1] >= 0
        return shaft if leads else (-shaft[0], -shaft[1])

    def _carried(self, hinge: Hinge) -> Point:
        if hinge.b < 0:
            bar = next(bar for bar in self.scene.bars if bar.name == hinge.name)
            return self.paper.at((bar.a + bar.b) / 2)
        corners = self.corners[hinge.b if hinge.a == 0 else hinge.a]
        return sum(x for x, _ in corners) // len(corners), sum(y for _, y in corners) // len(
            corners
        )

    # --- bodies ---

    def _bodies(self) -> None:
        waiting: list[tuple[tuple[int, int], list[str]]] = []
        for k, (solid, corners) in enumerate(zip(self.scene.solids, self.corners, strict=True)):
            if k == 0 or len(corners) < 2:  # noqa: PLR2004
                continue
            order: tuple[int, int] = (
                (0, -area(corners)) if self.is_planar else (self.paper.depth(solid.points), 0)
            )
            waiting.append((order, self._body(k, corners)))
        for bar in self.scene.bars:
            depth = self.paper.depth([bar.a, bar.b])
            waiting.append(((1, 0) if self.is_planar else (depth, 0), self._bar(bar)))
        for _, lines in sorted(waiting, key=lambda item: item[0]):
            self.bodies.extend(lines)

    def _body(self, k: int, corners: Sequence[Point]) -> list[str]:
        width = THICK if self.scene.solids[k].is_main else THIN
        is_plate = len(corners) > 2 and not self.scene.solids[k].is_line  # noqa: PLR2004
        path = _closed(corners) if is_plate else _open(corners)
        command = "filldraw" if is_plate else "draw"
        if is_plate:
            self.obstacles.plates.append(list(corners))
        self.obstacles.body([*corners, corners[0]] if is_plate else corners, width // 2)
        tint = f"tint{(k - 1) % TINTS + 1}"
        empty = ",fill=none" if self.scene.solids[k].is_line and len(corners) > 2 else ""  # noqa: PLR2004
        return [
            f"\\{command}[outline{empty},line width={number(width + RIM)}mm] {path};",
            f"\\{command}[{tint}{empty},line width={number(width)}mm] {path};",
        ]

    def _bar(self, bar: Bar) -> list[str]:
        a, b = self.paper.at(bar.a), self.paper.at(bar.b)
        self.anchors[bar.name] = between(a, b, 0.5), 14
        self.obstacles.path([a, b], 16 if bar.is_cylinder else 6)
        if not bar.is_cylinder:
            return [f"\\draw[rod outline] {_open([a, b])};", f"\\draw[rod] {_open([a, b])};"]
        length = distance(a, b)
        barrel = rounded(BARREL * length)
        style = "barrel,pressed" if bar.coordinate else "barrel"
        self.anchors[bar.name] = between(a, b, BARREL / 2), 16
        if bar.coordinate:
            side, middle = self._free_side(a, b), (barrel + length) // 2
            half = min(max((length - barrel) // 2 - 10, 30), STROKE)
            self.arrows.append(
                f"\\draw[motor,<->] {_frame(a, b)} ({number(middle - half)},{number(side * 26)})"
                f" -- ({number(middle + half)},{number(side * 26)});"
            )
            self.obstacles.path(_shifted(between(a, b, BARREL), b, side * 26), 8)
        return [
            f"\\draw[piston] {_open([a, b])};",
            f"\\filldraw[{style}] {_frame(a, b)} (0,-1.4) rectangle ({number(barrel)},1.4);",
        ]

    def _free_side(self, a: Point, b: Point) -> int:
        near = [p for corners in self.corners for p in corners if p not in (a, b)]
        length = max(distance(a, b), 1)
        close = [p for p in near if abs(turn(a, b, p)) < length * 300]
        left = sum(1 if turn(a, b, p) > 0 else -1 for p in close)
        return -1 if left > 0 else 1

    # --- joints ---

    def _hinges(self) -> None:
        # If several hinges are at one point, the actuated hinge is drawn on top of the other
        # hinges.
        for hinge in sorted(self.scene.hinges, key=lambda h: (h.coordinate is not None, h.is_main)):
            self._hinge(hinge)

    def _hinge(self, hinge: Hinge) -> None:
        point, radius = self._place(hinge), MAIN_PIN if hinge.is_main else PIN
        style = "pin,driven" if hinge.coordinate else "pin"
        shaft = self._shaft(hinge)
        reach = radius + 2
        if hinge.kind == "weld":
            self.joints.append(
                f"\\fill[weld,shift={{{at(point)}}}] (-1.6,-1.1) -- (1.6,-1.1) -- (0,1.7) -- cycle;"
            )
        elif hinge.kind == "ball":
            self.joints.append(f"\\filldraw[{style}] {at(point)} circle[radius={number(radius)}];")
            self.joints.append(f"\\fill[outline] {at(point)} circle[radius={number(radius // 2)}];")
        elif shaft is None:
            self.joints.append(f"\\filldraw[{style}] {at(point)} circle[radius={number(radius)}];")
        else:
            self._turned_hinge(point, style, shaft)
            reach = SHAFT
        if hinge.coordinate:
            self._motor(hinge, point, shaft)
            reach = MOTOR + 4
        self.obstacles.disc(point, reach)
        if hinge.b >= 0:
            self.anchors[hinge.name] = point, reach

    def _place(self, hinge: Hinge) -> Point:
        point, shaft = self.paper.at(hinge.at), self._shaft(hinge)
        others = [self.paper.at(other.at) for other in self.scene.hinges if other is not hinge]
        if shaft is None or 0 in (hinge.a, hinge.b) or hinge.b < 0:
            return point
        if all(distance(point, other) > 2 * SHAFT for other in others):
            return point
        # A hinge near other hinges is shifted along its child body. If the child body is too short,
        # the hinge is shifted along its parent body.
        for k in (hinge.b, hinge.a):
            along = [
                rounded(shaft[0] * (x - point[0]) + shaft[1] * (y - point[1]))
                for x, y in self.corners[k]
            ]
            reach = max(along, key=abs, default=0)
            if abs(reach) > 2 * SHAFT:
                step = 2 * SHAFT if reach > 0 else -2 * SHAFT
                return point[0] + rounded(step * shaft[0]), point[1] + rounded(step * shaft[1])
        return point

    def _turned_hinge(self, point: Point, style: str, shaft: tuple[float, float]) -> None:
        frame = f"[shift={{{at(point)}}},rotate={angle(*shaft)}]"
        self.joints.append(f"\\draw[axis] {frame} (-3.6,0) -- (3.6,0);")
        self.joints.append(
            f"\\filldraw[{style}] {frame} (-{number(SHAFT)},-1.2) rectangle ({number(SHAFT)},1.2);"
        )

    def _shaft(self, hinge: Hinge) -> tuple[float, float] | None:
        if hinge.axis is None or hinge.kind != "pin":
            return None
        right, up, _ = self.paper.along(hinge.axis)
        length = float(np.hypot(right, up))
        return None if length < FORESHORTENED else (right / length, up / length)

    def _motor(self, hinge: Hinge, point: Point, shaft: tuple[float, float] | None) -> None:
        near = 0.0 if hinge.axis is None else self.paper.along(hinge.axis)[2]
        if shaft is None:
            middle = self._free_direction(hinge, point)
            begin, end = (middle - 80, middle + 80) if near >= 0 else (middle + 80, middle - 80)
            self.arrows.append(
                f"\\draw[motor,->,shift={{{at(point)}}}] ({begin}:{number(MOTOR)})"
                f" arc[start angle={begin},end angle={end},radius={number(MOTOR)}];"
            )
            return
        # A rotation arrow shows only the part of its circle that is nearer to the viewer.
        away = self._away(hinge, shaft)
        beyond = point[0] + rounded(COLLAR * away[0]), point[1] + rounded(COLLAR * away[1])
        begin, end = (60, 300) if near >= -FORESHORTENED / 100 else (120, -120)
        self.obstacles.disc(beyond, MOTOR)
        self.arrows.append(
            f"\\draw[motor,->,shift={{{at(beyond)}}},rotate={angle(*shaft)}]"
            f" ({begin}:0.9 and {number(MOTOR)})"
            f" arc[start angle={begin},end angle={end},x radius=0.9,y radius={number(MOTOR)}];"
        )

    def _free_direction(self, hinge: Hinge, point: Point) -> int:
        compass = [(10, 0), (7, 7), (0, 10), (-7, 7), (-10, 0), (-7, -7), (0, -10), (7, -7)]
        directions = [
            (x - point[0], y - point[1])
            for corners in (self.corners[k] for k in (hinge.a, hinge.b) if k > 0)
            for x, y in corners
            if (x, y) != point
        ]
        if hinge.a == 0:
            directions.append((0, -100 * self._up(hinge, point)))

        def closeness(k: int) -> int:
            x, y = compass[k]
            cosines = [(x * w[0] + y * w[1]) / distance(w, (0, 0)) for w in directions]
            return rounded(10 * max(cosines, default=0.0))

        return 45 * min(range(8), key=closeness)

    def _slide(self, slide: DrawnSlide) -> None:
        point, start = self.paper.at(slide.at), self.paper.at(slide.start)
        right, up, _ = self.paper.along(slide.axis)
        length = float(np.hypot(right, up))
        style = "pin,driven" if slide.coordinate else "pin"
        self.obstacles.disc(point, 22)
        self.anchors[slide.name] = point, 24
        if length < FORESHORTENED:
            self.joints.append(
                f"\\filldraw[{style},shift={{{at(point)}}}] (-1.9,-1.9) rectangle (1.9,1.9);"
            )
            self.joints.append(f"\\fill[outline] {at(point)} circle[radius=0.5];")
            return
        x, y = right / length, up / length
        if x < 0 or (x == 0 and y < 0):
            x, y = -x, -y
        place = point if slide.mouth is None else self.paper.at(slide.mouth)
        if slide.mouth is None:
            self._guide(slide, start, point, (x, y))
        frame = f"[shift={{{at(place)}}},rotate={angle(x, y)}]"
        self.joints.append(f"\\filldraw[{style}] {frame} (-2.6,-1.8) rectangle (2.6,1.8);")
        self.anchors[slide.name] = place, 26
        self.obstacles.disc(place, 24)
        if slide.coordinate:
            self.arrows.append(f"\\draw[motor,<->] {frame} (-4.5,3.2) -- (4.5,3.2);")
            ends = [
                (place[0] + rounded(s * 45 * x), place[1] + rounded(s * 45 * y)) for s in (-1, 1)
            ]
            self.obstacles.path(_shifted(ends[0], ends[1], 32), 8)

    def _guide(
        self, slide: DrawnSlide, start: Point, point: Point, direction: tuple[float, float]
    ) -> None:
        x, y = direction
        is_rail = slide.a == 0 and not self.has_plate
        reaches = self._reaches(slide, start, point, direction, is_rail=is_rail)
        ends = [(point[0] + rounded(x * r), point[1] + rounded(y * r)) for r in reaches]
        if is_rail:
            low = [(px + rounded(20 * y), py - rounded(20 * x)) for px, py in ends]
            self._ground(low[0], low[1])
        else:
            self.bodies.append(f"\\draw[guide] {_open(ends)};")
            self.obstacles.path(ends, 4)

    def _reaches(
        self,
        slide: DrawnSlide,
        start: Point,
        point: Point,
        direction: tuple[float, float],
        *,
        is_rail: bool,
    ) -> tuple[int, int]:
        shown = [self.paper.at(p) for p in slide.travel] or [point if is_rail else start]
        along = [
            rounded(direction[0] * (p[0] - point[0]) + direction[1] * (p[1] - point[1]))
            for p in (point, *shown)
        ]
        beyond = RAIL if is_rail and not slide.travel else GUIDE
        return min(along) - beyond, max(along) + beyond

    # --- frames ---

    def _frame_of(self, T: Array, name: str) -> None:
        origin = self.paper.at(T[:3, 3])
        self.anchors[name] = origin, 10
        for k, letter_of_axis in enumerate("xyz"):
            right, up, _ = self.paper.along(T[:3, k])
            if float(np.hypot(right, up)) < FORESHORTENED:
                continue
            tip = origin[0] + rounded(AXIS * right), origin[1] + rounded(AXIS * up)
            letter = origin[0] + rounded(1.22 * AXIS * right), origin[1] + rounded(1.22 * AXIS * up)
            self.arrows.append(f"\\draw[frame] {at(origin)} -- {at(tip)};")
            self.arrows.append(f"\\node[axis name] at {at(letter)} {{${letter_of_axis}$}};")
            self.obstacles.path([origin, letter], 6)
            self.obstacles.disc(letter, 10)


def _open(corners: Sequence[Point]) -> str:
    return " -- ".join(map(at, corners))


def _closed(corners: Sequence[Point]) -> str:
    return f"{_open(corners)} -- cycle"


def _frame(a: Point, b: Point) -> str:
    return f"[shift={{{at(a)}}},rotate={angle(b[0] - a[0], b[1] - a[1])}]"


def _shifted(a: Point, b: Point, shift: int) -> list[Point]:
    length = max(distance(a, b), 1)
    x, y = (b[0] - a[0]) / length, (b[1] - a[1]) / length
    move = rounded(-shift * y), rounded(shift * x)
    return [(p[0] + move[0], p[1] + move[1]) for p in (a, b)]
