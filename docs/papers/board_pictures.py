"""Pictures of the board installer: figures 2, 3 and 5, equation (27), and length errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from panels import COLOURS, GREY, PALE, edges, legend_below, panels, plane, solid

import chasles

if TYPE_CHECKING:
    from board_installer import Errors

FloatArray = NDArray[np.float64]

MOVED = np.array([0.5, -0.06, 0.3, -0.9, 0.03, 0.0])
"""Joint values in figure 2: waist, slider, crank, yaw, push rod and roll [rad or m]."""
EQUATION = (
    r"$x = \rho\,\cos q_1 + (e_4 + t\cos\theta_7)\,\cos(q_1 + q_4)$",
    r"$y = \rho\,\sin q_1 + (e_4 + t\cos\theta_7)\,\sin(q_1 + q_4)$",
    r"$z = z_G + L_1 - h_4 + k\,r\,\sin q_3 + t\,\sin\theta_7$",
    r"$R = R_z(q_1 + q_4)\;R_y(-\theta_7)\;R_x(q_6)$",
    "",
    r"$\rho = g_0 + L_2 + a_w + k\,r\,(\cos q_3 - 1) - (k - 1)\,q_2$",
    r"$\cos(\gamma_0 + \theta_7) = (a^2 + b^2 - (l_0 + q_5)^2)\,/\,(2\,a\,b)$",
)
SHORT = {
    "rod_KH_length": "rod KH",
    "rod_FH_length": "rod FH",
    "greater_rod_length": "greater rod",
    "smaller_rod_length": "smaller rod",
    "push_rod_length": "push rod",
    "rod_KH_b_x": "crank at KH",
    "rod_FH_b_x": "crank at FH",
}


def drawn(found: Any, box: FloatArray, errors: Sequence[Errors]) -> dict[str, Any]:
    """Return all pictures of the paper, keyed by caption."""
    return {
        "Figure 2: the robot in its reference (pale) and in another configuration": in_space(),
        "Figure 3: structure and reference configuration, seen from the side": structure(),
        "Equation 27: the tool in active variables": equation(),
        "Figure 5a: cloud of tool positions, and the required box": cloud(found, box),
        "Figure 5b: cloud and required box seen from above": view(found, box, 2),
        "Figure 5c: cloud and required box seen from the side": view(found, box, 1),
        "Figure 5d: cloud and required box seen along x": view(found, box, 0),
        "Table 2: largest tool error if one length is 0.1 mm too long": bars(errors),
    }


@dataclass(frozen=True)
class Skeleton:
    """Positions (3,) of the robot's pins in the base frame [m], keyed by letter."""

    pins: dict[str, FloatArray]

    def line(self, letters: str | Sequence[str]) -> FloatArray:
        """Return the positions (m, 3) [m] of the pins that `letters` names, in the same order."""
        return np.array([self.pins[letter] for letter in letters])


def skeleton(q: FloatArray) -> Skeleton:
    """Compute pin positions: chain pins from link poses, crank and plate pins from lengths."""
    robot = chasles.load("board_installer")
    size = {name: parameter.value for name, parameter in robot.parameters.items()}
    T = dict(zip(robot.link_names, robot.link_poses(q), strict=True))
    k, p, a, gamma0 = size["k"], size["p"], size["a"], size["gamma0"]

    def at(link: str, x: float = 0.0, z: float = 0.0) -> FloatArray:
        return np.asarray((T[link] @ (x, 0, z, 1))[:3])

    ahead, up = T["slider"][:3, 0], T["slider"][:3, 2]
    crank = (size["g0"] + size["L2"] / k - size["r"], size["z_G"] + size["L1"] / k)
    E, W = at("smaller_arm"), at("swinging_bracket")
    pins = {
        "S": np.zeros(3),
        "P": at("rotating_frame", z=size["z_G"]),
        "G": at("greater_arm"),
        "E": E,
        "W": W,
        "K": at("greater_arm", z=size["L1"] / k),
        "F": at("smaller_arm", size["L2"] / k),
        "O": at("rotating_frame", *crank),
        "H": at(
            "rotating_frame",
            crank[0] + size["r"] * np.cos(q[2]),
            crank[1] + size["r"] * np.sin(q[2]),
        ),
        "G'": at("greater_arm") - p * ahead,
        "E'": E - p * ahead,
        'E"': E + p * up,
        'W"': W + p * up,
        "Y": at("four_axis_reducer"),
        "Y'": at("four_axis_reducer", z=-size["h4"]),
        "C": at("pitch_bracket"),
        "M": at(
            "four_axis_reducer", size["e4"] - a * np.cos(gamma0), a * np.sin(gamma0) - size["h4"]
        ),
        "N": at("pitch_bracket", -size["b"]),
        "T": robot.fk(q)[:3, 3],
    }
    return Skeleton(pins)


MEMBERS = (
    ("base and frame", ["S", "P", "G"], 5, 1.6),
    ("main chain", ["G", "E", "W", "Y", "Y'", "C", "T"], 0, 2.2),
    ("crank and pantograph", ["O", "H", "K"], 3, 1.4),
    ("", ["H", "F"], 3, 1.4),
    ("parallelograms", ["G", "G'", "E'", "E", 'E"', 'W"', "W"], 2, 1.0),
    ("", ["E'", 'E"'], 2, 1.0),
    ("push rod", ["M", "N", "C"], 4, 1.4),
)
"""Name, pin letters, color index and line width of each group of links in the pictures."""


def structure() -> Any:
    """Draw the board installer in its reference configuration, seen from the side.

    The picture shows the parallel links, and the wrist that follows pin H.
    """
    found = skeleton(np.zeros(6))
    figure, axes = panels(3.5)
    for name, letters, k, width in MEMBERS:
        x, _, z = found.line(letters).T
        axes.plot(x, z, color=COLOURS[k], linewidth=width, label=name or "_")
    for letter, (x, _, z) in found.pins.items():
        axes.plot(x, z, "o", color="#000000", markersize=2.4, markerfacecolor="#ffffff")
        dx, dz = NUDGES.get(letter, (0.03, 0.03))
        if letter not in ("P", "Y'"):
            axes.annotate(letter, (x + dx, z + dz), fontsize=6.5)
    plane(axes, "x [m]", "z [m]")
    axes.set(xlim=(-0.5, 1.65), ylim=(-0.1, 1.85))
    legend_below(figure, axes, 2)
    return figure


NUDGES = {
    "S": (0.04, 0.0),
    "G": (0.03, -0.1),
    "G'": (-0.1, -0.1),
    "K": (-0.09, 0.04),
    "E": (0.03, -0.1),
    "E'": (-0.12, 0.02),
    'E"': (-0.06, 0.05),
    "H": (0.04, -0.03),
    "O": (-0.04, -0.1),
    "F": (0.03, -0.1),
    "W": (-0.1, -0.1),
    "Y": (0.03, 0.03),
    "M": (0.03, -0.04),
    "N": (-0.08, -0.08),
    "C": (0.0, 0.04),
    "T": (0.03, 0.03),
}
"""Offset of each pin's letter from the pin in the side view [m]."""


def in_space() -> Any:
    """Draw the robot in the reference configuration (pale) and in another configuration."""
    figure, axes = solid(3.2)
    for q, alpha in ((np.zeros(6), 0.3), (MOVED, 1.0)):
        found = skeleton(q)
        for name, letters, k, width in MEMBERS:
            label = name if name and alpha == 1 else "_"
            x, y, z = found.line(letters).T
            axes.plot(x, y, z, color=COLOURS[k], linewidth=width, alpha=alpha, label=label)
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    axes.set(xlim=(-0.4, 1.6), ylim=(-0.6, 0.9), zlim=(0, 1.8))
    axes.set(xticks=(0, 0.5, 1, 1.5), yticks=(-0.5, 0, 0.5), zticks=(0, 0.5, 1, 1.5))
    axes.set_box_aspect((2.0, 1.5, 1.8))
    axes.view_init(18, -62)
    legend_below(figure, axes, 2)
    return figure


def equation() -> Any:
    """Draw equation (27) and its auxiliary equations as text."""
    figure, axes = panels(0.21 * len(EQUATION))
    axes.axis("off")
    for k, words in enumerate(EQUATION):
        place = 1 - (k + 0.5) / len(EQUATION)
        axes.text(0.5, place, words, fontsize=9, ha="center", va="center", transform=axes.transAxes)
    return figure


def cloud(found: Any, box: FloatArray) -> Any:
    """Draw figure 5 (a): cells that the tool reaches, colored by height."""
    figure, axes = solid(3.0)
    cells = np.argwhere(found.hits > 0)
    centers = np.stack([own[cells[:, k]] for k, own in enumerate(found.grid.centers())], axis=1)
    some = centers[:: max(1, len(centers) // 4000)]
    axes.scatter(*some.T, s=3, c=some[:, 2], cmap="cividis", alpha=0.6, linewidths=0)
    edges(axes, *box, color=COLOURS[3], linewidth=1.2)
    axes.plot([], [], color=COLOURS[3], label="required box")
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    axes.set(xticks=(0, 1, 2), yticks=(-1, 0, 1), zticks=(1, 1.5))
    axes.set_box_aspect((1.9, 3.4, 0.9), zoom=1.15)
    axes.view_init(28, -60)
    legend_below(figure, axes, 1)
    return figure


def view(found: Any, box: FloatArray, normal: int) -> Any:
    """Draw figure 5 (b), (c) or (d): samples per column of cells, and the required box."""
    across, up = {2: (0, 1), 1: (0, 2), 0: (1, 2)}[normal]
    shares = 1000 * found.hits.sum(normal) / found.hits.sum()
    lower, upper = found.grid.lower, found.grid.upper
    figure, axes = panels({2: 4.0, 1: 2.2, 0: 1.7}[normal])
    image = axes.imshow(
        np.ma.masked_equal(shares if across < up else shares.T, 0).T,
        origin="lower",
        extent=(lower[across], upper[across], lower[up], upper[up]),
        cmap="cividis",
        interpolation="nearest",
    )
    corners = box[[0, 1, 1, 0, 0], across], box[[0, 0, 1, 1, 0], up]
    axes.plot(*corners, color="#ffffff", linewidth=2.6)
    axes.plot(*corners, color=COLOURS[3], linewidth=1.4, label="required box")
    plane(axes, f"{'xyz'[across]} [m]", f"{'xyz'[up]} [m]")
    bar = figure.colorbar(image, ax=axes, shrink=0.9)
    bar.set_label("samples per 1000", fontsize=7)
    bar.ax.tick_params(labelsize=7)
    legend_below(figure, axes, 1)
    return figure


def bars(errors: Sequence[Errors]) -> Any:
    """Draw the largest tool errors along x, y and z for each wrong length, and a 0.5 mm line."""
    figure, axes = panels(2.6)
    place = np.arange(len(errors))
    for k in range(3):
        sizes = [1e3 * own.largest[k] for own in errors]
        axes.bar(place + 0.27 * (k - 1), sizes, 0.25, color=COLOURS[k], label=f"along {'xyz'[k]}")
    axes.axhline(0.5, color=GREY, linestyle="--", linewidth=0.9, label="printed 0.5 mm")
    names = [SHORT[own.name] for own in errors]
    axes.set_xticks(place, names, rotation=35, ha="right", rotation_mode="anchor", fontsize=7)
    axes.set_ylabel("tool error [mm]")
    axes.grid(axis="y", color=PALE)
    axes.set_axisbelow(True)
    legend_below(figure, axes, 2)
    return figure
