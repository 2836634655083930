"""Handwritten functions of a planar platform on three legs, each with a crank and a rod."""

import json
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import sympy as sp

from chasles.derive.emit.c import scalar
from chasles.derive.emit.c.header import header, support
from chasles.derive.emit.c.written import written_files
from chasles.derive.loops.modes.triad import Triad, triad_mirror, triad_polynomial, triad_position
from chasles.derive.loops.modes.triad_modes import written_modes
from chasles.derive.model.robot import Joint, SerialRobot
from chasles.derive.program.programs import programs
from chasles.derive.terms.symbolic_function import Argument, Result, SymbolicFunction
from chasles.derive.terms.terms import Terms
from tests.support.handwritten.tiny import sha256

BASE, CRANK, PLATFORM = 0.29, 0.17, 0.13
ANGLES = np.radians([210, 330, 90])
DIRECTIONS = np.stack([np.cos(ANGLES), np.sin(ANGLES)], -1)


def _exact(degrees):
    angle = sp.pi * degrees / 180
    return sp.cos(angle), sp.sin(angle)


def _inverse(terms, theta, cs, crank, direction, pin, rod):
    """Return (direction, offset, margin) of a leg.

    The two solutions for the crank angle are direction + offset and direction - offset.
    """
    (x, y, _), (c, s) = theta, cs
    base = sp.Rational(str(BASE))
    dx = terms.let(x + c * pin[0] - s * pin[1] - base * direction[0])
    dy = terms.let(y + s * pin[0] + c * pin[1] - base * direction[1])
    square = terms.let(dx**2 + dy**2)
    bend = terms.let((crank**2 + rod**2 - square) / (2 * crank * rod))
    margin = terms.let(1 - bend**2)
    across = terms.let(2 * crank * rod * sp.sqrt(margin))
    off = terms.let(sp.atan2(across, square + crank**2 - rod**2))
    return terms.let(sp.atan2(dy, dx)), off, margin


@cache
def functions(rod):
    """Return the functions of the platform.

    The argument ``rod`` is the rod length in meters as text, such as "13/100".
    """
    terms = Terms({})
    q = sp.symbols("q1:4", real=True)
    theta = sp.symbols("theta1:4", real=True)
    phi = sp.Symbol("phi", real=True)
    directions = [_exact(angle) for angle in (210, 330, 90)]
    base, crank, platform = (sp.Rational(str(v)) for v in (BASE, CRANK, PLATFORM))
    turned = [terms.cos_sin(angle) for angle in q]
    A = [
        (terms.let(base * dx + crank * c), terms.let(base * dy + crank * s))
        for (dx, dy), (c, s) in zip(directions, turned, strict=True)
    ]
    b = [(platform * dx, platform * dy) for dx, dy in directions]
    L = [sp.Rational(rod)] * 3
    cs = terms.cos_sin(phi)
    arguments = {
        "q": Argument("q", q, (3,), "rad", "cranks"),
        "theta": Argument("theta", theta, (3,), "m, rad", "x, y, phi"),
        "phi": Argument("phi", (phi,), (), "rad", "angle"),
    }

    def function(name, inputs, *outputs):
        taken = tuple(arguments[name] for name in inputs)
        return SymbolicFunction(name, f"{name}.", "", taken, outputs, terms)

    triad = Triad(tuple(A), tuple(b), tuple(L))
    x, y = triad_position(terms, triad, *cs)
    mx, my = triad_mirror(terms, triad, *cs)
    px, py, angle = theta
    c, s = terms.cos_sin(angle)
    residuals, rows, lines, cranks = [], [], [], []
    for k, (a, (bx, by)) in enumerate(zip(A, b, strict=True)):
        rx, ry = terms.let(c * bx - s * by), terms.let(s * bx + c * by)
        dx, dy = terms.let(px + rx - a[0]), terms.let(py + ry - a[1])
        length = terms.let(sp.sqrt(dx**2 + dy**2))
        nx, ny = terms.let(dx / length), terms.let(dy / length)
        residuals.append(terms.let(length - L[k]))
        rows += [nx, ny, terms.let(rx * ny - ry * nx)]
        arm = terms.let(crank * (turned[k][0] * ny - turned[k][1] * nx))
        cranks += [arm if j == k else sp.S.Zero for j in range(3)]
    lines = tuple(rows)
    legs = [
        _inverse(terms, theta, (c, s), crank, *leg) for leg in zip(directions, b, L, strict=True)
    ]
    slots = list(product((1, -1), repeat=3))
    inverse = tuple(
        terms.let(w + side * t) for x in slots for side, (w, t, _) in zip(x, legs, strict=True)
    )
    margins = tuple(margin for _ in slots for *_, margin in legs)
    pose = Result("x", (x, y, phi), (3,), "m, rad", "pose")
    mirror = Result("x", (mx, my, phi), (3,), "m, rad", "pose")
    polynomial = tuple(triad_polynomial(terms, triad))
    return (
        function("assembly_polynomial", "q", Result("a", polynomial, (7,), "1", "coefficients")),
        function("assembly_position", ("q", "phi"), pose),
        function("assembly_mirror", ("q", "phi"), mirror),
        function("rods", ("theta", "q"), Result("r", tuple(residuals), (3,), "m", "residuals")),
        function("rods_D_chain", ("theta", "q"), Result("D", lines, (3, 3), "1, m", "rows")),
        function(
            "velocity_relation",
            ("theta", "q"),
            Result("J_x", lines, (3, 3), "1, m", "rods"),
            Result("J_q", tuple(cranks), (3, 3), "m", "cranks"),
        ),
        function(
            "actuators_all",
            ("theta",),
            Result("q", inverse, (8, 3), "rad", "branches"),
            Result("margin", margins, (8, 3), "1", "margins"),
        ),
    )


ROLES = {
    "assembly_polynomial": {"role": "assembly polynomial", "domain": "actuators"},
    "assembly_position": {"role": "assembly pose", "domain": "actuators"},
    "assembly_mirror": {"role": "assembly mirror", "domain": "actuators"},
    "rods": {"role": "lengths", "domain": "chain"},
    "rods_D_chain": {"role": "lengths derivative", "domain": "chain"},
    "velocity_relation": {
        "role": "velocity relation",
        "domain": "chain",
        "directions": [0, 1, 5],
    },
    "modes": {"role": "modes", "domain": "actuators", "codomain": "chain"},
    "actuators_all": {
        "role": "branches",
        "domain": "chain",
        "codomain": "actuators",
        "labels": ["".join(sides) for sides in product("+-", repeat=3)],
    },
}


def write(folder: Path, rod="13/100"):
    """Write the generated files of the planar platform, without batch functions."""
    derived = functions(rod)
    joints = tuple(Joint(f"crank_{k}", "revolute") for k in (1, 2, 3))
    robot = SerialRobot("planar", joints, title="A planar platform")
    made = programs(derived, "planar")
    modes = written_modes(derived[0].inputs[0], PLATFORM)
    files = {
        "planar.c": scalar.source(robot, derived, made, [modes]),
        "planar.h": header(robot, [*derived, modes], made),
        scalar.SUPPORT: support(scalar.SUPPORT),
        **written_files(robot, [modes]),
    }

    def described(item):
        return {
            "name": item.name,
            "shape": list(item.shape),
            "unit": item.unit,
            "meaning": item.meaning,
        }

    def joint(name, kind, unit):
        return {"name": name, "kind": kind, "unit": unit, "lower": None, "upper": None}

    names = ["x", "y", "phi"]
    manifest = {
        "chasles": 2,
        "name": "planar",
        "title": "A planar platform",
        "kind": "hybrid",
        "source": "Made up.",
        "coordinates": [joint(j.name, "revolute", "rad") for j in joints],
        "chain": [
            joint("x", "prismatic", "m"),
            joint("y", "prismatic", "m"),
            joint("phi", "revolute", "rad"),
        ],
        "passive": [],
        "configuration": [{"name": n, "unit": "rad" if n == "phi" else "m"} for n in names],
        "loops": ["leg_1", "leg_2", "leg_3"],
        "reference": reference(float(sp.Rational(rod))),
        "solution": "closed form",
        "frames": {"base": "base", "tip": "ee", "links": []},
        "parameters": [],
        "tolerances": {"dead_point": 1e-12},
        "functions": [
            {
                "name": f.name,
                "symbol": f"planar_{f.name}",
                "summary": f.summary,
                "inputs": [described(item) for item in f.inputs],
                "outputs": [described(item) for item in f.outputs],
                "operations": {"total": 300},
                **ROLES[f.name],
            }
            for f in (*derived, modes)
        ],
        "files": {name: sha256(text) for name, text in files.items()},
    }
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / name).write_text(text)
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return folder


def reference(rod):
    pose = np.zeros(3)
    return {"q": cranks(pose, rod, 1.0).tolist(), "z": pose.tolist()}


def cranks(pose, rod, side):
    """Return the crank angles of a pose (..., 3), or NaN if a leg is too short."""
    d = pins(pose) - BASE * DIRECTIONS
    r = np.hypot(d[..., 0], d[..., 1])
    with np.errstate(invalid="ignore"):
        return np.arctan2(d[..., 1], d[..., 0]) + side * np.arccos(
            (CRANK**2 + r**2 - rod**2) / (2 * CRANK * r)
        )


def pins(pose):
    """Return the platform pins (..., 3, 2) in the base frame."""
    c, s = np.cos(pose[..., 2, None]), np.sin(pose[..., 2, None])
    bx, by = PLATFORM * DIRECTIONS.T
    return np.stack(
        [pose[..., 0, None] + c * bx - s * by, pose[..., 1, None] + s * bx + c * by], -1
    )


def ends(q):
    """Return the crank ends (..., 3, 2) in the base frame."""
    return BASE * DIRECTIONS + CRANK * np.stack([np.cos(q), np.sin(q)], -1)
