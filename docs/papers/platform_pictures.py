"""Draws the planar 3-RRR platform, its workspace and singularities, and roadmaps."""

from __future__ import annotations

from typing import Any

import numpy as np
import platform_3rrr as platform
import roadmaps
from animated_arms import boxed, drawn, points
from lynxmotion_pictures import VIEW
from panels import COLOURS, GREY, PALE, STYLES, legend_below, panels, plane, solid
from report import Figures

import chasles
from chasles.study import singularity_curves
from chasles.study.planning import Plan, prm

ANGLES = {"2.6": 15, "2.7": 30, "2.7, second": 45, "2.7, third": 60}
RNG = 35
"""Seed of the random numbers in figures 3.2 to 3.4. With this seed, a roadmap with 100 points and
step 10 contains no path, as in the report."""
MM = 1000.0


def figures() -> Figures:
    """Return figures 2.1 to 3.4 of the report, keyed by caption."""
    robot = platform.platform()
    found: Figures = {
        "figure 2.1 drawn: the platform in the pose of figure 2.3": chasles.draw(
            robot, robot.ik_planar(platform.POSE).q[0]
        ),
        "figure 2.1: the platform and its dimensions": model(),
        "figure 2.2: steps to the crank angles": flow_chart(),
    }
    for number, pose in platform.POSES.items():
        x, y, phi = MM * pose[0], MM * pose[1], np.degrees(pose[2])
        caption = f"figure {number}: pose ({x:.0f} mm, {y:.0f} mm, {phi:.0f} deg), both elbows"
        found[caption] = configuration(pose)
    for number, angle in ANGLES.items():
        found[f"figure {number}: workspace at {angle} deg, L = 130 and 170 mm"] = workspace(angle)
    found["assembly modes: both poses with the cranks of figure 2.3"] = modes()
    found["singularities: types 1 and 2 at 0 deg, first branches, and a position of both"] = (
        singular()
    )
    found["figure 3.1: our map; start and goal"] = the_map()
    for number, (samples, step) in roadmaps.CASES.items():
        caption = f"figure {number}: {samples} points, step {step} as largest and smallest distance"
        found[caption] = roads(samples, step)
    found["roadmap success: success rate, step as largest distance, 95 % intervals"] = success()
    found["roadmap arm: path from point 1 to 5 around a sphere, above a table"] = arm()
    return found


def leg_lines(pose: Any, q: Any) -> Any:
    """Return positions (3, 3, 2) of base joint, elbow and platform joint of each leg [mm]."""
    b, p = platform.base_and_platform()
    c, s = np.cos(pose[2]), np.sin(pose[2])
    ends = np.asarray(pose[:2]) + p @ np.array([[c, s], [-s, c]])
    crank = platform.platform().parameters["S_A"].value
    elbows = b + crank * np.column_stack([np.cos(q), np.sin(q)])
    return MM * np.stack([b, elbows, ends], axis=1)


def posed(axes: Any, pose: Any, q: Any, colour: str, **style: Any) -> None:
    """Draw the platform and its legs."""
    lines, label = leg_lines(pose, q), style.pop("label", None)
    given = {"marker": "o", "markersize": 3, "linewidth": 1.6} | style
    for k, line in enumerate(lines):
        axes.plot(*line.T, color=colour, label=None if k else label, **given)
    axes.fill(*lines[:, 2].T, facecolor=colour, edgecolor=colour, alpha=0.25)


def base(axes: Any) -> None:
    """Draw the base joints and their triangle."""
    b = MM * platform.base_and_platform()[0]
    axes.fill(*b.T, facecolor="none", edgecolor=GREY, linestyle=":", linewidth=0.8)
    axes.plot(*b.T, "s", color=COLOURS[5], markersize=4)
    plane(axes, "x [mm]", "y [mm]")


def model() -> Any:
    """Draw the platform at the center with the dimensions of table 2.1."""
    figure, axes = panels(3.1)
    pose = np.zeros(3)
    q = platform.platform().ik_planar(pose).q[0]
    posed(axes, pose, q, COLOURS[0])
    base(axes)
    lines = leg_lines(pose, q)
    for k, line in enumerate(lines):
        axes.annotate(f"$PB_{platform.ORDER.index(k) + 1}$", line[0] + SHIFTS[k], fontsize=8)
    for name, ends, shift in (("$S_A$", lines[1, :2], (-8, -26)), ("$L$", lines[1, 1:], (10, -4))):
        axes.annotate(name, ends.mean(0) + np.array(shift), fontsize=8)
    for joint, name, place in (
        (lines[0, 0], "$r_{base}$", (-165, -118)),
        (lines[1, 2], "$r_{platform}$", (22, -8)),
    ):
        axes.annotate("", joint, (0, 0), arrowprops={"arrowstyle": "<->", "color": COLOURS[3]})
        axes.annotate(name, place, fontsize=8, color=COLOURS[3])
    axes.margins(0.12)
    return figure


SHIFTS = (np.array([-10, -38]), np.array([-10, -38]), np.array([14, 4]))
"""Offset of the label of each base joint [mm]."""


def flow_chart() -> Any:
    """Draw a flow chart of the steps from a platform pose to the crank angles."""
    figure, axes = panels(3.3)
    steps = (
        "pose $x, y, a$; table 2.1",
        "base and platform joints\n(B.1.1)-(B.1.4), table 2.2",
        "$e_1, e_2, e_3$ of each leg\n(B.1.8)-(B.2.0), corrected",
        "$e_1^2 + e_2^2 \\geq e_3^2$ in all legs?",
        "$\\theta_i = 2\\,$atan$\\,t_{1,2}$ (B.2.6):\neight solutions",
    )
    style = {"boxstyle": "round,pad=0.35", "facecolor": PALE, "edgecolor": COLOURS[0]}
    for k, words in enumerate(steps):
        axes.text(0.4, 1 - 0.235 * k, words, ha="center", va="center", bbox=style, fontsize=7.5)
        if k:
            ends = {"xytext": (0.4, 1.075 - 0.235 * k + 0.07), "xy": (0.4, 1.075 - 0.235 * k)}
            axes.annotate("", **ends, arrowprops={"arrowstyle": "->", "color": COLOURS[5]})
    axes.text(
        0.93, 1 - 0.235 * 3, "out of\nreach", ha="center", va="center", bbox=style, fontsize=7.5
    )
    arrow = {"arrowstyle": "->", "color": COLOURS[5]}
    axes.annotate("", xy=(0.82, 0.295), xytext=(0.71, 0.295), arrowprops=arrow)
    axes.text(0.765, 0.32, "no", ha="center", fontsize=7)
    axes.text(0.43, 0.16, "yes", fontsize=7)
    axes.set(xlim=(0, 1.05), ylim=(-0.05, 1.07))
    axes.axis("off")
    return figure


def configuration(pose: Any) -> Any:
    """Draw the platform at a pose with the first solution of each leg, and the other in gray."""
    figure, axes = panels(3.2)
    q = platform.platform().ik_planar(pose).q[[0, -1]]
    posed(axes, pose, q[1], "#9a9a9a", linestyle="--", label="other solution")
    posed(axes, pose, q[0], COLOURS[0], label="first solution")
    base(axes)
    legend_below(figure, axes, 2)
    return figure


def workspace(angle: int) -> Any:
    """Draw the workspace boundaries of the platform with lower links of 130 and 170 mm."""
    figure, axes = panels(3.0)
    for k, length in enumerate((130, 170)):
        found = platform.region(angle, length)
        label = f"L = {length} mm: {found.area * MM**2:.0f} mm²"
        for i, arc in enumerate(found.arcs):
            style = {"color": COLOURS[k], "linestyle": STYLES[k], "linewidth": 1.6}
            axes.plot(*(MM * arc.points()).T, label=None if i else label, **style)
    plane(axes, "x [mm]", "y [mm]")
    legend_below(figure, axes, 1)
    return figure


def modes() -> Any:
    """Draw both assembly modes of the platform with the same crank angles."""
    figure, axes = panels(3.2)
    q = platform.platform().ik_planar(platform.POSE).q[0]
    x, valid = platform.platform().fk_planar_all(q)
    for k, pose in enumerate(x[valid]):
        angle = np.degrees(pose[2])
        posed(axes, pose, q, COLOURS[k], linestyle=STYLES[k], label=f"turned by {angle:.2f} deg")
    base(axes)
    legend_below(figure, axes, 2)
    return figure


def singular() -> Any:
    """Draw the singular tool positions at an orientation of 0 deg."""
    figure, axes = panels(3.3)
    bounds = (-0.2, 0.2)
    found = singularity_curves(platform.platform(), 0.0, x=bounds, y=bounds, resolution=161)
    for lines, k, name in ((found.type_1, 0, "type 1"), (found.type_2, 3, "type 2")):
        for i, line in enumerate(lines):
            style = {"color": COLOURS[k], "linestyle": STYLES[k % 2], "linewidth": 1.4}
            axes.plot(*(MM * line).T, label=None if i else name, **style)
    axes.plot(*(MM * platform.third_kind()[:2]), "D", color=COLOURS[5], label="type 3")
    plane(axes, "x [mm]", "y [mm]")
    legend_below(figure, axes, 3)
    return figure


def the_map() -> Any:
    """Draw the map that replaces figure 3.1, with start and goal."""
    figure, axes = panels(3.0)
    on_map(axes)
    legend_below(figure, axes, 2)
    return figure


def on_map(axes: Any) -> None:
    """Draw the occupied cells of the map, the start and the goal."""
    side = roadmaps.SIDE
    occupied = roadmaps.workshop().occupied.T
    axes.imshow(~occupied, origin="lower", extent=(0, side, 0, side), cmap="gray", vmin=-0.4)
    axes.plot(*roadmaps.START, "o", color=COLOURS[2], label="start", markersize=5)
    axes.plot(*roadmaps.GOAL, "D", color=COLOURS[1], label="goal", markersize=5)
    axes.set_xlabel("x [cells]")
    axes.set_ylabel("y [cells]")


def roads(samples: int, step: float) -> Any:
    """Draw a roadmap with its path for each of the two interpretations of the paper's step."""
    figure, axes = panels(5.6, 2, 1)
    for own, given, reading in (
        (axes[0], {"max_step": step}, "largest distance"),
        (axes[1], {"dispersion": step}, "smallest distance"),
    ):
        made = prm(roadmaps.workshop(), samples, rng=RNG, **given)
        plan: Plan = made.plan(roadmaps.START, roadmaps.GOAL, algorithm="dijkstra")
        on_map(own)
        for edge in made.q[made.edges]:
            if made.space.is_free_segment(*edge):
                own.plot(*edge.T, color="#9ecae1", linewidth=0.5, zorder=1)
        own.plot(*made.q.T, ".", color=COLOURS[0], markersize=2.5, label="points")
        own.plot(*plan.q.T, color=COLOURS[3], linewidth=1.8, label="path")
        words = f"path of {plan.length:.0f} cells" if plan.found else "no path"
        own.set_title(f"step as {reading}: {len(made.q)} points, {words}", fontsize=7.5)
    legend_below(figure, axes[0], 4)
    return figure


def success() -> Any:
    """Plot the success rate of path planning over the number of points, for both step sizes."""
    figure, axes = panels(2.5)
    roadmaps.trials().plot(axes)
    axes.set_xscale("log")
    axes.set_xticks(roadmaps.COUNTS, map(str, roadmaps.COUNTS))
    axes.set_xticks([], minor=True)
    axes.set_xlabel("points")
    axes.legend(fontsize=7, loc="upper left")
    return figure


def arm() -> Any:
    """Draw the Lynxmotion arm along its planned path around the sphere."""
    figure, axes = solid(3.2)
    space, plan = roadmaps.arm_plan()
    lines = points(space.robot, plan.at(np.linspace(0, 1, 40)))
    for k in (0, 10, 20, 30, 39):
        ends = k in (0, 39)
        drawn(axes, lines[k], COLOURS[0] if ends else "#9ecae1", linewidth=1.8 if ends else 1.0)
    axes.lines[0].set_label("start and goal")
    axes.lines[1].set_label("on the way")
    axes.plot(*lines[:, -1].T, color=COLOURS[3], label="path of the tool")
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 19), np.linspace(0, np.pi, 10))
    ball = np.array([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)])
    center = np.array(roadmaps.BALL)
    surface = roadmaps.BALL_RADIUS * ball + center[:, None, None]
    axes.plot_surface(*surface, color=COLOURS[1], alpha=0.6, linewidth=0)
    boxed(axes, lines)
    axes.view_init(*VIEW)
    legend_below(figure, axes, 2)
    return figure
