"""Well manipulator: a working process of 49 s, and the quality of two models.

Closed chain cascade manipulator with an improved kinematic model, Mathematical Problems in
Engineering. The robot is `well_manipulator`; `robots/well_first_cylinder.toml` here is its first
cylinder with pin B where (64) prints it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import well_pictures
from numpy.typing import NDArray
from report import Figures, Printed, Row, agrees, assumed, erratum, not_reproducible, read, show

import chasles
from chasles.derive import load, model_report
from chasles.derive.quality.quality_report import ConventionQuality, ModelReport, plain
from chasles.study.motion import Sampled, Sequence, line

FloatArray = NDArray[np.float64]

ROBOT_FILES = Path(__file__).parents[2] / "derive" / "robots"
TURNING = [0, 1, 2, 4, 6]
"""theta1, 2, 3, 5 and 7 among the joints of the main chain."""
ARMS = TURNING[1:]
CYLINDERS = [1, 2, 4, 6]
"""The four cylinders among the coordinates."""
TELESCOPES = ["l_HI", "l_MN"]
OVER_THE_WELL = np.array([[0, 1, 0, 1.237], [0, 0, -1, 0], [-1, 0, 0, 1.02], [0, 0, 0, 1]])
"""Pose of R after 25 s [m], (4) of section 5."""
DESCENT = 2.166
"""Way down in each of the last two stages [m]: 216.6 mm/s for 10 s."""
BY_LAW = "with the law assumed for 39-49 s"
"""Note on what depends on the last stage, for which the paper names no law."""
RATE = 50.0
"""Samples per second."""
RESTARTS = 25
"""Restarts of the last stage that stand for rates of minimum norm."""


def rows() -> list[Row]:
    """Every printed number beside ours."""
    printed = read("well_manipulator")
    return [
        *constant_rows(printed),
        *stage_rows(printed),
        *state_rows(printed),
        *amplitude_rows(printed),
        *model_rows(printed),
        *equation_rows(printed),
    ]


@cache
def robot() -> Any:
    """The manipulator."""
    return chasles.load("well_manipulator")


# The constants (64)


def constant_rows(printed: dict[str, Printed]) -> list[Row]:
    """Every constant of (64); B is right as r_AB."""
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
        *(agrees(printed[key], np.array(vector)) for key, vector in vectors.items()),
        *(agrees(printed[key], value[key]) for key in ("theta4", "theta6")),
        erratum(
            printed["r_B"],
            np.array(vectors["r_AB"]),
            right,
            "y and z are exchanged, as r_AB and the triangle of (39) show",
        ),
    ]


# The process of section 5


@dataclass(frozen=True)
class Process:
    """The 49 s of section 5.

    Attributes:
        sampled: The motion of the coordinates and of R.
        theta: (m, 7) joints of the main chain [rad or m].
        rates: (m, 7) their rates [rad/s or m/s].
        swings: (m, 4) angles theta8 to theta11 of the cylinders [rad].
    """

    sampled: Sampled
    theta: FloatArray
    rates: FloatArray
    swings: FloatArray

    def at(self, time: float) -> int:
        """The index of the sample at a time [s]; where stages meet, the first of the later."""
        return int(np.searchsorted(self.sampled.t, time - 0.5 / RATE))


def initial() -> FloatArray:
    """(7,) joints of the main chain at the start, (63), telescopes retracted [rad or m]."""
    theta = np.zeros(7)
    theta[TURNING] = np.radians([0, 88.79, -49.2, -86.76, -40.62])
    return theta


def over_the_well(down: float) -> FloatArray:
    """The pose of R on its vertical line, a distance [m] below the one after 25 s."""
    pose = OVER_THE_WELL.copy()
    pose[2, 3] -= down
    return pose


@cache
def process(restarts: int = 1) -> Process:
    """All eight stages; in the last one four joints face three conditions.

    Args:
        restarts: Postures from which the last stage is solved by steps of minimum norm, at equal
            distances. One is the posture of 37 s; many are the integral of rates of minimum norm.
    """
    well, start = robot(), initial()
    q_start = well.actuators(start)
    q_object = q_start.copy()
    q_object[0] = np.radians(30)
    retracted = dict.fromkeys(TELESCOPES, 0.0)
    prepared = well.ik(OVER_THE_WELL, given={"theta2": start[1], **retracted})
    q_prepared = prepared.within_limits().nearest(q_start)
    narrow = line(over_the_well(0), over_the_well(DESCENT))
    moves = (
        Sequence(well, q_start)
        .move(q_object, "constant", duration=5, name="to the object")
        .hold(5, "grab")
        .move(q_start, "constant", duration=5, name="back")
        .move(well.chain(q_prepared), "constant", of="chain", duration=10, name="over the well")
        .hold(2, "adjust")
        .follow(narrow, "constant", lock=["theta2", *TELESCOPES], duration=10, name="in")
        .hold(2, "adjust")
    )
    for part in range(restarts):
        begin, end = (DESCENT * (1 + k / restarts) for k in (part, part + 1))
        moves = moves.follow(
            line(over_the_well(begin), over_the_well(end)),
            "constant",
            lock=TELESCOPES,
            redundancy="minimum_norm",
            duration=10 / restarts,
            name="down",
        )
    sampled = moves.sample(RATE)
    theta, rates = well.chain(sampled.q), well.chain_rates(sampled.q, sampled.qd)
    return Process(sampled, theta, rates, well.passive(sampled.q))


def stage_rows(printed: dict[str, Printed]) -> list[Row]:
    """What section 5 prints of each stage."""
    found = process()
    T, V = found.sampled.T, found.sampled.V
    after_39 = found.at(39)
    tool = {time: T[found.at(time), :3, 3] for time in (0, 5, 25, 37, 39)}
    evaluated = -1.146 - 0.2166 * (39 - 30)
    ours = {
        "theta1": found.theta[found.at(5), 0],
        "theta1_rate": found.rates[found.at(2), 0],
        "R_start": tool[0],
        "R_turned": tool[5],
        "R_object_z": tool[5][2],
        "R_25": tool[25],
        "R_7": T[found.at(30), :3, :3].round(9),
        "theta2_locked": found.theta[found.at(25), 1],
        "descent": -V[found.at(30), 2],
        "R_37": tool[37][2],
        "descent_8": -V[found.at(45), 2],
    }
    moved = 1e3 * digits_of_start()
    return [
        *(agrees(printed[key], value) for key, value in ours.items()),
        not_reproducible(
            printed["R_object"],
            tool[5][:2],
            f"(63) has two decimals: half a unit of the last moves R by up to {moved:.2f} mm",
        ),
        erratum(
            printed["R_39"],
            T[after_39, 2, 3],
            1.02 - DESCENT,
            "read 1020 - 2166 - 216.6 (t - 39), which goes on from 37 s; evaluated at 39 s",
            evaluated=evaluated,
        ),
        assumed(
            printed["law"],
            "minimum norm",
            "four joints face three conditions and the paper names no law: each pose is solved "
            "anew from the posture of 37 s by steps of minimum norm in the joint angles, which "
            "comes closest to the amplitudes",
        ),
    ]


def digits_of_start() -> float:
    """How far half a unit of the last digits of (63) moves R, at most along an axis [m]."""
    well, start = robot(), initial()
    J = well.jacobian_mixed(well.actuators(start)) @ well.actuators_D_chain(start)
    return float(np.abs(J[:3, ARMS]).sum(1).max() * np.radians(0.005))


def state_rows(printed: dict[str, Printed]) -> list[Row]:
    """Postures and rates, evaluated from the paper's equations apart from chasles."""
    well, found = robot(), process()
    first = well.chain(well.actuators(initial()))
    result = [
        agrees(printed["initial"], first[TURNING], "angles of (63) are in degrees"),
        agrees(printed["upright"], elevation(found.sampled.T[0])),
    ]
    for time in (0, 25, 37):
        k = found.at(time)
        result += [
            agrees(printed[f"angles_{time}"], found.theta[k, ARMS]),
            agrees(printed[f"lengths_{time}"], found.sampled.q[k, CYLINDERS]),
            agrees(printed[f"swings_{time}"], found.swings[k]),
        ]
    after_27 = found.at(27)
    return [
        *result,
        agrees(printed["rates_4"], found.rates[found.at(20), ARMS[1:]]),
        agrees(printed["rates_27"], found.rates[after_27, ARMS[1:]]),
        agrees(printed["speeds_27"], found.sampled.qd[after_27, CYLINDERS[1:]]),
    ]


def elevation(T: FloatArray) -> float:
    """Angle of the fifth arm above the horizontal [rad]."""
    return float(np.arctan2(T[2, 0], np.hypot(T[0, 0], T[1, 0])))


# Amplitudes of figures 6 to 10


def amplitude_rows(printed: dict[str, Printed]) -> list[Row]:
    """Largest less least value over the 49 s."""
    found = process()
    return [
        *angle_rows(printed, found),
        *length_rows(printed, found),
        *speed_rows(printed, found),
        *acceleration_rows(printed, found),
    ]


def angle_rows(printed: dict[str, Printed], found: Process) -> list[Row]:
    """Figures 6 and 8; the printed amplitudes of the cylinders' angles have no reading."""
    joints, swings = np.ptp(found.theta[:, TURNING], axis=0), np.ptp(found.swings, axis=0)
    on_arm = np.degrees(np.ptp(found.swings - found.theta[:, ARMS], axis=0))
    tried = (
        "tried: angle on the arm before, as (38) defines it; on the arm behind (here {:.1f}); "
        "each stage alone; B as printed"
    )
    names = ("theta1", "theta2", "theta3", "theta5", "theta7")
    return [
        *(
            agrees(printed[f"amplitude_{n}"], own, "" if n == "theta1" else BY_LAW)
            for n, own in zip(names, joints, strict=True)
        ),
        *(
            not_reproducible(printed[f"amplitude_theta{k}"], own, tried.format(behind))
            for k, own, behind in zip(range(8, 12), swings, on_arm, strict=True)
        ),
    ]


def length_rows(printed: dict[str, Printed], found: Process) -> list[Row]:
    """Figure 9; that of cylinder 1 as printed follows from the misprinted pin B."""
    first, *others = np.ptp(found.sampled.q[:, CYLINDERS], axis=0)
    misprinted = chasles.load(Path(__file__).parent / "robots" / "well_first_cylinder.toml")
    lengths = misprinted.actuators(found.theta[:, :2])[:, 1]
    return [
        erratum(
            printed["amplitude_l1"],
            first,
            "349",
            "345 follows from r_B as (64) prints it, in the row below",
        ),
        agrees(printed["swapped"], np.ptp(lengths), BY_LAW),
        *(agrees(printed[f"amplitude_l{k}"], own, BY_LAW) for k, own in enumerate(others, 2)),
    ]


def speed_rows(printed: dict[str, Printed], found: Process) -> list[Row]:
    """Figures 7 and 10: rates of joints where ours agree, the others with the reading tried."""
    tried = "tried: each pose from the posture of 37 s; rates of minimum norm, which give {:.{}f}"
    walked = process(RESTARTS)
    rates, others = (np.ptp(own.rates[:, TURNING], axis=0) for own in (found, walked))
    result = []
    for k, own, other in zip((1, 2, 3, 5, 7), rates, others, strict=True):
        item, words = printed[f"amplitude_rate{k}"], tried.format(np.degrees(other), 1)
        if k in (3, 5):
            result.append(not_reproducible(item, own, words))
        else:
            result.append(agrees(item, own, "" if k == 1 else BY_LAW))
    speeds, others = (np.ptp(own.sampled.qd[:, CYLINDERS], axis=0) for own in (found, walked))
    for k, own, other in zip((1, 2, 3, 4), speeds, others, strict=True):
        words = tried.format(np.degrees(1e3 * other), 0)
        if k == len(CYLINDERS):
            words += f"; ours of cylinder 3 is {np.degrees(1e3 * speeds[2]):.1f}"
        as_printed = "tried: mm deg/s, in the row below; ours in mm/s"
        result.append(not_reproducible(printed[f"amplitude_v{k}"], own, as_printed))
        result.append(not_reproducible(printed[f"amplitude_w{k}"], own, words))
    return result


def acceleration_rows(printed: dict[str, Printed], found: Process) -> list[Row]:
    """Rates jump where stages meet, so that no acceleration at 39 s is finite."""
    k = found.at(39)
    theta3, l2 = np.degrees(found.rates[k, 2]), 1e3 * found.sampled.qd[k, 2]
    jump = "the rate jumps there, by {:.3g} {}; a quotient of differences depends on its step"
    own = np.degrees(found.rates[k, 2] * RATE), found.sampled.qd[k, 2] * RATE
    return [
        not_reproducible(
            printed["jump_theta3"],
            np.radians(own[0]),
            f"{jump.format(theta3, 'deg/s')}: ours is over 1/{RATE:.0f} s",
        ),
        not_reproducible(
            printed["jump_l2"],
            own[1],
            f"{jump.format(l2, 'mm/s')}: ours is over 1/{RATE:.0f} s",
        ),
    ]


# Completeness, continuity and minimality


@cache
def quality() -> ModelReport:
    """The report on conventions at the manipulator's joints."""
    return model_report(load(ROBOT_FILES / "well_manipulator.toml"))


def convention(name: str, joint: int = 0) -> ConventionQuality:
    """A convention between two axes: 0 the first pair."""
    (found,) = [c for c in quality().joints[joint].conventions if c.convention == name]
    return found


def model_rows(printed: dict[str, Printed]) -> list[Row]:
    """Section 3: model (6) is `mdh5`, model (8) `hayati5`."""
    report = quality()
    r, t = report.revolute, report.prismatic
    parallel = convention("mdh5", 1)
    missed = f"between axes 2 and 3 it {parallel.verdict}"
    return [
        agrees(printed["det_6"], plain(convention("mdh5").determinant)),
        agrees(printed["det_8"], plain(convention("hayati5").determinant)),
        agrees(printed["det_whole"], plain(convention("mdh5").completed), "0 at parallel axes"),
        agrees(printed["parallel"], report.joints[1].angle, missed),
        agrees(printed["continuous_8"], convention("hayati5", 1).verdict),
        agrees(printed["identifiable"], report.identifiable),
        agrees(printed["complete"], report.suited_rank, "the rank over random postures"),
        erratum(
            printed["parameters"],
            report.suited_rank,
            4 * r + 2 * t + 6,
            "a fifth number places the frame along its axis, which no pose of the tool shows",
            evaluated=5 * r + 2 * t + 6,
        ),
    ]


# Errors of equations


def equation_rows(printed: dict[str, Printed]) -> list[Row]:
    """(25), (33) and (36) against the poses of the links."""
    well = robot()
    poses = well.link_poses(well.actuators(initial()))
    links = well.frames.links
    T = {link: poses[k] for k, link in enumerate(links)}
    own = T["arm_7"][:3, 3]
    lengths = {name: well.parameters[name].value for name in ("l_LM", "l_GH", "l_DG", "l_AD")}
    before = T["arm_5"][:3, 3] + T["arm_6"][:3, :3] @ (well.parameters["N_x"].value, N_y(), 0)
    corrected = before + lengths["l_LM"] * T["arm_5"][:3, 0]
    leaves = "model (8) shifts along x and z alone there, so that (25) and (33) leave it"
    return [
        equation_of_a_shift(printed["equation_25"], T["arm_4"], T["arm_5"], "I_y", leaves),
        equation_of_a_shift(printed["equation_33"], T["arm_6"], T["arm_7"], "N_y", leaves),
        erratum(
            printed["equation_36"],
            own,
            corrected,
            "read l_LM in its third line; l_MN is 0 in this motion",
            evaluated=before,
        ),
    ]


def N_y() -> float:
    """The offset of the fourth arm's second part [m]."""
    return float(robot().parameters["N_y"].value)


def equation_of_a_shift(
    item: Printed, before: FloatArray, behind: FloatArray, name: str, note: str
) -> Row:
    """The shift along y between two links, which model (8) cannot give."""
    own = chasles.screws.inverse(before) @ behind
    return erratum(item, own[1, 3], robot().parameters[name].value, note, evaluated=0.0)


def figures() -> Figures:
    """Figures 6 to 10, and the arm over the well."""
    return well_pictures.drawn(process())


if __name__ == "__main__":
    show(rows())
