"""Part 2 of the report: kinematics, workspace and singularities of a planar 3-RRR platform."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from report import (
    MISSING,
    TWICE,
    Printed,
    Row,
    agrees,
    at,
    consistent,
    erratum,
    evaluated,
    lost,
    not_printed,
)

import chasles
from chasles.study import PlanarRegion, constant_orientation_workspace

POSES = {"2.3": (0.02, 0.05, 0.0), "2.4": (0.045, 0.02, np.radians(10)), "2.5": (0.075, 0.0, 0.0)}
"""Poses (x, y, phi) of figures 2.3 to 2.5 [m, rad]."""
POSE, TURNED = np.array(POSES["2.3"]), np.array(POSES["2.4"])
"""Poses of figures 2.3 and 2.4. The printed equations are evaluated at the pose of figure 2.4."""
ANGLES = (15, 30, 45, 60)
"""Orientations of the platform in figures 2.6 and 2.7 [deg]."""
ORDER = (2, 0, 1)
"""Leg indices of chasles in the order of table 2.2, which starts with the joint at 90 deg."""
AHEAD = np.array([0.0, 0.3, 0.0])
"""Displacement (x, y, phi) [m, rad] from the pose of figure 2.3, along which singularities are
searched."""
INWARDS = 1e-10
"""Relative displacement that moves a point of the workspace boundary inward, so that the platform
reaches this point."""
BISECTIONS = 50
LEG = "The example is the lower left leg at (45 mm, 20 mm, 10 deg)"
MM2 = 1e-6
"""One square millimeter in square meters."""
SPEED = np.array([0.1, 0.0, 0.0])
"""Velocity of the platform [m/s, rad/s]."""


@cache
def platform(lower_links: int = 130) -> Any:
    """Load the platform with lower links of 130 mm (table 2.1) or 170 mm (text of the report)."""
    return chasles.load({130: "planar_3rrr", 170: "planar_3rrr_170"}[lower_links])


def rows(printed: dict[str, Printed]) -> list[Row]:
    """Compare every number in part 2 of the report with the value that chasles computes."""
    return [
        *dimensions(printed),
        *joints(printed),
        *legs(printed),
        *inverse(printed),
        *modes(printed),
        *areas(printed),
        *singularities(printed),
    ]


def dimensions(printed: dict[str, Printed]) -> list[Row]:
    """Compare table 2.1, and the link length L that the text of the report states."""
    values = {name: parameter.value for name, parameter in platform().parameters.items()}
    return [
        consistent(printed["S_A"], values["S_A"]),
        consistent(printed["L"], values["L"]),
        consistent(printed["r_platform"], values["r_p"]),
        consistent(printed["r_base"], values["r_b"]),
        erratum(
            printed["L_text"],
            values["L"],
            "130",
            "table 2.1 and the conclusion state 130 mm. Other rows also use 170 mm",
            cause=("the length S_A in the line above", values["S_A"]),
        ),
    ]


@cache
def region(angle: float, lower_links: int = 130) -> PlanarRegion:
    """Return the region of positions that the platform reaches at an orientation angle [deg]."""
    return constant_orientation_workspace(platform(lower_links), np.radians(angle))


def base_and_platform() -> tuple[Any, Any]:
    """Return positions (3, 2) of base joints, and of platform joints in the platform frame [m]."""
    here, turned = (
        np.array([ring.center for ring in region(angle).pieces[0]]) for angle in (0, 180)
    )
    return (here + turned) / 2, (turned - here) / 2


def joints(printed: dict[str, Printed]) -> list[Row]:
    """Compare table 2.2 and equations (B.1.1) to (B.1.4)."""
    b, p = base_and_platform()
    found = []
    for name, points, words in (("PB", b, "base"), ("PP", p, "platform")):
        angle = np.mod(np.arctan2(points[:, 1], points[:, 0]), 2 * np.pi)[list(ORDER)]
        found += [
            consistent(
                printed[name], angle[:2], "the angles 90 and 210 deg are inputs", evaluated=at()
            ),
            erratum(
                printed[f"{name}3"],
                angle[2],
                2 * np.pi - np.pi / 6,
                "the correct angle is 2 pi - pi/6, which is 330 deg. With the printed angle, the "
                f"{words} triangle is not equilateral",
                evaluated=at(),
            ),
        ]
    r = platform().parameters
    x, y, a = TURNED
    on_base = at_each_leg(r=r["r_b"].value)
    return [
        *found,
        agrees(
            printed["platform_joints"],
            on_platform(),
            "we evaluated the pose (45 mm, 20 mm, 10 deg)",
            evaluated=at_each_leg(r=r["r_p"].value, a=a, x=x, y=y),
        ),
        erratum(
            printed["base_joints"],
            b,
            -on_base(printed["base_joints"]),
            "the correct equations have no minus signs. In equation (B.2.7), a second minus sign "
            "cancels the wrong sign",
            evaluated=on_base,
        ),
    ]


def at_each_leg(**values: float) -> Callable[[Printed], Any]:
    """Return a function that evaluates printed equations for legs i = 1, 2, 3, one row per leg."""
    return lambda item: np.array([evaluated(item, i=i, **values) for i in (1, 2, 3)])


def on_platform() -> Any:
    """Return the positions (3, 2) of the platform joints at the pose of figure 2.4 [m]."""
    _, p = base_and_platform()
    a = TURNED[2]
    return TURNED[:2] + p @ np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]])


def leg(k: int) -> dict[str, float]:
    """Return symbol values of leg k for its first inverse solution at the pose of figure 2.4."""
    robot = platform()
    b, _ = base_and_platform()
    q = robot.ik_planar(TURNED).q[0]
    swing = robot.configuration(q)[6 + k]
    x, y = on_platform()[k] - b[k]
    values = {name: robot.parameters[name].value for name in ("S_A", "L")}
    return values | {"X": x, "Y": y, "theta": q[k], "psi": q[k] + swing}


def in_mm(values: dict[str, float]) -> dict[str, float]:
    """Convert the lengths X, Y, S_A and L to millimeters, the unit of the printed equation."""
    return {name: 1000 * values[name] for name in ("X", "Y", "S_A", "L")}


def legs(printed: dict[str, Printed]) -> list[Row]:
    """Compare equations (B.1.5) to (B.2.8) for the lower left leg at the pose of figure 2.4."""
    values = leg(0)
    X, Y, theta, psi, S_A, L = (values[name] for name in ("X", "Y", "theta", "psi", "S_A", "L"))
    square = X**2 + Y**2 - 2 * S_A * (X * np.cos(theta) + Y * np.sin(theta)) + S_A**2 - L**2
    both = platform().ik_planar(TURNED).q[[0, -1], 0]
    e3 = X**2 + Y**2 + S_A**2 - L**2
    e1, e2 = np.linalg.solve(np.array([np.sin(both), np.cos(both)]).T, [-e3, -e3])
    b, _ = base_and_platform()
    node = on_platform()[0] - L * np.array([np.cos(psi), np.sin(psi)])
    sides = {"theta": theta, "S_A": S_A, "X_PB": -b[0, 0]}
    return [
        agrees(printed["legs"], np.array([[X], [Y]]), LEG, evaluated=at(**values)),
        erratum(
            printed["leg_square"],
            0.0,
            square,
            "the correct left side is X^2 + Y^2 - 2 S_A (X cos(theta) + Y sin(theta)) + S_A^2 - "
            f"L^2. {LEG}",
            evaluated=at(**values),
        ),
        agrees(
            printed["e1_e2"],
            np.array([e1, e2]),
            f"our values solve equation (B.2.1) at both solutions theta. {LEG}",
            evaluated=at(**values),
        ),
        erratum(
            printed["e3"],
            2 * S_A * (X * np.cos(theta) + Y * np.sin(theta)),
            e3,
            "the correct e3 is X^2 + Y^2 + S_A^2 - L^2. We evaluated the printed formula in "
            "millimeters",
            evaluated=lambda item: at(**in_mm(values))(item) * MM2,
        ),
        agrees(
            printed["half_tangents"],
            np.zeros(2),
            f"we evaluated the printed equation with the corrected e3 at both solutions. {LEG}",
            evaluated=lambda item: np.array(
                [evaluated(item, t=t, e1=e1, e2=e2, e3=e3) for t in np.tan(both / 2)]
            ),
        ),
        agrees(
            printed["half_angle"],
            both,
            f"we evaluated the printed equation with the corrected e3. {LEG}",
            evaluated=at(e1=e1, e2=e2, e3=e3),
        ),
        agrees(
            printed["node_x"],
            node[0],
            "the paper computes M from the base joint of equation (B.1.3). We compute M from the "
            "platform joint",
            evaluated=at(**sides),
        ),
        erratum(
            printed["node_y"],
            node[1],
            b[0, 1] + S_A * np.sin(theta),
            "the correct equation is -Y_PB + S_A sin(theta)",
            evaluated=at(**sides),
        ),
    ]


def inverse(printed: dict[str, Printed]) -> list[Row]:
    """Compare both inverse solutions of each leg, and the total number of solutions."""
    found = []
    for length in (130, 170):
        q = platform(length).ik_planar(POSE).q[[0, -1]]
        for k in range(3):
            found.append(consistent(printed[f"inverse_{length}_{k + 1}"], wrapped(q[:, k]), TWICE))
    for figure in ("2.4", "2.5"):
        q = platform().ik_planar(POSES[figure]).q[[0, -1]].T
        item = printed[f"pose_{figure.replace('.', '_')}"]
        found.append(lost(item, wrapped(q), f"{MISSING}. Our value has both solutions of each leg"))
    solutions = platform().ik_planar(POSE)
    count = int((solutions.valid | solutions.other_mode).sum())
    return [*found, consistent(printed["branches"], count, TWICE)]


def wrapped(angle: Any) -> Any:
    """Wrap angles to the range from -pi to pi."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


def modes(printed: dict[str, Printed]) -> list[Row]:
    """Compare the assembly modes of the platform."""
    robot = platform()
    x, valid = robot.fk_planar_all(robot.ik_planar(POSE).q)
    first = x[0][valid[0]]
    other = first[np.linalg.norm(first - POSE, axis=1).argmax()]
    counts = ", ".join(map(str, valid.sum(-1)))
    return [
        consistent(printed["other_mode"], other[:2], TWICE),
        consistent(printed["other_angle"], other[2], TWICE),
        consistent(
            printed["modes"],
            x.shape[1],
            f"{TWICE}; the solver has this number of slots, which is the degree of the equations",
        ),
        not_printed(
            printed["modes_found"],
            counts,
            "each number counts the assembly modes of one branch",
        ),
    ]


def areas(printed: dict[str, Printed]) -> list[Row]:
    """Return table rows for the areas of the workspaces in figures 2.6 and 2.7.

    Circular arcs bound each workspace.
    """
    found = [consistent(printed["area_0"], region(0).area, TWICE)]
    for length, ending in ((130, ""), (170, "_170")):
        for angle in ANGLES:
            item, area = printed[f"area_{angle}{ending}"], region(angle, length).area
            words = f"{MISSING}. We compute the area exactly from circular arcs"
            ours = consistent(item, area, TWICE) if item.value else lost(item, area, words)
            found.append(ours)
    return found


def singularities(printed: dict[str, Printed]) -> list[Row]:
    """Return table rows for three types of singularity, and for the actuator rates of a motion."""
    robot = platform()
    way = robot.distance_to_singularity(POSE, AHEAD)
    return [
        not_printed(
            printed["type_1"],
            way.type_1 * AHEAD[1],
            "at the singularity, a leg is stretched",
        ),
        not_printed(
            printed["type_2"],
            way.type_2 * AHEAD[1],
            "at the singularity, the platform gains a degree of freedom",
        ),
        not_printed(
            printed["type_3"],
            third_kind()[:2],
            "at this boundary position, singularities of types 1 and 2 coincide",
        ),
        not_printed(
            printed["velocity"],
            robot.actuator_rates(POSE, SPEED),
            "the rates follow from J_x x' = J_q q' for the first inverse solution of each leg",
        ),
    ]


@cache
def third_kind() -> Any:
    """Return a pose (x, y, phi) on the workspace boundary at 0 deg, where J_x is also singular."""
    for arc in region(0).arcs:
        along = np.linspace(0, 1, 181)
        sign = np.sign([determinant(on(arc, u)) for u in along])
        for k in np.flatnonzero(sign[:-1] * sign[1:] < 0):
            low, high = along[k], along[k + 1]
            for _ in range(BISECTIONS):
                middle = (low + high) / 2
                same = np.sign(determinant(on(arc, middle))) == sign[k]
                low, high = (middle, high) if same else (low, middle)
            return on(arc, low)
    raise ValueError("no singularity of type 2 reaches the boundary of the workspace")


def on(arc: Any, part: float) -> Any:
    """Return the pose at a fraction of an arc of the workspace boundary, moved slightly inward."""
    points = arc.points()
    at = np.linspace(0, 1, len(points))
    p = np.array([np.interp(part, at, column) for column in points.T])
    out = p - arc.center
    p = arc.center + arc.radius * out / np.linalg.norm(out)
    return np.r_[p * (1 - INWARDS), 0.0]


def determinant(pose: Any) -> float:
    """Return the determinant of J_x at a pose, for the first inverse solution of each leg."""
    robot = platform()
    return float(robot.determinants(pose, robot.ik_planar(pose).q[0]).J_x)
