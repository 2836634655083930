"""Handwritten `manifest.json` and C code of a planar snake with many links.

If the first joint exceeds one radian, the pose contains NaN, which simulates loops that do not
close.
"""

from tests.support.handwritten import tiny

LINK = 0.05
WALL = 1.0

HEADER = """\
void snake_fk_jacobian_mixed(const double q[{n}], double T[16], double J[{m}]);
void snake_jacobian_mixed(const double q[{n}], double J[{m}]);
"""
SOURCE = """\
#include "snake.h"
#include <math.h>
#define N {n}
void snake_fk_jacobian_mixed(const double q[{n}], double T[16], double J[{m}])
{{
    double x[N + 1], y[N + 1], a = 0.0;
    int i;
    x[0] = y[0] = 0.0;
    for (i = 0; i < N; i++) {{
        a += q[i];
        x[i + 1] = x[i] + {link} * cos(a);
        y[i + 1] = y[i] + {link} * sin(a);
    }}
    for (i = 0; i < 16; i++) T[i] = 0.0;
    T[0] = T[5] = cos(a); T[4] = sin(a); T[1] = -T[4];
    T[3] = q[0] > {wall} ? NAN : x[N]; T[7] = y[N]; T[10] = T[15] = 1.0;
    for (i = 0; i < 6 * N; i++) J[i] = 0.0;
    for (i = 0; i < N; i++) {{
        J[i] = y[i] - y[N]; J[N + i] = x[N] - x[i]; J[5 * N + i] = 1.0;
    }}
}}
void snake_jacobian_mixed(const double q[{n}], double J[{m}])
{{
    double T[16];
    snake_fk_jacobian_mixed(q, T, J);
}}
"""


def write(path, n, limit=None):
    """Write the manifest and the C code of a snake with n joints to a folder.

    Each joint has the limits -limit and limit.
    """
    q, T = tiny.argument("q", [n], "rad"), tiny.argument("T", [4, 4])
    J = tiny.argument("J", [6, n])
    both = tiny.function("fk_jacobian_mixed", "Pose and Jacobian.", [q], [T, J])
    alone = tiny.function("jacobian_mixed", "Jacobian.", [q], [J])
    lower = None if limit is None else -limit
    joint = {"kind": "revolute", "unit": "rad", "lower": lower, "upper": limit}
    manifest = {
        **tiny.manifest(),
        "name": "snake",
        "title": "A planar snake",
        "coordinates": [{"name": f"joint{i + 1}", **joint} for i in range(n)],
        "functions": [{**f, "symbol": f"snake_{f['name']}"} for f in (both, alone)],
    }
    folder = tiny.Folder(path, manifest, "snake")
    source = SOURCE.format(n=n, m=6 * n, link=LINK, wall=WALL)
    folder.write(source, HEADER.format(n=n, m=6 * n))
    return folder
