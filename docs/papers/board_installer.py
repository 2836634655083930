"""Board installer: a hybrid robot in screw theory, its workspace and its errors.

The paper derives the kinematics of a hybrid robot for board installation at height by screw theory.
The lengths, equations and figures of the paper are lost. The robot `board_installer` has
reconstructed lengths. R0 is its reference configuration; T1 and T2 are two other configurations.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import board_pictures
import numpy as np
from numpy.typing import NDArray
from report import (
    TWICE,
    Figures,
    Printed,
    Row,
    assumed,
    consistent,
    lost,
    not_printed,
    not_reproducible,
    read,
    show,
)

import chasles
from chasles import se3
from chasles.derive import mobility
from chasles.derive.model.mechanism import Mechanism
from chasles.study import workspace

FloatArray = NDArray[np.float64]

ROBOT_FILES = Path(__file__).parents[2] / "derive" / "robots"
DEG = np.pi / 180
CASES = {
    "R0": np.zeros(6),
    "T1": np.array([20 * DEG, 0.03, 10 * DEG, -20 * DEG, 0.02, 0]),
    "T2": np.array([-35 * DEG, -0.06, -15 * DEG, 25 * DEG, -0.03, 12 * DEG]),
}
"""Joint values of each configuration: waist, slider, crank, yaw, push rod and roll [rad or m]."""
BOX = np.array([[1.2, -0.715, 0.93], [1.55, 0.715, 1.55]])
"""Lower and upper corners of the box that the tool must reach [m]. The paper does not state the x
coordinates of the box."""
LABOUR = np.array([1.0, 1.5])
"""Lowest and highest installation heights at which the robot saves labor, according to the paper
[m]."""
SAMPLES = 1_000_000
LONGER = 1e-4
"""Error of one length in the error study that replaces table 2 [m]."""
EQUATION_27 = (
    "x = rho cos q1 + (e4 + t cos th7) cos(q1 + q4), "
    "y = rho sin q1 + (e4 + t cos th7) sin(q1 + q4), z = z_G + L1 - h4 + k r sin q3 + t sin th7 "
    "with rho = g0 + L2 + a_w + k r (cos q3 - 1) - "
    "(k - 1) q2 and cos(gamma0 + th7) = (a^2 + b^2 - (l0 + q5)^2)/(2 a b)"
)
"""Text of equation (27), which gives the tool position from the active joint variables. The
function `equation_27` evaluates this equation."""
LENGTHS = (
    "rod_KH_length",
    "rod_FH_length",
    "greater_rod_length",
    "smaller_rod_length",
    "push_rod_length",
    "rod_KH_b_x",
    "rod_FH_b_x",
)
"""Names of the lengths that the error study changes, one at a time."""


def rows() -> list[Row]:
    """Compare every value that the paper prints with the value that chasles computes."""
    printed = read("board_installer")
    return [
        *mobility_rows(printed),
        *length_rows(printed),
        *case_rows(printed),
        *screw_rows(printed),
        *box_rows(printed),
        *error_rows(printed),
    ]


@cache
def robot() -> Any:
    """Load the board installer, whose coordinates are its active joints."""
    return chasles.load("board_installer")


def parameters() -> dict[str, float]:
    """Return the lengths [m] and the angle [rad] of the robot, keyed by parameter name."""
    return {name: parameter.value for name, parameter in robot().parameters.items()}


def configurations(count: int) -> FloatArray:
    """Return random coordinates (count, 6) of the board installer within their limits."""
    found = np.random.default_rng(0).uniform(robot().lower, robot().upper, (count, 6))
    return np.asarray(found)


# Mobility and lengths


def mobility_rows(printed: dict[str, Printed]) -> list[Row]:
    """Compare the mobility of the board installer, which is six.

    The Kutzbach formula gives a wrong mobility, because the loops are planar.
    """
    mechanism = chasles.derive.read(ROBOT_FILES / "board_installer.toml")
    if not isinstance(mechanism, Mechanism):
        raise TypeError("expected a board installer with loops")
    counted = mobility(mechanism)
    n, j = counted.bodies, counted.joints
    return [
        lost(
            printed["mobility"],
            counted.true,
            f"the robot has six motors; the mobility is {counted.coordinates} coordinates minus "
            f"the rank {counted.rank} of the loop equations",
        ),
        lost(
            printed["by_counting"],
            counted.kutzbach,
            f"the formula uses n = {n}, j = {j} and lambda = 6. Its value is 15 too low, because "
            f"the five loops are planar",
        ),
    ]


def length_rows(printed: dict[str, Printed]) -> list[Row]:
    """Return rows with the lengths and joint limits of the robot, which are all assumed."""
    value = parameters()
    reason = "with this value, all loops close and the tool reaches the box"
    push_rod = np.linalg.norm(triangle(0.0)[1] - triangle(0.0)[0])
    found = [assumed(printed[name], size, reason) for name, size in value.items()]
    found.append(assumed(printed["l0"], push_rod, "the length follows from a, b and gamma0"))
    for coordinate in robot().coordinates:
        limits = np.array([coordinate.lower, coordinate.upper])
        item = printed[f"limits_{coordinate.name}"]
        found.append(
            assumed(item, limits, "within these limits, the tool reaches the required box")
        )
    return found


def triangle(extension: float) -> tuple[FloatArray, FloatArray]:
    """Return the positions [m] of push-rod pins M and N in the base frame, for an extension [m]."""
    value = parameters()
    q = np.zeros(6)
    q[4] = extension
    T = dict(zip(robot().link_names, robot().link_poses(q), strict=True))
    a, gamma0 = value["a"], value["gamma0"]
    upper = (value["e4"] - a * np.cos(gamma0), 0, a * np.sin(gamma0) - value["h4"], 1)
    M, N = T["four_axis_reducer"] @ upper, T["pitch_bracket"] @ (-value["b"], 0, 0, 1)
    return M[:3], N[:3]


# Poses at three configurations, and equation (27)


def case_rows(printed: dict[str, Printed]) -> list[Row]:
    """Compare printed joint values, poses and derivatives at three configurations."""
    found = []
    for name, q in CASES.items():
        theta = robot().chain(q)
        found.append(consistent(printed[f"{name}_q"], robot().actuators(theta), TWICE))
        found.append(consistent(printed[f"{name}_chain"], theta, TWICE))
        matrices = {
            "T": robot().fk(q)[:3],
            "J": robot().jacobian_space(q),
            "D": robot().chain_D_q(q),
        }
        for letter, matrix in matrices.items():
            for k, row in enumerate(matrix, 1):
                found.append(consistent(printed[f"{name}_{letter}_{k}"], row, TWICE))
    return found


def screw_rows(printed: dict[str, Printed]) -> list[Row]:
    """Check that the slider and arm joints only translate the tool, and check equation (27)."""
    q = configurations(300)
    arm, shift = arm_exponentials(q), arm_shift(q)
    turned = np.abs(arm[:, :3, :3] - np.eye(3)).max()
    off = max(turned, np.abs(arm[:, :3, 3] - shift).max())
    tool = robot().fk(q)[:, :3, 3]
    return [
        lost(
            printed["translation"],
            off,
            "at 300 configurations, we compared exp(xi2 th2) ... exp(xi5 th5) with "
            "Trans(k r (cos q3 - 1) - (k - 1) q2, 0, k r sin q3)",
        ),
        lost(
            printed["equation_27"],
            np.abs(equation_27(q) - tool).max(),
            f"we evaluated the reconstructed equation (27) at 300 configurations: {EQUATION_27}",
        ),
    ]


def arm_exponentials(q: FloatArray) -> FloatArray:
    """Return the product (m, 4, 4) of the exponentials of the slider and the three arm joints."""
    value = parameters()
    z_G, g0 = value["z_G"], value["g0"]
    z_W, x_W = z_G + value["L1"], g0 + value["L2"]
    axes = [
        (1, 0, 0, 0, 0, 0),
        (z_G, 0, -g0, 0, -1, 0),
        (z_W, 0, -g0, 0, -1, 0),
        (z_W, 0, -x_W, 0, -1, 0),
    ]
    theta = robot().chain(q)[:, 1:5]
    T = np.eye(4)
    for k, axis in enumerate(axes):
        T = T @ se3.exp(theta[:, k, None] * np.array(axis, dtype=float))
    return T


def arm_shift(q: FloatArray) -> FloatArray:
    """Return the translation (m, 3) [m] by the slider and arm joints, in closed form."""
    value = parameters()
    k, r = value["k"], value["r"]
    along = k * r * (np.cos(q[:, 2]) - 1) - (k - 1) * q[:, 1]
    return np.stack([along, np.zeros(len(q)), k * r * np.sin(q[:, 2])], axis=1)


def equation_27(q: FloatArray) -> FloatArray:
    """Return the tool position (m, 3) [m] by equation (27)."""
    value = parameters()
    a, b, gamma0, t = (value[name] for name in ("a", "b", "gamma0", "t"))
    l0 = np.sqrt(a**2 + b**2 - 2 * a * b * np.cos(gamma0))
    cosine = (a**2 + b**2 - (l0 + q[:, 4]) ** 2) / (2 * a * b)
    pitch = np.arccos(cosine) - gamma0
    shift = arm_shift(q)
    radius = value["g0"] + value["L2"] + value["a_w"] + shift[:, 0]
    hand = value["e4"] + t * np.cos(pitch)
    turned = q[:, 0] + q[:, 3]
    return np.stack(
        [
            radius * np.cos(q[:, 0]) + hand * np.cos(turned),
            radius * np.sin(q[:, 0]) + hand * np.sin(turned),
            value["z_G"] + value["L1"] - value["h4"] + shift[:, 2] + t * np.sin(pitch),
        ],
        axis=1,
    )


# The workspace and the required box


@cache
def cloud() -> Any:
    """Sample the workspace in figure 5 with a million configurations."""
    return workspace(robot(), samples=SAMPLES, resolution=40)


def box_rows(printed: dict[str, Printed]) -> list[Row]:
    """Check that the tool, facing the wall, reaches the whole required box within all limits."""
    T = box_poses()
    reached = robot().ik(T).within_limits().count > 0
    inside = T[reached, :3, 3]
    heights = [z for z in LABOUR if reached[T[:, 2, 3] == z].all()]
    least, largest = inside.min(0), inside.max(0)
    forward, sideways, _ = largest - least
    note = "we chose lengths and limits with which the tool, facing the wall, reaches the box"
    return [
        consistent(printed["lowest"], least[2], note),
        consistent(printed["highest"], largest[2], note),
        consistent(printed["forward"], forward, note),
        consistent(printed["sideways"], sideways, note),
        consistent(printed["labour"], np.array(heights), note),
        not_printed(
            printed["box"], reached.mean(), f"we tested {len(T)} tool poses in the box; {note}"
        ),
        assumed(printed["box_x"], BOX[0, 0], "the paper does not state the position of the box"),
        lost(
            printed["extents"],
            cloud().bounds,
            "our values come from an optimization that starts at the best samples",
        ),
    ]


def box_poses() -> FloatArray:
    """Return tool poses (m, 4, 4) on a grid in the required box, including its boundary."""
    x, y, z = (np.linspace(*BOX[:, k], count) for k, count in enumerate((8, 15, 8)))
    places = np.array(list(product(x, y, np.union1d(z, LABOUR))))
    T = np.tile(np.eye(4), (len(places), 1, 1))
    T[:, :3, 3] = places
    return T


# Table 2 as an error analysis


@dataclass(frozen=True)
class Errors:
    """Largest tool errors that the error of one link or rod length causes.

    Attributes:
        name: Name of the link or rod length that has an error, one of `LENGTHS`.
        largest: (3,) largest tool errors along x, y and z [m].
        distance: Largest distance from the correct tool position [m].
    """

    name: str
    largest: FloatArray
    distance: float


def grid(built: Any) -> FloatArray:
    """Return coordinates (m, 6) of a robot on a grid within its joint limits."""
    counts = (3, 7, 7, 3, 3, 3)
    sides = [np.linspace(*ends) for ends in zip(built.lower, built.upper, counts, strict=True)]
    return np.array(list(product(*sides)))


@cache
def errors() -> tuple[Errors, ...]:
    """Compute tool errors at 3969 configurations for a 0.1 mm error of each length in turn."""
    built = chasles.load("board_installer", parametric=True)
    p = np.array([number.value for number in built.geometry])
    names = [number.name for number in built.geometry]
    q = grid(built)
    right = built.fk_p(q, p)[:, :3, 3]
    found = []
    for name in LENGTHS:
        longer = p.copy()
        longer[names.index(name)] += LONGER
        off = built.fk_p(q, longer)[:, :3, 3] - right
        found.append(Errors(name, np.abs(off).max(0), float(np.linalg.norm(off, axis=1).max())))
    return tuple(found)


def error_rows(printed: dict[str, Printed]) -> list[Row]:
    """Return the rows of the error study, which replaces the lost table 2.

    The paper summarizes table 2 by a tool error of 0.5 mm. The last row states the error of one
    pantograph rod that causes this tool error.
    """
    worst = max(errors(), key=lambda own: own.distance)
    least = LONGER * 0.5e-3 / worst.distance
    return [
        *(
            lost(
                printed[f"error_{own.name}"],
                own.largest,
                f"within the limits, the tool error with closed loops is at most "
                f"{1e3 * own.distance:.3f} mm",
            )
            for own in errors()
        ),
        not_reproducible(
            printed["error"],
            worst.distance,
            "the paper measured the error of one robot. Our value is the largest tool error that "
            "a 0.1 mm error of one pantograph rod or crank causes",
        ),
        not_printed(
            printed["tolerance"],
            least,
            f"the tool error is proportional to the rod error. A rod error of 0.1 mm gives the "
            f"tool error of {1e3 * worst.distance:.2f} mm in the preceding row",
        ),
    ]


def figures() -> Figures:
    """Draw figures 2, 3 and 5, equation (27), and the error study."""
    return board_pictures.drawn(cloud(), BOX, errors())


if __name__ == "__main__":
    show(rows())
