"""Draws the figure of the region that a robot's tool reaches."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import sympy as sp

from ...chain.body_shapes import Skeleton
from ...chain.rigid_bodies import Array
from ...model.mechanism import Mechanism
from ...model.robot import SerialRobot
from ...terms.casadi_graph import lower, values_at
from ...terms.symbolic_function import SymbolicFunction
from ...terms.terms import Terms
from ..chain.tables import limits
from .contours import Point
from .paper import at, number, rounded
from .reached import ToolPosition, ToolRegion, box, first_axis, is_vertical, path, reached

_POSITION = [3, 7, 11]
"""Indices of the position entries in a row-major pose."""
Ends = tuple[sp.Expr | None, sp.Expr | None]
"""Lower and upper limit of a coordinate, where None means no limit."""
_LARGEST = 550.0
"""Length of the longer side of the region on paper, in tenths of a millimeter."""
_TICKS = 5
"""Maximum number of tick labels on an axis."""
_STEPS = (1, 2, 5)
_FILLED = "draw=blue!55!black,fill=blue!55!black!18!white,line width=0.3mm,even odd rule"


def workspace(robot: SerialRobot, skeleton: Skeleton) -> str:
    r"""Draw the region that a serial robot's tool reaches within the joint limits.

    Args:
        robot: The description.
        skeleton: Its bodies.

    Returns:
        A sentence and a ``tikzpicture``, or "" if the region is unknown.
    """
    names = [f"q_{{{k}}}" for k in range(1, len(robot.coordinates) + 1)]
    return _figure(reached(skeleton), names, [joint.limits for joint in robot.coordinates])


def workspace_of_loops(
    mechanism: Mechanism,
    terms: Terms,
    skeleton: Skeleton,
    functions: Sequence[SymbolicFunction],
    names: Sequence[str],
) -> str:
    r"""Draw the region that the tool of a robot with loops reaches.

    Args:
        mechanism: The description.
        terms: The parameters of the mechanism, at default values.
        skeleton: Its bodies.
        functions: Its functions.
        names: LaTeX names of the actuated coordinates.
    """
    found = reached_by_loops(mechanism, terms, skeleton, functions)
    return _figure(found, names, [c.limits for c in mechanism.coordinates], closing=True)


def _figure(
    found: ToolRegion | None, names: Sequence[str], ends: Sequence[Ends], *, closing: bool = False
) -> str:
    if found is None:
        return ""
    words = _words(found, names, ends, closing=closing)
    centered = f"\\begin{{center}}\n{_picture(found)}\n\\end{{center}}"
    return f"\\begin{{samepage}}\n{words}\n{centered}\n\\end{{samepage}}\n"


def _words(found: ToolRegion, names: Sequence[str], ends: Sequence[Ends], *, closing: bool) -> str:
    moving = [f"${names[k]}$" for k in found.moving]
    listed = f"{', '.join(moving[:-1])} and {moving[-1]}"
    ranges = [f"${names[k]}$: {limits(ends[k])}" for k in found.moving if ends[k] != (None, None)]
    within = f" within their limits ({', '.join(ranges)})" if ranges else ""
    closed = " and the loops close" if closing else ""
    if found.axes[0] == "r":
        where = "The tool origin reaches the shaded area of the half plane through the first axis"
        turning = names[found.upright]
        after = f"; $r$ is the distance from this axis, and ${turning}$ rotates the region about it"
    else:
        where, after = "The tool origin reaches the shaded area of its plane", ""
    turns = " A joint without limits makes one revolution." if len(ranges) < len(moving) else ""
    return f"{where} if {listed} move{within}{closed}{after}.{turns}"


def _picture(found: ToolRegion) -> str:
    points = [point for loop in found.loops for point in loop]
    low = [min(p[k] for p in points) for k in (0, 1)]
    high = [max(p[k] for p in points) for k in (0, 1)]
    if found.axes[0] == "r":
        low[0] = 0.0
    span = max(b - a for a, b in zip(low, high, strict=True))
    step = _step(span)
    ends = [(math.floor(a / step), math.ceil(b / step)) for a, b in zip(low, high, strict=True)]
    scale = _LARGEST / span
    corner = [first * step for first, _ in ends]

    def on_paper(point: Point) -> tuple[int, int]:
        x, y = (rounded(scale * (value - low)) for value, low in zip(point, corner, strict=True))
        return x, y

    return "\n".join(
        [
            r"\begin{tikzpicture}[x=1mm,y=1mm,font=\footnotesize]",
            rf"  \path[{_FILLED}]",
            *("    " + "--".join([*map(at, map(on_paper, loop)), "cycle"]) for loop in found.loops),
            "  ;",
            *_axes(found.axes, ends, step, scale),
            r"\end{tikzpicture}",
        ]
    )


def _step(span: float) -> float:
    return next(
        digit * 10.0**power
        for power in range(-9, 9)
        for digit in _STEPS
        if digit * 10.0**power * _TICKS >= span
    )


def _axes(
    names: Sequence[str], ends: Sequence[tuple[int, int]], step: float, scale: float
) -> list[str]:
    ticks = [
        [
            (number(rounded(scale * step * (n - first))), f"{n * step:.10g}")
            for n in range(first, last + 1)
        ]
        for first, last in ends
    ]
    across, upward = (",".join("/".join(tick) for tick in own) for own in ticks)
    right, top = (own[-1][0] for own in ticks)
    return [
        rf"  \draw (0,{top})--(0,0)--({right},0);",
        rf"  \foreach \x/\t in {{{across}}} \draw (\x,0)--++(0,-1) node[below] {{$\t$}};",
        rf"  \foreach \y/\t in {{{upward}}} \draw (0,\y)--++(-1,0) node[left] {{$\t$}};",
        rf"  \path ({right},0)++(2,0) node[right] {{${names[0]}$ (m)}};",
        rf"  \path (0,{top})++(0,2) node[above] {{${names[1]}$ (m)}};",
    ]


def reached_by_loops(
    mechanism: Mechanism,
    terms: Terms,
    skeleton: Skeleton,
    functions: Sequence[SymbolicFunction],
) -> ToolRegion | None:
    """Return the region that the tool of a robot with loops reaches within the actuator limits.

    Configurations at which a loop does not close are excluded. The other steps are the same as in
    the function ``reached``.

    Args:
        mechanism: The description.
        terms: The parameters of the mechanism, at default values.
        skeleton: Its bodies.
        functions: The functions of the robot, which include ``fk`` and ``margin``.

    Returns:
        The region, or None if the region is unknown or ``fk`` has no closed form.
    """
    named = {function.name: function for function in functions}
    ends = [
        [None if x is None else float(terms.value(x)) for x in c.limits]
        for c in mechanism.coordinates
    ]
    limits = box(
        [
            (c.unit == "m", low, high)
            for c, (low, high) in zip(mechanism.coordinates, ends, strict=True)
        ]
    )
    if limits is None or "fk" not in named or named["fk"].calls:
        return None
    (position,) = lower([_position(named["fk"], named.get("margin"))], mechanism.name)

    def at(q: Array) -> Array:
        found = values_at(position, q)
        p, margins = found[:, :3], found[:, 3:]
        p[~(margins >= 0).all(1)] = np.nan
        return p

    upright = _upright(mechanism, skeleton)
    return ToolPosition(at, *limits, skeleton.size, upright).region()


def _position(fk: SymbolicFunction, margin: SymbolicFunction | None) -> SymbolicFunction:
    entries = [fk.outputs[0].entries[k] for k in _POSITION]
    if margin is not None:
        entries += margin.outputs[0].entries
    result = replace(fk.outputs[0], entries=tuple(entries), shape=(len(entries),))
    return replace(fk, name="position", outputs=(result,))


def _upright(mechanism: Mechanism, skeleton: Skeleton) -> tuple[int, Array] | None:
    joint, axis, foot = first_axis(path(skeleton))
    moved = [coordinate.moves for coordinate in mechanism.coordinates]
    if joint.kind != "revolute" or joint.name not in moved or not is_vertical(axis):
        return None
    return moved.index(joint.name), foot
