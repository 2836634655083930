"""Pictures of the bricklaying gantry: figures 1 and 3 to 8, and the wall."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from panels import COLOURS, GREY, PALE, curves, edges, legend_below, panels, plane, solid

import chasles

if TYPE_CHECKING:
    from bricklaying_gantry import Spot, Triangle
    from bricklaying_wall import Wall

FloatArray = NDArray[np.float64]

INCH = 0.0254
FRAME = (0.45, 0.55, 0.3)
"""Width, length and height of the frame [m]."""
CONFIGURATION = (0.28, 0.33, 0.1)
"""Guide position (x, y, z) of the gantry in figure 1 [m]."""
STAGES = 8
"""Number of motion stages for each brick: grip, three lines to lay the brick, release and three
return lines."""


def drawn(spots: dict[int, Sequence[Spot]], found: Triangle, built: Wall) -> dict[str, Any]:
    """Return all pictures of the paper, keyed by caption."""
    return {
        "Figure 1: frame, platforms and guide of the gantry, from its link poses": gantry(),
        "Figure 3: drop spots of both set-ups in polar coordinates": drop_spots(spots),
        "Figure 4: the target (11, 8)": target(),
        "Figure 5: the length of the chain to the target": chain_length(found),
        "Figure 6: circles of shoulder, elbow and wrist": perimeters(found),
        "Figure 7: the triangle of shoulder, elbow and wrist": angles(found),
        "Figure 8: the chain at the target, elbow above and below the line": both_elbows(found),
        "Wall: three courses laid by the gantry, and the path of its guide": wall_of_bricks(built),
        "Rates: motors of the gantry while it lays the first brick": motor_rates(built),
    }


def box(axes: Any, lower: Any, upper: Any, **style: Any) -> None:
    """Draw the edges of an axis-aligned box, or its faces if a face color is given."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # noqa: PLC0415

    corner = np.array([lower, upper], dtype=float)
    faces = []
    for axis in range(3):
        others = [k for k in range(3) if k != axis]
        for side in (0, 1):
            face = np.zeros((4, 3))
            face[:, axis] = corner[side, axis]
            for point, picks in zip(face, ((0, 0), (0, 1), (1, 1), (1, 0)), strict=True):
                point[others] = [corner[pick, k] for pick, k in zip(picks, others, strict=True)]
            faces.append(face)
    axes.add_collection3d(Poly3DCollection(faces, **style))


def gantry() -> Any:
    """Draw the gantry: its frame, and the platforms and the guide at their link poses."""
    robot = chasles.load("bricklaying_gantry")
    at = dict(zip("xyz", CONFIGURATION, strict=True))
    q = robot.actuators([at[joint.name] for joint in robot.chain_joints])
    y_platform, x_platform, guide = robot.link_poses(q)[:, :3, 3]
    width, length, height = FRAME
    figure, axes = solid(3.0)
    edges(axes, (0, 0, -height), (width, length, 0), color=GREY, linewidth=0.8)
    rail = {"edgecolor": "#303030", "linewidth": 0.4, "alpha": 0.85}
    x, y = x_platform[0], y_platform[1]
    parts = [
        ((0, y - 0.06, 0), (width, y - 0.04, 0.02), 0),
        ((0, y + 0.04, 0), (width, y + 0.06, 0.02), 0),
        ((x - 0.04, y - 0.07, 0.02), (x + 0.04, y + 0.07, 0.04), 1),
        (guide - [0.012, 0.012, 0.2], np.add(guide, (0.012, 0.012, 0.04)), 2),
    ]
    for low, high, k in parts:
        box(axes, low, high, facecolor=COLOURS[k], **rail)
    axes.plot([], [], color=GREY, label="frame")
    for k, name in enumerate(("y platform", "x platform", "guide, moves along z")):
        axes.plot([], [], "s", color=COLOURS[k], label=name)
    axes.set(xlim=(0, 0.5), ylim=(0, 0.55), zlim=(-0.3, 0.2))
    axes.set(xticks=(0, 0.2, 0.4), yticks=(0, 0.2, 0.4), zticks=(-0.2, 0, 0.2))
    axes.set_box_aspect((0.5, 0.55, 0.5))
    axes.view_init(22, -58)
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    legend_below(figure, axes, 2)
    return figure


def inches(height: float, width: float, up: float, **given: Any) -> tuple[Any, Any]:
    """Return a figure of planar plots in inches, and the axes of the plots."""
    figure, axes = panels(height, **given)
    for own in np.atleast_1d(axes).ravel():
        plane(own, "x [inch]", "y [inch]")
        own.set(xlim=(-0.6, width), ylim=(-1.1, up))
    return figure, axes


def drop_spots(spots: dict[int, Sequence[Spot]]) -> Any:
    """Draw the two set-ups of the gantry, with a line from the origin to each drop spot."""
    figure, both = inches(2.2, 6.4, 6.9, columns=2, sharey=True)
    for (setup, own), axes in zip(spots.items(), both, strict=True):
        for spot in own:
            x, y = spot.xy / INCH
            axes.plot([0, x], [0, y], color=COLOURS[0], linewidth=0.8)
            axes.plot(x, y, "o", color=COLOURS[3], markersize=3)
        for k in (0, -1):
            x, y = own[k].xy / INCH
            words = f"θ {np.degrees(own[k].theta):.1f}°\nr {own[k].r / INCH:.2f}"
            axes.annotate(words, (x, y), (x - 1.2, y + 0.25), fontsize=6)
        axes.set_title(f"set-up {setup}", fontsize=8)
    both[1].set_ylabel("")
    return figure


def target() -> Any:
    """Draw figure 4: the pick-up spot at the origin, and the target."""
    figure, axes = inches(2.2, 14, 9.5)
    goal(axes)
    return figure


def goal(axes: Any) -> None:
    """Draw the pick-up spot and the target."""
    axes.plot(0, 0, "s", color="#000000", markersize=4, clip_on=False)
    axes.plot(11, 8, "*", color=COLOURS[3], markersize=8)
    axes.annotate("target (11, 8)", (11, 8), (9.6, 8.7), fontsize=7)
    axes.annotate("pick-up", (0, 0), (0.4, -0.85), fontsize=7)


def line_to(axes: Any, found: Triangle) -> None:
    """Draw the line from the origin to the target."""
    axes.plot([0, 11], [0, 8], color=GREY, linewidth=0.8, linestyle="--")
    axes.annotate(f"P = {np.degrees(found.line):.2f}°", (2.6, 0.55), fontsize=7, color="#404040")
    angle = np.linspace(0, found.line, 40)
    axes.plot(2.2 * np.cos(angle), 2.2 * np.sin(angle), color=GREY, linewidth=0.8)


def chain_length(found: Triangle) -> Any:
    """Draw figure 5: the line from the origin to the target, and its length."""
    figure, axes = inches(2.2, 14, 9.5)
    line_to(axes, found)
    goal(axes)
    axes.plot([11, 11], [0, 8], color=GREY, linewidth=0.8)
    length = float(np.hypot(11, 8))
    axes.annotate(f"{length:.2f} inch", (4.9, 4.1), rotation=36, rotation_mode="anchor", fontsize=7)
    return figure


def perimeters(found: Triangle) -> Any:
    """Draw figure 6: circles around the origin, the wrist center and the target."""
    from matplotlib.patches import Circle  # noqa: PLC0415

    figure, axes = inches(2.9, 17, 13.9)
    wrist = found.wrist / INCH
    circles = (
        ("shoulder, 7 inch", (0, 0), 7),
        ("elbow, 5 inch", wrist, 5),
        ("wrist, 5 inch", (11, 8), 5),
    )
    for k, (name, center, radius) in enumerate(circles):
        style = ("-", "--", "-.")[k]
        axes.add_patch(Circle(center, radius, fill=False, color=COLOURS[k], linestyle=style))
        axes.plot([], [], style, color=COLOURS[k], label=name)
    axes.plot([0, 11], [0, 8], color=GREY, linewidth=0.8, linestyle="--")
    axes.plot(*wrist, "o", color=COLOURS[3], markersize=4)
    words = "({:.2f}, {:.2f})".format(*wrist)
    pointer = {"arrowstyle": "-", "linewidth": 0.6}
    axes.annotate(words, wrist, (12.0, 0.9), fontsize=7, arrowprops=pointer)
    axes.plot(11, 8, "*", color=COLOURS[3], markersize=8)
    legend_below(figure, axes, 2)
    return figure


def arm(axes: Any, q: FloatArray, colour: str, style: str, name: str) -> FloatArray:
    """Draw the planar arm, and return the positions of shoulder, elbow, wrist and tip [inch]."""
    poses = chasles.load("bricklaying_planar").link_poses(q)
    points = np.vstack([[0, 0], poses[:, :2, 3] / INCH])
    axes.plot(*points.T, style, color=colour, marker="o", markersize=3.5, label=name)
    return points


def angles(found: Triangle) -> Any:
    """Draw figure 7: sides and angles of the triangle of shoulder, elbow and wrist."""
    figure, axes = inches(2.6, 14, 10.5)
    line_to(axes, found)
    points = arm(axes, found.q[0], COLOURS[0], "-", "")
    shoulder, elbow, wrist = np.degrees(found.q[0])
    for words, place in (
        (f"A {shoulder - np.degrees(found.line):.2f}°", (1.35, 3.0)),
        (f"B {180 + elbow:.2f}°", points[1] + [-1.2, 0.7]),
        (f"C {-wrist if wrist < 0 else wrist:.2f}°", points[2] + [-0.6, -1.3]),
        ("7", (0.4, 3.8)),
        ("5", (4.9, 6.2)),
        ("5", (8.8, 6.9)),
    ):
        axes.annotate(words, place, fontsize=7)
    axes.plot(11, 8, "*", color=COLOURS[3], markersize=8)
    return figure


def both_elbows(found: Triangle) -> Any:
    """Draw figure 8: both elbow solutions of the planar arm with their joint angles."""
    figure, axes = inches(2.9, 14, 10.5)
    for k, (q, side) in enumerate(zip(found.q, ("above", "below"), strict=True)):
        words = ", ".join(f"{value:.2f}°" for value in np.degrees(q))
        arm(axes, q, COLOURS[k], ("-", "--")[k], f"elbow {side}: {words}")
    goal(axes)
    legend_below(figure, axes, 1)
    return figure


def wall_of_bricks(built: Wall) -> Any:
    """Draw the brick wall, the pick-up spot and the path of the gantry's guide."""
    from bricklaying_wall import BRICK  # noqa: PLC0415

    figure, axes = solid(2.9)
    half = np.array([BRICK[0], BRICK[1], 0]) / 2
    # The path and the bricks are drawn from back to front, because matplotlib cannot sort them by
    # depth.
    axes.computed_zorder = False
    way = built.sampled.T[:, :3, 3]
    axes.plot(*way.T, color=COLOURS[0], linewidth=0.6, zorder=0, label="path of the guide")
    style = {"facecolor": "#c8783c", "edgecolor": "#303030", "linewidth": 0.4}
    behind_first = sorted(built.places, key=lambda own: (own[2], own[0]))
    for k, place in enumerate(behind_first, 1):
        box(axes, place - half - (0, 0, BRICK[2]), place + half, zorder=k, **style)
    axes.plot(*way[0], "s", color="#000000", markersize=4, label="pick-up spot")
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    axes.set(xlim=(0, 0.4), ylim=(0, 0.5), zlim=(0, 0.15))
    axes.set(xticks=(0, 0.2, 0.4), yticks=(0.2, 0.4), zticks=(0, 0.1))
    axes.set_box_aspect((0.4, 0.5, 0.2), zoom=0.88)
    axes.view_init(24, -52)
    axes.xaxis.labelpad = axes.yaxis.labelpad = 0
    legend_below(figure, axes, 2)
    return figure


def motor_rates(built: Wall) -> Any:
    """Plot the rates of the gantry's three motors for the first brick, including the return."""
    sampled = built.sampled
    first = sampled.stage < STAGES
    figure, axes = panels(2.2)
    names = ("motor x", "motor y", "motor z")
    curves(axes, sampled.t[first], sampled.qd[first], names, "rate [rad/s]")
    axes.axhline(0, color=PALE, zorder=0)
    legend_below(figure, axes, 3)
    return figure
