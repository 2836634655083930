"""Bricklaying gantry: tables of positions, a planar arm with links of 7, 5 and 5 units, and a wall.

Ibrahim, Umar and Olatunde, Forward and inverse kinematic analyses of a developed and evaluated
bricklaying gantry-based parallel robot manipulator. The robot `bricklaying_gantry` is the gantry.
In equations (3) to (6), a polar arm replaces the gantry; the file `robots/bricklaying_polar.toml`
in this folder describes this arm.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import bricklaying_pictures
import numpy as np
from bricklaying_wall import chain_of, wall, wall_rows
from numpy.typing import NDArray
from report import (
    ECHO,
    TWICE,
    Figures,
    Printed,
    Row,
    agrees,
    at,
    consistent,
    erratum,
    lost,
    read,
    show,
)

import chasles
from chasles.derive import kutzbach, mobility
from chasles.derive.model.mechanism import Mechanism
from chasles.study.motion import MotionSequence

FloatArray = NDArray[np.float64]

INCH, MM = 0.0254, 1e-3
ROBOT_FILES = Path(__file__).parents[2] / "derive" / "robots"
PICK_TO_DROP = 20.0
"""Time from the pick spot to a drop spot [s], printed in section 2.2."""
TARGET = np.array([11.0, 8.0]) * INCH


def deg(angle: float) -> float:
    """Convert an angle in degrees to radians."""
    return float(np.radians(angle))


def exchanged(value: float) -> str:
    """Format a number to two decimals and exchange the two decimal digits."""
    text = f"{value:.2f}"
    return text[:-2] + text[:-3:-1]


def rounded_twice(value: float, digits: int) -> float:
    """Round a number twice: to one extra digit, then to the requested digits.

    If the extra digit is 5, the number is rounded up.
    """
    unit = 10.0**-digits
    return float(np.floor(round(value, digits + 1) / unit + 0.5 + 1e-9) * unit)


CORRECTED = {
    "table_4_row_1_theta_rad": ("1.35", "the rounded angle 78 deg instead of 77.63 deg", deg(78)),
    "table_4_row_1_r": (
        "5.09",
        "1.09/cos 78 deg = 5.24 with swapped decimals",
        exchanged(1.09 / np.cos(deg(78))),
    ),
    "table_4_row_2_theta_rad": ("1.18", "the rounded angle 68 deg instead of 67.88 deg", deg(68)),
    "table_4_row_2_r": ("5.42", "5.02/sin 68 deg", 5.02 / np.sin(deg(68)) * INCH),
    "table_4_row_3_r": ("5.83", "2.99/cos 59 deg", 2.99 / np.cos(deg(59)) * INCH),
    "table_4_row_5_theta": (
        "44",
        "rounding 44.49 to 44.5, and then 44.5 to 45",
        deg(rounded_twice(44.493, 0)),
    ),
    "table_4_row_5_theta_rad": (
        "0.78",
        "45 deg = 0.79 rad with swapped decimals",
        exchanged(deg(45)),
    ),
    "table_4_row_5_r": ("7.19", "5.13/cos 45 deg with 0.707 for the cosine", 5.13 / 0.707 * INCH),
    "table_5_row_1_theta_rad": ("0.800", "the rounded angle 46 deg instead of 45.84 deg", deg(46)),
    "table_5_row_2_theta_rad": ("0.795", "the rounded angle 46 deg instead of 45.57 deg", deg(46)),
    "table_5_row_2_r": ("2.84", "2.03/sin 46 deg", 2.03 / np.sin(deg(46)) * INCH),
    "table_5_row_4_theta_rad": (
        "0.790",
        "the rounded angle 45.3 deg instead of 45.287 deg",
        deg(45.3),
    ),
    "table_5_row_5_theta_rad": (
        "0.790",
        "the rounded angle 45.3 deg instead of 45.284 deg",
        deg(45.3),
    ),
    "text_1_row_1_r": ("5.09", "1.09/cos 78 deg", 1.09 / np.cos(deg(78)) * INCH),
    "text_1_row_1_omega": (
        "0.068",
        "1.36/20, which was rounded to 0.07 and printed as 0.070",
        f"{1.36 / 20:.2f}0",
    ),
    "text_1_row_2_omega": (
        "0.059",
        "1.19/20, which was rounded to 0.06 and printed as 0.060",
        f"{1.19 / 20:.2f}0",
    ),
    "text_1_row_2_numerator": ("5.02", "", None),
    "text_1_row_5_theta_rad": ("0.78", "the rounded angle 45 deg instead of 44.49 deg", deg(45)),
    "text_1_row_5_omega": (
        "0.039",
        "0.79/20, with the angle 0.79 rad instead of 0.777 rad",
        0.79 / 20,
    ),
    "range_1_theta": (
        "0.58",
        "1.36 - 0.89, without the misprinted row 5 of table 4",
        1.36 - 0.89,
    ),
    "range_2_theta": (
        "0.013",
        "0.803 - 0.787, the difference of two rounded angles",
        0.803 - 0.787,
    ),
    "other_root": (
        "15.04",
        "(33.64 + 12.35)/3.06, with rounded coefficients",
        (33.64 + 12.35) / 3.06 * INCH,
    ),
    "distance": (
        "8.60",
        "8.6049 for the rounded wrist center, rounded to 8.605 and then to 8.61",
        rounded_twice(np.hypot(6.96, 5.06), 2) * INCH,
    ),
    "cosine_A": (
        "0.8137",
        "(74.13 + 49 - 25)/120.54, with 74.13 = 8.61^2",
        (74.13 + 49 - 25) / 120.54,
    ),
    "A": ("35.54", "acos 0.8141", np.arccos(0.8141)),
    "B": (
        "89.99",
        "acos((49 + 25 - 74.13)/70); the correct angle is acute",
        np.arccos((74 - 74.13) / 70),
    ),
    "C": ("54.47", "180 - 90.11 - 35.50", deg(180 - 90.11 - 35.50)),
    "A_prime": ("71.57", "35.50 + 36.03", deg(35.50 + 36.03)),
    "C_prime": ("125.53", "180 - 54.39", deg(180 - 54.39)),
}
"""Correct value of each misprint, its cause as a noun phrase, and the wrong value that results from
the cause."""
NUMERATOR = "the paper prints 45.02/2.04 instead of 5.02/2.04"


INPUTS = ("_x", "_y", "_time", "target", "lengths")
"""Endings of the keys of printed values that are inputs of chasles, not results."""
PARTS = "the value is counted in our parts list, which follows the paper"
IN_INCHES = {1: (4,), 2: (1, 3, 4, 5)}
"""Numbers of the drop spots for which the printed polar radius r is correct in inches, keyed by
set-up number."""


def rows() -> list[Row]:
    """Compare every value that the paper prints with the value that chasles computes."""
    printed = read("bricklaying_gantry")
    return [
        *mobility_rows(printed),
        *equation_rows(printed),
        *drop_spot_rows(printed),
        *unit_rows(printed),
        *inverse_rows(printed),
        *wall_rows(printed),
    ]


def judged(printed: dict[str, Printed], key: str, ours: Any) -> Row:
    """Compare a printed value with our value and return the table row.

    If `CORRECTED` contains the key, the row is an erratum. If `CORRECTED` does not contain the key,
    the printed value must agree with our value.
    """
    if key in CORRECTED:
        corrected, words, value = CORRECTED[key]
        if value is None:
            return erratum(printed[key], ours, corrected, NUMERATOR)
        return erratum(printed[key], ours, corrected, cause=(words, value))
    if printed[key].is_evaluated:
        return consistent(printed[key], ours, TWICE)
    return consistent(printed[key], ours) if key.endswith(INPUTS) else agrees(printed[key], ours)


# Mobility


def mobility_rows(printed: dict[str, Printed]) -> list[Row]:
    """Compare the mobility formula and the numbers of links and joints in section 2.1."""
    mechanism = chasles.derive.read(ROBOT_FILES / "bricklaying_gantry.toml")
    if not isinstance(mechanism, Mechanism):
        raise TypeError("expected a gantry with loops")
    counted = mobility(mechanism)
    by_numbers = kutzbach(links=14, joints=15, freedom=15)
    note = (
        f"equation (1) uses lambda = 6, n = 14 and j = f = 15. The rank of the loop equations "
        f"also gives {counted.true}"
    )
    found = {
        "links": counted.bodies,
        "joints": counted.joints,
        "freedoms": counted.freedoms,
        "order": counted.order,
        "loops": len(counted.loop_orders),
        "width": chasles.load("bricklaying_gantry").parameters["w_y"].value,
    }
    return [
        agrees(printed["mobility"], by_numbers, note),
        *(
            consistent(printed[key], value, ECHO if key == "width" else PARTS)
            for key, value in found.items()
        ),
    ]


# The forward tables


@dataclass(frozen=True)
class Spot:
    """A spot at which a brick is dropped, reached by the gantry and by the polar arm.

    Attributes:
        xy: (2,) position of the gantry's guide [m].
        theta: Angle of the polar arm [rad].
        r: Length of the polar arm [m].
        omega: Angular rate of the polar arm from the pick spot [rad/s].
        duration: Time of the motion from the pick spot to the drop spot [s].
    """

    xy: FloatArray
    theta: float
    r: float
    omega: float
    duration: float


@cache
def polar_arm() -> Any:
    """Load the polar arm, which is a link of variable length r at the angle theta."""
    return chasles.load(Path(__file__).parent / "robots" / "bricklaying_polar.toml")


@cache
def spots(setup: int) -> tuple[Spot, ...]:
    """Return the five spots at which bricks are dropped in a set-up of the paper."""
    printed = read("bricklaying_gantry")
    keys = [(f"setup_{setup}_row_{k}_x", f"setup_{setup}_row_{k}_y") for k in range(1, 6)]
    return tuple(
        spot(np.array([float(str(printed[x].value)), float(str(printed[y].value))]) * INCH)
        for x, y in keys
    )


def spot(xy: FloatArray) -> Spot:
    """Return the gantry's guide position and the polar arm's motion for a drop spot.

    The polar arm reaches the drop spot in 20 s at constant rates.
    """
    gantry = chasles.load("bricklaying_gantry")
    q = gantry.actuators(chain_of(gantry, [*xy, 0]))
    guide = gantry.fk(q)[:3, 3]
    arm = polar_arm()
    (drop,) = arm.ik_position(guide).within_limits().valid_q()
    motion = MotionSequence(arm, np.zeros(3)).move(drop, "constant", duration=PICK_TO_DROP)
    sampled = motion.sample(frequency=1)
    theta, r, _ = sampled.q[-1]
    return Spot(guide[:2], theta, r, sampled.qd[0, 0], sampled.t[-1])


def equation_rows(printed: dict[str, Printed]) -> list[Row]:
    """Evaluate equations (3) to (6) of the paper for the first drop position.

    The equations are compared with the guide position of the gantry and the joint angle of the
    polar arm.
    """
    own = spots(1)[0]
    x, y = own.xy
    values = {"x": x, "y": y, "r": own.r, "theta": own.theta}
    values |= {"omega": own.omega, "t": own.duration}
    gantry = "our value is the guide position of the gantry at spot 1 of set-up 1"
    arm = "our value is the joint angle of the polar arm at spot 1 of set-up 1"
    return [
        agrees(printed["equations_3_4"], own.xy, gantry, evaluated=at(**values)),
        agrees(printed["equation_5"], own.theta, arm, evaluated=at(**values)),
        agrees(printed["equation_6"], own.theta, arm, evaluated=at(**values)),
    ]


def drop_spot_rows(printed: dict[str, Printed]) -> list[Row]:
    """Compare tables 1, 2, 4 and 5, the text of section 2.2, and the ranges in the abstract."""
    found = []
    for setup in (1, 2):
        for k, own in enumerate(spots(setup), 1):
            values = {
                "x": own.xy[0],
                "y": own.xy[1],
                "time": own.duration,
                "theta": own.theta,
                "theta_rad": own.theta,
                "r": own.r,
                "omega": own.omega,
                "numerator": own.xy[1],
            }
            starts = (f"setup_{setup}", f"table_{setup + 3}", f"text_{setup}")
            keys = [(f"{start}_row_{k}_{name}", name) for start in starts for name in values]
            found += [judged(printed, key, values[name]) for key, name in keys if key in printed]
        for name in ("theta", "r", "omega"):
            ours = np.array([getattr(own, name) for own in spots(setup)])
            found.append(judged(printed, f"exact_{setup}_{name}", ours))
            if (key := f"range_{setup}_{name}") in printed:
                found.append(judged(printed, key, np.ptp(ours)))
        found.append(positions(printed[f"orientation_{setup}"], spots(setup)))
    return found


def positions(item: Printed, own: tuple[Spot, ...]) -> Row:
    """Compare the position matrix X_wi of section 3.1 with the guide positions of a set-up."""
    values = {f"r{k}": spot.r for k, spot in enumerate(own, 1)}
    values |= {f"t{k}": spot.theta for k, spot in enumerate(own, 1)}
    guide = np.array([[*spot.xy, 0] for spot in own])
    words = "the matrix contains only positions, which agree with the guide positions"
    return agrees(item, guide, words, evaluated=at(**values))


def unit_rows(printed: dict[str, Printed]) -> list[Row]:
    """Show that tables 4 and 5 and the abstract label inches as mm."""
    chain = chasles.load("bricklaying_planar")
    lengths = {"lengths_mm": [chain.parameters[name].value for name in ("l3", "l1")]}
    for setup, right in IN_INCHES.items():
        own = spots(setup)
        lengths[f"table_{setup + 3}_x_mm"] = [spot.xy[0] for spot in own]
        lengths[f"table_{setup + 3}_y_mm"] = [spot.xy[1] for spot in own]
        lengths[f"table_{setup + 3}_r_mm"] = [own[k - 1].r for k in right]
    return [in_inches(printed[key], np.array(ours)) for key, ours in lengths.items()]


def in_inches(item: Printed, ours: FloatArray) -> Row:
    """Compare lengths that the paper prints in mm, although the printed values are in inches."""
    cause = ("lengths in inches, as in section 2.2", ours / INCH * MM)
    return erratum(item, ours, ours, "the correct unit is inch, not mm", cause=cause)


# The planar arm with links of 7, 5 and 5 inches


@dataclass(frozen=True)
class Triangle:
    """Planar arm at the target, with its last link on the line from the origin to the target.

    Attributes:
        q: (2, 3) joint angles of both solutions, with the elbow above the line in the first [rad].
        wrist: (2,) position of the wrist center [m].
        line: Angle of the line from the origin to the target [rad].
    """

    q: FloatArray
    wrist: FloatArray
    line: float


@cache
def triangle() -> Triangle:
    """Compute both elbow solutions of the planar arm at the target, and the wrist center."""
    (on_line,) = polar_arm().ik_position([*TARGET, 0]).within_limits().valid_q()
    chain = chasles.load("bricklaying_planar")
    q = chain.ik_planar([*TARGET, on_line[0]]).valid_q()
    q = q[np.argsort(-q[:, 0])]
    return Triangle(q, chain.link_poses(q[0])[1, :2, 3], float(on_line[0]))


def inverse_rows(printed: dict[str, Printed]) -> list[Row]:
    """Compare the inverse kinematics of the planar arm in section 2.3."""
    found = triangle()
    chain, arm = chasles.load("bricklaying_planar"), polar_arm()
    shoulder, elbow, wrist = found.q[0]
    (center,) = arm.ik_position([*found.wrist, 0]).within_limits().valid_q()
    lengths = np.array([chain.parameters[name].value for name in ("l1", "l2", "l3")])
    beyond = arm.fk([found.line, center[1] + 2 * lengths[2], 0])
    ours = {
        "target": chain.fk(found.q[0])[:2, 3],
        "lengths": lengths,
        "root": found.wrist[0],
        "other_root": beyond[0, 3],
        "wrist_y": found.wrist[1],
        "distance": center[1],
        "cosine_A": np.cos(shoulder - found.line),
        "P": found.line,
        "A": shoulder - found.line,
        "B": np.pi - abs(elbow),
        "C": abs(wrist),
        "A_prime": shoulder,
        "C_prime": np.pi - abs(wrist),
    }
    return [
        *quadratic_rows(printed, found.line, np.array([found.wrist[0], beyond[0, 3]]) / INCH),
        *(judged(printed, key, value) for key, value in ours.items()),
        lost(
            printed["other_elbow"],
            found.q[1],
            "the paper names the solution with the elbow below the line, but does not calculate it",
        ),
    ]


def quadratic_rows(printed: dict[str, Printed], line: float, roots: FloatArray) -> list[Row]:
    """Compare equations (12) to (17), which intersect a line with a circle (inches).

    The x coordinates computed by chasles are the roots of the printed quadratic equation.
    """
    slope = np.tan(line)
    a = 1 + slope**2
    b, c = -a * roots.sum(), a * roots.prod()
    root = np.sqrt(b**2 - 4 * a * c)
    x, y = roots[0], slope * roots[0]
    return [
        agrees(
            printed["squares"],
            np.array([(x - 11) ** 2, (y - 8) ** 2]),
            "the left sides are evaluated at the wrist center",
            evaluated=at(x=x, y=y),
        ),
        erratum(
            printed["circle"],
            c,
            "160",
            "the paper prints 25 as the right side of both (13) and (14). At the wrist center, the "
            f"left sides are {(x - 11) ** 2:.3f} and {(y - 8) ** 2:.3f}; only their sum is 25. "
            f"Equation (16) is correct",
            evaluated=at(),
        ),
        agrees(
            printed["line_square"],
            np.array([slope**2, 2 * 8 * slope, 8**2]),
            evaluated=at(),
        ),
        agrees(
            printed["quadratic"],
            np.array([a, b, c]),
            "the coefficients follow from the intersections of circle and line",
        ),
        erratum(
            printed["discriminant"],
            root,
            "12.36",
            cause=("sqrt(1131.65 - 979.2), with rounded coefficients", np.sqrt(1131.65 - 979.2)),
        ),
    ]


def figures() -> Figures:
    """Draw the figures of the paper, and the wall of bricks."""
    return bricklaying_pictures.drawn({setup: spots(setup) for setup in (1, 2)}, triangle(), wall())


if __name__ == "__main__":
    show(rows())
