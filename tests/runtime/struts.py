"""A planar platform on three cylinders, written by hand, whose loops Newton's iteration closes.

z = (x, y, phi, swing1, length1, swing2, length2, swing3, length3); q = twice the lengths. There is
one constraint more than are independent.
"""

import json
from pathlib import Path

import numpy as np

from .tiny import argument, sha256

BASE = np.array([[-1.0, -0.6], [1.0, -0.6], [0.0, 1.2]])
PINS = np.array([[-0.4, 0.3], [0.4, -0.2], [0.3, 0.5]])
HEADER = """\
#ifndef STRUTS_H
#define STRUTS_H
void struts_constraint(const double z[9], double c[7]);
void struts_constraint_D_z(const double z[9], double D[63]);
void struts_chain_fk(const double theta[3], double T[16]);
void struts_chain_jacobian_mixed(const double theta[3], double J[18]);
#endif
"""
SOURCE = """\
#include "struts.h"
#include <math.h>
static const double base[3][2] = {{-1.0, -0.6}, {1.0, -0.6}, {0.0, 1.2}};
static const double pins[3][2] = {{-0.4, 0.3}, {0.4, -0.2}, {0.3, 0.5}};
void struts_constraint(const double z[9], double c[7])
{
    int k;
    double cp = cos(z[2]), sp = sin(z[2]);
    for (k = 0; k < 3; k++) {
        double px = cp * pins[k][0] - sp * pins[k][1], py = sp * pins[k][0] + cp * pins[k][1];
        double s = z[3 + 2 * k], l = z[4 + 2 * k];
        c[2 * k] = z[0] + px - base[k][0] - l * cos(s);
        c[2 * k + 1] = z[1] + py - base[k][1] - l * sin(s);
    }
    c[6] = c[0] + c[3] - 2.0 * c[4];
}
void struts_constraint_D_z(const double z[9], double D[63])
{
    int k, i;
    double cp = cos(z[2]), sp = sin(z[2]);
    for (i = 0; i < 63; i++) D[i] = 0.0;
    for (k = 0; k < 3; k++) {
        double px = cp * pins[k][0] - sp * pins[k][1], py = sp * pins[k][0] + cp * pins[k][1];
        double s = z[3 + 2 * k], l = z[4 + 2 * k];
        double *x = D + 18 * k, *y = x + 9;
        x[0] = 1.0; y[1] = 1.0; x[2] = -py; y[2] = px;
        x[3 + 2 * k] = l * sin(s); x[4 + 2 * k] = -cos(s);
        y[3 + 2 * k] = -l * cos(s); y[4 + 2 * k] = -sin(s);
    }
    for (i = 0; i < 9; i++) D[54 + i] = D[i] + D[27 + i] - 2.0 * D[36 + i];
}
void struts_chain_fk(const double theta[3], double T[16])
{
    double c = cos(theta[2]), s = sin(theta[2]), x = theta[0], y = theta[1];
    int i;
    for (i = 0; i < 16; i++) T[i] = 0.0;
    T[0] = c; T[1] = -s; T[4] = s; T[5] = c; T[3] = x; T[7] = y; T[10] = T[15] = 1.0;
}
void struts_chain_jacobian_mixed(const double theta[3], double J[18])
{
    int i;
    (void)theta;
    for (i = 0; i < 18; i++) J[i] = 0.0;
    J[0] = J[4] = J[17] = 1.0;
}
"""


def q_of(pose):
    """Actuated coordinates (..., 3) that hold poses (..., 3)."""
    pose = np.asarray(pose)
    c, s = np.cos(pose[..., 2, None]), np.sin(pose[..., 2, None])
    x = pose[..., 0, None] + c * PINS[:, 0] - s * PINS[:, 1] - BASE[:, 0]
    y = pose[..., 1, None] + s * PINS[:, 0] + c * PINS[:, 1] - BASE[:, 1]
    return 2 * np.hypot(x, y)


def manifest():
    """The manifest of the platform."""
    z, theta = argument("z", [9]), argument("theta", [3])

    def function(name, inputs, outputs, role, **more):
        return {
            "name": name,
            "symbol": f"struts_{name}",
            "summary": f"{name} of it.",
            "inputs": inputs,
            "outputs": outputs,
            "operations": {"total": 20},
            "role": role[0],
            "domain": role[1],
            **more,
        }

    def joint(name, kind, unit):
        return {"name": name, "kind": kind, "unit": unit, "lower": None, "upper": None}

    legs = [(f"swing{k}", "rad") for k in (1, 2, 3)], [(f"length{k}", "m") for k in (1, 2, 3)]
    variables = [("x", "m"), ("y", "m"), ("phi", "rad")]
    variables += [pair for leg in zip(*legs, strict=True) for pair in leg]
    swings = np.arctan2(*(PINS - BASE).T[::-1])
    reference = np.zeros(9)
    # Near, not exact.
    reference[3::2] = swings + np.array([0.01, -0.02, 0.01])
    reference[4::2] = q_of(np.zeros(3)) / 2
    return {
        "chasles": 2,
        "name": "struts",
        "title": "A platform on cylinders",
        "kind": "platform",
        "source": "Made up.",
        "coordinates": [joint(f"motor{k}", "revolute", "rad") for k in (1, 2, 3)],
        "chain": [
            joint("x", "prismatic", "m"),
            joint("y", "prismatic", "m"),
            joint("phi", "revolute", "rad"),
        ],
        "passive": [{"name": name, "unit": unit} for name, unit in legs[0]],
        "configuration": [{"name": name, "unit": unit} for name, unit in variables],
        "loops": ["leg1", "leg2", "leg3"],
        "reference": {"q": q_of(np.zeros(3)).tolist(), "z": reference.tolist()},
        "actuated_in_z": [{"index": k, "ratio": 0.5} for k in (4, 6, 8)],
        "solution": "newton",
        "frames": {"base": "base", "tip": "ee", "links": []},
        "parameters": [],
        "tolerances": {"dead_point": 1e-12},
        "functions": [
            function("constraint", [z], [argument("c", [7])], ("constraint", "configuration")),
            function(
                "constraint_D_z",
                [z],
                [argument("D", [7, 9])],
                ("constraint derivative", "configuration"),
            ),
            function(
                "chain_fk", [theta], [argument("T", [4, 4])], ("pose", "chain"), of_actuators="fk"
            ),
            function(
                "chain_jacobian_mixed",
                [theta],
                [argument("J", [6, 3])],
                ("jacobian", "chain"),
                of_actuators="jacobian_mixed",
            ),
        ],
    }


def write(folder: Path):
    """The platform on disk."""
    content = manifest()
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "struts.c").write_text(SOURCE)
    (folder / "struts.h").write_text(HEADER)
    content["files"] = {"struts.c": sha256(SOURCE), "struts.h": sha256(HEADER)}
    (folder / "manifest.json").write_text(json.dumps(content))
    return folder
