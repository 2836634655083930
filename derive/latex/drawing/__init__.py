r"""Draws a robot in TikZ, in the style of scientific papers."""

import math
import re
from collections.abc import Sequence
from itertools import count

from ...chain.body_shapes import Skeleton
from ...loops.model.planes import loops
from ...model.mechanism import Mechanism
from ...model.robot import SerialRobot
from ...terms.terms import Terms
from ..setting import names
from .labels import Label, Obstacles, loop_number, placed
from .marks import Marks
from .paper import Paper, Point, at, rounded
from .parts import DrawnMembers, Scene, scene
from .view import view, view_of_arm

PREAMBLE = "\\usepackage{tikz}\n\\usetikzlibrary{arrows.meta}"
"""LaTeX preamble that loads TikZ and its arrow library for a drawing."""
_STYLES = r"""  [x=1mm,y=1mm,line cap=round,line join=round,
   font=\footnotesize,>={Stealth[length=1.7mm]},
   outline/.style={draw=black!70,fill=black!70},
   base/.style={draw=black!60,fill=black!6,line width=0.3mm},
   ground/.style={draw=black!75,line width=0.2mm},
   stand/.style={draw=black!75,fill=white,line width=0.25mm},
   guide/.style={draw=black!75,line width=0.5mm},
   tint1/.style={draw=blue!40!black!24!white,fill=blue!40!black!24!white},
   tint2/.style={draw=orange!75!black!32!white,fill=orange!75!black!32!white},
   tint3/.style={draw=teal!80!black!28!white,fill=teal!80!black!28!white},
   tint4/.style={draw=black!22,fill=black!22},
   tint5/.style={draw=violet!70!black!24!white,fill=violet!70!black!24!white},
   tint6/.style={draw=olive!80!black!30!white,fill=olive!80!black!30!white},
   rod outline/.style={draw=black!70,line width=1.2mm},
   rod/.style={draw=black!25,line width=0.8mm},
   piston/.style={draw=black!70,line width=0.9mm},
   barrel/.style={draw=black!80,fill=white,line width=0.3mm},
   pin/.style={draw=black!85,fill=white,line width=0.3mm},
   driven/.style={fill=red!65!orange!85!black},
   pressed/.style={fill=red!65!orange!85!black!40!white},
   weld/.style={fill=black!85},
   axis/.style={draw=black!85,line width=0.15mm,dash pattern=on 1mm off 0.3mm on 0.2mm off 0.3mm},
   motor/.style={draw=red!65!orange!85!black,line width=0.35mm},
   frame/.style={draw=blue!70!black,line width=0.4mm,->},
   axis name/.style={font=\scriptsize,text=blue!70!black,inner sep=0pt},
   loop/.style={draw=black!60,circle,fill=white,line width=0.2mm,inner sep=0pt,
     minimum size=3.8mm,font=\scriptsize},
   leader/.style={draw=black!45,line width=0.15mm},
   name/.style={inner sep=0pt},
   coordinate name/.style={inner sep=0pt,text=red!65!orange!65!black}]"""
_SCALES = (1, 2, 5)
_SHORTEST = 150
"""Minimum length of the scale bar in the picture (0.1 mm)."""
_BELOW = 40
"""Distance of the scale bar below the drawing (0.1 mm)."""


def drawing(
    mechanism: Mechanism, terms: Terms, skeleton: Skeleton, reference: Sequence[float]
) -> str:
    r"""Draw a robot with loops as a TikZ picture.

    Each body is drawn between its joints. Main-chain bodies are drawn with thicker lines than other
    bodies. Actuated joints are red. Each coordinate is drawn with its name and an arrow in its
    positive direction. The label of a geared motor is next to the joint that the motor moves. Loops
    are numbered in the order of ``chasles.derive.loops.model.planes.loops``. Planar loops are
    viewed along their normal. Mechanisms that are not planar are viewed obliquely from above,
    without perspective. The picture is at most 140 mm wide and 110 mm high, including labels.

    Args:
        mechanism: The description.
        terms: The parameters of the mechanism, with default values.
        skeleton: Its bodies.
        reference: Values of the coordinates z in the drawn configuration (radian or meter).

    Returns:
        A ``tikzpicture`` that needs ``PREAMBLE``.
    """
    members = DrawnMembers(
        {c.moves: k for k, c in enumerate(mechanism.coordinates, 1)},
        {joint.name for joint in mechanism.main_chain.joints},
        loops(mechanism),
    )
    parts = scene(skeleton, reference, members)
    directions, is_planar = view(mechanism, terms, skeleton, reference)
    paper = Paper.around(directions, parts.points)
    marks = _marks(parts, paper, is_planar=is_planar)
    taken = marks.obstacles
    # Coordinate labels have the fewest free positions, so they are placed first.
    labels = [line for label in _coordinates(mechanism, marks) for line in placed(label, taken)]
    for k, corners in enumerate(parts.loops, 1):
        place = loop_number([paper.at(p) for p in corners], taken)
        labels.append(f"\\node[loop] at {at(place)} {{{k}}};")
    labels += [line for label in _names(mechanism, marks) for line in placed(label, taken)]
    return _picture(marks, labels)


def arm_drawing(robot: SerialRobot, skeleton: Skeleton) -> str:
    r"""Draw a serial robot with its joint axes, base frame and tool frame.

    A planar arm is viewed along its axes. Arms that are not planar are viewed obliquely from above,
    without perspective. Each coordinate is drawn with its name and an arrow in its positive
    direction.

    Args:
        robot: The description.
        skeleton: Its bodies.

    Returns:
        A ``tikzpicture`` that needs ``PREAMBLE``.
    """
    # The picture shows no motors, so the labels of a coupled robot name its joints.
    letter = r"\theta" if robot.couplings else "q"
    moving = [joint.name for joint in robot.moving]
    members = DrawnMembers(
        {name: k for k, name in enumerate(moving, 1)}, {j.name for j in robot.joints}
    )
    parts = scene(skeleton, skeleton.q_drawn, members)
    directions, is_planar = view_of_arm(skeleton)
    marks = _marks(parts, Paper.around(directions, parts.points), is_planar=is_planar)
    taken = marks.obstacles
    symbols = bool(names.own_symbols(robot))
    wanted = [
        _label(
            *_coordinate(k, name, letter, symbols=symbols), *marks.anchors[name], "coordinate name"
        )
        for k, name in enumerate(moving, 1)
    ]
    wanted.append(_label(*_name(robot.tool_frame), *marks.anchors["tool"], "name"))
    return _picture(marks, [line for label in wanted for line in placed(label, taken)])


def _marks(parts: Scene, paper: Paper, *, is_planar: bool) -> Marks:
    marks = Marks(parts, paper, is_planar=is_planar)
    if parts.foot is not None:
        marks.ground_at(*map(paper.at, parts.foot))
    return marks


def _picture(marks: Marks, labels: Sequence[str]) -> str:
    low, high = _extent(marks.obstacles)
    paper = marks.paper
    lines = [
        "\\begin{tikzpicture}",
        _STYLES,
        *(f"  {line}" for group in (marks.behind, marks.bodies, marks.joints) for line in group),
        *(f"  {line}" for group in (marks.arrows, labels) for line in group),
        *(f"  {line}" for line in _scale(paper.scale, low)),
        f"  \\useasboundingbox {at((low[0], low[1] - _BELOW))} rectangle {at(high)};",
        "\\end{tikzpicture}",
    ]
    return "\n".join(lines) + "\n"


def _coordinates(mechanism: Mechanism, marks: Marks) -> list[Label]:
    return [
        _label(
            *_coordinate(k, coordinate.name), *marks.anchors[coordinate.moves], "coordinate name"
        )
        for k, coordinate in enumerate(mechanism.coordinates, 1)
    ]


def _names(mechanism: Mechanism, marks: Marks) -> list[Label]:
    actuated = {coordinate.moves for coordinate in mechanism.coordinates}
    found = [
        _label(*_name(joint.name), *marks.anchors[joint.name], "name")
        for joint in mechanism.main_chain.moving
        if joint.name in marks.anchors and joint.name not in actuated
    ]
    return [*found, _label(*_name(mechanism.tool_frame), *marks.anchors["tool"], "name")]


def _label(text: str, letters: float, point: Point, radius: int, style: str) -> Label:
    return Label(text, letters, point, radius, style)


def _coordinate(
    k: int, name: str, letter: str = "q", *, symbols: bool = False
) -> tuple[str, float]:
    """Return the LaTeX label of a coordinate, and the width of this label in letters."""
    if name in (letter, f"{letter}{k}", f"{letter}_{k}"):
        return f"${letter}_{{{k}}}$", 2
    text, letters = _name(name, symbols=symbols)
    return f"${letter}_{{{k}}}$ {text}", 2.6 + letters


def _name(name: str, *, symbols: bool = False) -> tuple[str, float]:
    """Return the LaTeX text of a name, and the approximate width of this text in letters.

    A name such as ``a1`` stays unchanged, unless the LaTeX article prints it as a symbol with an
    index.
    """
    if re.fullmatch(r"[A-Za-z]\d+", name) and not symbols:
        return names.escape(name), len(name)
    head, *rest = re.findall(r"[A-Za-z]+|[0-9]+", name) or [name]
    if len(head) > 1 and head not in names.GREEK:
        return names.escape(name), len(name)
    return f"${names.parameter(name)}$", 1.2 + 0.8 * sum(map(len, rest))


def _extent(obstacles: Obstacles) -> tuple[Point, Point]:
    x, y = [], []
    for box in obstacles.boxes:
        x += [box.left, box.right]
        y += [box.bottom, box.top]
    for a, b, half in (*obstacles.lines, *obstacles.outlines):
        x += [a[0] - half, a[0] + half, b[0] - half, b[0] + half]
        y += [a[1] - half, a[1] + half, b[1] - half, b[1] + half]
    return (min(x) - 5, min(y) - 5), (max(x) + 5, max(y) + 5)


def _scale(per_meter: float, corner: Point) -> list[str]:
    start = math.floor(math.log10(_SHORTEST / per_meter)) - 1
    meters = next(
        digit * 10.0**power
        for power in count(start)
        for digit in _SCALES
        if rounded(digit * 10.0**power * per_meter) >= _SHORTEST
    )
    a = (corner[0] + 10, corner[1] - _BELOW + 18)
    b = (a[0] + rounded(meters * per_meter), a[1])
    return [
        f"\\draw[ground,|-|] {at(a)} -- {at(b)};",
        f"\\node[name,anchor=west] at {at((b[0] + 15, b[1]))} {{${meters:g}\\,\\mathrm{{m}}$}};",
    ]


__all__ = ["PREAMBLE", "DrawnMembers", "arm_drawing", "drawing"]
