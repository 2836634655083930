"""Part 1 of the report: tables, workspace, inverse kinematics and motions of the Lynxmotion arm."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from report import (
    MISSING,
    TWICE,
    Finding,
    Printed,
    Row,
    agrees,
    assumed,
    at,
    consistent,
    erratum,
    evaluated,
    lost,
    not_printed,
)

import chasles
from chasles.study import Workspace, exact_workspace, workspace
from chasles.study.grid import indices
from chasles.study.motion import MotionSequence, Trajectory, parabola, task_curve, task_line
from chasles.study.planning import configuration_space, sphere
from chasles.study.samples import samples_of

HERE = Path(__file__).parent
VIA = np.array(
    [[0.2, 0.2, 0.1], [0.2, 0.15, 0.05], [0.2, 0.1, 0.1], [0.2, 0.05, 0.05], [0.2, 0, 0.1]]
)
"""Via points of table 1.4 [m]."""
CONFIGURATIONS = np.radians(
    [[50, -25, 45, -60, 0], [60, -30, 50, -55, 0], [70, -35, 55, -50, 0], [80, -40, 60, -45, 0]]
)
"""Configurations of table 1.2, with theta5 = 0."""
SAMPLES, FINEST = 500_000, 30
"""Number of workspace samples, and number of cells along the longest side of the workspace."""
D1 = 0.05
"""Shoulder height of the Lynxmotion arm in all motions [m], as in robots/lynxmotion_low.toml."""
BALL, RADIUS = np.array([0.2, 0.075, 0.075]), 0.012
"""Center and radius of the sphere obstacle [m]. We chose a sphere midway between points 3 and 4,
because our copy of the report has no figure 1.10."""
DETOUR = np.array([0.2, 0.075, 0.14])
"""Via point above the sphere obstacle [m]."""
THIN, THICK = 1e-4, 0.012
"""Link radii [m]: `THIN` for distances from link center lines, and `THICK` for the links in part 3.
"""
RATE = 100.0
"""Samples of a motion per second, for the sampling interval of 0.01 s in the paper."""
FINE = 600.0
"""Sampling frequency [Hz] for maxima, a multiple of three because trapezoidal phases end at thirds
of a second."""
GENERIC = "The test arm has the lengths d1 = 70, a2 = 120, a3 = 90 and d5 = 50 mm"
ROUNDING = 1e-9
"""Lengths [m] and angles [rad] below this value count as 0."""
PHASES = 3
"""Number of phases of a trapezoidal speed profile: acceleration, uniform speed and deceleration."""
BISECTIONS = 40


@cache
def arm() -> Any:
    """Load the Lynxmotion arm with all lengths equal to 0.1 m."""
    return chasles.load("lynxmotion")


@cache
def generic() -> Any:
    """Load a variant of the arm with four different lengths, to test equations."""
    return chasles.load(HERE / "robots" / "lynxmotion_generic.toml")


@cache
def low() -> Any:
    """Load the arm with a lower shoulder, so that all via points are within its limits."""
    return chasles.load(HERE / "robots" / "lynxmotion_low.toml")


def rows(printed: dict[str, Printed]) -> list[Row]:
    """Compare every number in part 1 of the report with the value that chasles computes."""
    return [
        *model(printed),
        *forward(printed),
        *reach(printed),
        *inverse(printed),
        *limits(printed),
        *free_motion(printed),
        *straight_lines(printed),
        *detour(printed),
        *quintics(printed),
    ]


def model(printed: dict[str, Printed]) -> list[Row]:
    """Compare equation (1.2) at generic values, the rows of table 1.1, and the arm lengths."""
    robot, q = arm(), np.array([0.3, 0.7, -0.4, 0.5, -0.6])
    joint = chasles.load(HERE / "robots" / "mdh_row.toml")
    row = {name: own.value for name, own in joint.parameters.items()} | {"theta": 0.7}
    values = dict(zip(("q1", "q2", "q3", "q4", "q5"), map(float, q), strict=True))
    T = np.concatenate([np.eye(4)[None], robot.link_poses(q)])
    turned = np.repeat(q[None], 37, axis=0)
    turned[:, 4] = np.linspace(0, 2 * np.pi, 37)
    p = robot.fk(turned)[:, :3, 3]
    path = float(np.linalg.norm(np.diff(p, axis=0), axis=1).sum())
    names = ("d1", "a2", "a3", "d5")

    def by_rows(table: Printed) -> Any:
        symbols = ("alpha", "a", "theta", "d")
        rows = [dict(zip(symbols, own, strict=True)) for own in evaluated(table, **values)]
        return np.array([evaluated(printed["mdh"], **own) for own in rows])

    return [
        consistent(printed["lengths"], [robot.parameters[name].value for name in names]),
        agrees(
            printed["mdh"],
            joint.fk([0.7]),
            "we evaluated the matrix at theta = 0.7 rad, alpha = 0.3 rad, a = 0.34 m and "
            "d = 0.21 m",
            evaluated=at(**row),
        ),
        consistent(
            printed["table_1_1"],
            np.linalg.solve(T[:-1], T[1:]),
            "we evaluated the rows by equation (1.2) at q = (0.3, 0.7, -0.4, 0.5, -0.6)",
            evaluated=by_rows,
        ),
        agrees(
            printed["roll"],
            Finding(path < ROUNDING, f"a path of {1000 * path:.6f} mm"),
            "the tool moves along this path while theta5 rotates by 360 deg",
        ),
    ]


def forward(printed: dict[str, Printed]) -> list[Row]:
    """Compare the tool poses of table 1.2, and check the limits of table 1.3."""
    robot = arm()
    T = robot.fk(CONFIGURATIONS)
    pitch = np.arctan2(T[:, 2, 2], np.hypot(T[:, 0, 2], T[:, 1, 2]))
    found = [consistent(printed["table_1_2"], CONFIGURATIONS[:, :4])]
    for k in range(2):
        found += [
            consistent(printed[f"position_{k + 1}"], T[k, :3, 3], TWICE),
            consistent(printed[f"pitch_{k + 1}"], pitch[k], TWICE),
        ]
    for k in range(2, 4):
        note = f"{MISSING}. The pitch of the tool is {np.degrees(pitch[k]):.1f} deg"
        found.append(lost(printed[f"position_{k + 1}"], T[k, :3, 3], note))
    upright = CONFIGURATIONS + np.array([0, np.pi / 2, 0, 0, 0])
    mirrored = CONFIGURATIONS * [1, -1, -1, -1, 1]
    counts = [within(q) for q in (CONFIGURATIONS, mirrored, upright)]
    words = f"{counts[1]} of 4 configurations are within the limits"
    other = f"if q2 is measured from the vertical, {counts[2]} of 4 are"
    return [
        *found,
        not_printed(
            printed["within_limits"],
            f"{counts[0]} of 4",
            f"the report does not compare its tables. Every q2 in table 1.2 is negative, but the "
            f"lower limit of q2 is 30 deg. If the signs of q2 to q4 are reversed, {words}; {other}",
        ),
    ]


def within(q: Any) -> int:
    """Count configurations within the limits of the arm."""
    robot = arm()
    return int(((q > robot.lower) & (q < robot.upper)).all(-1).sum())


@cache
def found_workspace() -> Workspace:
    """Compute the workspace of the arm within the joint limits of table 1.3."""
    return workspace(arm(), SAMPLES, resolution=FINEST, threads=2, progress=False)


def few_samples() -> Any:
    """Return tool positions (5000, 3) [m] at random configurations, as many as in the paper."""
    robot = arm()
    some = samples_of(robot, 5000, "uniform", key=0)
    q = np.concatenate([block.copy() for block in some.blocks(0)])
    return robot.fk(q)[:, :3, 3]


def reach(printed: dict[str, Printed]) -> list[Row]:
    """Compare the extents and volume of the workspace, and the fraction that samples cover."""
    robot, whole, p = arm(), found_workspace(), few_samples()
    cells = np.unique(indices(whole.grid, p))
    share = len(cells) / np.count_nonzero(whole.hits)
    limits = np.column_stack([robot.lower, robot.upper])[:4]
    side = f"{1000 * whole.grid.side:.0f} mm"
    missed = 1000 * max(
        np.abs(p.min(0) - whole.bounds[0]).max(), (whole.bounds[1] - p.max(0)).max()
    )
    measure = whole.size
    sampled = f"{SAMPLES} samples give {measure.value:.4f} ± {measure.error:.4f} m³"
    note = f"{MISSING}. We compute the volume from the boundary arcs. {sampled}"
    tried = f"{SAMPLES} samples hit {np.count_nonzero(whole.hits)} cubes with sides of {side}"
    return [
        consistent(printed["limits"], limits),
        consistent(printed["samples"], len(p)),
        consistent(printed["extents"], whole.bounds, TWICE),
        not_printed(
            printed["cover"],
            share,
            f"the sentence “{printed['cover'].text}” states no number. {tried}. The extents of "
            f"5000 samples are {missed:.1f} mm too small",
        ),
        lost(printed["volume"], exact_workspace(robot).volume, note),
    ]


def solutions(robot: Any, points: Any) -> Any:
    """Return both configurations (m, 2, 5) with a horizontal tool at m points, elbow up first."""
    x = np.column_stack([points, np.zeros(len(points))])
    found = robot.ik_position_pitch(x)
    facing = np.abs(found.q[..., 0]) <= np.pi / 2
    q = np.array([own[kept] for own, kept in zip(found.q, found.valid & facing, strict=True)])
    return np.take_along_axis(q, np.argsort(q[..., 2], axis=1)[..., None], axis=1)


def inverse(printed: dict[str, Printed]) -> list[Row]:
    """Compare equations (1.11) to (1.14), and the configurations at the via points."""
    q = solutions(arm(), VIA)
    found = []
    for name, k in {1: 0, 3: 2, 5: 4}.items():
        found += [
            consistent(printed[f"base_{name}"], q[k, 0, 0], TWICE),
            consistent(printed[f"up_{name}"], q[k, 0, 1:4], TWICE),
            consistent(printed[f"down_{name}"], q[k, 1, 1:4], TWICE),
        ]
    for name, k in ((2, 1), (4, 3)):
        found.append(lost(printed[f"up_{name}"], q[k, 0, :4], MISSING))
    T_via = arm().fk(q)
    pitch = np.abs(np.arcsin(T_via[:, 0, 2, 2])).max()
    return [
        *inverse_equations(printed),
        consistent(printed["via_points"], T_via[:, 0, :3, 3]),
        agrees(
            printed["horizontal"],
            Finding(pitch < ROUNDING, f"an elevation of at most {np.degrees(pitch):.6f} deg"),
            "we evaluated all via points, with elbow up",
        ),
        *found,
    ]


def inverse_equations(printed: dict[str, Printed]) -> list[Row]:
    """Compare equations (1.11) to (1.14) at via point 2 for an arm with four different lengths."""
    robot = generic()
    q = solutions(robot, VIA[1:2])[0]
    T = robot.link_poses(q[0])
    wrist = np.linalg.solve(T[0], T[3])[:3, 3]
    l1, l2 = robot.parameters["a2"].value, robot.parameters["a3"].value
    plane = {"x1": wrist[0], "z1": wrist[2], "l1": l1, "l2": l2}
    q1, q2, q3, q4 = q[0, :4]
    beta, alpha = q[:, 1].mean(), (q[0, 1] - q[1, 1]) / 2
    both = {
        "alpha": np.arccos(evaluated(printed["elbow"], **plane)),
        "beta": evaluated(printed["shoulder"], **plane),
    }
    angles = {"phi": -np.pi / 2, "q1": q1, "q2": q2, "q3": q3}
    right = Printed("", str(printed["theta4"].value).replace("q1 - ", ""), "deg", "")
    return [
        agrees(printed["shoulder"], beta, GENERIC, evaluated=at(**plane)),
        agrees(printed["elbow"], np.cos(alpha), GENERIC, evaluated=at(**plane)),
        agrees(
            printed["theta2"],
            q[:, 1],
            f"equations (1.11) and (1.12) give beta and alpha. {GENERIC}",
            evaluated=at(**both),
        ),
        erratum(
            printed["theta4"],
            q4,
            evaluated(right, **angles),
            "theta1 rotates about the vertical. The correct equation is phi - theta2 - theta3 with "
            f"theta1 = atan2(y, x) and phi = -90 deg. {GENERIC}",
            evaluated=at(**angles),
        ),
    ]


def limits(printed: dict[str, Printed]) -> list[Row]:
    """Find the shoulder heights at which the arm reaches all via points within its limits."""
    count = reached(0.1).sum()
    numbers = [f"{k + 1}" for k in np.flatnonzero(reached(0.1))]
    least, largest = (bisected(D1, end) for end in (0.0, 0.1))
    words = (
        f"the report does not compare its tables. With d1 = 0.1 m, only points "
        f"{' and '.join(numbers)} are reachable, but the motions pass through all five points"
    )
    reason = (
        "with d1 = 0.1 m, the arm does not reach three of the via points. Our value of d1 is the "
        "rounded middle of the range in which the arm reaches all via points"
    )
    return [
        not_printed(printed["via_within"], f"{int(count)} of 5", words),
        consistent(printed["least_d1"], least, TWICE),
        consistent(printed["largest_d1"], largest, TWICE),
        assumed(printed["d1"], low().parameters["d1"].value, reason),
    ]


def reached(d1: float) -> Any:
    """Test for each of the five via points whether the arm reaches the point within its limits.

    Instead of lowering the shoulder of the arm, the function raises the via points, which is
    equivalent.
    """
    lift = np.array([0, 0, arm().parameters["d1"].value - d1])
    x = np.column_stack([VIA + lift, np.zeros(len(VIA))])
    return arm().ik_position_pitch(x).within_limits().valid.any(-1)


def bisected(inside: float, outside: float) -> float:
    """Find by bisection the shoulder height [m] at which a via point becomes unreachable."""
    for _ in range(BISECTIONS):
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if reached(middle).all() else (inside, middle)
    return inside


def start() -> MotionSequence:
    """Return a motion sequence that starts at the first via point with the elbow up."""
    return MotionSequence(low(), solutions(low(), VIA[:1])[0, 0])


def task(point: Any) -> Any:
    """Return the task coordinates of a point with a horizontal tool: position and pitch 0."""
    return np.r_[point, 0.0]


@cache
def free() -> Trajectory:
    """Return the motion of figure 1.6: two parabolas through via points 1-2-3 and 3-4-5."""
    found = start()
    for k in (0, 2):
        curve = task_curve("position_pitch", parabola(VIA[k : k + 3]))
        found = found.follow(curve, "constant", duration=0.5)
    return found.sample(RATE)


@cache
def lines(rate: float = RATE) -> Trajectory:
    """Return the motion of figures 1.7 to 1.9: straight lines of 1 s each, trapezoidal speed."""
    return along(VIA, rate)


@cache
def around(rate: float = RATE) -> Trajectory:
    """Return the motion of figure 1.10, whose third line ends at a point above the sphere."""
    return along(np.vstack([VIA[:3], DETOUR, VIA[3:]]), rate)


def along(points: Any, rate: float) -> Trajectory:
    """Return a motion along straight lines between points, with 1 s for each line."""
    found = start()
    for a, b in pairwise(points):
        curve = task_line("position_pitch", task(a), task(b))
        found = found.follow(curve, "trapezoidal", duration=1.0)
    return found.sample(rate)


@cache
def polynomials() -> Trajectory:
    """Return the motion of figure 1.11: quintic joint polynomials, 1 s between via points."""
    found = start()
    for q in solutions(low(), VIA)[1:, 0]:
        found = found.move(q, "quintic", duration=1.0)
    return found.sample(RATE)


def free_motion(printed: dict[str, Printed]) -> list[Row]:
    """Compare time steps and via-point distances of the parabolic motion in figure 1.6."""
    made = free()
    p = made.T[:, :3, 3]
    miss = np.linalg.norm(p[None] - VIA[:, None], axis=-1).min(1).max()
    inner = [np.linalg.norm(p[None] - VIA[[k], None], axis=-1).min() for k in (0, 2, 4)]
    speed = np.linalg.norm(made.V[:, :3], axis=1)
    words = (
        "three points do not determine a conic. One of our parabolas passes through points 1, 2 "
        "and 3, and the other through points 3, 4 and 5"
    )
    return [
        assumed(printed["free_curve"], "a parabola", words),
        consistent(printed["free_steps"], (len(made.t) - 1) // 2),
        consistent(printed["free_time"], made.t[1]),
        consistent(
            printed["free_error"],
            max(inner),
            f"{TWICE}; the points are 1, 3 and 5. Points 2 and 4 are within {1000 * miss:.2f} mm "
            "of the nearest step",
        ),
        lost(
            printed["free_speed"],
            [speed.min(), speed.max()],
            f"{MISSING}. The parabola parameter is linear in time, so the speed varies",
        ),
    ]


def straight_lines(printed: dict[str, Printed]) -> list[Row]:
    """Compare the motion on straight lines: phases, tool speeds, joint rates and straightness."""
    made = lines()
    speed = np.linalg.norm(made.V[:, :3], axis=1)
    peaks = [speed[made.stage == k].max() for k in range(4)]
    acceleration = np.diff(speed[made.stage == 0])
    scale = np.abs(acceleration).max()
    signs = np.sign(np.where(np.abs(acceleration) < scale / 10, 0, acceleration))
    phases = 1 + int(np.count_nonzero(np.diff(signs)))
    return [
        agrees(
            printed["phases"],
            Finding(phases == PHASES, f"{phases} phases"),
            "the sampled speed on the first line has three phases: rising, constant and falling",
        ),
        assumed(
            printed["line_time"],
            1.0,
            f"{MISSING}. Our value is the time between the via points of figure 1.11",
        ),
        lost(
            printed["line_speed"],
            peaks,
            f"{MISSING}. Each speed is 1.5 times the length of the line divided by its time",
        ),
        lost(
            printed["line_rates"],
            np.abs(lines(FINE).qd).max(0)[:4],
            f"{MISSING}. Our values use {FINE:.0f} samples/s, because {RATE:.0f} samples/s miss "
            f"the maxima",
        ),
        consistent(printed["line_error"], off_lines(made), TWICE),
    ]


def off_lines(made: Trajectory) -> float:
    """Return the largest distance [m] of the tool from the lines between the via points."""
    a, b = VIA[made.stage], VIA[made.stage + 1]
    along = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
    p = made.T[:, :3, 3] - a
    return float(np.linalg.norm(p - (p * along).sum(1, keepdims=True) * along, axis=1).max())


def detour(printed: dict[str, Printed]) -> list[Row]:
    """Return table rows for the sphere between via points 3 and 4, and the clearance around it."""
    reason = f"{MISSING}. We chose a sphere midway between points 3 and 4"
    clear = clearance(around(FINE))
    return [
        assumed(printed["ball"], RADIUS, reason),
        assumed(printed["detour"], DETOUR, "we chose a point above the midpoint of points 3 and 4"),
        not_printed(
            printed["blocked"],
            clearance(lines()),
            "our value is negative, because the straight line penetrates the sphere",
        ),
        not_printed(
            printed["clearance"],
            clear,
            "our value is the smallest distance along all five lines, from the axes of the links. "
            f"Links of {1000 * THICK:.0f} mm radius, as in part 3, would penetrate the sphere by "
            f"{1000 * (THICK - clear):.1f} mm",
        ),
    ]


def clearance(made: Trajectory) -> float:
    """Return the minimum distance [m] of link center lines from the sphere during a motion."""
    space = configuration_space(low(), [sphere(BALL, RADIUS)], radius=THIN)
    own = [k for k, (_, other) in enumerate(space.checks) if other == 0]
    return float(min(space.distances(q)[own].min() for q in made.q)) + THIN


def quintics(printed: dict[str, Printed]) -> list[Row]:
    """Compare the quintic polynomials: durations, rates at the ends, and peak rates."""
    made = polynomials()
    ends = np.isin(made.t.round(6), range(5))
    step = np.abs(np.diff(made.q[ends], axis=0))[:, :4]
    peaks = np.array([np.abs(made.qd[made.stage == k]).max(0)[:4] for k in range(4)])
    ratio = (peaks / step)[step > 0]
    return [
        consistent(printed["quintic_time"], made.t[-1] / 4),
        agrees(printed["quintic_ends"], np.abs(made.qd[ends]).max()),
        agrees(printed["quintic_stops"], np.abs(made.qdd[ends]).max()),
        consistent(
            printed["quintic_peak"],
            ratio.mean(),
            f"{TWICE}; the value is a mean over all joints and segments",
        ),
        lost(printed["quintic_rates"], peaks.max(0), MISSING),
    ]
