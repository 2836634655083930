"""Part 1 of the report: the Lynxmotion arm, its tables, workspace, inverse and five motions."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from report import (
    Printed,
    Row,
    agrees,
    assumed,
    erratum,
    evaluated,
    lost,
    not_reproducible,
)

import chasles
from chasles.study import Workspace, exact_workspace, workspace
from chasles.study.motion import Sampled, Sequence, parabola, task_curve, task_line
from chasles.study.planning import ball, robot_space
from chasles.study.samples import samples_of

HERE = Path(__file__).parent
VIA = np.array(
    [[0.2, 0.2, 0.1], [0.2, 0.15, 0.05], [0.2, 0.1, 0.1], [0.2, 0.05, 0.05], [0.2, 0, 0.1]]
)
"""Via points of table 1.4 [m]."""
POSTURES = np.radians(
    [[50, -25, 45, -60, 0], [60, -30, 50, -55, 0], [70, -35, 55, -50, 0], [80, -40, 60, -45, 0]]
)
"""Postures of table 1.2, with theta5 = 0."""
SAMPLES, FINEST = 2_000_000, 30
"""Postures of the workspace, and cells along its longest side."""
D1 = 0.05
"""Height of the shoulder in the motions [m]; robots/lynxmotion_low.toml has it."""
BALL, RADIUS = np.array([0.2, 0.075, 0.075]), 0.012
"""The ball in the middle between points 3 and 4 [m]: ours, figure 1.10 is lost."""
DETOUR = np.array([0.2, 0.075, 0.14])
"""The via point above the ball [m]."""
LINK = 1e-4
"""Radius of the links whose axes are kept off the ball [m]."""
RATE = 100.0
"""Samples per second: the paper's interval is 0.01 s."""
BISECTIONS = 40


@cache
def arm() -> Any:
    """The arm with all lengths of 0.1 m."""
    return chasles.load("lynxmotion")


@cache
def low() -> Any:
    """The arm with its shoulder lower, so that all via points are within its limits."""
    return chasles.load(HERE / "robots" / "lynxmotion_low.toml")


def rows(printed: dict[str, Printed]) -> list[Row]:
    """Every number of part 1 beside ours."""
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
    """Table 1.1 by (1.2), and the lengths."""
    robot, q = arm(), np.array([0.3, 0.7, -0.4, 0.5, -0.6])
    values = dict(zip(("q1", "q2", "q3", "q4", "q5"), q, strict=True))
    table = evaluated(printed["table_1_1"], **values)
    matrices = np.array(
        [
            evaluated(printed["mdh"], alpha=alpha, a=a, theta=theta, d=d)
            for alpha, a, theta, d in table
        ]
    )
    T = np.concatenate([np.eye(4)[None], robot.link_poses(q)])
    steps = np.linalg.solve(T[:-1], T[1:])
    turned = np.repeat(q[None], 37, axis=0)
    turned[:, 4] = np.linspace(0, 2 * np.pi, 37)
    p = robot.fk(turned)[:, :3, 3]
    names = ("d1", "a2", "a3", "d5")
    return [
        agrees(printed["lengths"], [robot.parameters[name].value for name in names]),
        agrees(printed["mdh"], steps[2], "row 3 of table 1.1", evaluated=matrices[2]),
        agrees(
            printed["table_1_1"],
            steps,
            "by (1.2) at q = (0.3, 0.7, -0.4, 0.5, -0.6)",
            evaluated=matrices,
        ),
        agrees(printed["roll"], float(np.linalg.norm(np.diff(p, axis=0), axis=1).sum())),
    ]


def forward(printed: dict[str, Printed]) -> list[Row]:
    """The tool at the postures of table 1.2, and these beside the limits of table 1.3."""
    robot = arm()
    T = robot.fk(POSTURES)
    pitch = np.arctan2(T[:, 2, 2], np.hypot(T[:, 0, 2], T[:, 1, 2]))
    found = [agrees(printed["table_1_2"], POSTURES[:, :4], "the postures that are put in")]
    for k in range(2):
        found += [
            agrees(printed[f"position_{k + 1}"], T[k, :3, 3]),
            agrees(printed[f"pitch_{k + 1}"], pitch[k]),
        ]
    for k in range(2, 4):
        note = f"the figure is lost; pitch {np.degrees(pitch[k]):.1f} deg"
        found.append(lost(printed[f"position_{k + 1}"], T[k, :3, 3], note))
    upright = POSTURES + np.array([0, np.pi / 2, 0, 0, 0])
    mirrored = POSTURES * [1, -1, -1, -1, 1]
    counts = [within(q) for q in (POSTURES, mirrored, upright)]
    words = f"{counts[1]} of 4 with the signs of q2 to q4 turned; {counts[2]} of 4 with q2 from"
    return [
        *found,
        not_reproducible(
            printed["within_limits"],
            counts[0],
            f"every q2 is negative and its lower limit is 30 deg; {words} the vertical",
        ),
    ]


def within(q: Any) -> int:
    """How many postures lie within the arm's limits."""
    robot = arm()
    return int(((q > robot.lower) & (q < robot.upper)).all(-1).sum())


@cache
def found_workspace() -> Workspace:
    """The workspace within table 1.3."""
    return workspace(arm(), SAMPLES, finest=FINEST, threads=2, progress=False)


def few_samples() -> Any:
    """(5000, 3) the tool at as many random postures as the paper has [m]."""
    robot = arm()
    some = samples_of(robot, 5000, "uniform", key=0)
    q = np.concatenate([block.copy() for block in some.blocks(0)])
    return robot.fk(q)[:, :3, 3]


def reach(printed: dict[str, Printed]) -> list[Row]:
    """The workspace: extents, volume, and what 5000 samples see of it."""
    robot, whole, p = arm(), found_workspace(), few_samples()
    cells = np.unique(whole.cells.index(p))
    share = len(cells) / np.count_nonzero(whole.hits)
    limits = np.column_stack([robot.lower, robot.upper])[:4]
    side = f"{1000 * whole.cells.side:.0f} mm"
    missed = 1000 * max(
        np.abs(p.min(0) - whole.extents[0]).max(), (whole.extents[1] - p.max(0)).max()
    )
    measure = whole.measure
    sampled = f"{measure.value:.4f} ± {measure.error:.4f} m³ from {SAMPLES} postures"
    note = f"by the arcs of its border; {sampled}; the figure is lost"
    tried = f"cells of {side}, of which {SAMPLES} postures hit {np.count_nonzero(whole.hits)}"
    return [
        agrees(printed["limits"], limits),
        agrees(printed["samples"], len(p), "random postures, as in the paper"),
        agrees(printed["extents"], whole.extents),
        not_reproducible(
            printed["cover"], share, f"{tried}; 5000 miss the extents by {missed:.1f} mm"
        ),
        lost(printed["volume"], exact_workspace(robot).volume, note),
    ]


def solutions(robot: Any, points: Any) -> Any:
    """(m, 2, 5) postures with a horizontal tool: the base faces the point, elbow up and down."""
    x = np.column_stack([points, np.zeros(len(points))])
    found = robot.ik_position_pitch(x)
    facing = np.abs(found.q[..., 0]) <= np.pi / 2
    q = np.array([own[kept] for own, kept in zip(found.q, found.valid & facing, strict=True)])
    return np.take_along_axis(q, np.argsort(q[..., 2], axis=1)[..., None], axis=1)


def inverse(printed: dict[str, Printed]) -> list[Row]:
    """(1.11) to (1.14) at point 1, and the postures at the via points."""
    robot = arm()
    q = solutions(robot, VIA)
    T = robot.link_poses(q[0, 0])
    wrist = np.linalg.solve(T[0], T[3])[:3, 3]
    l1, l2 = robot.parameters["a2"].value, robot.parameters["a3"].value
    plane = {"x1": wrist[0], "z1": wrist[2], "l1": l1, "l2": l2}
    q1, q2, q3, q4 = q[0, 0, :4]
    beta, alpha = q[0, :, 1].mean(), (q[0, 0, 1] - q[0, 1, 1]) / 2
    angles = {"phi": -np.pi / 2, "q1": q1, "q2": q2, "q3": q3}
    right = Printed("", str(printed["theta4"].value).replace("q1 - ", ""), "deg", "")
    names = {1: 0, 3: 2, 5: 4}
    found = []
    for name, k in names.items():
        found += [
            agrees(printed[f"base_{name}"], q[k, 0, 0]),
            agrees(printed[f"up_{name}"], q[k, 0, 1:4]),
            agrees(printed[f"down_{name}"], q[k, 1, 1:4]),
        ]
    for name, k in ((2, 1), (4, 3)):
        found.append(lost(printed[f"up_{name}"], q[k, 0, :4], "the figure is lost"))
    T_via = robot.fk(q)
    return [
        agrees(printed["shoulder"], beta, evaluated=evaluated(printed["shoulder"], **plane)),
        agrees(printed["elbow"], np.cos(alpha), evaluated=evaluated(printed["elbow"], **plane)),
        agrees(
            printed["theta2"],
            q[0, :, 1],
            "alpha and beta from (1.11) and (1.12)",
            evaluated=evaluated(
                printed["theta2"],
                alpha=np.arccos(evaluated(printed["elbow"], **plane)),
                beta=evaluated(printed["shoulder"], **plane),
            ),
        ),
        erratum(
            printed["theta4"],
            q4,
            evaluated(right, **angles),
            "theta1 turns about the vertical and does not count: phi - theta2 - theta3, "
            "theta1 = atan2(y, x); phi = -90 deg",
            evaluated=evaluated(printed["theta4"], **angles),
        ),
        agrees(printed["via_points"], T_via[:, 0, :3, 3]),
        agrees(printed["horizontal"], np.arcsin(T_via[:, 0, 2, 2])),
        *found,
    ]


def limits(printed: dict[str, Printed]) -> list[Row]:
    """The height of the shoulder with which the arm reaches all via points within its limits."""
    count = reached(0.1).sum()
    numbers = [f"{k + 1}" for k in np.flatnonzero(reached(0.1))]
    least, largest = (bisected(D1, end) for end in (0.0, 0.1))
    tried = f"d1 = 0.1 m and both elbows: only points {' and '.join(numbers)}; see the range of d1"
    words = "d1 = 0.1 m leaves out three points; the middle of the range, in round numbers"
    return [
        not_reproducible(printed["via_within"], int(count), tried),
        agrees(printed["least_d1"], least),
        agrees(printed["largest_d1"], largest),
        assumed(printed["d1"], low().parameters["d1"].value, words),
    ]


def reached(d1: float) -> Any:
    """(5,) whether the arm reaches each via point within limits.

    A shoulder that is lower by some length is the same as points that are higher by it.
    """
    lift = np.array([0, 0, arm().parameters["d1"].value - d1])
    x = np.column_stack([VIA + lift, np.zeros(len(VIA))])
    return arm().ik_position_pitch(x).within_limits().valid.any(-1)


def bisected(inside: float, outside: float) -> float:
    """The height between both at which the first via point leaves the limits [m]."""
    for _ in range(BISECTIONS):
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if reached(middle).all() else (inside, middle)
    return inside


def start() -> Sequence:
    """At the first via point, elbow up."""
    return Sequence(low(), solutions(low(), VIA[:1])[0, 0])


def task(point: Any) -> Any:
    """A point with a horizontal tool, as the inverse takes it."""
    return np.r_[point, 0.0]


@cache
def free() -> Sampled:
    """The motion of figure 1.6: two parabolas through points 1-2-3 and 3-4-5."""
    found = start()
    for k in (0, 2):
        curve = task_curve("position_pitch", parabola(VIA[k : k + 3]))
        found = found.follow(curve, "constant", duration=0.5)
    return found.sample(RATE)


@cache
def lines() -> Sampled:
    """The motion of figures 1.7 to 1.9: straight lines with trapezoidal speed, 1 s each."""
    return along(VIA)


@cache
def around() -> Sampled:
    """The motion of figure 1.10: the third line goes over a point above the ball."""
    return along(np.vstack([VIA[:3], DETOUR, VIA[3:]]))


def along(points: Any) -> Sampled:
    """The motion on straight lines between points, 1 s each."""
    found = start()
    for a, b in pairwise(points):
        curve = task_line("position_pitch", task(a), task(b))
        found = found.follow(curve, "trapezoidal", duration=1.0)
    return found.sample(RATE)


@cache
def polynomials() -> Sampled:
    """The motion of figure 1.11: quintic polynomials of the joints, 1 s between via points."""
    found = start()
    for q in solutions(low(), VIA)[1:, 0]:
        found = found.move(q, "quintic", duration=1.0)
    return found.sample(RATE)


def free_motion(printed: dict[str, Printed]) -> list[Row]:
    """The steps of the free motion, and how near it comes to the via points."""
    made = free()
    p = made.T[:, :3, 3]
    miss = np.linalg.norm(p[None] - VIA[:, None], axis=-1).min(1).max()
    inner = [np.linalg.norm(p[None] - VIA[[k], None], axis=-1).min() for k in (0, 2, 4)]
    speed = np.linalg.norm(made.V[:, :3], axis=1).max()
    words = "three points leave a conic open: parabolas through 1-2-3 and 3-4-5"
    return [
        assumed(printed["free_curve"], "parabolas", words),
        agrees(printed["free_steps"], len(made.t) - 1),
        agrees(printed["free_time"], made.t[-1]),
        agrees(
            printed["free_error"],
            max(inner),
            f"points 1, 3, 5; the nearest of the steps is {1000 * miss:.2f} mm off points 2 and 4",
        ),
        lost(printed["free_speed"], speed, "constant along each conic; the figure is lost"),
    ]


def straight_lines(printed: dict[str, Printed]) -> list[Row]:
    """Straight lines in three phases: speeds, rates, and how straight they are."""
    made = lines()
    speed = np.linalg.norm(made.V[:, :3], axis=1)
    peaks = [speed[made.stage == k].max() for k in range(4)]
    acceleration = np.diff(speed[made.stage == 0])
    scale = np.abs(acceleration).max()
    signs = np.sign(np.where(np.abs(acceleration) < scale / 10, 0, acceleration))
    phases = 1 + int(np.count_nonzero(np.diff(signs)))
    return [
        agrees(printed["phases"], phases, "counted in the sampled speed of the first line"),
        assumed(
            printed["line_time"], 1.0, "as between the via points of figure 1.11; no axis left"
        ),
        lost(printed["line_speed"], peaks, "the curve of figure 1.7 is lost; 1.5 length by time"),
        lost(printed["line_rates"], np.abs(made.qd).max(0)[:4], "the curves are lost"),
        agrees(printed["line_error"], off_lines(made)),
    ]


def off_lines(made: Sampled) -> float:
    """The largest distance of the tool from its straight lines [m]."""
    a, b = VIA[made.stage], VIA[made.stage + 1]
    along = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
    p = made.T[:, :3, 3] - a
    return float(np.linalg.norm(p - (p * along).sum(1, keepdims=True) * along, axis=1).max())


def detour(printed: dict[str, Printed]) -> list[Row]:
    """The ball between points 3 and 4, and the motion around it."""
    reason = "the figure is lost; a ball in the middle between points 3 and 4"
    return [
        assumed(printed["ball"], RADIUS, reason),
        assumed(printed["detour"], DETOUR, "above the middle between points 3 and 4"),
        assumed(printed["blocked"], clearance(lines()), "negative: the line goes through the ball"),
        assumed(printed["clearance"], clearance(around()), "the whole arm, on all five lines"),
    ]


def clearance(made: Sampled) -> float:
    """The least distance of the arm's axes from the ball [m]."""
    space = robot_space(low(), [ball(BALL, RADIUS)], radius=LINK)
    own = [k for k, (_, other) in enumerate(space.checks) if other == 0]
    return float(min(space.distances(q)[own].min() for q in made.q)) + LINK


def quintics(printed: dict[str, Printed]) -> list[Row]:
    """Quintic polynomials: times, ends at rest, and peaks."""
    made = polynomials()
    ends = np.isin(made.t.round(6), range(5))
    step = np.abs(np.diff(made.q[ends], axis=0))[:, :4]
    peaks = np.array([np.abs(made.qd[made.stage == k]).max(0)[:4] for k in range(4)])
    ratio = (peaks / step)[step > 0]
    return [
        agrees(printed["quintic_time"], made.t[-1] / 4),
        agrees(printed["quintic_ends"], np.abs(made.qd[ends]).max()),
        agrees(printed["quintic_stops"], np.abs(made.qdd[ends]).max()),
        agrees(printed["quintic_peak"], ratio.mean(), "mean over all joints and segments"),
        lost(printed["quintic_rates"], peaks.max(0), "the figure is lost"),
    ]
