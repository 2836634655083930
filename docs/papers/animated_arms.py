"""Draws arms as lines through their link frames, in pictures and animations."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from panels import COLOURS, FONT, PALE, solid

FRAMES = 48
"""Number of pictures in an animation."""
PER_SECOND = 12
DOTS_PER_INCH = 220
COLOURS_IN_GIF = 200
SLIMMEST = 0.45
"""Minimum side of a drawn 3D box relative to its longest side, so that tick labels fit."""
ZOOM = 0.95
"""Zoom factor of 3D axes, less than 1 so that the labels lie inside the picture."""


def points(robot: Any, q: Any) -> Any:
    """Return positions (..., links + 2, 3) of a robot's base, link origins and tool [m]."""
    links, tool = robot.link_poses(q)[..., :3, 3], robot.fk(q)[..., None, :3, 3]
    return np.concatenate([np.zeros_like(tool), links, tool], axis=-2)


def drawn(axes: Any, line: Any, colour: str = COLOURS[0], **style: Any) -> Any:
    """Draw an arm as a line through points (k, 3) with marks, and return the matplotlib line."""
    given = {"marker": "o", "markersize": 2.5, "linewidth": 1.8} | style
    return axes.plot(*np.asarray(line).T, color=colour, **given)[0]


def boxed(axes: Any, cloud: Any, margin: float = 0.05) -> None:
    """Set equal axis scales that contain all points (..., 3), and label the axes in meters."""
    flat = np.asarray(cloud).reshape(-1, 3)
    low, high = flat.min(0), flat.max(0)
    pad = margin * (high - low).max()
    short = np.maximum(SLIMMEST * (high - low).max() - (high - low), 0) / 2
    low, high = low - short, high + short
    for name, a, b in zip("xyz", low - pad, high + pad, strict=True):
        getattr(axes, f"set_{name}lim")(a, b)
        getattr(axes, f"set_{name}label")(f"{name} [m]")
    axes.set_box_aspect(high - low + 2 * pad, zoom=ZOOM)
    for axis, side in zip((axes.xaxis, axes.yaxis, axes.zaxis), high - low, strict=True):
        axis.get_major_locator().set_params(nbins=3 if side > (high - low).max() / 2 else 1)


def in_space(figure: Any, place: Any) -> Any:
    """Add 3D axes to a cell of a figure's subplot grid, with the font of the other panels."""
    import matplotlib.pyplot as plt  # noqa: PLC0415

    with plt.rc_context(FONT):
        axes = figure.add_subplot(place, projection="3d")
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_tick_params(pad=-2)
        axis.labelpad = -5
    return axes


def frame(axes: Any, T: Any, length: float, **style: Any) -> None:
    """Draw the x, y and z axes of a frame with pose (4, 4) in three colors."""
    for k, colour in enumerate((COLOURS[3], COLOURS[2], COLOURS[0])):
        ends = np.array([T[:3, 3], T[:3, 3] + length * T[:3, k]])
        axes.plot(*ends.T, color=colour, **({"linewidth": 1.2} | style))


def animation(
    robot: Any,
    q: Any,
    height: float,
    extra: Callable[[Any], None],
    view: tuple[float, float],
    count: int = FRAMES,
) -> Callable[[Path], None]:
    """Return a function that writes an arm's motion as an animated GIF.

    Args:
        robot: The arm.
        q: (m, n) coordinates of the arm at equal time intervals.
        height: Height of the picture [inch].
        extra: Function that draws the stationary objects in the axes.
        view: Elevation and azimuth of the camera [deg].
        count: Number of pictures.
    """

    def write(path: Path) -> None:
        import matplotlib.pyplot as plt  # noqa: PLC0415
        from PIL import Image  # noqa: PLC0415

        lines = points(robot, np.asarray(q))
        figure, axes = solid(height)
        figure.set_dpi(DOTS_PER_INCH)
        axes.view_init(*view)
        boxed(axes, lines)
        extra(axes)
        drawn(axes, lines[0], PALE)
        moving = (axes.plot([], [], [], color=COLOURS[3])[0], drawn(axes, lines[0]))
        for line in moving:
            line.set_animated(True)
        figure.canvas.draw()
        resting = figure.canvas.copy_from_bbox(figure.bbox)
        pictures = []
        for k in np.linspace(0, len(lines) - 1, count).astype(int):
            figure.canvas.restore_region(resting)
            for line, shown in zip(moving, (lines[: k + 1, -1], lines[k]), strict=True):
                line.set_data_3d(*shown.T)
                axes.draw_artist(line)
            pixels = np.asarray(figure.canvas.buffer_rgba())
            pictures.append(Image.fromarray(pixels[..., :3].copy()).quantize(COLOURS_IN_GIF))
        plt.close(figure)
        pictures[0].save(
            path, save_all=True, append_images=pictures[1:], duration=1000 // PER_SECOND, loop=0
        )

    return write
