"""Handwritten `manifest.json` and C code of a SCARA arm with a two-branch IK function.

Solution slot 0 has the elbow to the left (positive), solution slot 1 to the right. `ik_position`
has the tool angle as a second input.
"""

import numpy as np

from tests.support.handwritten import tiny

A1, A2 = 0.4, 0.3

HEADER = """\
#ifndef SCARA_H
#define SCARA_H
void scara_fk(const double q[4], double T[16]);
void scara_fk_jacobian_mixed(const double q[4], double T[16], double J[24]);
void scara_ik(const double T[16], double q[8], double residual[2], double margin[2]);
void scara_ik_position(const double p[3], const double phi[1], double q[8], double residual[2],
                       double margin[2]);
#endif
"""
SOURCE = """\
#include "scara.h"
#include <math.h>
#define A1 {true_a1!r}
#define A2 {a2!r}
void scara_fk(const double q[4], double T[16])
{{
    double a = q[0] + q[1], phi = a + q[3];
    int i;
    for (i = 0; i < 16; i++) T[i] = 0.0;
    T[0] = T[5] = cos(phi); T[4] = sin(phi); T[1] = -T[4];
    T[3] = A1 * cos(q[0]) + A2 * cos(a);
    T[7] = A1 * sin(q[0]) + A2 * sin(a);
    T[11] = q[2];
    T[10] = T[15] = 1.0;
}}
void scara_fk_jacobian_mixed(const double q[4], double T[16], double J[24])
{{
    double a = q[0] + q[1];
    int i;
    for (i = 0; i < 24; i++) J[i] = 0.0;
    J[1] = -A2 * sin(a); J[5] = A2 * cos(a);
    J[0] = J[1] - A1 * sin(q[0]); J[4] = J[5] + A1 * cos(q[0]);
    J[10] = J[20] = J[21] = J[23] = 1.0;
    scara_fk(q, T);
}}
static void solve(double x, double y, double z, double phi, double *q, double *residual,
                  double *margin)
{{
    const double a1 = {nominal_a1!r};
    double c = (x * x + y * y - a1 * a1 - A2 * A2) / (2.0 * a1 * A2);
    double reached = c > 1.0 ? 1.0 : c < -1.0 ? -1.0 : c;
    double s = sqrt(1.0 - reached * reached);
    int slot;
    if (isnan(c)) reached = c;
    for (slot = 0; slot < 2; slot++, q += 4) {{
        q[1] = atan2(slot ? -s : s, reached);
        q[0] = atan2(y, x) - atan2(A2 * sin(q[1]), a1 + A2 * cos(q[1]));
        q[0] = atan2(sin(q[0]), cos(q[0]));
        q[2] = z;
        q[3] = phi - q[0] - q[1];
        q[3] = atan2(sin(q[3]), cos(q[3]));
        residual[slot] = hypot(a1 * cos(q[0]) + A2 * cos(q[0] + q[1]) - x,
                               a1 * sin(q[0]) + A2 * sin(q[0] + q[1]) - y);
        margin[slot] = 1.0 - fabs(c);
    }}
}}
void scara_ik(const double T[16], double q[8], double residual[2], double margin[2])
{{
    solve(T[3], T[7], T[11], atan2(T[4], T[0]), q, residual, margin);
}}
void scara_ik_position(const double p[3], const double phi[1], double q[8], double residual[2],
                       double margin[2])
{{
    solve(p[0], p[1], p[2], phi[0], q, residual, margin);
}}
"""
LABELS = ["elbow +", "elbow -"]
COORDINATES = [
    ("shoulder", "revolute", "rad", -6.5, 6.5),
    ("elbow", "revolute", "rad", -2.5, 2.5),
    ("lift", "prismatic", "m", -10.0, 10.0),
    ("roll", "revolute", "rad", None, None),
]


def fk(q, a1=A1):
    q = np.asarray(q, dtype=float)
    T = np.zeros((*q.shape[:-1], 4, 4))
    a, phi = q[..., 0] + q[..., 1], q[..., 0] + q[..., 1] + q[..., 3]
    T[..., 0, 0] = T[..., 1, 1] = np.cos(phi)
    T[..., 1, 0], T[..., 0, 1] = np.sin(phi), -np.sin(phi)
    T[..., 0, 3] = a1 * np.cos(q[..., 0]) + A2 * np.cos(a)
    T[..., 1, 3] = a1 * np.sin(q[..., 0]) + A2 * np.sin(a)
    T[..., 2, 3] = q[..., 2]
    T[..., 2, 2] = T[..., 3, 3] = 1.0
    return T


def role(name, domain, labels=()):
    """Return the manifest entries that describe the role of a function."""
    return {"role": name, "domain": domain, "labels": list(labels)}


def manifest():
    """Return the manifest of the arm, without file hashes."""
    q, T = tiny.argument("q", [4], "rad or m"), tiny.argument("T", [4, 4])
    branches = [
        tiny.argument("q", [2, 4], "rad or m"),
        tiny.argument("residual", [2], "m or rad"),
        tiny.argument("margin", [2]),
    ]
    position = [tiny.argument("p", [3], "m"), tiny.argument("phi", [], "rad")]
    functions = [
        {**tiny.function("fk", "Pose of the tool.", [q], [T]), **role("pose", "actuators")},
        {
            **tiny.function(
                "fk_jacobian_mixed", "Pose and Jacobian.", [q], [T, tiny.argument("J", [6, 4])]
            ),
            **role("pose and jacobian", "actuators"),
        },
        {**tiny.function("ik", "All solutions.", [T], branches), **role("inverse", "pose", LABELS)},
        {
            **tiny.function("ik_position", "All solutions.", position, branches),
            **role("inverse", "task", LABELS),
        },
    ]
    names = ("name", "kind", "unit", "lower", "upper")
    return {
        **tiny.manifest(),
        "name": "scara",
        "title": "A SCARA arm",
        "coordinates": [dict(zip(names, row, strict=True)) for row in COORDINATES],
        "functions": [{**f, "symbol": f"scara_{f['name']}"} for f in functions],
    }


def write(path, true_a1=A1, **changes):
    """Write the arm to a folder.

    The inverse kinematics always uses the nominal length A1.
    """
    folder = tiny.Folder(path, {**manifest(), **changes}, "scara")
    source = SOURCE.format(true_a1=true_a1, nominal_a1=A1, a2=A2)
    folder.write(source, HEADER)
    return folder
