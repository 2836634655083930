"""Pictures of the photographic robot: its frames, and each axis moved from zero."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from animated_arms import animation, boxed, drawn, frame, points
from panels import COLOURS, GREY, legend_below, solid

from chasles.study.motion import Trajectory

VIEW = (18.0, -52.0)
PICTURES = 128
"""Number of pictures in the animation, 16 for each axis."""
EVERY = 8
"""Number of motion samples between two pictures of the animation."""
LENGTH = 0.18
"""Length of the axes of a drawn frame [m]."""
START = 1.7
"""Axis length of the drawn start frame relative to the length of other frames."""


def frames(robot: Any) -> Any:
    """Draw the link frames at zero joint values, with x, y and z axes in three colors."""
    figure, axes = solid(2.7)
    T, line = robot.link_poses(np.zeros(8)), points(robot, np.zeros(8))
    drawn(axes, line, GREY)
    for pose in (np.eye(4), *T):
        frame(axes, pose, LENGTH)
    names = {0: "w, 0", 1: "1", 2: "2", 3: "3", 4: "4, 5", 6: "6, 7, ee"}
    origins = T[:, :3, 3]
    for k, name in names.items():
        axes.text(*(origins[k] + np.array([0.05, -0.12, 0.07])), name, fontsize=7)
    boxed(axes, np.vstack([line, line + LENGTH]))
    axes.view_init(*VIEW)
    axes.xaxis.labelpad = 0
    for name, colour in zip("xyz", (COLOURS[3], COLOURS[2], COLOURS[0]), strict=True):
        axes.plot([], [], [], color=colour, label=name)
    legend_below(figure, axes, 3)
    return figure


def axis_moved(robot: Any, made: Trajectory) -> Any:
    """Draw the arm at zero joint values and at the end of a motion, and the path of the tool."""
    figure, axes = solid(2.7)
    lines = points(robot, made.q)
    drawn(axes, lines[0], COLOURS[2], linestyle=":", linewidth=2.6, label="zero")
    drawn(axes, lines[-1], COLOURS[0], label="end state")
    axes.plot(*lines[:, -1].T, "--", color=COLOURS[3], linewidth=1.4, label="path of the tool")
    # If the tool only rotates, its start and end frames have the same origin. The start frame is
    # longer and dotted, so that it stays visible.
    frame(axes, robot.fk(made.q[0]), START * LENGTH, linestyle=":", linewidth=1.6)
    frame(axes, robot.fk(made.q[-1]), LENGTH)
    boxed(axes, np.vstack([lines.reshape(-1, 3), lines[0] + START * LENGTH]))
    axes.view_init(*VIEW)
    axes.xaxis.labelpad = 0
    legend_below(figure, axes, 3)
    return figure


def all_axes(robot: Any, motions: Sequence[Trajectory]) -> Any:
    """Animate the motion of each joint from zero to its end value and back."""
    ways = [np.concatenate([made.q[::EVERY], made.q[::-EVERY]]) for made in motions]
    return animation(robot, np.concatenate(ways), 3.0, lambda _: None, VIEW, PICTURES)
