"""Pictures of the Lynxmotion arm: frames, configurations, workspace and five motions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import lynxmotion_arm as arm
import numpy as np
from animated_arms import animation, boxed, drawn, frame, in_space, points
from panels import COLOURS, GREY, STYLES, curves, legend_below, panels, plane, solid
from report import Figures

import chasles
from chasles.study.motion import Trajectory

JOINTS = ("q1", "q2", "q3", "q4")
NAMES = ("1, 2", "3", "4", "5")
"""Labels of the frames at each drawn origin. Frames 1 and 2 have the same origin."""
VIEW = (22.0, -60.0)


def figures() -> Figures:
    """Return pictures for figures 1.1 to 1.11 of the report, keyed by caption.

    Our copy of the report does not contain the original figures.
    """
    horizontal = arm.solutions(arm.arm(), arm.VIA[:1])[0, 0]
    found: Figures = {
        "figure 1.1 drawn: the arm at point 1": chasles.draw(arm.arm(), horizontal),
        "figure 1.1: frames of the links, modified DH": frames(),
        "figure 1.2: the configurations of table 1.2": configurations(),
        "figure 1.3: cells that the tool reaches within the limits of table 1.3": workspace(),
        "figure 1.4: inverse at point 1, in the plane of the arm": triangle(),
        "figure 1.5: arm at the via points, elbow up (lines) and down (pale)": via_points(),
        "figure 1.7: speed of the tool on the straight lines": speeds(),
    }
    for number, name, made in (
        ("1.6", "free motion on two parabolas", arm.free()),
        ("1.8", "straight lines", arm.lines()),
        ("1.10", "detour around the sphere", arm.around()),
        ("1.11", "quintic joint polynomials", arm.polynomials()),
    ):
        extra = around_ball if number == "1.10" else marks
        found[f"figure {number}: {name}"] = path(made, extra)
        found[f"figure {number} animated: {name}"] = animation(arm.low(), made.q, 2.9, extra, VIEW)
        other = "1.9" if number == "1.8" else f"{number} joints"
        found[f"figure {other}: joints and rates, {name}"] = joint_curves(made)
    return found


def frames() -> Any:
    """Draw the link frames of table 1.1 at one configuration of the arm."""
    figure, axes = solid(2.9)
    q = np.array([0.4, 1.0, -0.8, -0.6, 0.0])
    line, T = points(arm.arm(), q), arm.arm().link_poses(q)
    drawn(axes, line, GREY)
    frame(axes, T[0], 0.04)
    for pose, name in zip(T[1:], NAMES, strict=True):
        frame(axes, pose, 0.04)
        axes.text(*(pose[:3, 3] + np.array([0.02, 0.0, -0.03])), name, fontsize=7)
    boxed(axes, np.vstack([line, line[-1] + [0.04, 0.04, 0.04]]))
    axes.view_init(*VIEW)
    for name, colour in zip("xyz", (COLOURS[3], COLOURS[2], COLOURS[0]), strict=True):
        axes.plot([], [], [], color=colour, label=name)
    legend_below(figure, axes, 3)
    return figure


def configurations() -> Any:
    """Draw the arm in the configurations of table 1.2."""
    figure, axes = solid(3.1)
    lines = points(arm.arm(), arm.CONFIGURATIONS)
    for k, line in enumerate(lines):
        drawn(axes, line, COLOURS[k], linestyle=STYLES[k], label=f"configuration {k + 1}")
    boxed(axes, lines)
    axes.view_init(*VIEW)
    legend_below(figure, axes, 2)
    return figure


def workspace() -> Any:
    """Draw the workspace cells that the tool reaches, in 3D and seen along z and y."""
    found = arm.found_workspace()
    figure, axes = panels(5.0, 2, 2, height_ratios=[1.7, 1])
    for own in axes[0]:
        own.remove()
    center = found.grid.lower + (np.argwhere(found.hits) + 0.5) * found.grid.side
    cloud = in_space(figure, axes[0, 0].get_gridspec()[0, :])
    cloud.scatter(*center.T, c=center[:, 2], cmap="cividis", s=3, linewidths=0)
    boxed(cloud, center)
    cloud.view_init(*VIEW)
    lower, upper = found.grid.lower, found.grid.upper
    for own, (normal, across, up) in zip(axes[1], (("z", 0, 1), ("y", 0, 2)), strict=True):
        hits = np.ma.masked_equal(found.projection(normal), 0)
        extent = (lower[across], upper[across], lower[up], upper[up])
        shares = 1000 * hits.T / found.samples
        image = own.imshow(shares, origin="lower", extent=extent, cmap="cividis", vmax=10)
        plane(own, f"{'xyz'[across]} [m]", f"{'xyz'[up]} [m]")
        own.locator_params(nbins=3)
    bar = figure.colorbar(image, ax=axes[1], location="bottom", extend="max", shrink=0.7)
    bar.ax.tick_params(labelsize=7)
    bar.set_label("samples per 1000, in a column of cells", fontsize=7)
    return figure


def triangle() -> Any:
    """Draw both elbow configurations at point 1, and the angles of equations (1.11) to (1.13)."""
    figure, axes = panels(2.6)
    robot = arm.arm()
    q = arm.solutions(robot, arm.VIA[:1])[0]
    for k, (own, name) in enumerate(zip(q, ("elbow up", "elbow down"), strict=True)):
        line = points(robot, own)
        across = np.hypot(line[:, 0], line[:, 1])
        style = {"linestyle": STYLES[k], "marker": "o", "markersize": 4}
        axes.plot(across, line[:, 2], color=COLOURS[k], label=name, **style)
    shoulder, wrist = points(robot, q[0])[[1, 4]]
    reach = float(np.hypot(*wrist[:2]))
    axes.plot([0, reach], [shoulder[2], wrist[2]], ":", color=GREY)
    axes.annotate(r"$\alpha$", (0.045, 0.104), fontsize=9)
    axes.annotate(r"$\beta = 0$", (0.108, 0.103), fontsize=8)
    plane(axes, "distance from the base's axis [m]", "z [m]")
    legend_below(figure, axes, 2)
    return figure


def via_points() -> Any:
    """Draw the arm at the via points."""
    figure, axes = solid(3.2)
    q = arm.solutions(arm.low(), arm.VIA)
    lines = points(arm.low(), q)
    for line in lines[:, 1]:
        drawn(axes, line, "#bdbdbd", linewidth=1.0)
    for k, line in enumerate(lines[:, 0]):
        drawn(axes, line, COLOURS[k], linestyle=STYLES[k], label=f"point {k + 1}")
    boxed(axes, lines)
    axes.view_init(*VIEW)
    legend_below(figure, axes, 3)
    return figure


def marks(axes: Any) -> None:
    """Draw the via points with their numbers."""
    axes.scatter(*arm.VIA.T, color=COLOURS[5], s=9, depthshade=False, label="via points")
    for k, p in enumerate(arm.VIA):
        axes.text(*(p + np.array([0.004, -0.006, 0.008])), str(k + 1), fontsize=7)


def around_ball(axes: Any) -> None:
    """Draw the via points, the sphere obstacle and the via point above the sphere."""
    marks(axes)
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 19), np.linspace(0, np.pi, 10))
    ball = np.array([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)]) * arm.RADIUS
    axes.plot_surface(*(ball + arm.BALL[:, None, None]), color=COLOURS[1], alpha=0.6, linewidth=0)
    axes.scatter(*arm.DETOUR, color=COLOURS[4], s=12, depthshade=False, label="above")


def path(made: Trajectory, extra: Callable[[Any], None]) -> Any:
    """Draw the tool path with six configurations along it."""
    figure, axes = solid(3.0)
    chosen = np.linspace(0, len(made.q) - 1, 6).astype(int)
    lines = points(arm.low(), made.q)
    for k in chosen:
        first = k == chosen[0]
        drawn(axes, lines[k], COLOURS[0] if first else "#9ecae1", linewidth=1.8 if first else 1.0)
    axes.lines[0].set_label("start")
    axes.lines[1].set_label("on the way")
    axes.plot(*lines[:, -1].T, color=COLOURS[3], linewidth=1.4, label="path of the tool")
    extra(axes)
    boxed(axes, lines)
    axes.view_init(*VIEW)
    legend_below(figure, axes, 3 if extra is around_ball else 2)
    return figure


def speeds() -> Any:
    """Plot the tool speed over time."""
    figure, axes = panels(1.9)
    made = arm.lines()
    speed = np.linalg.norm(made.V[:, :3], axis=1)
    curves(axes, made.t, 1000 * speed[:, None], ["speed"], "speed [mm/s]")
    return figure


def joint_curves(made: Trajectory) -> Any:
    """Plot joint angles and their rates over time."""
    figure, axes = panels(3.4, 2, 1, sharex=True)
    curves(axes[0], made.t, np.degrees(made.q[:, :4]), JOINTS, "angle [deg]")
    curves(axes[1], made.t, np.degrees(made.qd[:, :4]), JOINTS, "rate [deg/s]")
    axes[0].set_xlabel("")
    legend_below(figure, axes[0], 4)
    return figure
