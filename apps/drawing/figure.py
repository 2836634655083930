"""Technical drawings of robots as matplotlib figures."""

from __future__ import annotations

import io
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, Robot, ShapeError, Solutions
from chasles.arrays import real_array
from chasles.contract import as_path, check_type, requires, write_files
from chasles.tolerances import SAME_SOLUTION

from .assembly import assembly_modes, has_modes, others
from .lettering import Lettering, Places
from .scene import Scene, corners, scenes
from .skeleton import Skeleton, skeleton
from .views import AXONOMETRIC, SPATIAL, View, views_of

FloatArray = NDArray[np.float64]

WIDTH = 3.15
"""Width of a figure [inch]: 8 cm, the width of a printed column."""
_TALLEST = 5.2
_LEFT, _RIGHT, _BOTTOM, _TOP, _GAP = 0.42, 0.08, 0.36, 0.16, 0.2
"""Margins of a figure and gap between two views [inch]."""
_ENTRY = 0.1
"""Height of a legend line [inch]."""
_TICK, _MAX_TICKS = (0.4, 0.2), 4
"""Space for one tick label along the x and the y axis [inch], and maximum number of ticks per axis.
"""
_LETTERS, _SMALL = 7.0, 6.0
"""Font sizes [pt]."""
_AXES = ("#d55e00", "#009e73", "#0072b2")
_GHOSTS = ("#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7", "#56b4e9", "#999999", "#000000")
"""Colors that color-blind readers can distinguish (Okabe and Ito, 2008)."""
MAX_GHOSTS = 3
"""Maximum number of additional configurations that are selected automatically and drawn in pale
colors. Readers could hardly distinguish more than three pale configurations."""
_VISIBLE = 1e-3
"""Maximum distance of coinciding configurations, relative to the robot size."""
_PATH = "#cc79a7"
_DARK = "#333333"
_LINES: dict[str, dict[str, Any]] = {
    "link": {"color": "#7d8b99", "linewidth": 2.6},
    "ram": {"color": "#7d8b99", "linewidth": 1.8},
    "base": {"color": "#777777", "linewidth": 0.7, "dashes": (6, 2, 1, 2)},
    "guide": {"color": "#777777", "linewidth": 1.6},
    "rod": {"color": "#777777", "linewidth": 1.5},
    "piston": {"color": "#555555", "linewidth": 1.3},
    "axis": {"color": _DARK, "linewidth": 0.4, "dashes": (8, 2, 2, 2)},
    "ground": {"color": _DARK, "linewidth": 0.8},
    "hatch": {"color": _DARK, "linewidth": 0.4},
}
_HALO = ("link", "rod", "ram", "piston")
"""Line styles with a white border, which separates crossing lines."""
_AREAS: dict[str, dict[str, Any]] = {
    "joint": {"facecolor": "#ffffff", "edgecolor": _DARK, "linewidth": 0.6},
    "driven": {"facecolor": "#e69f00", "edgecolor": _DARK, "linewidth": 0.6},
    "plate": {"facecolor": "#dde3e8", "edgecolor": "#7d8b99", "linewidth": 1.2},
    "floor": {"facecolor": "#eeeeee", "edgecolor": "#777777", "linewidth": 0.8},
    "stand": {"facecolor": "#ffffff", "edgecolor": _DARK, "linewidth": 0.6},
    "barrel": {"facecolor": "#ffffff", "edgecolor": _DARK, "linewidth": 0.7},
    "driven barrel": {"facecolor": "#f3cf80", "edgecolor": _DARK, "linewidth": 0.7},
    "dot": {"facecolor": _DARK, "edgecolor": "none", "linewidth": 0.0},
}


def draw(
    robot: Robot,
    q: ArrayLike | None = None,
    *,
    ghosts: Any = None,
    path: Any = None,
    views: Sequence[str] | None = None,
    ax: Any = None,
    file: str | os.PathLike[str] | None = None,
) -> Any:
    """Draw a robot: links, joint symbols, cylinders, rods, ground and frames.

    Actuated joints are orange and labeled with their coordinate. Passive joints are white. The
    drawing of a planar robot states its lengths in meters. The figure is 8 cm wide. No window
    opens.

    Args:
        robot: The robot, from `chasles.load`.
        q: (n,) actuated coordinates [rad or m]. The default is the reference configuration of a
            robot with loops, or a configuration of an arm in which all joints are clearly visible.
        ghosts: Additional configurations in pale colors. True draws the (at most three) other
            inverse solutions for the tool pose that are nearest to q. "modes" draws at most three
            other assembly modes at q. A `Solutions` object for one pose, or an array (g, n) of
            coordinates, draws these configurations. The legend states which solutions have
            coinciding links.
        path: A `Trajectory`, a `Motion`, a `Plan` or an array (k, n) of coordinates, whose tool
            path is drawn.
        views: One or more of "front", "side", "top", "axonometric" and, for planar robots, "plane".
            The default is "plane" for planar robots. Other robots are drawn in the other four
            views, or only in "axonometric" if `ax` is passed.
        ax: Matplotlib axes for a single view, or None for a new figure.
        file: The file to write (.pdf, .svg or .png), or None. Not with `ax`.

    Returns:
        The matplotlib figure, or `ax` if axes are passed.

    Raises:
        OutOfReachError: The loops of the robot do not close at q.
        InputValueError: A view or file suffix is unknown, axes are passed for several views, a
            motion belongs to a different robot, or the robot does not have the requested `ghosts`.
        ShapeError: `q`, `ghosts` or `path` has the wrong number of coordinates.
        NotInstalledError: Matplotlib is not installed (`pip install 'chasles[draw]'`).
    """
    check_type("draw: robot", robot, Robot)
    bodies = skeleton(robot)
    chosen = bodies.q_drawn if q is None else _row(robot, q)
    poses = bodies.poses(chosen)
    pale, labels = _ghosts(bodies, chosen, ghosts)
    tool_path = None if path is None else _tool_path(bodies, path)
    found = views_of(bodies, poses, None if views is None else tuple(views))
    if views is None and ax is not None and len(found) > 1:
        found = [AXONOMETRIC]
    if ax is not None and file is not None:
        raise InputValueError("draw: ax and file: expected one of them; save the figure of ax")
    if ax is not None and len(found) != 1:
        raise InputValueError(f"draw: ax: expected one view, got {len(found)} views")
    shown = scenes(bodies, poses, pale, tool_path, found)
    if ax is not None:
        _limit(ax, shown[0].box, None)
        _paint(ax, shown[0])
        return ax
    figure = figure_of(shown, labels, has_path=path is not None)
    if file is not None:
        suffix = as_path("draw: file", file).suffix
        if suffix.lower() in (".gif", ".mp4"):
            raise InputValueError(
                f"draw: file: expected a picture, got {os.fspath(file)!r}; call animate"
            )
        if suffix[1:].lower() not in figure.canvas.get_supported_filetypes():
            expected = "expected a file that ends in .pdf, .svg or .png"
            raise InputValueError(f"draw: file: {expected}, got {os.fspath(file)!r}")
        stream = io.BytesIO()
        figure.savefig(stream, dpi=300, format=suffix[1:])
        write_files({Path(file): stream.getvalue()})
    return figure


def _row(robot: Robot, q: ArrayLike) -> FloatArray:
    row = real_array("draw", "q", q)
    if row.shape != (robot.n,):
        raise ShapeError(f"draw: q: expected shape ({robot.n},), got {row.shape}")
    _require_finite("draw: q", row)
    return row


def _require_finite(name: str, array: FloatArray) -> None:
    if not np.isfinite(array).all():
        raise InputValueError(f"{name}: expected finite numbers")


def rows_of(robot: Robot, configurations: Any, name: str) -> FloatArray:
    """Return coordinates (k, n) of configurations, a plan, a trajectory or a motion.

    Raises:
        ShapeError: The shape of the configurations is not (k, n).
        InputValueError: The motion belongs to a different robot.
    """
    sampled = configurations.sample() if hasattr(configurations, "sample") else configurations
    if getattr(sampled, "robot", robot.name) != robot.name:
        raise InputValueError(
            f"{name}: expected a motion of robot {robot.name}, got robot {sampled.robot}"
        )
    caller, _, argument = name.partition(": ")
    rows = real_array(caller, argument, getattr(sampled, "q", sampled))
    if rows.ndim != 2 or rows.shape[1] != robot.n or not len(rows):  # noqa: PLR2004
        raise ShapeError(f"{name}: expected shape (k, {robot.n}), got {rows.shape}")
    _require_finite(name, rows)
    return rows


def _tool_path(bodies: Skeleton, path: Any) -> FloatArray:
    rows = rows_of(bodies.robot, path, "draw: path")
    tips: FloatArray = bodies.tip_poses(bodies.poses(rows))[:, :3, 3]
    return tips


def _ghosts(bodies: Skeleton, q: FloatArray, ghosts: Any) -> tuple[FloatArray, tuple[str, ...]]:
    """Return (body poses (g, bodies, 4, 4), labels) of the configurations in pale colors."""
    robot = bodies.robot
    if ghosts is None or ghosts is False:
        return np.empty((0, len(bodies.bodies), 4, 4)), ()
    if isinstance(ghosts, str):
        return _modes(bodies, q, ghosts), ()
    if ghosts is True:
        if "ik" not in robot.functions:
            raise InputValueError(
                f"draw: ghosts: expected a robot with a closed-form inverse, got {robot.name}"
            )
        ghosts = _nearest(other_inverses(robot, q), q)
    if isinstance(ghosts, Solutions):
        pale = bodies.poses(ghosts.valid_q())
        return pale, _with_coinciding(bodies, q, pale, _labels(ghosts))
    return bodies.poses(rows_of(robot, ghosts, "draw: ghosts")), ()


def _modes(bodies: Skeleton, q: FloatArray, word: str) -> FloatArray:
    if word != "modes":
        raise InputValueError(f'draw: ghosts: expected "modes", got {word!r}')
    if not has_modes(bodies.robot):
        raise InputValueError(
            "draw: ghosts: expected a robot with an assembly mode function, got "
            f"{bodies.robot.name}"
        )
    z = bodies.robot.configuration(q)
    modes = others(assembly_modes(bodies, q, z), z, bodies)
    return bodies.poses_from_configuration(modes.z[:MAX_GHOSTS])


def redundancy_at(robot: Robot, q: FloatArray) -> dict[str, float]:
    # In robots with loops, redundancy parameters are joints of the main chain.
    """Return the redundancy parameters at q (n,), for `ik(T, fixed=...)`."""
    theta = robot.chain(q) if robot.loops else q
    names = [joint.name for joint in robot.chain_joints]
    return {
        item.name: float(robot.swivel(q) if item.index is None else theta[names.index(item.name)])
        for item in robot.redundancy
    }


def other_inverses(robot: Robot, q: FloatArray) -> Solutions:
    """Return the other distinct solutions for the pose and redundancy parameters at q."""
    found: Solutions = robot.ik(robot.fk(q), fixed=redundancy_at(robot, q)).distinct()
    is_other = np.abs(found.distances_from(q)).max(-1) > SAME_SOLUTION
    return found._replace(valid=found.valid & is_other)


def _nearest(found: Solutions, q: FloatArray) -> Solutions:
    """Select the `MAX_GHOSTS` solutions nearest to q."""
    distances = np.where(found.valid, np.abs(found.distances_from(q)).max(-1), np.inf)
    kept = np.zeros_like(found.valid)
    kept[np.argsort(distances, kind="stable")[:MAX_GHOSTS]] = True
    return found._replace(valid=found.valid & kept)


def _labels(found: Solutions) -> tuple[str, ...]:
    if not found.labels:
        return ()
    return tuple(label for label, valid in zip(found.labels, found.valid, strict=True) if valid)


def _with_coinciding(
    bodies: Skeleton, q: FloatArray, pale: FloatArray, labels: tuple[str, ...]
) -> tuple[str, ...]:
    """Return the labels of the configurations.

    If the links coincide with an earlier configuration, the label names that configuration.
    """
    seen = [(corners(bodies, bodies.poses(q)), "the drawn robot")]
    found = []
    for number, (ghost, label) in enumerate(zip(pale, labels, strict=False), 1):
        own = corners(bodies, ghost)
        near = (name for points, name in seen if _is_same(points, own, bodies.size))
        name = next(near, "")
        found.append(f"{label}: coincides with {name}" if name else label)
        seen.append((own, f"line {number}"))
    return tuple(found)


def _is_same(a: FloatArray, b: FloatArray, size: float) -> bool:
    return float(np.abs(a - b).max()) <= _VISIBLE * size


# --- layout of the figure ---


def figure_of(
    shown: list[Scene],
    labels: tuple[str, ...],
    *,
    has_path: bool,
    boxes: list[tuple[FloatArray, FloatArray]] | None = None,
    places: list[Places] | None = None,
) -> Any:
    """Return a figure 8 cm wide with one axes object per scene.

    Args:
        shown: The scenes.
        labels: Legend text of each configuration that is drawn in addition to the first.
        has_path: Whether the legend lists the tool path.
        boxes: Lower and upper corner of the region drawn for each scene, or None for the bounding
            box of the scene.
        places: Label offsets of each view in an animation. The first frame sets the offsets for all
            frames. An animation shows no dimensions of links.
    """
    with requires("chasles[draw]"):
        from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415
        from matplotlib.figure import Figure  # noqa: PLC0415

    entries = len(labels) + has_path
    below = _ENTRY * entries + (0.04 if entries else 0.0)
    cells = _cells([scene.view for scene in shown])
    boxes = [scene.box for scene in shown] if boxes is None else boxes
    spans = [high - low for low, high in boxes]
    widths = _largest(cells, spans, 1)
    heights = _largest(cells, spans, 0)
    across = WIDTH - _LEFT - _RIGHT - _GAP * (len(widths) - 1)
    upright = _TALLEST - _BOTTOM - _TOP - _GAP * (len(heights) - 1)
    scale = min(across / sum(widths), upright / sum(heights))
    height = scale * sum(heights) + _BOTTOM + _TOP + _GAP * (len(heights) - 1) + below
    figure = Figure(figsize=(WIDTH, height))
    FigureCanvasAgg(figure)
    # Views that are narrower than the figure are centered.
    spare = (across - scale * sum(widths)) / 2
    of_view: list[Places | None] = [None] * len(shown) if places is None else [*places]
    for scene, box, (row, column), kept in zip(shown, boxes, cells, of_view, strict=True):
        left = _LEFT + spare + scale * sum(widths[:column]) + _GAP * column
        bottom = _BOTTOM + below + scale * sum(heights[row + 1 :]) + _GAP * (len(heights) - 1 - row)
        size = scale * widths[column], scale * heights[row]
        ax = figure.add_axes((left / WIDTH, bottom / height, size[0] / WIDTH, size[1] / height))
        _limit(ax, box, (widths[column], heights[row]))
        _paint(ax, scene, kept)
        _label_axes(ax, scene.view, size, is_low=row == len(heights) - 1, is_left=column == 0)
    _legend(figure, labels, has_path=has_path)
    return figure


def _cells(views: list[View]) -> list[tuple[int, int]]:
    """Return row and column of each view. Four views fill two rows."""
    if [view.name for view in views] == [view.name for view in SPATIAL]:
        return [(0, 0), (0, 1), (1, 0), (1, 1)]
    return [(0, k) for k in range(len(views))]


def _largest(cells: list[tuple[int, int]], spans: list[FloatArray], part: int) -> list[float]:
    """Return the maximum width of each column, or height of each row."""
    count = 1 + max(cell[part] for cell in cells)
    return [
        max(float(s[1 - part]) for c, s in zip(cells, spans, strict=True) if c[part] == k)
        for k in range(count)
    ]


def _limit(ax: Any, box: tuple[FloatArray, FloatArray], size: tuple[float, float] | None) -> None:
    """Set the axis limits to a box, or to a rectangle with the same center."""
    low, high = box
    if size is not None:
        middle = (low + high) / 2
        low, high = middle - np.array(size) / 2, middle + np.array(size) / 2
    ax.set_xlim(low[0], high[0])
    ax.set_ylim(low[1], high[1])
    ax.set_aspect("equal")
    ax.apply_aspect()


def _label_axes(
    ax: Any, view: View, size: tuple[float, float], *, is_low: bool, is_left: bool
) -> None:
    with requires("chasles[draw]"):
        from matplotlib.ticker import MaxNLocator  # noqa: PLC0415

    for side in ("top", "right", "bottom", "left"):
        ax.spines[side].set(linewidth=0.4, color="#aaaaaa")
    ax.tick_params(labelsize=_SMALL, width=0.4, length=2, pad=1.5, color="#777777")
    if view.name != "plane":
        ax.set_title(view.name, fontsize=_SMALL, loc="left", pad=2, color="#555555")
    if not view.labels[0]:
        ax.set_xticks([])
        ax.set_yticks([])
        return
    for axis, length, space in zip((ax.xaxis, ax.yaxis), size, _TICK, strict=True):
        count = max(min(int(length / space), _MAX_TICKS), 1)
        axis.set_major_locator(MaxNLocator(count, steps=[1, 2, 5, 10]))
    ax.set_xlabel(f"{view.labels[0]} [m]", fontsize=_LETTERS, labelpad=1)
    ax.set_ylabel(f"{view.labels[1]} [m]", fontsize=_LETTERS, labelpad=1)
    if not is_low:
        ax.set_xlabel("")
        ax.tick_params(labelbottom=False)
    if not is_left:
        ax.set_ylabel("")
        ax.tick_params(labelleft=False)


def _paint(ax: Any, scene: Scene, places: Places | None = None) -> None:
    """Draw a scene on axes. An animation passes the label offsets as `places`."""
    with requires("chasles[draw]"):
        from matplotlib.lines import Line2D  # noqa: PLC0415
        from matplotlib.patches import Polygon  # noqa: PLC0415

    order = 10.0
    for k, ghost in enumerate(scene.ghosts):
        for line in ghost:
            colour = _GHOSTS[k % len(_GHOSTS)]
            ax.add_line(Line2D(*line.T, color=colour, linewidth=1.3, alpha=0.45, zorder=5))
            ax.plot(*line.T, "o", color=colour, markersize=1.6, alpha=0.45, zorder=5)
    for mark in scene.marks:
        order += 0.01
        if mark.is_area:
            ax.add_patch(
                Polygon(mark.points, zorder=order, joinstyle="round", **_AREAS[mark.style])
            )
            continue
        style = _LINES[mark.style]
        x, y = mark.points.T
        joined: dict[str, Any] = {"solid_joinstyle": "round", "solid_capstyle": "round"}
        if mark.style in _HALO:
            wide = style["linewidth"] + 1.4
            halo: dict[str, Any] = {"color": "#ffffff", "linewidth": wide, "solid_capstyle": "butt"}
            ax.add_line(Line2D(x, y, zorder=order, **halo))
        ax.add_line(Line2D(x, y, zorder=order + 0.005, **joined, **style))
    if scene.path is not None:
        ax.add_line(Line2D(*scene.path.T, color=_PATH, linewidth=1.1, zorder=order + 1))
    for frame in scene.frames:
        for tip, colour in zip(frame.tips, _AXES, strict=True):
            _arrow(ax, frame.origin, tip, colour)
    letters = Lettering(ax, scene, _LETTERS, {} if places is None else places)
    if scene.view.name in ("axonometric", "plane"):
        letters.name_coordinates()
        letters.name_axes(_AXES)
        if places is None:
            letters.write_lengths()
    if scene.view.name == "axonometric":
        letters.add_scale()


def _arrow(ax: Any, origin: FloatArray, tip: FloatArray, colour: str) -> None:
    style = {"arrowstyle": "-|>,head_length=0.25,head_width=0.1", "color": colour}
    extent = {"shrinkA": 0, "shrinkB": 0, "linewidth": 0.8, "mutation_scale": 8}
    ax.annotate("", tip, origin, zorder=900, arrowprops=style | extent)


def _legend(figure: Any, labels: tuple[str, ...], *, has_path: bool) -> None:
    with requires("chasles[draw]"):
        from matplotlib.lines import Line2D  # noqa: PLC0415

    handles = [
        Line2D([], [], color=_GHOSTS[k % len(_GHOSTS)], linewidth=1.3, alpha=0.6, label=label)
        for k, label in enumerate(labels)
    ]
    if has_path:
        handles.append(Line2D([], [], color=_PATH, linewidth=1.1, label="path of the tool"))
    if handles:
        style = {"fontsize": _SMALL, "frameon": False, "labelspacing": 0.2, "borderpad": 0.1}
        figure.legend(handles=handles, loc="lower center", **style)
