"""Eight-axis photographic robot.

X. Xie, X. Miao, S. Wang, F. Zhang: Kinematic Model Analysis of an 8-DOF Photographic Robot.
Transactions on Intelligent Welding Manufacturing, 2018.

    $ python docs/papers/photo_robot.py
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from report import (
    TWICE,
    Figures,
    Finding,
    Printed,
    Row,
    agrees,
    assumed,
    at,
    consistent,
    erratum,
    evaluated,
    not_printed,
    not_reproducible,
    read,
    show,
)

import chasles
import chasles.derive
from chasles.study.motion import Motion, Trajectory, joint_line, time_scaling

HERE = Path(__file__).parent
CONFIGURATION = np.array([0.4, 0.3, -0.5, 0.2, 0.6, -0.7, 0.8, -0.9])
CASE = "The configuration of the robot is (0.4, 0.3, -0.5, 0.2, 0.6, -0.7, 0.8, -0.9) m or rad"
MATRICES = ("A0", "A1", "A2", "A3", "A4", "A5", "A6", "A7", "Aee")
ENDS = {"a": 1.0, "b": np.pi / 2, "c": np.pi / 2, "d": 0.5} | dict.fromkeys("efgh", np.pi / 2)
"""Assumed joint value at the end of the motion in each panel of figure 3 [m or rad]. The paper
moves each axis "as much as possible", and prints no limits."""
AXES = dict(zip("abcdefgh", (0, 2, 1, 3, 4, 5, 6, 7), strict=True))
"""Index of the joint that moves in each panel of figure 3."""
SLIDES = (0, 3)
ROUNDING = 1e-12
"""Points coincide if their distance is smaller than this length [m]."""


def rows() -> list[Row]:
    """Compare every number that the paper prints with the value that chasles computes."""
    printed, robot = read("photo_robot"), chasles.load("photo_robot")
    return [
        *structure(printed, robot),
        *parameters(printed, robot),
        *matrices(printed, robot),
        *s_model(printed),
        *poses(printed, robot),
        *calibration(printed),
        *figure_3(printed, robot),
    ]


def structure(printed: dict[str, Printed], robot: Any) -> list[Row]:
    """Compare the number and types of the joints.

    The letter S denotes three axes through one point.
    """
    letters = "".join("P" if axis.unit == "m" else "R" for axis in robot.coordinates)
    wrist = robot.link_poses(CONFIGURATION)[6:, :3, 3]
    meet = "S" if np.ptp(wrist, axis=0).max() < ROUNDING else "RRR"
    rank = np.linalg.matrix_rank(robot.jacobian_mixed(CONFIGURATION))
    reached = robot.ik(
        robot.fk(CONFIGURATION), fixed={"r1": CONFIGURATION[0], "r4": CONFIGURATION[3]}
    )
    return [
        consistent(printed["freedoms"], robot.n),
        agrees(
            printed["kinds"], f"{letters[:5]}-{meet}", "the last three axes intersect in a point"
        ),
        agrees(
            printed["redundancy"],
            robot.n - int(rank),
            "the value is 8 minus the rank of the Jacobian",
        ),
        not_printed(
            printed["inverse"],
            int(reached.count),
            f"the solutions are in closed form. {CASE}",
        ),
    ]


def parameters(printed: dict[str, Printed], robot: Any) -> list[Row]:
    """Compare the lengths below equation (12), where the paper prints r1 = 0 twice."""
    names = ("r10", "r2", "l3", "r40", "r6")
    ring_top = robot.link_poses(np.zeros(8))[2, 2, 3]
    below = evaluated(printed["r20"]) - 1e3 * ring_top
    return [
        assumed(
            printed["unit"],
            "mm",
            "the paper prints no unit; with lengths in mm, the arm reaches a few meters",
        ),
        *(consistent(printed[name], robot.parameters[name].value) for name in names),
        not_reproducible(
            printed["r20"],
            ring_top,
            "no equation contains r20. Our value is r2: by equations (3) to (5), the ring top has "
            f"the height r2 in the world frame. With r20, the upper surface of the track lies "
            f"{below:.0f} mm below the world frame, although the text defines the world frame on "
            "this surface",
        ),
    ]


def matrices(printed: dict[str, Printed], robot: Any) -> list[Row]:
    """Compare table 1 and equations (1) and (3) to (11) with chasles.

    Equation (1) is evaluated at arbitrary values.
    """
    joint, theta = chasles.load(HERE / "robots" / "dh_row.toml"), 0.7
    T, own = joint.fk([theta]), steps(robot, CONFIGURATION)
    values, symbols = lengths(joint) | {"theta": theta}, at_configuration(robot)
    right = Printed("", str(printed["dh_22"].value).replace("sin(theta)", "cos(theta)"), "", "")
    return [
        agrees(
            printed["dh"],
            np.delete(T.ravel(), 5),
            "we evaluated the matrix at theta = 0.7 rad, alpha = 0.3 rad, r = 0.21 m and "
            "l = 0.34 m",
            evaluated=lambda item: evaluated_rows(item, values),
        ),
        erratum(
            printed["dh_22"],
            T[1, 1],
            evaluated(right, **values),
            "the correct factor is cos(theta) instead of sin(theta). Each alpha of table 1 is "
            "±90 deg, so the factor cos(alpha) of the entry is 0",
            evaluated=at(**values),
        ),
        consistent(
            printed["table_1"],
            own[:8],
            f"we evaluated the rows by the corrected equation (1). {CASE}",
            evaluated=lambda item: by_corrected_dh(item, symbols),
        ),
        *(
            agrees(printed[name], step, CASE, evaluated=at(**symbols))
            for name, step in zip(MATRICES, own, strict=True)
        ),
    ]


def by_corrected_dh(table: Printed, symbols: dict[str, float]) -> Any:
    """Return pose matrices (8, 4, 4) of the rows of table 1, by the corrected equation (1)."""
    return np.array([dh_matrix(*row) for row in evaluated(table, **symbols)])


def dh_matrix(theta: float, r: float, length: float, alpha: float) -> Any:
    """Return the DH matrix of equation (1), with the misprint of the paper corrected."""
    c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    return [
        [c, -ca * s, s * sa, length * c],
        [s, ca * c, -c * sa, length * s],
        [0, sa, ca, r],
        [0, 0, 0, 1],
    ]


def lengths(robot: Any) -> dict[str, float]:
    """Return the parameters of the robot, keyed by name [m]."""
    return {name: parameter.value for name, parameter in robot.parameters.items()}


def at_configuration(robot: Any) -> dict[str, float]:
    """Return the values of the symbols in table 1 and equations (3) to (11)."""
    symbols = ("r1", "t2", "t3", "r4", "t5", "t6", "t7", "tee")
    return dict(zip(symbols, map(float, CONFIGURATION), strict=True)) | lengths(robot)


def steps(robot: Any, q: Any) -> Any:
    """Return the pose (9, 4, 4) of each link frame relative to the preceding frame."""
    T = np.concatenate([np.eye(4)[None], robot.link_poses(q)])
    return np.linalg.solve(T[:-1], T[1:])


def s_model(printed: dict[str, Printed]) -> list[Row]:
    """Compare equation (2) with a joint that has six nonzero parameters, and with equation (11)."""
    joint, theta = chasles.load(HERE / "robots" / "s_model.toml"), 0.7
    T = joint.fk([theta])
    numbers = lengths(joint)
    symbols = {"ct": np.cos(theta), "st": np.sin(theta)} | {name: numbers[name] for name in "xyz"}
    for name in ("alpha", "beta"):
        symbols |= {f"c{name[0]}": np.cos(numbers[name]), f"s{name[0]}": np.sin(numbers[name])}
    right = Printed("", str(printed["s_model_y"].value).replace("ca*cb", "ca*ct"), "m", "")
    last = chasles.load(HERE / "robots" / "s_model_zero.toml").fk(CONFIGURATION[-1:])
    c, s = np.cos(CONFIGURATION[-1]), np.sin(CONFIGURATION[-1])
    return [
        agrees(
            printed["s_model"],
            np.delete(T[:3].ravel(), 7),
            "we evaluated the matrix at theta = 0.7 rad, alpha = 0.3 rad, beta = -0.4 rad and "
            "(x, y, z) = (0.11, 0.23, -0.17) m",
            evaluated=lambda item: evaluated_rows(item, symbols),
        ),
        erratum(
            printed["s_model_y"],
            T[1, 3],
            evaluated(right, **symbols),
            "the correct factor of y is cos(alpha) cos(theta) + sin(alpha) sin(beta) sin(theta). "
            "The paper prints cos(beta) instead of cos(theta)",
            evaluated=at(**symbols),
        ),
        erratum(
            printed["Aee_by_2"],
            last[:2, :2],
            np.array([[c, -s], [s, c]]),
            "equation (11) rotates by -theta_ee. Equation (2) with row 7-EE of table 1 rotates by "
            "+theta_ee = -0.9 rad. The robot file uses the direction of equation (11)",
            evaluated=at(tee=CONFIGURATION[-1]),
        ),
    ]


def evaluated_rows(printed: Printed, symbols: dict[str, float]) -> Any:
    """Evaluate the printed equations of a matrix row by row, and return all values in an array."""
    texts = [text for row in printed.value or () for text in row]
    return np.array([evaluated(Printed("", text, "", ""), **symbols) for text in texts])


def poses(printed: dict[str, Printed], robot: Any) -> list[Row]:
    """Compare equation (12), and poses by equations (3) to (11), with the poses of chasles."""
    found = []
    for name, q in (("zero", np.zeros(8)), ("configuration", CONFIGURATION)):
        T_w_ee, T_w_0 = robot.fk(q), robot.link_poses(q)[0]
        found += columns(printed[f"{name}_world"], T_w_ee)
        found += columns(printed[f"{name}_track"], np.linalg.solve(T_w_0, T_w_ee))
    symbols = at_configuration(robot)
    first, *others = (evaluated(printed[name], **symbols) for name in MATRICES)
    product = np.linalg.multi_dot(others)
    whole = first @ product
    note = (
        "the correct product is A0 A1 ... A7 Aee. The product starts with A0, because the text "
        f"states the position in the world frame. {CASE}"
    )
    return [
        erratum(
            printed["world"],
            robot.fk(CONFIGURATION)[:3, 3],
            whole[:3, 3],
            note,
            evaluated=lambda _: product[:3, 3],
        ),
        *found,
    ]


def columns(pose: Printed, ours: Any) -> list[Row]:
    """Return four table rows for a pose: its x, y and z axes and its position."""
    table = np.array(pose.value)
    return [
        consistent(
            replace(pose, item=f"{pose.item}: {name}", value=tuple(table[:, k])),
            ours[:3, k],
            f"{TWICE}; {pose.text}" if pose.text else TWICE,
        )
        for k, name in enumerate(("x axis", "y axis", "z axis", "position [m]"))
    ]


def calibration(printed: dict[str, Printed]) -> list[Row]:
    """Check the claims of section 5 that the kinematic model is complete and continuous."""
    folder = Path(chasles.derive.__file__).parent / "robots"
    report = chasles.derive.model_report(chasles.derive.read(folder / "photo_robot.toml"))
    complete = report.rank == report.identifiable
    rank = f"the rank {report.rank} for {report.identifiable} = 4 r + 2 t + 6 parameters"
    rows = [quality(joint, "dh") for joint in report.joints]
    by_ee = quality(report.joints[-1], "s_model").completed
    zeros = dict.fromkeys(by_ee.free_symbols, 0)
    values = [*(row.value for row in rows), float(by_ee.subs(zeros))]
    return [
        agrees(
            printed["complete"], Finding(complete, rank), "the parameters include base and tool"
        ),
        agrees(
            printed["continuous"],
            Finding(
                all(row.is_continuous for row in rows) and min(values) > 0,
                f"values of det(D^T D) of at least {min(values):.1f}",
            ),
            f"for DH, det(D^T D) is {rows[0].completed}, and each alpha between two axes is "
            f"±90 deg. For the S-model, det(D^T D) is {by_ee}, and beta of row 7-EE is 0",
        ),
        not_printed(
            printed["numbers"],
            report.identifiable,
            f"the paper's conventions have {report.numbers} parameters, including base and tool",
        ),
    ]


def quality(joint: Any, convention: str) -> Any:
    """Return the report of one kinematic convention for a joint."""
    return next(own for own in joint.conventions if own.convention == convention)


def figure_3(printed: dict[str, Printed], robot: Any) -> list[Row]:
    """Measure the tool's path in each panel of figure 3, in which one axis moves from zero."""
    found = []
    for part in AXES:
        p = moved(robot, part).T[:, :3, 3]
        way = float(np.linalg.norm(np.diff(p, axis=0), axis=1).sum())
        end = f"the tool ends at {place(p[-1])} m"
        end = "the tool is at the wrist center, so it does not move" if way < ROUNDING else end
        reason = f"the paper prints no final configuration. At our final configuration, {end}"
        found.append(assumed(printed[part], way, reason))
    return found


def place(p: Any) -> str:
    """Format a position [m]."""
    return f"({', '.join(f'{value + 0.0:.3f}' for value in np.round(p, 3))})"


def moved(robot: Any, part: str) -> Trajectory:
    """Return the motion of a panel of figure 3: one axis moves, and the others stay at zero."""
    end = np.zeros(8)
    end[AXES[part]] = ENDS[part]
    curve = joint_line(np.zeros(8), end)
    return Motion(robot, curve, time_scaling("quintic", 1.0, duration=2.0), np.zeros(8)).sample(100)


def figures() -> Figures:
    """Draw figures 1, 2 and 3 a to h, and an animation in which all eight axes move in turn."""
    from photo_pictures import all_axes, axis_moved, frames  # noqa: PLC0415

    robot = chasles.load("photo_robot")
    found: Figures = {
        "figure 1: axes of motion, q1 = r1 to q8 = theta_ee, at a bent arm": chasles.draw(robot),
        "figure 2: frames of the links at zero": frames(robot),
    }
    for part, axis in AXES.items():
        name = f"figure 3 {part}: {robot.coordinates[axis].name} from zero to {end_state(part)}"
        found[name] = axis_moved(robot, moved(robot, part))
    found["figure 3: all axes, one after the other and back"] = all_axes(
        robot, [moved(robot, part) for part in AXES]
    )
    return found


def end_state(part: str) -> str:
    """Format the assumed joint value at the end of the motion in a panel of figure 3."""
    return f"{ENDS[part]:g} m" if AXES[part] in SLIDES else f"{np.degrees(ENDS[part]):.0f} deg"


if __name__ == "__main__":
    show(rows())
