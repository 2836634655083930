"""Manipulator for wells: its working process of 49 s, and two kinematic models of its joints.

Closed chain cascade manipulator with an improved kinematic model, Mathematical Problems in
Engineering. The robot file `well_manipulator` describes this manipulator. The file
`robots/well_first_cylinder.toml` in this folder describes the manipulator's first cylinder, with
pin B as printed in equation (64). The motion of the paper fixes theta2 and both telescopes; without
`fixed=`, `ik` fixes theta7 instead of theta2. An amplitude is the largest minus the smallest value.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import well_pictures
from numpy.typing import NDArray
from report import (
    TWICE,
    Figures,
    Printed,
    Row,
    agrees,
    assumed,
    at,
    consistent,
    erratum,
    in_one_reading,
    not_reproducible,
    read,
    show,
)
from well_model import equation_rows, lie_group_rows, model_rows
from well_process import (
    ARMS,
    CYLINDERS,
    DESCENT,
    OVER_THE_WELL,
    RATE,
    TURNING,
    Process,
    cylinder_norm,
    initial,
    integrated,
    joint_norm,
    process,
    robot,
)

import chasles

__all__ = ["ARMS", "CYLINDERS", "OVER_THE_WELL", "RATE", "Process", "process", "robot", "rows"]

FloatArray = NDArray[np.float64]

BY_LAW = (
    "from 39 s to 49 s, we solve each pose by minimum-norm steps from the configuration at 37 s"
)
"""Note on values that depend on the last stage, whose motion the paper does not define."""
SHIFT = np.radians([0.0049, -0.0045, -0.0049, -0.0049])
"""Shifts of the start angles theta2, theta3, theta5 and theta7, within half a unit of their last
printed digit [rad]."""
HALF_UNIT = np.radians(0.005)
"""Half a unit of the last digit of the start angles in equation (63) [rad]."""
JUMP = 0.2
"""Assumed time step [s]. The jump of the rate of theta3, divided by this time step, is the printed
acceleration."""


def rows() -> list[Row]:
    """Compare every value that the paper prints with the value that chasles computes."""
    printed = read("well_manipulator")
    return [
        *constant_rows(printed),
        *stage_rows(printed),
        *state_rows(printed),
        *amplitude_rows(printed),
        *lie_group_rows(printed),
        *model_rows(printed),
        *equation_rows(printed),
    ]


# The constants of equation (64)


def constant_rows(printed: dict[str, Printed]) -> list[Row]:
    """Compare every constant of equation (64).

    In equation (64), the vector r_B is misprinted, but the vector r_AB is correct.
    """
    value = {name: parameter.value for name, parameter in robot().parameters.items()}
    vectors = {
        "p_AD": (0, 0, value["l_AD"]),
        "p_DG": (value["l_DG"], 0, 0),
        "p_GH": (value["l_GH"], 0, 0),
        "p_LM": (value["l_LM"], 0, 0),
        "r_AB": (value["B_x"], 0, value["B_z"]),
    }
    pins = {"r_IL": "I", "r_NO": "N", "r_C": "C", "r_E": "E", "r_F": "F", "r_J": "J", "r_K": "K"}
    pins |= {"r_P": "P", "r_Q": "Q", "r_R": "R", "r_DE": "E", "r_IJ": "J", "r_NP": "P"}
    vectors |= {key: (value[f"{pin}_x"], value[f"{pin}_y"], 0) for key, pin in pins.items()}
    right = np.array([-85.4, 0, 154.5]) * 1e-3
    return [
        *(consistent(printed[key], np.array(vector)) for key, vector in vectors.items()),
        *(consistent(printed[key], value[key]) for key in ("theta4", "theta6")),
        erratum(
            printed["r_B"],
            np.array(vectors["r_AB"]),
            right,
            "y and z are swapped, as the triangle of equation (39) shows",
            cause=("r_AB with y and z swapped", right[[0, 2, 1]]),
        ),
    ]


def stage_rows(printed: dict[str, Printed]) -> list[Row]:
    """Compare the values that section 5 prints for each stage with our values."""
    found = process()
    T, V = found.sampled.T, found.sampled.V
    tool = {time: T[found.at(time), :3, 3] for time in (0, 5, 25, 37, 39)}
    theta2 = found.theta[found.at(15) : found.at(37), 1]
    inputs = {
        "theta1": found.theta[found.at(5), 0],
        "R_25": tool[25],
        "R_7": T[found.at(30), :3, :3].round(9),
        "theta2_fixed": theta2[np.abs(theta2 - theta2[0]).argmax()],
        "descent": -V[found.at(30), 2],
        "descent_8": -V[found.at(45), 2],
    }
    derived = {"theta1_rate": found.rates[found.at(2), 0], "R_37": tool[37][2]}
    shifts = ", ".join(f"{value:+.4f}" for value in np.degrees(SHIFT))
    return [
        *(consistent(printed[key], value) for key, value in inputs.items()),
        *(agrees(printed[key], value) for key, value in derived.items()),
        *(consistent(printed[f"R_{k}"], tool[t], TWICE) for k, t in (("start", 0), ("turned", 5))),
        agrees(
            printed["R_object"],
            at_the_object(),
            f"with the start angles of equation (63), R is {shown_mm(tool[5])}. For our "
            f"value, we shifted theta2, theta3, theta5 and theta7 by {shifts} deg. Each shift is "
            f"within half a unit of the last printed digit. Shifts by half a unit move R by up to "
            f"{1e3 * digits_of_start():.2f} mm",
        ),
        erratum(
            printed["R_39"],
            tool[39][2],
            1.02 - DESCENT,
            "the correct equation is 1020 - 2166 - 216.6 (t - 39), which continues the motion from "
            "37 s. We evaluated both equations at 39 s",
            evaluated=lambda item: at(t=39.0)(item) * 1e-3,
        ),
        assumed(
            printed["law"],
            "the minimum norm",
            "four joints satisfy three conditions, and the paper does not state the rule of "
            "motion. We solve each pose by minimum-norm steps of the joint angles from the "
            "configuration at 37 s. Our rule gives the amplitudes of figures 6 and 9. No rule that "
            "we tried gives all amplitudes of the paper",
        ),
    ]


def at_the_object() -> FloatArray:
    """Return point R (3,) after 5 s [m], from start angles that round to the printed angles."""
    if np.abs(SHIFT).max() >= HALF_UNIT:
        raise ValueError("the shifted start angles do not round to the printed digits")
    theta = initial()
    theta[ARMS] += SHIFT
    theta[0] = np.radians(30)
    return np.asarray(robot().fk(robot().actuators(theta))[:3, 3])


def shown_mm(p: FloatArray) -> str:
    """Format a position [m] in millimeters."""
    return f"({', '.join(f'{1e3 * value:.2f}' for value in p)}) mm"


def digits_of_start() -> float:
    """Return the largest shift [m] of point R along an axis, by rounding errors of start angles."""
    well, start = robot(), initial()
    J = well.jacobian_mixed(well.actuators(start)) @ well.actuators_D_chain(start)
    return float(np.abs(J[:3, ARMS]).sum(1).max() * HALF_UNIT)


def state_rows(printed: dict[str, Printed]) -> list[Row]:
    """Compare configurations and rates with independent evaluations of the paper's equations."""
    well, found = robot(), process()
    first = well.chain(well.actuators(initial()))
    values = {"upright": elevation(found.sampled.T[0])}
    for time in (0, 25, 37):
        k = found.at(time)
        values[f"angles_{time}"] = found.theta[k, ARMS]
        values[f"lengths_{time}"] = found.sampled.q[k, CYLINDERS]
        values[f"swings_{time}"] = found.swings[k]
    after_27 = found.at(27)
    values["rates_4"] = found.rates[found.at(20), ARMS[1:]]
    values["rates_27"] = found.rates[after_27, ARMS[1:]]
    values["speeds_27"] = found.sampled.qd[after_27, CYLINDERS[1:]]
    return [
        consistent(printed["initial"], first[TURNING]),
        *(consistent(printed[key], value, TWICE) for key, value in values.items()),
    ]


def elevation(T: FloatArray) -> float:
    """Return the angle of the fifth arm above the horizontal [rad]."""
    return float(np.arctan2(T[2, 0], np.hypot(T[0, 0], T[1, 0])))


# Amplitudes in figures 6 to 10

LAWS = {
    "minimum-norm joint rates": joint_norm,
    "minimum-norm cylinder speeds": cylinder_norm,
}
"""Alternatives to the rule of figure 6: norms that the paper may minimize from 39 s to 49 s. Each
function in `LAWS` returns the weight matrix of a norm. The integration of the joint rates starts at
39 s."""


def amplitude_rows(printed: dict[str, Printed]) -> list[Row]:
    """Compare amplitudes: the largest minus the smallest value of each curve over the 49 s."""
    found = process()
    return [
        *angle_rows(printed, found),
        *length_rows(printed, found),
        *speed_rows(printed, found),
        *acceleration_rows(printed, found),
    ]


def angle_rows(printed: dict[str, Printed], found: Process) -> list[Row]:
    """Compare the amplitudes of the joint and cylinder angles in figures 6 and 8."""
    joints, swings = np.ptp(found.theta[:, TURNING], axis=0), np.ptp(found.swings, axis=0)
    on_arm = np.ptp(found.swings - found.theta[:, ARMS], axis=0)
    other = {name: np.ptp(integrated(norm).swings, axis=0) for name, norm in LAWS.items()}
    names = ("theta1", "theta2", "theta3", "theta5", "theta7")
    return [
        *(
            agrees(printed[f"amplitude_{n}"], own, "" if n == "theta1" else BY_LAW)
            for n, own in zip(names, joints, strict=True)
        ),
        *(
            not_reproducible(
                printed[f"amplitude_theta{8 + k}"],
                swings[k],
                "our value is for the angle relative to the preceding arm, as in equation (38)",
                readings={"the angle relative to the following arm": on_arm[k]}
                | {name: values[k] for name, values in other.items()},
            )
            for k in range(4)
        ),
    ]


def length_rows(printed: dict[str, Printed], found: Process) -> list[Row]:
    """Compare the amplitudes of the cylinder lengths in figure 9.

    The misprinted position of pin B explains the printed amplitude of cylinder 1.
    """
    first, *others = np.ptp(found.sampled.q[:, CYLINDERS], axis=0)
    misprinted = chasles.load(Path(__file__).parent / "robots" / "well_first_cylinder.toml")
    lengths = np.ptp(misprinted.actuators(found.theta[:, :2])[:, 1])
    cause = (f"the wrong r_B of equation (64), which gives {1e3 * lengths:.2f} mm", lengths)
    return [
        erratum(printed["amplitude_l1"], first, "349", BY_LAW, cause=cause),
        *(agrees(printed[f"amplitude_l{k}"], own, BY_LAW) for k, own in enumerate(others, 2)),
    ]


def speed_rows(printed: dict[str, Printed], found: Process) -> list[Row]:
    """Compare figures 7 and 10: joint rates, and cylinder speeds in the assumed unit mm·deg/s."""
    others = {name: integrated(norm) for name, norm in LAWS.items()}
    rates = np.ptp(found.rates[:, TURNING], axis=0)
    by_law = {name: np.ptp(own.rates[:, TURNING], axis=0) for name, own in others.items()}
    least_speeds = by_law["minimum-norm cylinder speeds"]
    angle = np.degrees(np.ptp(others["minimum-norm cylinder speeds"].theta[:, 4]))
    return [
        agrees(printed["amplitude_rate1"], rates[0]),
        agrees(printed["amplitude_rate2"], rates[1], BY_LAW),
        in_one_reading(
            printed["amplitude_rate3"],
            least_speeds[2],
            f"our value holds for minimum-norm cylinder speeds between 39 s and 49 s. With this "
            f"rule, the amplitude of theta5 is {angle:.0f} deg instead of the printed 132 deg. The "
            f"rule of figure 6 gives a rate of {np.degrees(rates[2]):.1f} deg/s",
        ),
        not_reproducible(
            printed["amplitude_rate5"],
            rates[3],
            readings={name: values[3] for name, values in by_law.items()},
        ),
        agrees(printed["amplitude_rate7"], rates[4], BY_LAW),
        *cylinder_speed_rows(printed, found, others),
    ]


def cylinder_speed_rows(
    printed: dict[str, Printed], found: Process, others: dict[str, Process]
) -> list[Row]:
    """Compare the cylinder speeds with figure 10 of the paper."""
    speeds = np.ptp(found.sampled.qd[:, CYLINDERS], axis=0)
    by_law = {name: np.ptp(own.sampled.qd[:, CYLINDERS], axis=0) for name, own in others.items()}
    amplitudes = [printed[f"amplitude_v{k}"] for k in range(1, 5)]
    in_mm = [replace(v, unit="mm·deg/s", printed_unit=v.unit) for v in amplitudes]
    unit = "we read the printed mm/s as mm·deg/s, the unit that results from joint rates in deg/s"
    own = np.degrees(1e3 * speeds)
    return [
        in_one_reading(
            in_mm[0],
            by_law["minimum-norm joint rates"][0],
            f"{unit}. Our value holds for minimum-norm joint rates between 39 s and 49 s. The rule "
            f"of figure 6 gives {own[0]:.0f} mm·deg/s, which is {1e3 * speeds[0]:.1f} mm/s",
        ),
        *(
            not_reproducible(
                in_mm[k],
                speeds[k],
                f"{unit}. In mm/s, our value is {1e3 * speeds[k]:.1f} mm/s",
                readings={name: values[k] for name, values in by_law.items()},
            )
            for k in (1, 2)
        ),
        in_one_reading(
            in_mm[3],
            speeds[2],
            f"{unit}. The printed value is the speed of cylinder 3 with the rule of figure 6. "
            f"This rule moves cylinder 4 at {own[3]:.0f} mm·deg/s",
        ),
    ]


def acceleration_rows(printed: dict[str, Printed], found: Process) -> list[Row]:
    """Compare accelerations at 39 s, which are infinite because rates jump between stages."""
    k = found.at(39)
    theta3, l2 = abs(found.rates[k, 2]), abs(found.sampled.qd[k, 2])
    return [
        in_one_reading(
            printed["jump_theta3"],
            theta3 / JUMP,
            f"the rate jumps by {np.degrees(theta3):.2f} deg/s, and the paper states no time "
            f"step. Our value is for a time step of {JUMP} s. For a time step of 1/{RATE:.0f} s, "
            f"the acceleration is {np.degrees(theta3 * RATE):.0f} deg/s²",
        ),
        not_reproducible(
            printed["jump_l2"],
            l2 * RATE,
            f"the speed jumps by {1e3 * l2:.2f} mm/s. Our value is for a time step of "
            f"1/{RATE:.0f} s",
            readings={
                f"a time step of {JUMP} s": l2 / JUMP,
                f"a time step of {JUMP} s and speeds in mm·deg/s": np.degrees(l2) / JUMP,
            },
        ),
    ]


def figures() -> Figures:
    """Draw figures 6 to 10, and the arm over the well."""
    return well_pictures.drawn(process())


if __name__ == "__main__":
    show(rows())
