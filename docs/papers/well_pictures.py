"""Draws figures 6 to 10 of the paper, and the well manipulator at the end of each stage."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from panels import COLOURS, GREY, PALE, curves, legend_below, panels, plane

import chasles

if TYPE_CHECKING:
    from well_process import Process

FloatArray = NDArray[np.float64]

STAGES = (0, 5, 10, 15, 25, 27, 37, 39, 49)
"""Start and end times of the stages in section 5 [s]."""
SHOWN = (0, 25, 37, 49)
"""Times at which the arm is drawn [s]."""
FRAMES = 50
PER_SECOND = 10
DOTS_PER_INCH = 220
TURNING = [0, 1, 2, 4, 6]
CYLINDERS = [1, 2, 4, 6]
JOINTS = ("θ1", "θ2", "θ3", "θ5", "θ7")
SWINGS = ("θ8", "θ9", "θ10", "θ11")
PISTONS = ("cylinder 1", "cylinder 2", "cylinder 3", "cylinder 4")


def drawn(process: Process) -> dict[str, Any]:
    """Return all pictures of the paper, keyed by caption."""
    sampled = process.sampled
    q, qd = sampled.q[:, CYLINDERS], sampled.qd[:, CYLINDERS]
    angles, rates = process.theta[:, TURNING], process.rates[:, TURNING]
    swings = np.degrees(process.swings)
    return {
        "Configurations: the arm after 0, 25, 37 and 49 s, with pale cylinders": configurations(
            process
        ),
        "Process: the arm over 49 s, with orange cylinders": working(process),
        "Figure 6: joint angles over 49 s": over_time(
            process, np.degrees(angles), JOINTS, "joint angle [deg]"
        ),
        "Figure 7: rates of the joints over 49 s": over_time(
            process, np.degrees(rates), JOINTS, "rate [deg/s]"
        ),
        "Figure 8: angles of the cylinders over 49 s": over_time(
            process, swings, SWINGS, "angle of cylinder [deg]"
        ),
        "Figure 9: lengths of the cylinders over 49 s": over_time(
            process, 1e3 * q, PISTONS, "length [mm]"
        ),
        "Figure 10: speeds of the cylinders over 49 s": over_time(
            process, 1e3 * qd, PISTONS, "speed [mm/s]"
        ),
    }


def over_time(process: Process, values: FloatArray, names: tuple[str, ...], label: str) -> Any:
    """Plot curves over time. Pale stripes and numbers mark the eight stages of the process."""
    figure, axes = panels(2.5)
    curves(axes, process.sampled.t, values, names, label)
    for stage, (begin, end) in enumerate(pairwise(STAGES), 1):
        if stage % 2 == 0:
            axes.axvspan(begin, end, color=PALE, zorder=0)
        axes.annotate(
            str(stage),
            ((begin + end) / 2, 1.01),
            xycoords=("data", "axes fraction"),
            ha="center",
            fontsize=6.5,
            color=GREY,
        )
    axes.set_title("stage", loc="left", fontsize=6.5, color=GREY, x=-0.14, pad=2)
    legend_below(figure, axes, 5 if len(names) > len(SWINGS) else 4 if names is SWINGS else 2)
    return figure


def configurations(process: Process) -> Any:
    """Draw the arm and its cylinders from the side at four times, and the vertical line of R."""
    figure, axes = panels(3.6)
    for k, time in enumerate(SHOWN):
        arms, cylinders = side(process.sampled.q[process.at(time)])
        axes.plot(*arms.T, "-o", color=COLOURS[k], markersize=2.5, label=f"{time} s")
        for ends in cylinders:
            axes.plot(*ends.T, color=COLOURS[k], linewidth=2.4, alpha=0.35)
    axes.axvline(process.sampled.T[process.at(25), 0, 3], color=GREY, linewidth=0.8, linestyle=":")
    axes.annotate("line of R", (1.65, 3.3), color=GREY, fontsize=7)
    axes.set_xlim(-0.5, 2.9)
    plane(axes, "x [m]", "z [m]")
    axes.legend(loc="center left", bbox_to_anchor=(1.02, 0.5), frameon=False, fontsize=7)
    return figure


def working(process: Process) -> Callable[[Path], None]:
    """Return a function that writes a GIF of the process, with the arm drawn in its own plane."""

    def write(path: Path) -> None:
        import matplotlib.pyplot as plt  # noqa: PLC0415
        from matplotlib.animation import FuncAnimation, PillowWriter  # noqa: PLC0415

        figure, axes = panels(3.6, dpi=DOTS_PER_INCH)
        axes.axvline(process.sampled.T[-1, 0, 3], color=GREY, linewidth=0.8, linestyle=":")
        plane(axes, "in the plane of the arm [m]", "z [m]")
        axes.set(xlim=(-0.5, 2.9), ylim=(-3.5, 4.1))
        (arm,) = axes.plot([], [], "-o", color=COLOURS[0], markersize=2.5)
        pistons = [axes.plot([], [], color=COLOURS[1], linewidth=2.4)[0] for _ in CYLINDERS]
        clock = axes.text(0.04, 0.03, "", transform=axes.transAxes, fontsize=7)

        def frame(k: int) -> list[Any]:
            q = process.sampled.q[k].copy()
            turned, q[0] = np.degrees(q[0]), 0.0
            points, cylinders = side(q)
            arm.set_data(*points.T)
            for piston, ends in zip(pistons, cylinders, strict=True):
                piston.set_data(*ends.T)
            clock.set_text(f"{process.sampled.t[k]:.0f} s\nwaist {turned:.0f}°")
            return [arm, *pistons, clock]

        frames = np.linspace(0, len(process.sampled.t) - 1, FRAMES).astype(int)
        moving = FuncAnimation(figure, frame, frames=frames, blit=False)
        moving.save(path, writer=PillowWriter(fps=PER_SECOND))
        plt.close(figure)

    return write


def side(q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return positions of arm joints (8, 2) and cylinder ends (4, 2, 2) in the x-z plane [m]."""
    well = chasles.load("well_manipulator")
    value = {name: parameter.value for name, parameter in well.parameters.items()}
    T = dict(zip(well.link_names, well.link_poses(q), strict=True))

    def pin(link: str, x: float, y: float = 0.0, z: float = 0.0) -> FloatArray:
        return np.asarray((T[link] @ (x, y, z, 1))[[0, 2]])

    def named(link: str, name: str) -> FloatArray:
        return pin(link, value[f"{name}_x"], value[f"{name}_y"])

    arms = [pin(link, 0) for link in well.link_names]
    ends = [
        ("arm_2", "E", "arm_3", "F"),
        ("arm_4", "J", "arm_5", "K"),
        ("arm_6", "P", "arm_7", "Q"),
    ]
    first = [pin("arm_1", value["B_x"], 0, value["B_z"]), named("arm_2", "C")]
    others = [[named(a, name_a), named(b, name_b)] for a, name_a, b, name_b in ends]
    return np.array([*arms, named("arm_7", "R")]), np.array([first, *others])
